/* CIEDE2000's bound of a picture that is there, from its own colors. It is tighter than planning's,
 * which has to take the darkest and the most colorful colors that there may be.
 *
 * A pixel's color has room for so much of a term beside the scene's other terms. Errors in
 * proportion to a term, above all those of highlights, are then no more than that. The color also
 * tells how steep the slopes of L, a and b are. A pixel may mix samples of all objects and the
 * background, in any shares. */
#pragma once

#include "bound/shown/shown.h"

/* Constant once made; any threads may use it. */
typedef struct shd_picture_errors shd_picture_errors;

/* `list` is of the plan and tier that the picture was made by, and counts what is left out. The
 * screen is that of `shown`. *out lives in the arena. It is NULL if no more can be told than by
 * planning, because there are too many terms or negative ones. False: memory. */
bool shd_picture_errors_new(const shd_plan *plan, const shd_excess_list *list,
                            const shd_shown *shown, shd_arena *arena,
                            const shd_picture_errors **out);

/* The bound of a pixel that shows this color of the working space. It takes some 0.5 us. */
double shd_picture_delta_e(const shd_picture_errors *errors, const double rgb[3]);
