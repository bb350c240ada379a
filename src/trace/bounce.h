/* What mirrors, glass and other surfaces that are no end of a ray show: T. Whitted, "An improved
 * illumination model for shaded display", 1980, whose coefficients are those of the point. Per
 * channel,
 *
 *     I = o (local + r I_mirror + t I_refracted) + (1 - o) I_behind
 *
 * where o is the opacity, r the reflection, t the transmission, and local the light model's. Rays
 * go on from each hit to the same model: mirrored at the normal, refracted by Snell's law (the
 * index is 1 before a surface and `ior` behind it, where its own normal points away from), and
 * straight through. What cannot be refracted is mirrored, with r + t. There is no Fresnel term.
 * Where an interpolated normal would send a ray to the wrong side of the triangle, the triangle's
 * own is taken. A ray that meets nothing brings the background.
 *
 * Each such ray is a step of a path. Paths end after `depth` steps, and steps are left out whose
 * product of coefficients is below `minContribution` in its largest channel. Both add nothing:
 * what is cut is counted.
 *
 * Channels are those of shd_ray_channels. In a tinted plan they are bins, and the color at the eye
 * is the sum of what each bin adds to it.
 *
 * Each ray also knows how far it is off: see stray.h. */
#pragma once

#include <stdatomic.h>

#include "plan/paths.h"
#include "shade/lighting.h"
#include "sight/ray.h"

/* Writes the radiance of the local model at a point, where `meeting` was met by a beam of `width`:
 * out[0], or in a tinted plan [bins->count], what each bin adds to it. */
typedef struct shd_local_light {
    const void *context;
    void (*light)(const void *context, void *scratch, const shd_surface *at,
                  const shd_meeting *meeting, double width, double (*out)[3]);
} shd_local_light;

typedef struct shd_bouncing {
    const shd_plan *plan;
    const shd_caster *caster;
    shd_local_light local;
    const bool *bounces; /* [object]: whether rays go on from it */
    const shd_strays *strays;
} shd_bouncing;

/* What a path's first hit became. */
typedef struct shd_bounced {
    double radiance[3]; /* I; over a background that is not transparent */
    double alpha;       /* 1 - the mean share through which a transparent background is seen */
    double cut;         /* the sum of the largest products of coefficients of what was left out */
    double error; /* of radiance, at most, by what rays met; not what is seen at the first hit */
    bool edge;    /* a ray was lost (stray.h), which `error` does not count */
    uint64_t rays;
} shd_bounced;

/* [object]. NULL: the arena is full. */
const bool *shd_bouncing_objects(const shd_plan *plan, shd_arena *arena);

/* The doubles of memory that paths take. */
size_t shd_bounce_room(const shd_plan *plan);

/* Follows the rays from what the eye sees at a point, whose local radiance is known, as
 * shd_local_light has it. `scratch` is for the local model, `room` for paths. Any thread. */
shd_bounced shd_bounce(const shd_bouncing *bouncing, void *scratch, double *room,
                       const shd_surface *at, const double (*local)[3]);
