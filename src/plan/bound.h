/* Error bounds: how far a picture may be from the model.
 *
 * A tier's errors (error.h) are carried through the scene in three steps: what the lights may add
 * to the error of a color in each piece of what is seen (pieces.h, excess.c), what that is in the
 * output's codes (bound.c), and to the eye (bound_delta_e.c). Edges that run through a sample are
 * not counted, see error.h. */
#ifndef SHD_PLAN_BOUND_H
#define SHD_PLAN_BOUND_H

#include "base/arena.h"
#include "base/transfer.h"
#include "plan/error.h"

struct shd_plan;

/* Upper bounds; infinite: unknown. */
typedef struct shd_bound {
    double linear;  /* of components of the film, in the working space, from the model's */
    double code;    /* of 8-bit samples of outputs, from those of the exact tier's picture */
    double delta_e; /* CIEDE2000, from the same; what has alpha lies over black */
} shd_bound;

double shd_bound_in(const shd_bound *bound, shd_metric metric);

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

enum { SHD_BOUND_TEXT = 32 };

/* Rounded up to two digits, 2.1e-06, or to as many more as keep it within `most`, the budget that
 * the bound meets (infinite: there is none). */
void shd_print_bound(double bound, double most, char out[SHD_BOUND_TEXT]);

/* What f32 on the way through an output's curve makes of a difference of two films, relative to the
 * channel: 1.15 times what 3e6 pairs of floats have shown. */
double shd_curve_noise(shd_transfer transfer);

/* And through a matrix that is not diagonal, relative to the products that it adds up. */
static const double SHD_MATRIX_NOISE = 5 * 0x1p-24;

/* ---- Excess: errors of what is seen, for pieces of surfaces that are about as bright. ---- */

/* Of colors' parts: r, g, b / (r + g + b). */
typedef struct shd_parts {
    double least[3], most[3];
} shd_parts;

/* Light of one color: of a material times some of its lights. */
typedef struct shd_term {
    double color[4]; /* components by their size, and their sum */
    double part[3];  /* r, g, b / (r + g + b) */
} shd_term;

/* How much of a term there is at a piece, and how much it errs, as multiples of its color. */
typedef struct shd_much {
    double low, high;
    double absolute, limited; /* errors, as in shd_excess */
    double misplaced;         /* the error that both tiers share */
} shd_much;

/* The error of a color, in channel c, where its value is v within [floor, most], is at most
 *     absolute[c] + limit(c, v) + color v
 *     limit(c, v) = min(limited[c], ratio (v - base[c]) + distance v)
 * for highlights err in proportion to themselves, and what lies below `base` is none. As all
 * lights of a color err in one direction of the colors, it is also at most
 *     (main_absolute + min(main_limited, ...)) main[c] + rest_absolute[c] + rest_limited[c] + color
 * v of which the first part is one vector in length and direction. Where its terms are known, it is
 * the sum of their errors and color v: each is one vector, and of where there is w of a term
 *     absolute + min(limited, (ratio + distance) w)
 * at most, without the ratio for the diffuse ones. */
typedef struct shd_excess {
    double absolute[3], limited[3];
    double main[3]; /* its sum is 1, or 0 where there is nothing */
    double main_absolute, main_limited;
    double rest_absolute[3], rest_limited[3];
    double ratio, distance;
    double base[3], floor[3], most[3];
    shd_parts parts, gain; /* of its colors; of what they have above `floor` */
    /* The constant term, and for each hue of its lights a diffuse one and those of each lobe; how
     * much there is of each is in the list. NULL: too many, or those of different materials. */
    const shd_term *terms;
    size_t term_count, lobe_count;
    size_t material;  /* of the pieces, */
    int dark, bright; /* and steps of what they show least and most */
} shd_excess;

enum { SHD_EXCESSES = 24, SHD_MOST_TERMS = 12 };

/* A pixel that mixes colors errs by their errors' mean, and lies above each one's share w of it.
 * Curves are flattest in the light, so that all shares but one hide in that one's; but where a
 * curve is straight near black, colors u at its end and 0 err by 1 - w + slope(w u) / slope(u) w
 * of each one's bound together: at most 1.39 for Lab's cube root, 1.32 for sRGB. */
static const double SHD_MIXTURE = 1.4;

typedef struct shd_excess_list {
    size_t count;
    shd_excess excess[SHD_EXCESSES];
    shd_much much[SHD_EXCESSES][SHD_MOST_TERMS]; /* of excesses whose terms are known */
    bool nonnegative; /* no color or coefficient is below 0; else `ratio`, `main`, `base` and
                         `floor` mean nothing */
    bool grey;        /* channels are equal */
    bool mixed;       /* pixels may be means of samples, of any of the pieces and the background */
    double color;     /* relative error of every color: rounding, what is left out */
    double rounding;  /* the rounding alone */
    double more;      /* absolute, in every channel: lights left out */
    double most[3];   /* of all colors, by size */
    double worst;     /* of all errors, those with `rounding` */
    double misplaced; /* of colors where f64 has a point: of `linear` alone, for tiers share it */
} shd_excess_list;

/* The most that each light adds to a channel. */
typedef struct shd_influences {
    size_t count;
    double **rows; /* [count][light_count]: of pieces of what is seen */
} shd_influences;

/* Without `more`; `influences` may be NULL. SHD_MEMORY is false. */
bool shd_excess_find(const struct shd_plan *plan, shd_tier tier, shd_arena *arena,
                     shd_excess_list *out, shd_influences *influences);

double shd_bound_linear(const shd_excess_list *list);
double shd_bound_code(const shd_excess_list *list, const shd_shown *shown);
/* What is no more than `enough` may be told as that, and then what is more as any value that is. */
double shd_bound_delta_e(const shd_excess_list *list, const shd_shown *shown, double enough);

/* The worst of all outputs; `count` 0: only `linear` is known. */
shd_bound shd_bound_of(const shd_excess_list *list, const shd_shown *shown, size_t count,
                       shd_tier tier);

#endif
