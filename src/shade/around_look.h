/* What a lobe may be over blocks and cells of an environment. Only for shade/around_quick.c. */
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

/* Places, and looks at them. With the scale, near times high is the most that the lobe is in a
 * place, and far times low the least. Up to some percent: it is for choosing nodes. There is room
 * for what fills up the last SHD_LOOKS_STEP. */
enum { SHD_LOOKS_STEP = 16, SHD_LOOKS_MOST = 128 };
typedef struct shd_looks {
    size_t count;
    float middle[3][SHD_LOOKS_MOST]; /* unit */
    float reach[SHD_LOOKS_MOST];     /* no direction of the place is farther, in radians */
    float near[SHD_LOOKS_MOST];      /* what falls off from the lobe's peak, which is 1; 0: the */
    float far[SHD_LOOKS_MOST];       /* lobe is nothing there, and others mean nothing */
    float high[SHD_LOOKS_MOST], low[SHD_LOOKS_MOST]; /* what else it is multiplied by */
    float plain[SHD_LOOKS_MOST];  /* the square of the reach in widths of the lobe */
    float square[SHD_LOOKS_MOST]; /* the same, and more where the lobe is faint */
    float kink[SHD_LOOKS_MOST];   /* what a kink, or the horizon, makes of it: of the most */
} shd_looks;

/* Looks at all places. The same bits on every machine. */
typedef void shd_looks_function(const shd_lobe_view *v, shd_looks *looks);
shd_looks_function shd_look_at_lobe_portable, shd_look_at_lobe_avx2, shd_look_at_lobe_avx512;
