/* The sockets that the public port listens on. libmicrohttpd takes one; what comes to the others is
 * handed to it by a thread of their own, which does nothing else. */
#pragma once

#include <stdbool.h>

#include "address.h"
#include "base/status.h"

struct MHD_Daemon;

typedef struct shd_doors shd_doors;

enum { SHD_DOORS_MOST = 8, SHD_DOORS_SIZE = SHD_DOORS_MOST * SHD_ADDRESS_SIZE };

/* Opens a list of addresses (address.h), parted by blanks or commas; or takes the socket that a
 * service manager has given, if there is one (else -1). `bound` gets the real addresses. */
shd_status shd_doors_open(const char *addresses, int given, shd_doors **out,
                          char bound[SHD_DOORS_SIZE], shd_error *error);

int shd_doors_first(const shd_doors *doors); /* the socket for libmicrohttpd to listen on */

/* The first socket is libmicrohttpd's from now on; hands over what comes to the others. */
shd_status shd_doors_serve(shd_doors *doors, struct MHD_Daemon *daemon, shd_error *error);

/* Lets nobody in any more who is not connected yet. If a service manager has the socket, who has
 * not been let in waits there for the next daemon. */
void shd_doors_seal(shd_doors *doors);

bool shd_doors_have_waiting(shd_doors *doors); /* somebody who was not handed over yet */
void shd_doors_stop(shd_doors *doors); /* hands nobody over any more; before libmicrohttpd stops */

/* Closes what is left, and removes unix sockets that it has made. NULL is fine. */
void shd_doors_drop(shd_doors *doors);
