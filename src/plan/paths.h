/* What the rays of a traced scene are worth and cost, from its materials alone. */
#pragma once

#include "plan/plan.h"

typedef struct shd_paths {
    size_t bouncing; /* objects from which rays go on */
    double steps;    /* rays of a path to expect where it meets such objects only */
    /* At most so much is cut of a sample, as a factor: of the largest radiance that rays would have
     * met where they were left out. By the depth, and by minContribution. */
    double cut;
} shd_paths;

/* The most that rays bring from a surface is m = max o r + max o t + max (1 - o), each the largest
 * of the channels, and there are at most b rays. So paths of d + 1 steps, which the depth cuts, add
 * up to m^(d+1) at most. What minContribution cuts is less than it for each of at most b^d rays;
 * and all that is cut, none of which is behind another, is at most max(1, m)^(d+1). */
shd_paths shd_find_paths(const shd_plan *plan);

/* What of further rays an object shows, at most: the largest r + t of the channels. */
double shd_sent_on(const shd_plan *plan, size_t object);

/* How far off an object's own light is for rays that are off, by levels of how far they are, and of
 * N.V. */
enum { SHD_STRAY_LEVELS = 10, SHD_STRAY_VIEWS = 4 };
static const double SHD_STRAY_OFF[SHD_STRAY_LEVELS] = {1e-13, 1e-12, 1e-11, 1e-10, 1e-9,
                                                       1e-8,  1e-7,  1e-6,  1e-5,  1e-4},
                    SHD_STRAY_VIEW[SHD_STRAY_VIEWS] = {1e-4, 1e-3, 1e-2, 0.1};

typedef struct shd_stray {
    double bend; /* by how much its surface bends for each length; 0: it is flat */
    /* Of any channel, if no N.V is below the view's level. Directions to the eye and twice the
     * normal are turned by no more than `off`, and points beside by no more than that times
     * shd_strays.wide. */
    double error[SHD_STRAY_VIEWS][SHD_STRAY_LEVELS];
    bool plane;   /* it is infinite */
    bool by_view; /* it depends on N.V, even below these levels */
    double most;  /* of what it shows by itself */
} shd_stray;

/* What tracing needs to add up how far off its rays are. */
typedef struct shd_strays {
    double far;    /* four times as far as any light is from anything bounded, at least */
    shd_stray *of; /* [object_count] */
    double wide;
    double slope;    /* of what is seen behind all objects, by direction (shd_backdrop_slope) */
    double rounding; /* a length: how far off the surface f64 puts hits */
    double further;  /* the part of it for each length of the ray, on infinite planes */
    double seen;     /* how far off is what the eye sees, but for what further rays bring */
} shd_strays;

/* The nanoseconds that rays to lights take for a sample that meets the object, and those that
 * further rays take with the shadows where they end. 0 if the scene is not traced. */
typedef struct shd_traced_cost {
    double shadow, trace;
} shd_traced_cost;

shd_traced_cost shd_find_traced_cost(const shd_plan *plan, const shd_paths *paths, size_t object);
