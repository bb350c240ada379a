/* The memory that a process may have, for all that it does together. Code that wants some of it
 * asks beforehand, and tells when it is given back.
 *
 * Work that only makes later work faster tries: it takes what is free. Other work takes: if too
 * little is free, others give way, rank by rank, before work is refused. Memory that is there in
 * any case (libraries, connections that were accepted) is counted.
 *
 * A budget of NULL is endless and counts nothing. Any thread. */
#pragma once

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/status.h"

typedef struct shd_budget shd_budget;

/* NULL if there is no memory. */
shd_budget *shd_budget_new(uint64_t cap);
SHD_C void shd_budget_drop(shd_budget *budget); /* NULL is fine */

/* Another owner, who drops it, too: the last one ends it. */
SHD_C shd_budget *shd_budget_keep(shd_budget *budget);

/* A function that gives way: it is asked for `bytes`, and gives some of them back before it returns
 * or soon after. It returns how many. Any thread that takes may call it, with any locks. */
typedef size_t shd_give_way(void *context, size_t bytes);

typedef enum shd_rank {
    SHD_RANK_SPARE,    /* memory that is in no use */
    SHD_RANK_ANSWERS,  /* answers that clients do not take */
    SHD_RANK_RECORDS,  /* what pictures share */
    SHD_RANK_TABLES,   /* what was simulated, and would have to be again */
    SHD_RANK_PICTURES, /* finished pictures */
    SHD_RANK_MESHES,   /* meshes that clients have put, and would have to put again */
    SHD_RANKS
} shd_rank;

/* Registers what gives way, one function for each rank, before work begins. */
void shd_budget_yield(shd_budget *budget, shd_rank rank, shd_give_way *give_way, void *context);

/* Takes `bytes` if they are free, or become so. False: nothing was taken. */
bool shd_budget_try(shd_budget *budget, size_t bytes);                  /* if they are free now */
SHD_C bool shd_budget_take(shd_budget *budget, size_t bytes);           /* if others give way */
bool shd_budget_wait(shd_budget *budget, size_t bytes, double seconds); /* waits that long */
SHD_C void shd_budget_count(shd_budget *budget, size_t bytes);          /* in any case */

SHD_C void shd_budget_give(shd_budget *budget, size_t bytes);

/* Counts bytes that stay for good, which no work can have. */
void shd_budget_fix(shd_budget *budget, size_t bytes);

typedef struct shd_budget_load {
    uint64_t cap, used, fixed; /* bytes; fixed ones are used, too */
    uint64_t refused;          /* how often something was refused to work */
} shd_budget_load;

shd_budget_load shd_budget_load_of(shd_budget *budget);

/* The most that work can have: the cap without what is fixed. UINT64_MAX for a NULL budget. */
SHD_C uint64_t shd_budget_most(shd_budget *budget);
