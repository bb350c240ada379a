/* Error bounds: how far a picture may be from the model.
 *
 * A tier's errors (light/error.h) are carried through the scene in three steps: by how much the
 * lights may be off in each piece of what is seen (light/pieces.h, light/excess.h), what that is in
 * the output's codes (shown/code.c), and what it is to the eye (shown/delta_e.c). These bounds
 * choose the tier of a plan, and what it leaves out (choose.c). */
#pragma once

#include "base/transfer.h"
#include "plan/cost.h"

/* How an output shows linear light, if that is known. Its codes are a curve of a matrix times the
 * working space's components. To the eye, a matrix makes the linear RGB of a screen, which is held
 * in [0,1], and another one XYZ divided by the white. */
typedef struct shd_shown {
    bool coded; /* false: `curve` and `matrix` are not known */
    shd_transfer curve;
    double matrix[3][3];
    bool seen;                 /* false: what follows is not known */
    shd_transfer screen_curve; /* on the way to the screen's linear RGB: to there and back */
    double screen[3][3], to_xyz[3][3];
} shd_shown;

/* Chooses how a draft is carried out: in the tier that is asked for, or in the cheapest one that
 * meets the budget if lights cost `costs` ([SHD_EXACT + 1], see plan/cost.h). With a budget it also
 * chooses tolerances, and the weakest lights of the whole picture, which out->plan is then without.
 * The bound counts all of that. `shown`: [output_count]; NULL: it is not known, so that only the
 * exact tier meets a budget in codes or CIEDE2000. SHD_SCENE: nothing meets the budget. SHD_MEMORY,
 * without a text: also if the draft's flag cancels. */
shd_status shd_choose(const shd_plan *draft, const shd_shown *shown, const shd_kernel_cost *costs,
                      shd_arena *arena, shd_choice *out, shd_error *error);
