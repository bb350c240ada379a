/* The inside of the module: the block of bytes that a model becomes. */
#pragma once

#include <stdbool.h>
#include <stddef.h>

#include "import/model.h"

typedef struct shd_block {
    char *bytes; /* which nobody frees: the process ends */
    size_t size, room;
    bool full; /* memory ran out: nothing is written any more */
} shd_block;

/* Appends bytes, zeros if `data` is NULL, and returns where. */
uint64_t shd_block_put(shd_block *b, const void *data, size_t size);

/* `count` items of `size` bytes; the same of a text. */
shd_span shd_block_items(shd_block *b, const void *data, size_t count, size_t size);
shd_span shd_block_text(shd_block *b, const char *text);
