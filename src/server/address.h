/* Listening sockets from ADDR:PORT. */
#ifndef SHD_SERVER_ADDRESS_H
#define SHD_SERVER_ADDRESS_H

#include <stddef.h>

#include "base/status.h"

enum { SHD_ADDRESS_SIZE = 80 };

/* Opens a listening socket on "127.0.0.1:8080", "[::1]:8080", "localhost:8080", ":8080" (every
 * address) or with port 0 (any free port). `bound` gets the real address, in the same form. */
shd_status shd_listen(const char *address, int *out, char bound[SHD_ADDRESS_SIZE],
                      shd_error *error);

/* The address of a listening socket, in the same form; "unix" where it is none of the network. */
void shd_listen_describe(int fd, char bound[SHD_ADDRESS_SIZE]);

#endif
