/* Memory for what is kept, up to a cap, in pieces of whole units that go round.
 *
 * It comes from the system in slabs of a huge page's size, which ask to be one (advice: where the
 * system gives none, pages are small). Fresh pages cost a picture more time than its pixels do, so
 * shd_stock_touch makes some ahead, for threads that have nothing else to do. Any thread. */
#ifndef SHD_BASE_STOCK_H
#define SHD_BASE_STOCK_H

#include <stdbool.h>
#include <stddef.h>

#include "base/budget.h"

enum {
    SHD_STOCK_UNIT = 32 << 10,
    SHD_STOCK_MOST = 1 << 20,  /* of a piece */
    SHD_STOCK_AHEAD = 32 << 20 /* bytes that are free and touched, an eighth of the cap at most */
};

typedef struct shd_stock shd_stock;

/* What is mapped is tried of `budget`, which outlives it. NULL when out of memory. */
shd_stock *shd_stock_new(size_t cap, shd_budget *budget);
void shd_stock_drop(shd_stock *stock); /* with all of its pieces; NULL is fine */

/* `size` bytes, a multiple of SHD_STOCK_UNIT up to SHD_STOCK_MOST, with any content, aligned to
 * units. NULL: no run of free units is that long, and the system or the budget gives nothing. */
void *shd_stock_take(shd_stock *stock, size_t size);
void shd_stock_give(shd_stock *stock, void *memory, size_t size); /* what was taken */

/* Gives whole slabs without a piece back to the system, until that are `bytes` or there are no
 * more. Returns how many bytes were. */
size_t shd_stock_trim(shd_stock *stock, size_t bytes);

/* Touches a few pages that will be taken next, which is some 100 microseconds' work. False, and
 * nothing was done: as much as is useful is touched. */
bool shd_stock_touch(shd_stock *stock);

#endif
