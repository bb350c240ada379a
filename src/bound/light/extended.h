/* How far off extended scenes (shd_plan.extended) can be, whose light is computed in f64. */
#pragma once

#include "plan/plan.h"

/* Whether its lights err otherwise than those of Phong's model (excess.h). Shadows alone only take
 * light away, and the share that they leave is no source of error but on their edges, which no
 * bound counts (error.h). */
bool shd_errs_otherwise(const shd_plan *plan);

/* An upper bound of the error of the film's components against the model of docs/model.md.
 * Infinite: not known. */
double shd_extended_error(const shd_plan *plan);

/* Why `linear` is not known, if it is not: "a light may touch a surface ...". */
const char *shd_no_linear_bound(const shd_plan *plan);
