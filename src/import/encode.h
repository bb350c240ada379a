/* The inside of the module: PNG files of the pictures that are made here. */
#pragma once

#include <stdbool.h>
#include <stddef.h>

typedef struct shd_png_head {
    int width, height;
    int depth; /* 8 or 16 bits */
    int color; /* spng's color type */
} shd_png_head;

/* `samples`: rows from the top, those of 16 bits as the machine has them. *file is malloc'ed.
 * False: there is no memory. */
bool shd_encode_png(const shd_png_head *head, const void *samples, size_t size, void **file,
                    size_t *length);
