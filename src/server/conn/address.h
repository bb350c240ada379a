/* Sockets from ADDR:PORT and unix:/path: those that listen, and those that lead there. */
#pragma once

#include <stdbool.h>

#include "base/status.h"

enum { SHD_ADDRESS_SIZE = 128 };

/* Opens a listening socket on "unix:/path", in place of one that nobody listens on any more, with
 * the rights that the process' umask leaves; or on "127.0.0.1:8080", "[::1]:8080",
 * "localhost:8080", ":8080" (every address) or with port 0 (any free port). `bound` gets the real
 * address, in the same form. */
shd_status shd_listen(const char *address, int *out, char bound[SHD_ADDRESS_SIZE],
                      shd_error *error);

/* A socket that is connected to who listens on such an address, of this machine if it says
 * "every address". Each step on it gives up after `seconds`. */
shd_status shd_connect(const char *address, int seconds, int *out, shd_error *error);

/* Removes what a unix socket, by its real address, has left in the file system. */
void shd_listen_remove(const char *bound);

/* Lets nobody in any more, without an answer: who tries is told later, by the socket's end. Who is
 * connected already is still there to be accepted. For a socket that nobody else listens on. */
void shd_listen_seal(int fd);
bool shd_listen_has_waiting(int fd); /* whether somebody is connected who was not accepted yet */

/* The address of a listening socket, in the same form; of an abstract one, "unix:@name". */
void shd_listen_describe(int fd, char bound[SHD_ADDRESS_SIZE]);
