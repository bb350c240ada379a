/* Memory of dropped arenas, kept for the next ones: fresh pages from the system cost a small
 * picture more time than its pixels do.
 *
 * Blocks come in sizes an eighth of an octave apart, so that similar requests find what they need.
 * The block given back last is given out first, and the one given back longest ago is freed first.
 * Any thread. Under AddressSanitizer, kept memory is poisoned. */
#pragma once

#include "base/budget.h"

typedef struct shd_spares shd_spares;

/* Keeps up to `cap` bytes. Memory that is given stays counted in `budget`, which outlives the
 * spares, until it is freed. NULL if there is no memory. */
shd_spares *shd_spares_new(size_t cap, shd_budget *budget);
shd_budget *shd_spares_budget(const shd_spares *spares); /* NULL if `spares` is */
void shd_spares_drop(shd_spares *spares); /* everything taken was given back; NULL is fine */

/* A block of at least `size` bytes, aligned to 64, with any content: a kept one (NULL: there is
 * none), or a new one, which the caller counts (NULL: there is no memory). */
void *shd_spares_find(shd_spares *spares, size_t size);
void *shd_spares_make(size_t size);

/* The bytes that such a block has, which are the bytes to count. 0 if no block can be so large. */
size_t shd_spares_size(size_t size);

/* Gives back a block that was found or made with the same size; NULL is fine. */
void shd_spares_give(shd_spares *spares, void *memory, size_t size);

/* Frees the blocks that were given back longest ago until `bytes` are freed or nothing is left.
 * Returns how many bytes were freed. */
size_t shd_spares_trim(shd_spares *spares, size_t bytes);

/* To be called every so often: frees the blocks that nobody has asked for since the last call but
 * one, down to `floor` bytes. */
void shd_spares_rest(shd_spares *spares, size_t floor);

size_t shd_spares_kept(shd_spares *spares); /* bytes that wait */
