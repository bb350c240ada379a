/* The files of operators and users, opened with care. */
#pragma once

#include <stdbool.h>

#include "status.h"

/* Opens a regular file for reading. The answer is a descriptor that closes on exec, or -1 and
 * SHD_CONFIG with the file's name as path. A directory, a device or a FIFO is refused at once:
 * opening a FIFO would hang until somebody writes to it. Any thread. */
int shd_open_regular(const char *path, shd_error *error);

/* Gives closed standard streams a stand-in that refuses every read or write. Otherwise the next
 * file or connection that is opened would get such a stream's number, and a picture or a message
 * would go into it. False: the system refuses a stand-in. Call it at the start of a program, before
 * anything else is opened. */
bool shd_occupy_closed_streams(void);
