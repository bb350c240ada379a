#include "queue.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/lru.h"

/* Of two clients with as many places the one with the work that is so much more gives way. */
static const double much_more = 2;

/* What a client has in a lane. */
typedef struct shd_share {
    struct shd_share *previous, *next; /* ring of those that have something there */
    struct party *party;
    shd_lane lane;
    shd_turn *oldest, *newest;
    size_t count;
    shd_stint *begun;
} share;

/* A client, while it has something. */
typedef struct party {
    shd_key key;
    share lanes[SHD_LANES];
    char client[];
} party;

struct shd_queue {
    size_t places, large_places;
    size_t count[SHD_LANES];
    double clock[SHD_LANES];
    share rings[SHD_LANES];
    shd_index parties;
};

/* ---- Clients ---- */

static party *find_party(const shd_queue *queue, const char *client) {
    const shd_key key = shd_index_key(&queue->parties, 0, client, strlen(client));
    return shd_index_find(&queue->parties, &key);
}

/* NULL if memory is short. */
static party *find_or_add_party(shd_queue *queue, const char *client) {
    const size_t size = strlen(client) + 1;
    party *p = find_party(queue, client);
    if (p) return p;
    p = calloc(1, sizeof *p + size);
    if (!p) return NULL;
    memcpy(p->client, client, size);
    for (shd_lane lane = 0; lane < SHD_LANES; lane++)
        p->lanes[lane] = (share){.party = p, .lane = lane};
    p->key = shd_index_key(&queue->parties, 0, p->client, size - 1);
    shd_index_put(&queue->parties, &p->key, p);
    return p;
}

static size_t held_by(const party *p) {
    return p ? p->lanes[SHD_LANE_NEW].count + p->lanes[SHD_LANE_LARGE].count : 0;
}

static void drop_if_empty(shd_queue *queue, party *p) {
    if (held_by(p) || p->lanes[SHD_LANE_NEW].begun || p->lanes[SHD_LANE_LARGE].begun) return;
    shd_index_take(&queue->parties, &p->key);
    free(p);
}

/* ---- Turns ---- */

/* The tag of what this client, NULL if it has nothing yet, brought now. */
static double tag_for(const shd_queue *queue, const party *p, shd_lane lane, double cost) {
    const share *s = p ? &p->lanes[lane] : NULL;
    double after = queue->clock[lane];
    if (s && s->newest) after = fmax(after, s->newest->tag);
    for (const shd_stint *b = s ? s->begun : NULL; b; b = b->other) after = fmax(after, b->tag);
    return after + cost;
}

static void append_turn(shd_queue *queue, share *s, shd_turn *turn) {
    if (!s->count++) {
        share *ring = &queue->rings[s->lane];
        s->next = ring;
        s->previous = ring->previous;
        s->previous->next = ring->previous = s;
    }
    turn->share = s;
    turn->older = s->newest;
    turn->newer = NULL;
    *(s->newest ? &s->newest->newer : &s->oldest) = turn;
    s->newest = turn;
    queue->count[s->lane]++;
}

static void take_out(shd_queue *queue, shd_turn *turn) {
    share *s = turn->share;
    assert(s->count && queue->count[s->lane]);
    *(turn->older ? &turn->older->newer : &s->oldest) = turn->newer;
    *(turn->newer ? &turn->newer->older : &s->newest) = turn->older;
    turn->share = NULL;
    queue->count[s->lane]--;
    if (--s->count) return;
    s->previous->next = s->next;
    s->next->previous = s->previous;
}

void shd_queue_leave(shd_queue *queue, shd_turn *turn) {
    party *p = turn->share->party;
    take_out(queue, turn);
    memset(turn, 0, sizeof *turn);
    drop_if_empty(queue, p);
}

/* ---- Places ---- */

/* What gives way first of what a client has in a lane. */
static shd_turn *find_newest_own(const share *s) {
    shd_turn *turn = s->newest;
    while (turn && turn->wanted_by_others) turn = turn->older;
    return turn;
}

/* Of all clients but this one, the newest of who holds most; of those who hold as many, the most
 * costly one. `only`: a lane, or SHD_LANES for all. NULL: nobody holds so much more. */
static shd_turn *find_displaced(const shd_queue *queue, const party *asking, shd_lane only,
                                double cost) {
    shd_turn *found = NULL;
    size_t most = 0;
    for (int lane = 0; lane < SHD_LANES; lane++) {
        const share *ring = &queue->rings[lane];
        if (only != SHD_LANES && lane != (int)only) continue;
        for (const share *s = ring->next; s != ring; s = s->next) {
            const size_t held = only == SHD_LANES ? held_by(s->party) : s->count;
            shd_turn *turn = s->party == asking || held < most ? NULL : find_newest_own(s);
            if (!turn || (found && held == most && turn->cost <= found->cost)) continue;
            found = turn;
            most = held;
        }
    }
    size_t own = only == SHD_LANES ? held_by(asking) : asking ? asking->lanes[only].count : 0;
    if (!found || most < own + 1) return NULL;
    return most > own + 1 || found->cost > much_more * cost ? found : NULL;
}

/* Finds who gives way, if there has to be one. False: nobody does. */
static bool find_place(shd_queue *queue, const party *asking, shd_lane lane, double cost,
                       bool is_rest, void **displaced) {
    const bool lane_full =
        lane == SHD_LANE_LARGE && queue->count[SHD_LANE_LARGE] >= queue->large_places;
    const bool all_full = !is_rest && shd_queue_count(queue, SHD_LANES) >= queue->places;
    if (!lane_full && !all_full) return true;
    shd_turn *turn = find_displaced(queue, asking, lane_full ? SHD_LANE_LARGE : SHD_LANES, cost);
    if (!turn) return false;
    *displaced = turn->owner;
    return true;
}

