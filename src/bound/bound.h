/* Error bounds: how far a picture may be from the model. The room above plan.
 *
 * A tier's errors (light/error.h) are carried through the scene in three steps: what the lights may
 * add to the error of a color in each piece of what is seen (light/pieces.h, light/excess.h), what
 * that is in the output's codes (shown/code.c), and to the eye (shown/delta_e.c). Edges that run
 * through a sample are not counted, see light/error.h.
 * What a plan is made of is chosen by these bounds (choose.c). */
#ifndef SHD_BOUND_BOUND_H
#define SHD_BOUND_BOUND_H

#include "base/transfer.h"
#include "plan/cost.h"
#include "plan/plan.h"

/* Why `linear` is unknown. */
#define SHD_NO_LINEAR_BOUND "a light may touch a surface, or a value exceed what floats hold"

/* How an output shows linear light, as far as that is known. Its codes are a curve of a matrix
 * times the working space's components. To the eye, it is a matrix to the linear RGB of a screen,
 * held in [0,1], and from there to XYZ divided by the white. */
typedef struct shd_shown {
    bool coded; /* false: `curve` and `matrix` are not known */
    shd_transfer curve;
    double matrix[3][3];
    bool seen;                 /* false: nor are these */
    shd_transfer screen_curve; /* on the way to the screen's linear RGB: to there and back */
    double screen[3][3], to_xyz[3][3];
} shd_shown;

/* Chooses how a draft is carried out: the tier that is asked for, or with a budget the cheapest
 * that meets it, where lights cost `costs` ([SHD_EXACT + 1], see plan/cost.h), and what may be left
 * out under it: tolerances, and the weakest lights of the whole picture, without which choice->plan
 * then is. The bound counts all of that. `shown`: [output_count], or NULL: how outputs show colors
 * is not known, so that a budget in codes or CIEDE2000 is met by the exact tier. SHD_SCENE: nothing
 * meets the budget. SHD_MEMORY, without a text, also where the draft's flag cancels. */
shd_status shd_choose(const shd_plan *draft, const shd_shown *shown, const shd_kernel_cost *costs,
                      shd_arena *arena, shd_choice *out, shd_error *error);

#endif
