/* How far off light is where rays from mirrors and glass end. Inside of bound/. */
#pragma once

#include "bound/light/drift.h"
#include "plan/paths.h"

/* The most that rays bring, in any channel, and how far off that is. In a tinted plan both are of
 * what bins add up to, each by its absolute value, so that no shares of bins up to 1 make it more.
 */
typedef struct shd_brought {
    double most, error;
} shd_brought;

/* Of all rays after the first step, if there are mirrors or glass; else nothing. Scenes without
 * them have only straight rays, which the errors of what the eye sees count. `rounding` is that of
 * colors; `estimated` as in sums.h. */
shd_brought shd_find_beyond(const shd_plan *plan, double rounding, bool estimated);

/* Adds an object to what rays show: `local` is its own light, `beyond` what further rays bring. */
void shd_add_beyond(const shd_plan *plan, size_t object, shd_brought local,
                    const shd_brought *beyond, shd_brought *out);

/* Whether nothing that is seen is below 0, so that parts of it are no more than the whole. */
bool shd_adds_up(const shd_plan *plan);

/* Whether rays go straight on through the object. */
bool shd_lets_through(const shd_plan *plan, size_t object);

/* The largest component of the background, in a tinted plan of any share of its bins; 0: there is
 * none. */
double shd_background_most(const shd_plan *plan);

/* Fills what tracing needs to know of each object to add up its errors: [object_count]. */
void shd_fill_strays(const shd_plan *plan, double rounding, shd_strays *out);
