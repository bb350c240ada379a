/* Memory of dropped arenas, kept for the next ones: fresh pages from the system cost a small
 * picture more time than its pixels do.
 *
 * Blocks come in sizes an eighth of an octave apart, so that requests which resemble each other
 * find what they need. The blocks used last are given out first, while they are in a cache, and
 * what was not asked for the longest goes first where the cap is reached.
 * Any thread. Under AddressSanitizer, kept memory is poisoned. */
#ifndef SHD_BASE_SPARES_H
#define SHD_BASE_SPARES_H

#include <stddef.h>

#include "base/budget.h"

typedef struct shd_spares shd_spares;

/* Keeps up to `cap` bytes. What is given is counted in `budget`, which outlives it, and stays so
 * until it is ended. NULL when out of memory. */
shd_spares *shd_spares_new(size_t cap, shd_budget *budget);
shd_budget *shd_spares_budget(const shd_spares *spares); /* NULL where `spares` is */
void shd_spares_drop(shd_spares *spares); /* all that was taken has been given back; NULL is fine */

/* At least `size` bytes, aligned to 64, with any content. `find`: kept ones; NULL where there are
 * none, or `spares` is. `make`: new ones, that the caller counts; NULL when out of memory. Large
 * blocks ask the system for huge pages. */
void *shd_spares_find(shd_spares *spares, size_t size);
void *shd_spares_make(size_t size);

/* The bytes that such a block has, which are what is counted; 0 where there is none. */
size_t shd_spares_size(size_t size);

/* Gives back what was found or made with the same size; NULL is fine. */
void shd_spares_give(shd_spares *spares, void *memory, size_t size);

/* Ends what was given back longest ago until `bytes` are ended or nothing is left. Returns how many
 * bytes were. */
size_t shd_spares_trim(shd_spares *spares, size_t bytes);

/* Called now and then: ends what nobody has asked for since the last call but one, down to `floor`
 * bytes. */
void shd_spares_rest(shd_spares *spares, size_t floor);

size_t shd_spares_kept(shd_spares *spares); /* bytes that wait */

#endif
