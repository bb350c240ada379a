/* CIEDE2000's bound of a picture that is there, from its own colors: planning has to take the
 * darkest colors, and the most colorful ones, that there may be.
 *
 * How much of a term (a material's color times a light's) there is in a pixel is at most what its
 * color has room for, beside the other terms that the scene has: errors in proportion to a term,
 * highlights' above all, are no more than that. The pixel's own color tells how steep the slopes of
 * L, a and b are. A pixel may mix samples of all objects and the background, in any shares. */
#ifndef SHD_BOUND_SHOWN_PICTURE_H
#define SHD_BOUND_SHOWN_PICTURE_H

#include "bound/shown/shown.h"

/* Constant once made; any threads may use it. */
typedef struct shd_picture_errors shd_picture_errors;

/* `list` is of the plan and tier that the picture was made by, with what is left out counted; the
 * screen is that of `shown`. Lives in the arena. *out is NULL where no more can be told than by
 * planning: there are too many terms, or negative ones. False: memory. */
bool shd_picture_errors_new(const shd_plan *plan, const shd_excess_list *list,
                            const shd_shown *shown, shd_arena *arena,
                            const shd_picture_errors **out);

/* The bound of a pixel that shows this color, of the working space. Some 0.5 us. */
double shd_picture_delta_e(const shd_picture_errors *errors, const double rgb[3]);

#endif
