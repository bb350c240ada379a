/* What an attack counts, and how that is told. One thread at a time has a tally. */
#pragma once

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

#include "attack/scenes.h"

/* Bounds over what is measured, of pictures with four samples in the standard tier: [linear,
 * CIEDE2000 by planning, the same by the picture's colors], by eighths of powers of 2. */
enum { LOOSE = 3, EIGHTHS = 8 * 40 };

typedef struct counts {
    uint64_t scenes, pictures, pixels, samples, undecided, unbounded, refused, findings;
    double share[4]; /* the largest measured error over its bound: exact, and of each metric */
    uint64_t loose[LOOSE][EIGHTHS];
} counts;

enum { MOST_CHOSEN = 128 };

/* Of the families that were chosen. */
typedef struct tally {
    const family *chosen[MOST_CHOSEN];
    int chosen_count;
    counts counts[MOST_CHOSEN]; /* [chosen] */
} tally;

void tally_add(counts *to, const counts *by);
uint64_t tally_findings(const tally *a);

void tally_print_table(FILE *out, const tally *a);
void tally_print_looseness(FILE *out, const tally *a);

/* docs/attack.md. False: it cannot be written. */
bool tally_write_page(const tally *a, const char *path, double seconds, int threads,
                      uint64_t first);
