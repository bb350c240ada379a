/* Two scenes of one request, whose pictures are compared, or pictures that are there; or a scene
 * and its photo. */
#pragma once

#include "image/read.h"
#include "render/request.h"

typedef struct shd_pair {
    /* Owned; cancelled with the request that has them. The second is NULL beside a photo. */
    shd_request *sides[2];
    double density;           /* pixels a degree; 0: the usual */
    uint64_t work;            /* as shd_request_work */
    const shd_samples *photo; /* of the first side's scene; NULL: two are compared */
    shd_format format;        /* the photo's */
    const char *object;       /* whose material is wanted; NULL: that of all */
} shd_pair;

/* The request's pair, with nothing in it. NULL: memory, which the report says. */
shd_pair *shd_pair_new(shd_request *request);

/* A side, which may take a `share`th of what the limit `memory` leaves. Not SHD_OK: the report of
 * the request says why, at `place`. */
shd_status shd_pair_new_side(shd_request *request, const char *place, unsigned share,
                             shd_request **side);

/* What is wrong with a side, and what it is warned of, at its place in the document. */
void shd_pair_take_report(shd_request *request, const char *place, const shd_report *from);