shd_entry shd_queue_enter(shd_queue *queue, shd_turn *turn, void *owner, shd_lane lane,
                          const char *client, double cost, bool is_rest, void **displaced) {
    *displaced = NULL;
    party *p = find_or_add_party(queue, client);
    if (!p) return SHD_ENTRY_NO_MEMORY;
    if (!find_place(queue, p, lane, cost, is_rest, displaced)) {
        drop_if_empty(queue, p);
        return SHD_ENTRY_FULL;
    }
    *turn = (shd_turn){.owner = owner, .cost = cost, .tag = tag_for(queue, p, lane, cost)};
    append_turn(queue, &p->lanes[lane], turn);
    return SHD_ENTRY_WAITS;
}

/* ---- Turns that come ---- */

shd_turn *shd_queue_next(const shd_queue *queue, shd_lane lane, double before,
                         bool (*may)(const void *owner)) {
    const share *ring = &queue->rings[lane];
    shd_turn *next = NULL;
    for (const share *s = ring->next; s != ring; s = s->next) {
        shd_turn *turn = s->oldest; /* a client's tags grow */
        while (turn && may && !may(turn->owner)) turn = turn->newer;
        if (turn && turn->tag < (next ? next->tag : before)) next = turn;
    }
    return next;
}

void shd_queue_begin(shd_queue *queue, shd_turn *turn, shd_stint *stint) {
    share *s = turn->share;
    *stint = (shd_stint){s->begun, s, turn->cost, turn->tag};
    s->begun = stint;
    shd_queue_leave(queue, turn);
}

void shd_queue_end(shd_queue *queue, shd_stint *stint) {
    share *s = stint->share;
    shd_stint **at = &s->begun;
    while (*at != stint) at = &(*at)->other;
    *at = stint->other;
    shd_queue_advance(queue, s->lane, stint->tag);
    memset(stint, 0, sizeof *stint);
    drop_if_empty(queue, s->party);
}

void shd_queue_correct(shd_stint *stint, double more) {
    stint->cost += more;
    stint->tag += more;
}

void shd_queue_advance(shd_queue *queue, shd_lane lane, double clock) {
    queue->clock[lane] = fmax(queue->clock[lane], clock);
}

void *shd_queue_take(shd_queue *queue, shd_lane lane) {
    shd_turn *next = shd_queue_next(queue, lane, INFINITY, NULL);
    if (!next) return NULL;
    void *owner = next->owner;
    shd_stint stint;
    shd_queue_begin(queue, next, &stint);
    shd_queue_end(queue, &stint);
    return owner;
}

void shd_queue_share(shd_queue *queue, shd_turn *turn, const char *client) {
    party *old = turn->share->party;
    if (!strcmp(old->client, client)) return;
    turn->wanted_by_others = true;
    const shd_lane lane = turn->share->lane;
    const double tag = tag_for(queue, find_party(queue, client), lane, turn->cost);
    party *p = tag < turn->tag ? find_or_add_party(queue, client) : NULL;
    if (!p) return;
    take_out(queue, turn);
    turn->tag = tag;
    append_turn(queue, &p->lanes[lane], turn);
    drop_if_empty(queue, old);
}

void shd_queue_charge(shd_queue *queue, shd_lane lane, const char *client, double cost) {
    const party *p = find_party(queue, client);
    for (shd_turn *turn = p ? p->lanes[lane].oldest : NULL; turn; turn = turn->newer)
        turn->tag += cost;
}

double shd_queue_ahead(const shd_queue *queue, shd_lane lane, const char *client, double cost) {
    const share *ring = &queue->rings[lane];
    const double tag = tag_for(queue, find_party(queue, client), lane, cost);
    double ahead = 0;
    for (const share *s = ring->next; s != ring; s = s->next)
        for (const shd_turn *turn = s->oldest; turn && turn->tag <= tag; turn = turn->newer)
            ahead += turn->cost;
    return ahead;
}

bool shd_turn_waits(const shd_turn *turn) {
    return turn->share;
}

shd_lane shd_turn_lane(const shd_turn *turn) {
    return turn->share->lane;
}

size_t shd_queue_count(const shd_queue *queue, shd_lane lane) {
    if (lane != SHD_LANES) return queue->count[lane];
    return queue->count[SHD_LANE_NEW] + queue->count[SHD_LANE_LARGE];
}

size_t shd_queue_held(const shd_queue *queue, const char *client) {
    return held_by(find_party(queue, client));
}

/* ---- The whole ---- */

shd_status shd_queue_new(size_t places, shd_queue **out, shd_error *error) {
    shd_queue *queue = calloc(1, sizeof *queue);
    if (!queue) return shd_fail(error, SHD_EXHAUSTED, "", "no memory for a queue");
    queue->places = places;
    queue->large_places = places - places / 4;
    for (int lane = 0; lane < SHD_LANES; lane++)
        queue->rings[lane].previous = queue->rings[lane].next = &queue->rings[lane];
    const shd_status status = shd_index_new(places, &queue->parties, error);
    if (status)
        free(queue);
    else
        *out = queue;
    return status;
}

void shd_queue_drop(shd_queue *queue) {
    if (!queue) return;
    assert(!shd_queue_count(queue, SHD_LANES));
    shd_index_drop(&queue->parties);
    free(queue);
}
