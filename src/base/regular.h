/* The files of operators and users, opened with care. */
#ifndef SHD_BASE_REGULAR_H
#define SHD_BASE_REGULAR_H

#include <stdbool.h>

#include "status.h"

/* Opens a regular file to read: a descriptor that closes on exec, or -1, with SHD_CONFIG and the
 * file's name as path. A directory, a device or a FIFO is refused at once; a FIFO would hang who
 * opens it until somebody writes to it. Any thread. */
int shd_open_regular(const char *path, shd_error *error);

/* A closed standard stream's number would go to the next file or connection that is opened, and a
 * picture or a message into that. Such streams get a stand-in that refuses every read or write.
 * False: the system refuses one. At the start of a program, before anything else is opened. */
bool shd_occupy_closed_streams(void);

#endif
