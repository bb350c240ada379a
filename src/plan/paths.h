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

/* The nanoseconds that rays to lights and further rays take for a sample that meets the object. 0
 * if the scene is not traced. */
double shd_traced_cost(const shd_plan *plan, const shd_paths *paths, size_t object);
