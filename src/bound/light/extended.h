/* How far off extended scenes (shd_plan.extended) can be, whose light is computed in f64. */
#pragma once

#include "plan/plan.h"

/* An upper bound of the error of the film's components against the model of docs/model.md.
 * Infinite: not known. */
double shd_extended_error(const shd_plan *plan);
