/* Watches the connections of a port, from a thread that looks several times a second.
 *
 * libmicrohttpd closes connections that are silent. But a byte now and then keeps one for ever, the
 * end of a client is not seen while its connection is suspended, and a client's last bytes and its
 * end are not told apart if they arrive together. So the reaper sees to this:
 *
 * - A head, a body and an answer each have a total time, after which their connection is ended. On
 *   unix sockets, which count no bytes, a head's time begins with the end of the last answer.
 * - Connections whose client has left are ended, or their exchange stops waiting for its job.
 * - If nearly all places are taken, room is made. Connections of addresses that have many go before
 *   those of addresses that have few. Among them, idle ones end first, then those that have been at
 *   their head, their body or their answer for longest, but none at once.
 * - An address may have a number of connections. A few more are let in to be told so.
 * - Answers that are taken slowly give their memory to work that wants it: those first that have
 *   taken the most, bytes times seconds.
 *
 * To end a connection is to shut its socket down: libmicrohttpd sees that and closes it. */
#pragma once

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/status.h"

typedef struct shd_reaper shd_reaper;
typedef struct shd_connection shd_connection;

/* What a connection is at. */
typedef enum shd_phase {
    SHD_AT_REST, /* between requests */
    SHD_AT_HEAD,
    SHD_AT_BODY,
    SHD_AT_WORK,   /* suspended */
    SHD_AT_ANSWER, /* its answer is on its way */
    SHD_PHASES
} shd_phase;

typedef struct shd_patience {
    double head, body, send; /* seconds */
    double least_reading;    /* what a head or a body gets before it gives way to new connections */
    size_t connections;      /* places */
    size_t each;             /* of them from one address; 0: any number */
} shd_patience;

/* Why connections were ended. */
typedef enum shd_ending {
    SHD_END_LATE,
    SHD_END_LEFT,
    SHD_END_ROOM,
    SHD_END_MEMORY, /* their answers were not taken, and others wanted the memory */
    SHD_ENDINGS
} shd_ending;

/* What is done with those that wait, SHD_AT_WORK, whose client has left. */
typedef struct shd_departure {
    /* With the reaper's lock held. True: it does not wait any more, and is to be released. */
    bool (*leave)(void *who);
    void (*release)(void *who); /* later, without the lock */
} shd_departure;

/* `departure`: NULL if nothing waits. */
shd_status shd_reaper_new(const shd_patience *patience, const shd_departure *departure,
                          shd_reaper **out, shd_error *error);
void shd_reaper_set_patience(shd_reaper *reaper, const shd_patience *patience);
void shd_reaper_drop(shd_reaper *reaper); /* no connection is left; NULL is fine */

/* Whether a new connection of this address may be let in, be it to be told that it is one too many.
 * NULL: no address that counts, such as a proxy's. */
bool shd_reaper_admits(shd_reaper *reaper, const char *address);

/* Watches a new connection. NULL if memory is short. The socket stays open until it is removed. */
shd_connection *shd_reaper_add(shd_reaper *reaper, int socket, const char *address);

/* Whether its address had as many as it may before it came, and has. NULL: no. */
bool shd_reaper_is_excess(shd_reaper *reaper, const shd_connection *connection);

/* Forgets a connection that is closed next; NULL is fine. True: it was not ended from here, but
 * amid a request's head or body, so that its client may be sending still. */
bool shd_reaper_remove(shd_reaper *reaper, shd_connection *connection);

/* What the connection, NULL is fine, is at from now on. `who`: what waits, for SHD_AT_WORK. */
void shd_reaper_phase(shd_reaper *reaper, shd_connection *connection, shd_phase phase, void *who);

/* As many bytes of memory are free once the client has its answer, which is on its way. */
void shd_reaper_answer(shd_reaper *reaper, shd_connection *connection, size_t bytes);

/* Ends connections whose answers hold memory, until `bytes` will be free. Returns how many will be,
 * by this call and earlier ones whose connections are not closed yet. */
size_t shd_reaper_drop_answers(shd_reaper *reaper, size_t bytes);

/* The server stops: connections that rest are told so by their end, and so is who has been at a
 * head or a body for `grace` seconds. What they have sent until then is still read and answered. */
void shd_reaper_finish(shd_reaper *reaper, double grace);

typedef struct shd_reaped {
    size_t connections[SHD_PHASES]; /* now */
    uint64_t ended[SHD_ENDINGS];    /* so far */
    double oldest;                  /* seconds that one has been at work, at most */
} shd_reaped;

shd_reaped shd_reaper_count(shd_reaper *reaper);
