/* Working memory that one function lays out. It runs twice: without an arena it counts, with one it
 * hands out. So a size stands once, beside what it is for, and is known before anything is taken.
 *
 *     static void lay_out_thing(size_t count, shd_scratch *memory, thing *out) {
 *         out->values = shd_scratch_take(memory, count, sizeof *out->values);
 *     }
 */
#pragma once

#include "base/arena.h"

typedef struct shd_scratch {
    shd_arena *arena; /* NULL: all is counted and nothing is handed out */
    uint64_t bytes;   /* so far, as the arena rounds them; UINT64_MAX: more than there can be */
    bool full;        /* the arena gave nothing */
} shd_scratch;

/* Uninitialized memory for `count` items of `size` bytes, aligned to 64 bytes. NULL if it is only
 * counted, or the arena is full. */
void *shd_scratch_take(shd_scratch *scratch, size_t count, size_t size);

/* [rows] of [length] each, the rows one behind the other. */
float **shd_scratch_rows32(shd_scratch *scratch, size_t rows, size_t length);
double **shd_scratch_rows64(shd_scratch *scratch, size_t rows, size_t length);
