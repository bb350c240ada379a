/* Which job a worker of the engine takes, and which one it gives way to.
 *
 * For each job that waits the engine has a ticket: a right to take the next one of its lane. So
 * which one that is is decided when a worker has time.
 *
 * A large one is no hindrance to other clients' large ones: between two of its tiles its worker
 * looks whether one waits that would be done before it if all clients' work went on side by side
 * (queue.h), and does that first, on top of it. The one beneath is set aside with all of its memory
 * meanwhile, so that only a few may be, and only as long as memory is free. If several workers
 * have large ones, the one that would be done last gives way. What a long document asks for is
 * known once it is read. If it then turns out that others go first, it waits for its turn, and is
 * read again.
 *
 * All functions are called with the mutex that it was given. */
#pragma once

#include <pthread.h>
#include <stdbool.h>
#include <stddef.h>

#include "queue.h"
#include "shaded.h"
#include "stuck.h"

typedef struct shd_turns shd_turns;

typedef struct shd_ticket {
    shd_turns *turns;
} shd_ticket;

/* A large job that a worker has begun. */
typedef struct shd_begun {
    struct shd_begun *next;    /* any other */
    struct shd_begun *beneath; /* what was set aside for it, or NULL */
    pthread_t worker;
    struct shd_job *job; /* its worker's, and gone before this is */
    shd_stint stint;
    double at;      /* its tag less the cost that is left */
    unsigned depth; /* how many are set aside beneath it */
    bool is_aside;
} shd_begun;

struct shd_turns {
    shd_engine *engine;
    pthread_mutex_t *mutex;
    pthread_cond_t *changed;          /* a job is watched */
    void (*run)(struct shd_job *job); /* without the mutex */
    shd_ticket tickets[SHD_LANES];
    shd_queue *queue;           /* jobs that wait for a worker */
    unsigned large, most_large; /* jobs of that lane that came with a ticket, and may */
    size_t kept_tickets;        /* for others of that lane */
    shd_begun *begun;           /* all large ones */
    double running;             /* cost of jobs that workers have */
    shd_watched cancelled;      /* the ring of jobs that workers have all the same */
};

/* `turns` has its first four members, which outlive it, and lies where it stays. The queue is
 * the caller's to drop, once nobody waits. */
shd_status shd_turns_init(shd_turns *turns, size_t places, shd_error *error);

/* For a job that has entered the queue. False: the engine has no place for a ticket. */
bool shd_turns_give(shd_turns *turns, shd_lane lane);

/* The job, which waits, leaves the queue, as does a ticket. */
void shd_turns_leave(shd_turns *turns, struct shd_job *job);

/* The job was cancelled while a worker has it. */
void shd_turns_watch(shd_turns *turns, struct shd_job *job);

/* The job, which a worker has, costs so much more than was known. */
void shd_turns_correct(shd_turns *turns, struct shd_job *job, double more);

/* Whether the job, which a worker has begun, would not have been yet if this had been its cost. */
bool shd_turns_is_early(const struct shd_job *job, double cost);

size_t shd_turns_begun(const shd_turns *turns); /* large ones */
