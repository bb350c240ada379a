#include "turns.h"

#include <assert.h>
#include <math.h>

#include "base/clock.h"
#include "job.h"

/* How many a worker may have set aside: each has its memory, and a part of the worker's stack. */
enum { ASIDE_MOST = 3 };

/* Of memory for each byte of a document, once it is read. */
enum { READ_BYTES = 30 };

/* With a ticket, on a worker. There may be nobody: who it was given for has left meanwhile. */
static void take_new(void *context) {
    shd_turns *turns = ((shd_ticket *)context)->turns;
    pthread_mutex_lock(turns->mutex);
    shd_job *job = shd_queue_take(turns->queue, SHD_LANE_NEW);
    if (job) turns->running += job->cost;
    pthread_mutex_unlock(turns->mutex);
    if (job) turns->run(job);
}

/* ---- Large ones ---- */

/* Called and left with the mutex. The job is gone then. */
static void run_large(shd_turns *turns, shd_job *job, shd_begun *beneath) {
    shd_begun here = {.next = turns->begun,
                      .beneath = beneath,
                      .worker = pthread_self(),
                      .job = job,
                      .depth = beneath ? beneath->depth + 1 : 0};
    assert(here.depth <= ASIDE_MOST);
    shd_queue_begin(turns->queue, &job->turn, &here.stint);
    here.at = here.stint.tag - here.stint.cost;
    turns->begun = job->begun = &here;
    turns->running += job->cost;
    if (beneath) beneath->is_aside = true;
    pthread_mutex_unlock(turns->mutex);

    turns->run(job);

    pthread_mutex_lock(turns->mutex);
    if (beneath) beneath->is_aside = false;
    shd_begun **at = &turns->begun;
    while (*at != &here) at = &(*at)->next;
    *at = here.next;
    shd_queue_end(turns->queue, &here.stint);
}

/* One worker never takes large work, unless it is the only one: others lend themselves to what is
 * new between their tiles, but not while they read a document or plan. That one helps with tiles.
 * Tickets for which there is no worker are kept for the next end. */
static void take_large(void *context) {
    shd_turns *turns = ((shd_ticket *)context)->turns;
    pthread_mutex_lock(turns->mutex);
    shd_turn *next = NULL;
    if (turns->large == turns->most_large)
        turns->kept_tickets++;
    else
        next = shd_queue_next(turns->queue, SHD_LANE_LARGE, INFINITY, NULL);
    if (next) {
        turns->large++;
        run_large(turns, next->owner, NULL);
        turns->large--;
        if (turns->kept_tickets) {
            turns->kept_tickets--;
            shd_turns_give(turns, SHD_LANE_LARGE);
        }
    }
    pthread_mutex_unlock(turns->mutex);
}

/* ---- Giving way ---- */

static shd_begun *find_own(const shd_turns *turns) {
    shd_begun *b = turns->begun;
    while (b && (b->is_aside || !pthread_equal(b->worker, pthread_self()))) b = b->next;
    return b;
}

/* Whether of those that could give way it is the one that is to be done last. */
static bool is_last(const shd_turns *turns, const shd_begun *own) {
    if (own->depth == ASIDE_MOST) return false;
    for (const shd_begun *b = turns->begun; b; b = b->next)
        if (!b->is_aside && b->depth < ASIDE_MOST && b->stint.tag > own->stint.tag) return false;
    return true;
}

/* Whether it may be begun on top of another: what it takes is known, more or less, and half of what
 * is free at most. */
static bool has_room(const void *owner) {
    const shd_job *job = owner;
    if (!job->was_read && job->question.coding) return false;
    const shd_budget_load load = shd_budget_load_of(job->server->budget);
    const uint64_t left = load.used < load.cap ? load.cap - load.used : 0;
    const uint64_t needs =
        job->was_read ? shd_request_needs(job->request) : READ_BYTES * (uint64_t)job->size;
    return needs <= left / 2;
}

