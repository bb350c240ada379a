/* Objects that lie together have far lights in common: what these do at a sphere around them all is
 * found once, and each object adds what is near. Of objects whose lights are in clusters, which are
 * alike in all but their places and colors. Inside of bound/. */
#pragma once

#include "bound/light/excess.h"

struct shd_finding;

/* The objects in an order in which those that lie together follow each other. */
typedef struct shd_crowds {
    uint32_t *objects; /* [object_count] */
    uint32_t *kinds;   /* [object_count], of `objects`; 0: it has nothing in common with others */
    size_t first, end; /* in `objects`: the part in question */
    bool known;        /* what they have in common is found: */
    shd_much *much;    /* [terms] */
    double ratio, distance;
} shd_crowds;

/* `terms`: the most that there are. False: memory, or cancelled. */
bool shd_crowd_new(struct shd_finding *f, size_t terms, shd_arena *arena);

/* The object at a place of the order. */
size_t shd_crowd_enter(struct shd_finding *f, size_t at);

/* Begins what is found at a piece of that object with what it has in common with others, after
 * which cuts are of what is near. */
void shd_crowd_begin(struct shd_finding *f, double *influences);
