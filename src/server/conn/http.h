/* The public port. */
#pragma once

#include "server/server.h"

struct MHD_Daemon;

/* Serves on a listening socket, which the daemon owns from then on. The server outlives it. */
shd_status shd_http_start(shd_server *server, int socket, struct MHD_Daemon **out,
                          shd_error *error);

/* A descriptor that can be read, to its end, once the I/O thread has finished what it is at now: a
 * connection that it was taking meanwhile is known to the reaper by then. The caller closes it.
 * -1: the system refused it. */
int shd_http_turn(struct MHD_Daemon *daemon);

/* Closes every connection; no exchange is suspended any more. */
void shd_http_stop(shd_server *server, struct MHD_Daemon *daemon);
