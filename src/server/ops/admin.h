/* The operators' port. Its daemon and its reaper are its own: no crowd on either port starves it.
 */
#pragma once

#include "base/status.h"

struct shd_server;
typedef struct shd_admin shd_admin;

/* Serves on a listening socket, which is the port's from then on, even if it does not start. */
shd_status shd_admin_start(struct shd_server *server, int socket, shd_admin **out,
                           shd_error *error);
void shd_admin_stop(shd_admin *admin); /* NULL is fine */
