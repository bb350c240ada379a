/* Excesses: the errors of what is seen. Each is of pieces of surfaces that are about as bright. */
#pragma once

#include "plan/plan.h"

/* The ranges of r, g and b / (r + g + b) of some colors. */
typedef struct shd_parts {
    double least[3], most[3];
} shd_parts;

/* One of a material's colors times that of some of its lights. */
typedef struct shd_term {
    double color[4]; /* the components' absolute values, and their sum */
    double part[3];  /* r, g, b / (r + g + b) */
} shd_term;

/* How much of a term there is at a piece, and how much it errs, as multiples of its color. */
typedef struct shd_much {
    double low, high;
    double absolute, limited; /* errors, as in shd_excess */
    double misplaced;         /* the error that both tiers share */
} shd_much;

/* The error of a color, in channel c of value v in [floor, most], is at most
 *     absolute[c] + limit(c, v) + color v
 *     limit(c, v) = min(limited[c], ratio (v - base[c]) + distance v)
 * because highlights err in proportion to themselves, and there is no highlight below `base`. All
 * lights of a color err in one direction of the colors, so that the error is also at most
 *     (main_absolute + min(main_limited, ...)) main[c] + rest_absolute[c] + rest_limited[c]
 *     + color v
 * whose first part is one vector. If the terms are known, the error is color v and the sum of the
 * terms' errors. The error of w of a term is one vector: the term's color times at most
 *     absolute + min(limited, (ratio + distance) w)
 * or the same without the ratio if the term is diffuse. */
typedef struct shd_excess {
    double absolute[3], limited[3];
    double main[3]; /* its sum is 1, or 0 if nothing errs */
    double main_absolute, main_limited;
    double rest_absolute[3], rest_limited[3];
    double ratio, distance;
    double base[3], floor[3], most[3];
    shd_parts parts; /* of its colors */
    shd_parts gain;  /* of what the colors have above `floor` */
    /* The constant term, and for each hue of its lights a diffuse term and one for each lobe; how
     * much there is of them is in the list. NULL: they are too many, or of several materials. */
    const shd_term *terms;
    size_t term_count, lobe_count;
    size_t material;  /* of the pieces */
    int dark, bright; /* the steps of the least and the most that they show */
} shd_excess;

/* (ratio + distance) of term t, which is at least 1, or without the ratio if it is diffuse. */
static inline double shd_term_rate(const shd_excess *e, size_t t) {
    return e->distance + ((t - 1) % (1 + e->lobe_count) ? e->ratio : 0);
}

enum { SHD_EXCESSES = 24, SHD_MOST_TERMS = 12 };

typedef struct shd_excess_list {
    size_t count;
    shd_excess excess[SHD_EXCESSES];
    shd_much much[SHD_EXCESSES][SHD_MOST_TERMS]; /* of excesses whose terms are known */
    /* No color or coefficient is below 0. Else `ratio`, `main`, `base` and `floor` mean nothing. */
    bool nonnegative;
    bool grey;       /* channels are equal */
    bool textured;   /* patterns make colors darker than these; what that shows is not known */
    bool mixed;      /* a pixel may be a mean of samples, of any pieces and the background */
    double color;    /* the relative error of every color, by rounding and by what is left out */
    double rounding; /* the part of it by rounding */
    double more;     /* the absolute error of every channel, by lights that are left out */
    double most[3];  /* the largest absolute values of all colors */
    double worst;    /* the largest error without what is left out */
    /* The largest error by f64's places of points. All tiers share it: it counts in `linear`. */
    double misplaced;
} shd_excess_list;

/* The most that each light adds to any channel, at pieces of what is seen. */
typedef struct shd_influences {
    size_t count;
    double **rows; /* [count][light_count] */
} shd_influences;

/* Whether pairs of objects and lights are so many that lights are looked at in clusters. */
bool shd_is_crowded(const shd_plan *plan);

/* Finds the errors of all that is seen if nothing is left out. `influences` may be NULL. False:
 * memory, or cancelled. */
bool shd_excess_find(const shd_plan *plan, shd_tier tier, shd_arena *arena, shd_excess_list *out,
                     shd_influences *influences);

/* Counts what is left out of each channel: at most `absolute`, and `relative` times the channel. */
void shd_excess_leave_out(shd_excess_list *list, double absolute, double relative);
