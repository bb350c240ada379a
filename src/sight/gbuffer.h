/* What is seen: the hits of rays, in the order of the rays. */
#pragma once

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/scratch.h"
#include "plan/plan.h"

enum { SHD_NOTHING = -1 };

/* Rays to cast. */
typedef struct shd_shots {
    size_t count;
    const int32_t *x, *y;  /* [count]: a pixel of the whole picture, or outside of it */
    const uint8_t *sample; /* [count]: which of the sample pattern's rays */
} shd_shots;

/* The hits of a list of shots, appended in the order of the shots. A shot that hits nothing has no
 * entry. Arrays are [capacity], aligned to 64 bytes. */
typedef struct shd_hits {
    size_t count, capacity; /* capacity: a multiple of 16 */
    uint32_t *shot;         /* index of the shot */
    int32_t *object;        /* index in shd_scene.objects */
    /* For tiers in f32, rounded from f64; else NULL. */
    float *position32[3]; /* in the plan's frame: (p - plan->origin) * plan->scale */
    /* N, unit. If the material is two-sided, it is that of the side that is seen: it faces the
     * viewer, but for interpolated normals near silhouettes. */
    float *normal32[3];
    float *mirror32[3]; /* W = 2(N.V)N - V, unit: the mirrored view */
    float *low32[3]; /* what rounding took from the position; NULL unless plan->split_positions */
    /* For the exact tier, in the world's frame: the position, N and V; else NULL. */
    double *position[3], *normal[3], *view[3];
    /* For outputs with layers of data; else NULL. */
    double *depth;     /* the distance along the camera's axis */
    float *world32[3]; /* the position in the world's frame, if there is no `position` */
    /* For faceted objects (flat, gouraud), traced scenes and patterns on meshes, and set for hits
     * of triangles; else NULL. */
    uint32_t *triangle;
    double *u, *v; /* the barycentric weights of its second and third corner */
} shd_hits;

/* Lays out memory for `capacity` hits, rounded up to a multiple of 16. */
void shd_hits_lay_out(const shd_plan *plan, size_t capacity, shd_scratch *memory, shd_hits *out);

/* Repeats the last hit, if there is one, 15 times, so that vectors of any width see finite values
 * wherever they begin. The count stays, and there is room for 15 more. */
void shd_hits_pad(shd_hits *hits);

/* Whether all hits are of the same object. True if there are none. */
static inline bool shd_is_one_object(const shd_hits *hits) {
    int32_t differ = 0;
    for (size_t i = 0; i < hits->count; i++) differ |= hits->object[i] ^ hits->object[0];
    return !differ;
}
