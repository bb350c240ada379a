/* What this process may have of its machine: the memory and the processors that there are, and what
 * its control groups (version 1, version 2 or both) and those above them leave of these. */
#ifndef SHD_BASE_MACHINE_H
#define SHD_BASE_MACHINE_H

#include <stdint.h>

enum { SHD_MACHINE_SOURCE = 256 };

typedef struct shd_machine {
    uint64_t memory;     /* bytes; UINT64_MAX where nothing tells */
    unsigned processors; /* that this process may run on */
    double quota;        /* processors' time; infinity where there is no bound */
    /* The files that the least were found in, cut where longer; "" where nothing tells. */
    char memory_source[SHD_MACHINE_SOURCE], quota_source[SHD_MACHINE_SOURCE];
} shd_machine;

/* Looks under `root`, "" but in tests, for /proc and what is mounted; affinity is the calling
 * thread's. What cannot be read bounds nothing. */
shd_machine shd_machine_look(const char *root);

/* How many threads keep busy what there is: parts of a processor count as one. At least 1. */
unsigned shd_machine_threads(const shd_machine *machine);

#endif
