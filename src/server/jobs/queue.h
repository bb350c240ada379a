/* Who is next, and who finds a place: work is divided among clients, not among requests.
 *
 * Clients are served by self-clocked fair queueing (Golestani, "A self-clocked fair queueing scheme
 * for broadband applications", INFOCOM 1994): what comes gets a tag,
 *
 *     tag = max(clock, tag of the client's one before it) + cost,
 *
 * the smallest tag is next, and the clock is the tag of who was last. So of clients that always
 * have something each gets the same cost done, whatever its requests are; who has had nothing here
 * comes before the second request of everybody else; and nobody waits for ever.
 *
 * What takes long is not taken, but begun, and ends (shd_stint): until then the client's next ones
 * are tagged as after it, and the clock, which goes on with what is done of it, is behind its tag.
 * If all clients' work went on side by side, what comes meanwhile with an earlier tag would be done
 * before it. It may wait until that is done, and then still ends no later than it would then.
 *
 * There are two lanes, each with a clock of its own: what is new, and what is known to be large.
 * Large work may have three places of four. If all places are taken, a newcomer may still take one
 * from the client that holds most, whose newest gives way. A lone client may have them all.
 *
 * No locks: one thread at a time. */
#pragma once

#include <stdbool.h>
#include <stddef.h>

#include "base/status.h"

typedef enum shd_lane { SHD_LANE_NEW, SHD_LANE_LARGE, SHD_LANES } shd_lane;

typedef struct shd_queue shd_queue;

/* One that waits: a part of its owner, and all zero while it does not. */
typedef struct shd_turn {
    struct shd_turn *older, *newer; /* of the same client in the same lane */
    struct shd_share *share;        /* NULL: it does not wait */
    void *owner;
    double cost, tag;
    bool wanted_by_others; /* another client's requests wait for it, too: it does not give way */
} shd_turn;

/* One that was begun: a part of its owner, and all zero while it is not. */
typedef struct shd_stint {
    struct shd_stint *other; /* of the same client in the same lane */
    struct shd_share *share; /* NULL: it was not begun, or has ended */
    double cost, tag;        /* as of its turn */
} shd_stint;

shd_status shd_queue_new(size_t places, shd_queue **out, shd_error *error);
void shd_queue_drop(shd_queue *queue); /* nobody waits in it; NULL is fine */

typedef enum shd_entry { SHD_ENTRY_WAITS, SHD_ENTRY_FULL, SHD_ENTRY_NO_MEMORY } shd_entry;

/* If there is a place, the owner waits from now on, as `client`'s. *displaced is the owner that has
 * to give way, which the caller takes out, or NULL. `is_rest`: the owner has had a place, and was
 * taken, so that it finds one among the large ones even if all places are taken. */
shd_entry shd_queue_enter(shd_queue *queue, shd_turn *turn, void *owner, shd_lane lane,
                          const char *client, double cost, bool is_rest, void **displaced);

/* The owner that is next in this lane, which does not wait any more; NULL if nobody does. It is
 * begun and ends at once. */
void *shd_queue_take(shd_queue *queue, shd_lane lane);

/* The turn that is next in this lane, of those with a smaller tag than `before` whose owner `may`,
 * if that is not NULL. NULL if there is none. */
shd_turn *shd_queue_next(const shd_queue *queue, shd_lane lane, double before,
                         bool (*may)(const void *owner));

void shd_queue_begin(shd_queue *queue, shd_turn *turn, shd_stint *stint); /* it waits no more */
void shd_queue_end(shd_queue *queue, shd_stint *stint);
void shd_queue_correct(shd_stint *stint, double more); /* it costs so much more than was known */

/* Of all that go on in this lane at least so much is done: a tag less the cost that is left. */
void shd_queue_advance(shd_queue *queue, shd_lane lane, double clock);

/* It does not wait any more. */
void shd_queue_leave(shd_queue *queue, shd_turn *turn);

/* This client wants it, too: it waits where it would if that one alone did, if that is better. */
void shd_queue_share(shd_queue *queue, shd_turn *turn, const char *client);

/* What the client had in this lane has cost more than was known when it entered: what else it has
 * there waits for longer. */
void shd_queue_charge(shd_queue *queue, shd_lane lane, const char *client, double cost);

/* The cost of all in this lane that would be taken before something of this client's that came to
 * it now. */
double shd_queue_ahead(const shd_queue *queue, shd_lane lane, const char *client, double cost);

bool shd_turn_waits(const shd_turn *turn);
shd_lane shd_turn_lane(const shd_turn *turn);                      /* of one that waits */
size_t shd_queue_count(const shd_queue *queue, shd_lane lane);     /* SHD_LANES: in all */
size_t shd_queue_held(const shd_queue *queue, const char *client); /* by this client */
