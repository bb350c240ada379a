/* What this process may have of its machine: the memory and the processors that there are, less
 * what its control groups (version 1, version 2 or both) and those above them keep from it. */
#pragma once

#include <stdint.h>

enum { SHD_MACHINE_SOURCE = 256 };

typedef struct shd_machine {
    uint64_t memory;     /* bytes; UINT64_MAX if nothing tells */
    unsigned processors; /* that this process may run on */
    double quota;        /* processors' time; infinity if there is no bound */
    /* The files that the smallest figures were found in, perhaps cut; "" if nothing tells. */
    char memory_source[SHD_MACHINE_SOURCE], quota_source[SHD_MACHINE_SOURCE];
} shd_machine;

/* Looks for /proc and the mounted trees under `root`, which is "" except in tests. Affinity is that
 * of the calling thread. A file that cannot be read bounds nothing. */
shd_machine shd_machine_look(const char *root);

/* How many threads keep the processors busy: a part of a processor counts as one. At least 1. */
unsigned shd_machine_threads(const shd_machine *machine);
