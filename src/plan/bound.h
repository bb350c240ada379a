/* Error bounds: how far a picture may be from the model.
 *
 * A tier's errors (error.h) are carried through the scene in three steps: what each object's
 * lights may add to the error of its color (excess.c), what that is in the output's codes
 * (codes.c), and to the eye (seen.c). Edges that run through a sample are not counted, see
 * error.h. */
#ifndef SHD_PLAN_BOUND_H
#define SHD_PLAN_BOUND_H

#include "base/arena.h"
#include "base/catalog.h"
#include "plan/error.h"

struct shd_plan;

/* Upper bounds; infinite: unknown. */
typedef struct shd_bound {
    double linear; /* of components of the film, in the working space, from the model's */
    double code;   /* of 8-bit samples of outputs, from those of the exact tier's picture */
    double
        delta_e; /* CIEDE2000, from the same; of a picture that lies over black, if it has alpha */
} shd_bound;

/* How an output shows linear light, as far as that is known. Its codes are a curve of a matrix
 * times the working space's components. To the eye, it is a matrix to the linear RGB of a screen,
 * held in [0,1], and from there to XYZ divided by the white. */
typedef struct shd_shown {
    bool coded; /* false: `curve` and `matrix` are not known */
    shd_transfer curve;
    double matrix[3][3];
    bool seen; /* false: nor are `screen` and `to_xyz` */
    double screen[3][3], to_xyz[3][3];
    bool coarse; /* nothing but 8-bit integers is stored */
} shd_shown;

/* With two digits, rounded up: 2.1e-06. */
void shd_print_bound(double bound, char out[16]);

/* The curve that outputs with a transfer have: encoded from linear light, and back. Both are
 * odd functions; not for SHD_TRANSFER_UNKNOWN. */
double shd_curve_encode(shd_transfer transfer, double linear);
double shd_curve_decode(shd_transfer transfer, double encoded);

/* ---- Excess: errors of objects with one material, any of them. ---- */

/* The error of a color, in channel c, where its value is v >= 0:
 *     absolute[c] + min(limited[c], ratio v[c]) + color v[c]
 * and, as all lights of a color err in one direction of the colors, it is at most
 *     (main_absolute + min(main_limited, ratio |v| / |main|)) main[c]
 *         + rest_absolute[c] + min(rest_limited[c], ...) + color v[c]
 * of which the first part is one vector in length and direction. */
typedef struct shd_excess {
    double absolute[3], limited[3];
    double main[3]; /* its sum is 1, or 0 where there is nothing */
    double main_absolute, main_limited;
    double rest_absolute[3], rest_limited[3];
    double ratio;
    double floor[3]; /* the least that its colors can be: constant terms */
} shd_excess;

enum { SHD_EXCESSES = 8 }; /* more materials than that share the last one */

typedef struct shd_excess_list {
    size_t count;
    shd_excess excess[SHD_EXCESSES];
    bool nonnegative; /* no color or coefficient is below 0; else `ratio` and `main` mean nothing */
    bool grey;        /* channels are equal */
    double color;     /* relative error of every color: rounding, what is left out */
    double more;      /* absolute, in every channel: lights left out, samples left out */
    double most[3];   /* of all colors, by size */
    /* Of all colors' parts: r, g, b / (r + g + b). */
    double least_part[3], most_part[3];
} shd_excess_list;

/* SHD_MEMORY is false. Without `more`. */
bool shd_excess_find(const struct shd_plan *plan, shd_tier tier, shd_arena *arena,
                     shd_excess_list *out);

double shd_bound_linear(const shd_excess_list *list);
double shd_bound_code(const shd_excess_list *list, const shd_shown *shown);
double shd_bound_delta_e(const shd_excess_list *list, const shd_shown *shown);

/* The worst of all outputs; `count` 0: only `linear` is known. */
shd_bound shd_bound_of(const shd_excess_list *list, const shd_shown *shown, size_t count,
                       shd_tier tier);

#endif
