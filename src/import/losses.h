/* The inside of the module: what a file has and no scene of it will, where only the file tells. */
#pragma once

#include <stdbool.h>
#include <stddef.h>

#include "base/status.h"

typedef struct shd_losses {
    char text[16384]; /* sentences, each with a newline behind it */
    size_t size;
    bool cut; /* there are more */
} shd_losses;

/* Adds a sentence, once. Control characters in it become '_'. */
void shd_lose(shd_losses *losses, const char *format, ...) SHD_PRINTF(2, 3);
