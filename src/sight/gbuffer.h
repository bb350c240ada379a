/* What is seen: hits of rays, in the order of the rays. */
#ifndef SHD_SIGHT_GBUFFER_H
#define SHD_SIGHT_GBUFFER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/scratch.h"
#include "plan/plan.h"

enum { SHD_NOTHING = -1 };

/* Rays to cast: pixel (x, y) of the whole picture, which may lie outside of it, and which of the
 * sample pattern's rays. */
typedef struct shd_shots {
    size_t count;
    const int32_t *x, *y;  /* [count] */
    const uint8_t *sample; /* [count] */
} shd_shots;

/* The hits of a list of shots, appended in the order of the shots; what hits nothing leaves no
 * entry. Arrays are [capacity], aligned to 64 bytes. */
typedef struct shd_hits {
    size_t count, capacity; /* capacity: a multiple of 16 */
    uint32_t *shot;         /* index of the shot */
    int32_t *object;        /* index in shd_scene.objects */
    /* Tiers in f32 (NULL for exact), rounded from f64: the position in the plan's frame, (p -
     * plan->origin) * plan->scale; N, unit, of the side that is seen where the material is
     * two-sided: it faces the viewer, but for interpolated ones near silhouettes;
     * W = 2(N.V)N - V, unit: the mirrored view. */
    float *position32[3], *normal32[3], *mirror32[3];
    float *low32[3]; /* what rounding the position took; NULL unless plan->split_positions */
    /* Exact tier (else NULL), in the world's frame: the position, N and V. */
    double *position[3], *normal[3], *view[3];
    /* Where an output has layers of data (else NULL): the distance along the camera's axis, and,
     * where there is no `position`, the position in the world's frame. */
    double *depth;
    float *world32[3];
    /* Where an object is faceted (flat, gouraud; else NULL), and set for hits of such: the
     * triangle, and the barycentric weights of its second and third corner. */
    uint32_t *triangle;
    double *u, *v;
} shd_hits;

/* Memory for `capacity` hits, rounded up to a multiple of 16. */
void shd_hits_lay_out(const shd_plan *plan, size_t capacity, shd_scratch *memory, shd_hits *out);

/* Repeats the last hit up to the next multiple of 16, so that vectors of any width see finite
 * values. The count stays. Nothing is done where there is no hit. */
void shd_hits_pad(shd_hits *hits);

/* Whether all hits are of the same object. True if there are none. */
static inline bool shd_is_one_object(const shd_hits *hits) {
    int32_t differ = 0;
    for (size_t i = 0; i < hits->count; i++) differ |= hits->object[i] ^ hits->object[0];
    return !differ;
}

#endif
