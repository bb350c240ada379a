/* How far off extended scenes (shd_plan.extended) can be, whose light is computed in f64. */
#pragma once

#include "plan/paths.h"

/* Whether its lights err otherwise than those of Phong's model (excess.h). Shadows alone only take
 * light away, and what they leave of light that comes from points is no source of error but on
 * their edges, which no bound counts (error.h). The share that they leave of a light with a shape
 * is one (shd_add_share). */
bool shd_errs_otherwise(const shd_plan *plan);

/* An upper bound of the error of the film's components against the model of docs/model.md.
 * Infinite: not known. */
double shd_extended_error(const shd_plan *plan);

/* The same of what a plan makes of environments beside what the exact tier makes of the same
 * points; the share of what is seen that shd_quick_share tells comes on top. For plans whose other
 * light is that of the exact tier. */
double shd_sums_error(const shd_plan *plan);

/* By how much of itself a component of the picture may be off by walking over environments, beside
 * what shd_sums_error counts: 0, or SHD_QUICK_SHARE. Negative: a part of what is seen may be more
 * than the whole, as some of it is below 0, so that no share tells it. */
double shd_quick_share(const shd_plan *plan);

/* What the error should stay below where its bound is loose: four times what quadrature of models
 * beside Phong's aims at under lights with a shape, which `./dev attack` holds pictures to, and
 * four times `noise`: [material_count], the largest standard error of simulated microgeometry in pi
 * f_r, against that microgeometry, or NULL. It is no proof. Infinite: there is nothing such. */
double shd_linear_estimate(const shd_plan *plan, const double *noise);

/* What tracing needs to add up how far off the rays of a picture are. NULL: the arena is full. */
const shd_strays *shd_find_strays(const shd_plan *plan, shd_arena *arena);

/* Whether the share that shadows leave of a light is bounded at all that is seen of the object. It
 * is not where a light with a shape is at the horizon, or seen from its edge (shd_add_share).
 * False: or that is not known. */
bool shd_share_has_bound(const shd_plan *plan, size_t object, const shd_plan_light *light);

/* Why `linear` is not known, if it is not: "a light may touch a surface ...". */
const char *shd_no_linear_bound(void);
