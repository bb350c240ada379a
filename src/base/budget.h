/* The memory that a process may have, for all that it does together: who wants some of it asks
 * before, and tells when it is given back.
 *
 * What only makes later work faster tries: it takes what is free. Work takes: where too little is
 * free, what is registered for it gives way, rank by rank, before work is refused. What is there in
 * any case (libraries, connections that were accepted) is counted.
 *
 * A budget of NULL is endless and counts nothing. Any thread. */
#ifndef SHD_BASE_BUDGET_H
#define SHD_BASE_BUDGET_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct shd_budget shd_budget;

/* NULL when out of memory. */
shd_budget *shd_budget_new(uint64_t cap);
void shd_budget_drop(shd_budget *budget); /* NULL is fine */

/* What gives way: is asked for `bytes`, and gives some of them back, before it returns or soon
 * after. Returns how many have been given back or will be, 0 where there is nothing to be had. It
 * is called by any thread that takes, with whatever locks that one holds. One of each rank, before
 * work begins; the ranks are asked in their order. */
typedef size_t shd_give_way(void *context, size_t bytes);

typedef enum shd_rank {
    SHD_RANK_SPARE,    /* memory that is in no use */
    SHD_RANK_ANSWERS,  /* those that are not taken */
    SHD_RANK_RECORDS,  /* what pictures share */
    SHD_RANK_PICTURES, /* finished ones */
    SHD_RANK_MESHES,   /* that clients have put, and would have to put again */
    SHD_RANKS
} shd_rank;

void shd_budget_yield(shd_budget *budget, shd_rank rank, shd_give_way *give_way, void *context);

/* Takes `bytes` where they are free, or become so. False: nothing was taken. */
bool shd_budget_try(shd_budget *budget, size_t bytes);                  /* free now */
bool shd_budget_take(shd_budget *budget, size_t bytes);                 /* others give way */
bool shd_budget_wait(shd_budget *budget, size_t bytes, double seconds); /* and that long for them */
void shd_budget_count(shd_budget *budget, size_t bytes);                /* in any case */

void shd_budget_give(shd_budget *budget, size_t bytes);

/* Counts what stays for good, which no work can have. */
void shd_budget_fix(shd_budget *budget, size_t bytes);

typedef struct shd_budget_load {
    uint64_t cap, used, fixed; /* bytes; fixed ones are used, too */
    uint64_t refused;          /* times that something was refused to work */
} shd_budget_load;

shd_budget_load shd_budget_load_of(shd_budget *budget);

/* The most that work can have: the cap without what is fixed; UINT64_MAX of a NULL budget. */
uint64_t shd_budget_most(shd_budget *budget);

#endif
