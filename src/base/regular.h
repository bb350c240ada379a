/* The files of operators and users, opened with care. */
#pragma once

#include <stdbool.h>

#include "status.h"

/* Opens a regular file for reading. The answer is a descriptor that closes on exec, or -1 and
 * SHD_CONFIG with the file's name as path; a FIFO does not hang it. Any thread. */
int shd_open_regular(const char *path, shd_error *error);

/* Gives closed standard streams a stand-in that refuses every read or write, so that no file or
 * connection gets such a stream's number, and with it a picture or a message. Call it before a
 * program opens anything. False: the system refuses a stand-in. */
bool shd_occupy_closed_streams(void);
