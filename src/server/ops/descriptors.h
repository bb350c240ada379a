/* File descriptors. They are counted at the start, so that connections cannot take the last one:
 * then no port could accept anybody, the operators' included, and no file could be opened. */
#pragma once

#include <stdint.h>

#include "base/status.h"

enum {
    SHD_ADMIN_CONNECTIONS = 64, /* at a time, on the operators' port */
    SHD_RESERVED = 192          /* for those, lingering ones, and all that is no connection */
};

/* Raises the process's limit of open files as far as `wanted` connections need and as it may be.
 * *connections is how many fit: `wanted`, or fewer. SHD_CONFIG if not even one does. */
shd_status shd_descriptors_claim(uint64_t wanted, uint64_t *connections, shd_error *error);
