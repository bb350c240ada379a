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

typedef struct shd_spares shd_spares;

/* Keeps up to `cap` bytes. NULL when out of memory. */
shd_spares *shd_spares_new(size_t cap);
void shd_spares_drop(shd_spares *spares); /* all that was taken has been given back; NULL is fine */

/* At least `size` bytes, aligned to 64, with any content; NULL when out of memory. Large blocks
 * ask the system for huge pages. `spares` NULL: always new. */
void *shd_spares_take(shd_spares *spares, size_t size);

/* Gives back what was taken with the same arguments; NULL is fine. */
void shd_spares_give(shd_spares *spares, void *memory, size_t size);

size_t shd_spares_kept(shd_spares *spares); /* bytes that wait */

#endif
