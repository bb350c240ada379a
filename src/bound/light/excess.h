/* Excess: errors of what is seen, for pieces of surfaces that are about as bright. */
#ifndef SHD_BOUND_LIGHT_EXCESS_H
#define SHD_BOUND_LIGHT_EXCESS_H

#include "base/arena.h"
#include "plan/plan.h"

/* The range of colors' parts r, g, b / (r + g + b). */
typedef struct shd_parts {
    double least[3], most[3];
} shd_parts;

/* Light of one color: one of a material's times that of some of its lights. */
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
 * because highlights err in proportion to themselves, and what lies below `base` is none. All
 * lights of a color err in one direction of the colors, so that the error is also at most
 *     (main_absolute + min(main_limited, ...)) main[c] + rest_absolute[c] + rest_limited[c] + color
 * v whose first part is one vector. If the terms are known, the error is color v and the sum of
 * what the terms err by. Each of these is one vector: where there is w of a term, its color times
 *     absolute + min(limited, (ratio + distance) w)
 * at most, without the ratio if the term is diffuse. */
typedef struct shd_excess {
    double absolute[3], limited[3];
    double main[3]; /* its sum is 1, or 0 where there is nothing */
    double main_absolute, main_limited;
    double rest_absolute[3], rest_limited[3];
    double ratio, distance;
    double base[3], floor[3], most[3];
    shd_parts parts, gain; /* of its colors; of what they have above `floor` */
    /* The constant term, and for each hue of its lights a diffuse term and one a lobe. The list
     * has how much there is of each. NULL: there are too many, or several materials'. */
    const shd_term *terms;
    size_t term_count, lobe_count;
    size_t material;  /* of the pieces, */
    int dark, bright; /* and steps of what they show least and most */
} shd_excess;

enum { SHD_EXCESSES = 24, SHD_MOST_TERMS = 12 };

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

/* The most that each light adds to any channel. */
typedef struct shd_influences {
    size_t count;
    double **rows; /* [count][light_count]: of pieces of what is seen */
} shd_influences;

/* Finds the errors of all that is seen, without what is left out. `influences` may be NULL. False:
 * memory, or cancelled. */
bool shd_excess_find(const shd_plan *plan, shd_tier tier, shd_arena *arena, shd_excess_list *out,
                     shd_influences *influences);

/* Counts what is left out, in a list without it: at most `absolute` and `relative` times a color,
 * in any channel. */
void shd_excess_leave_out(shd_excess_list *list, double absolute, double relative);

#endif
