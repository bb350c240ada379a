/* What a lobe may be over a block or a cell of an environment. Only for shade/around_quick.c. */
#pragma once

#include "shade/around.h"

/* What is the same for all blocks. */
typedef struct shd_lobe_view {
    const shd_around_lobe *lobe;
    double viewing; /* N.V, at least 0 */
    double scale;   /* of weights, of which near, far and the factors are parts */
    double inverse; /* of facets: 1 / m^2 */
    double peak;    /* of facets: the square of the tangent where there are most */
    double own;     /* how wide the lobe is: of half vectors, or of directions */
} shd_lobe_view;

shd_lobe_view shd_view_lobe(const shd_around_lobe *lobe);

/* With the scale, near times high is the most that the lobe is on the block, and far times low the
 * least. Up to some percent: it is for choosing nodes. */
typedef struct shd_lobe_look {
    double side;      /* N.L in the middle */
    double near, far; /* what falls off from the lobe's peak, which is 1 */
    double high, low; /* what else it is multiplied by */
    double plain;     /* the square of the block's reach in widths of the lobe */
    double square;    /* the same, and more where the lobe is faint */
    double kink;      /* what a kink, or the horizon, makes of it: a part of the most */
} shd_lobe_look;

/* False: the lobe is nothing there. */
bool shd_look_at_lobe(const shd_lobe_view *v, shd_vec3 middle, double reach, shd_lobe_look *out);