/* The job that goes first. NULL: there is none. */
static shd_job *find_first(const shd_turns *turns, const shd_begun *own) {
    if (!own->job->waiters || !is_last(turns, own)) return NULL;
    const shd_turn *turn = shd_queue_next(turns->queue, SHD_LANE_LARGE, own->stint.tag, has_room);
    return turn ? turn->owner : NULL;
}

/* The clock goes with the one of which least is done. */
static void advance_clock(shd_turns *turns) {
    double least = INFINITY;
    for (const shd_begun *b = turns->begun; b; b = b->next)
        if (!b->is_aside) least = fmin(least, b->at);
    shd_queue_advance(turns->queue, SHD_LANE_LARGE, least);
}

static void withdraw_ticket(shd_turns *turns, shd_lane lane) {
    /* Else a worker has it in hand already, and finds nobody then. */
    if (shd_engine_withdraw(turns->engine, &turns->tickets[lane])) return;
    if (lane == SHD_LANE_LARGE && turns->kept_tickets) turns->kept_tickets--;
}

/* On a worker, between two tiles of the large job that it does. */
static void give_way(void *context) {
    shd_turns *turns = context;
    pthread_mutex_lock(turns->mutex);
    shd_begun *own = find_own(turns);
    assert(own && own->job->begun == own);
    own->at = own->stint.tag - (1 - own->job->done) * own->stint.cost;
    advance_clock(turns);
    shd_job *first = find_first(turns, own);
    if (first) {
        const double began = shd_now();
        withdraw_ticket(turns, SHD_LANE_LARGE);
        run_large(turns, first, own);
        own->job->seconds -= shd_now() - began;
        /* Cancelled meanwhile, it has only now been able to notice. */
        if (!own->job->waiters) shd_turns_watch(turns, own->job);
    }
    pthread_mutex_unlock(turns->mutex);
}

/* ---- For jobs.c ---- */

bool shd_turns_give(shd_turns *turns, shd_lane lane) {
    shd_ticket *ticket = &turns->tickets[lane];
    if (lane == SHD_LANE_NEW) return shd_engine_submit(turns->engine, take_new, ticket);
    shd_engine_defer(turns->engine, take_large, ticket);
    return true;
}

void shd_turns_leave(shd_turns *turns, shd_job *job) {
    withdraw_ticket(turns, shd_turn_lane(&job->turn));
    shd_queue_leave(turns->queue, &job->turn);
}

void shd_turns_watch(shd_turns *turns, shd_job *job) {
    if (job->begun && job->begun->is_aside) return; /* it notices when it goes on */
    shd_stuck_watch(&turns->cancelled, &job->watched, job->id);
    pthread_cond_signal(turns->changed);
}

void shd_turns_correct(shd_turns *turns, shd_job *job, double more) {
    turns->running += more;
    job->cost += more;
    if (job->begun) shd_queue_correct(&job->begun->stint, more);
}

bool shd_turns_is_early(const shd_job *job, double cost) {
    const shd_begun *b = job->begun;
    return b && b->beneath && b->stint.tag - b->stint.cost + cost >= b->beneath->stint.tag;
}

size_t shd_turns_begun(const shd_turns *turns) {
    size_t count = 0;
    for (const shd_begun *b = turns->begun; b; b = b->next) count++;
    return count;
}

shd_status shd_turns_init(shd_turns *turns, size_t places, shd_error *error) {
    const unsigned threads = shd_engine_load(turns->engine).threads;
    turns->most_large = threads > 1 ? threads - 1 : 1;
    turns->cancelled.previous = turns->cancelled.next = &turns->cancelled;
    for (int lane = 0; lane < SHD_LANES; lane++) turns->tickets[lane].turns = turns;
    const shd_status status = shd_queue_new(places, &turns->queue, error);
    if (!status) shd_engine_between(turns->engine, give_way, turns);
    return status;
}
