/* Memory for what is kept, up to a cap. It is given out in pieces of whole units, and used again.
 *
 * The memory comes from the system in slabs of a huge page's size, which ask to be one. Fresh pages
 * cost a picture more time than its pixels do, so threads that have nothing else to do make some
 * ahead with shd_stock_touch. Any thread. */
#pragma once

#include "base/budget.h"

enum {
    SHD_STOCK_UNIT = 32 << 10,
    SHD_STOCK_MOST = 1 << 20,  /* the largest piece */
    SHD_STOCK_AHEAD = 32 << 20 /* bytes that are free and touched; an eighth of the cap at most */
};

typedef struct shd_stock shd_stock;

/* Slabs are tried of `budget`, which outlives the stock. NULL if there is no memory. */
shd_stock *shd_stock_new(size_t cap, shd_budget *budget);
void shd_stock_drop(shd_stock *stock); /* with all of its pieces; NULL is fine */

/* `size` bytes with any content, aligned to units. `size` is a multiple of SHD_STOCK_UNIT up to
 * SHD_STOCK_MOST. NULL: no free units in a row are as many, and there is no further slab. */
void *shd_stock_take(shd_stock *stock, size_t size);
void shd_stock_give(shd_stock *stock, void *memory, size_t size); /* a piece that was taken */

/* Gives whole slabs without a piece back to the system, until those are `bytes` or no more are
 * left. Returns how many bytes were given back. */
size_t shd_stock_trim(shd_stock *stock, size_t bytes);

/* Touches a few pages that will be taken next, which takes some 100 microseconds. False: as much as
 * is useful is touched already, and nothing was done. */
bool shd_stock_touch(shd_stock *stock);
