#include "attack/knobs.h"

#include <math.h>

#include "attack/scenes.h"

static _Thread_local int count, moved = -1;
static _Thread_local uint64_t place;

void knobs_move(int which, uint64_t where) {
    moved = which;
    place = where;
}

void knobs_begin(void) {
    count = 0;
}

int knobs_count(void) {
    return count;
}

double knob(uint64_t *random, double low, double high) {
    const double stays = between(random, low, high);
    uint64_t aside = place;
    return count++ == moved ? between(&aside, low, high) : stays;
}

double knob_decades(uint64_t *random, double low, double high) {
    return pow(10, knob(random, log10(low), log10(high)));
}

int knob_of(uint64_t *random, int choices) {
    return (int)knob(random, 0, choices);
}
