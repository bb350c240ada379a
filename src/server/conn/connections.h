/* The public port's connections as libmicrohttpd tells of them: who is let in, and that the reaper
 * knows. All on the I/O thread; `cls` is the server. */
#pragma once

#include <microhttpd.h>

#include "reaper.h"

/* Whether a connection is let in, be it to be refused: else it is closed without an answer. */
enum MHD_Result shd_connection_accept(void *cls, const struct sockaddr *peer, socklen_t size);

void shd_connection_notify(void *cls, struct MHD_Connection *connection, void **context,
                           enum MHD_ConnectionNotificationCode code);

/* Of a connection of either port: the reaper's word for it, its socket, and the address of its
 * other end. NULL, -1: there is none. */
shd_connection *shd_connection_watched(struct MHD_Connection *connection);
int shd_connection_socket(struct MHD_Connection *connection);
const struct sockaddr *shd_connection_peer(struct MHD_Connection *connection);
