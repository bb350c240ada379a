/* Ends connections whose client has left in the middle of a request. libmicrohttpd waits for
 * edges of epoll: where a client's last bytes and its end arrive together it sees the bytes only,
 * and keeps the connection until it has been silent for `idle-timeout`. A thread looks once a
 * second instead. All functions: any thread. */
#ifndef SHD_SERVER_REAPER_H
#define SHD_SERVER_REAPER_H

#include <stdbool.h>

#include "base/status.h"

typedef struct shd_reaper shd_reaper;
typedef struct shd_connection shd_connection;

shd_status shd_reaper_new(shd_reaper **out, shd_error *error);
void shd_reaper_drop(shd_reaper *reaper); /* no connection is left; NULL is fine */

/* Watches a connection, which is new and waits for a request. NULL, and unwatched, where memory
 * is short. The socket stays open until it is removed. */
shd_connection *shd_reaper_add(shd_reaper *reaper, int socket);
void shd_reaper_remove(shd_reaper *reaper, shd_connection *connection); /* NULL is fine */

/* Whether the connection waits for a request, or for the rest of one: only then is it reaped. NULL
 * is fine. */
void shd_connection_awaits(shd_connection *connection, bool awaits);

#endif
