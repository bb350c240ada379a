/* How much of a light arrives, anew from docs/model.md: every surface is looked at by every ray, in
 * long double or 113 bits. No code is shared with src/.
 *
 * A surface is counted as undecided where rounding of f64 may decide on it: one that is met within
 * some 256 eps C / |N.D| of an end of the way, eps = 2^-52 and C the size of the coordinates, and
 * one that only some of five ways meet, which lie beside each other by 64 eps C. */
#ifndef SHD_ATTACK_OCCLUDE_H
#define SHD_ATTACK_OCCLUDE_H

#include "attack/document.h"

/* A place that is lit. */
typedef struct site {
    point at, normal; /* normal: unit, as light is reckoned with */
    point own;        /* unit: the surface's, on the side that is lit */
    point outward;    /* unit: the surface's, outward */
    size_t thing, triangle;
} site;

/* The share that arrives, of each channel: from where all that is undecided hides to where none of
 * it does. */
typedef struct arrival {
    real low[3], high[3];
} arrival;

/* `toward`: unit, the way to a light without a shape. `key` tells cases apart (model.c). */
arrival occlude_point(const document *d, const lamp *l, const site *s, point toward, uint64_t *key);
arrival occlude_shape(const document *d, const lamp *l, const site *s, uint64_t *key);

#endif
