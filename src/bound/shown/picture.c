#include "bound/shown/picture.h"

#include <string.h>

#include "bound/shown/lab.h"

enum {
    MOST_CLASSES = 6,
    MOST_TERMS = 24, /* of all classes */
    LIMITS = 9       /* the three channels, and six pairs of them */
};

/* A color has no more of a term than (color[of] - other color[beside]) times `gain`. No other term
 * makes that negative. If `of` and `beside` are the same, `other` is 0. */
typedef struct limit {
    int of, beside;
    double other, gain;
} limit;

/* Light of one color, of one class. */
typedef struct term {
    double color[3], xyz[3];
    double absolute, limited, rate; /* w of the term errs by absolute + min(limited, rate w) */
    size_t class;
    bool constant; /* the first of its class, of which there is the class's share of the pixel */
    size_t limit_count;
    limit limits[LIMITS];
} term;

struct shd_picture_errors {
    size_t count, class_count; /* classes are objects that share their terms */
    term terms[MOST_TERMS];
    double error; /* of any channel of the working space */
    double share; /* of every color, relative: by rounding, and by what is left out in proportion */
    double more;  /* of every channel, by what is left out */
    double noise; /* relative: of f32 on the way to a channel of the screen */
    bool grey;    /* channels are equal, to the bit */
    shd_screen screen;
    double white[3]; /* XYZ of all of the screen's channels together */
};

/* ---- What is the same for all pixels. ---- */

/* Adds the terms of an excess. The constant one is among them because its limits matter to the
 * other ones. False: there are too many, or they are not known. */
static bool add_excess(const shd_excess_list *list, size_t index, const shd_term *known[],
                       size_t first[], shd_picture_errors *to) {
    const shd_excess *e = &list->excess[index];
    const shd_much *much = list->much[index];
    size_t class = 0;
    if (!e->terms) return false;
    while (class < to->class_count && known[class] != e->terms) class ++;
    if (class == to->class_count) {
        if (class == MOST_CLASSES || to->count + e->term_count > MOST_TERMS) return false;
        known[class] = e->terms;
        first[class] = to->count;
        for (size_t t = 0; t < e->term_count; t++) {
            term *added = &to->terms[to->count++];
            *added = (term){.class = class, .constant = t == 0};
            memcpy(added->color, e->terms[t].color, sizeof added->color);
            shd_apply(to->screen.xyz, added->color, added->xyz);
        }
        to->class_count++;
    }
    for (size_t t = 1; t < e->term_count; t++) {
        term *at = &to->terms[first[class] + t];
        at->absolute = shd_larger(at->absolute, much[t].absolute);
        at->limited = shd_larger(at->limited, much[t].limited);
        at->rate = shd_larger(at->rate, shd_term_rate(e, t));
    }
    return true;
}

static double smaller_ratio(double ratio, const double color[3], int of, int beside) {
    return color[beside] > 0 ? shd_smaller(ratio, color[of] / color[beside]) : ratio;
}

/* Each limit is a sum of channels that no color of the scene makes negative. The larger it is for
 * the term's own color, the tighter the limit. */
static void find_limits(shd_picture_errors *e, size_t index, const double *background) {
    static const double SLIM = 1e-3; /* a smaller difference tells nothing */
    term *t = &e->terms[index];
    for (int of = 0; of < 3; of++) {
        if (!(t->color[of] > 0)) continue;
        t->limits[t->limit_count++] = (limit){of, of, 0, 1 / t->color[of]};
        for (int beside = 0; beside < 3; beside++) {
            if (beside == of) continue;
            double other = INFINITY;
            for (size_t k = 0; k < e->count; k++)
                if (k != index) other = smaller_ratio(other, e->terms[k].color, of, beside);
            if (background) other = smaller_ratio(other, background, of, beside);
            const double left = t->color[of] - other * t->color[beside];
            if (other > 0 && left > SLIM * t->color[of])
                t->limits[t->limit_count++] = (limit){of, beside, other, 1 / left};
        }
    }
}

bool shd_picture_errors_new(const shd_plan *plan, const shd_excess_list *list,
                            const shd_shown *shown, shd_arena *arena,
                            const shd_picture_errors **out) {
    *out = NULL;
    const double error = shd_bound_linear(list);
    if (!list->nonnegative || !shown->seen || !isfinite(error) || list->textured) return true;
    shd_picture_errors *e = shd_arena_zalloc(arena, 1, sizeof *e);
    if (!e) return false;
    e->error = error;
    e->share = list->color;
    e->more = list->more;
    e->noise = shd_curve_noise(shown->screen_curve);
    e->screen = shd_screen_of(shown);
    e->grey = list->grey && e->screen.same;
    shd_apply(e->screen.to_xyz, (const double[3]){1, 1, 1}, e->white);
    const shd_term *known[MOST_CLASSES];
    size_t first[MOST_CLASSES];
    for (size_t i = 0; i < list->count; i++)
        if (!add_excess(list, i, known, first, e)) return true;
    const shd_scene *scene = plan->scene;
    for (size_t t = 0; t < e->count; t++)
        find_limits(e, t, shd_has_background(scene) ? scene->background : NULL);
    *out = e;
    return true;
}

/* ---- A pixel. ---- */

/* Errors of terms, as far as the pixel's color has room for the term and its class. */
typedef struct amounts {
    double absolute[MOST_TERMS], limited[MOST_TERMS];
} amounts;

static double most_of_term(const term *t, const double low[3], const double high[3]) {
    double most = 1e300;
    for (size_t k = 0; k < t->limit_count; k++) {
        const limit *l = &t->limits[k];
        most = shd_smaller(most, (high[l->of] - l->other * low[l->beside]) * l->gain);
    }
    return shd_larger(most, 0);
}

static amounts find_amounts(const shd_picture_errors *e, const double rgb[3]) {
    amounts a;
    double low[3], high[3], share = 1;
    for (int c = 0; c < 3; c++) {
        low[c] = shd_larger(rgb[c] - e->error, 0);
        high[c] = shd_larger(rgb[c], 0) + e->error;
    }
    for (size_t t = 0; t < e->count; t++) {
        const term *at = &e->terms[t];
        const double most = most_of_term(at, low, high);
        if (at->constant) share = shd_smaller(most, 1);
        a.absolute[t] = at->absolute * share;
        a.limited[t] = shd_smaller(at->rate * most, at->limited * share);
    }
    return a;
}

/* Sums of errors, in one direction. */
typedef struct sums {
    double absolute[MOST_CLASSES], limited[MOST_CLASSES]; /* of a pixel that is all of the class */
    double all_absolute, all_limited; /* of all classes, as far as there is room for them */
} sums;

static void sum_term(sums *to, const amounts *a, const term *t, size_t index, double part) {
    to->absolute[t->class] += t->absolute * part;
    to->limited[t->class] += t->limited * part;
    to->all_absolute += a->absolute[index] * part;
    to->all_limited += a->limited[index] * part;
}

/* The error of a pixel, in which the shares of classes add up to 1. */
static double whole_of(const shd_picture_errors *e, const sums *s) {
    double absolute = 0, limited = 0;
    for (size_t k = 0; k < e->class_count; k++) {
        absolute = shd_larger(absolute, s->absolute[k]);
        limited = shd_larger(limited, s->limited[k]);
    }
    return shd_smaller(absolute, s->all_absolute) + shd_smaller(limited, s->all_limited);
}

/* The error of each channel of the working space. */
static void find_channel_errors(const shd_picture_errors *e, const amounts *a, const double rgb[3],
                                double out[3]) {
    for (int c = 0; c < 3; c++) {
        sums s = {.all_absolute = 0};
        for (size_t t = 0; t < e->count; t++)
            sum_term(&s, a, &e->terms[t], t, e->terms[t].color[c]);
        out[c] = whole_of(e, &s) + e->share * (shd_larger(rgb[c], 0) + e->error) + e->more;
    }
}

/* How a pixel is on the screen. */
typedef struct shown_pixel {
    double light[3], error[3]; /* of its channels, before they are held in [0, 1] */
    double own[3];             /* the part of the error that f32 makes on the way there */
    bool held; /* some channel may be held in one of both pictures, so that each errs for itself */
} shown_pixel;

static shown_pixel show_pixel(const shd_picture_errors *e, const double rgb[3],
                              const double error[3]) {
    shown_pixel p = {.held = false};
    for (int r = 0; r < 3; r++) {
        double products = 0;
        for (int c = 0; c < 3; c++) {
            p.light[r] += e->screen.rgb[r][c] * rgb[c];
            products += fabs(e->screen.rgb[r][c]) * fabs(rgb[c]);
            p.error[r] += fabs(e->screen.rgb[r][c]) * error[c];
        }
        p.own[r] = e->noise * (fabs(p.light[r]) + p.error[r]);
        if (!e->screen.same) p.own[r] += SHD_MATRIX_NOISE * (products + p.error[r]);
        p.error[r] += p.own[r];
        p.held |= p.light[r] + p.error[r] > 1 || (!e->screen.same && p.light[r] < p.error[r]);
    }
    return p;
}

/* Adds the errors of a pixel without held channels: each term errs along its color. */
static void add_pixel_terms(shd_lab_difference *d, const shd_picture_errors *e, const amounts *a,
                            const shd_interval slope[3]) {
    sums l = {.all_absolute = 0}, x = l, y = l;
    for (size_t t = 0; t < e->count; t++) {
        const term *at = &e->terms[t];
        shd_lab_difference one = {0, 0, 0}; /* of a move by its color */
        if (!(at->absolute + at->limited > 0)) continue;
        shd_lab_add(&one, slope, 1, at->xyz);
        sum_term(&l, a, at, t, one.l);
        sum_term(&x, a, at, t, one.a);
        sum_term(&y, a, at, t, one.b);
    }
    d->l += whole_of(e, &l);
    d->a += whole_of(e, &x);
    d->b += whole_of(e, &y);
}

double shd_picture_delta_e(const shd_picture_errors *e, const double rgb[3]) {
    const amounts a = find_amounts(e, rgb);
    double error[3];
    find_channel_errors(e, &a, rgb, error);
    const shown_pixel p = show_pixel(e, rgb, error);

    double value[3] = {0, 0, 0}, move[3] = {0, 0, 0};
    for (int r = 0; r < 3; r++)
        for (int k = 0; k < 3; k++) {
            value[r] += e->screen.to_xyz[r][k] * shd_smaller(shd_larger(p.light[k], 0), 1);
            move[r] += fabs(e->screen.to_xyz[r][k]) * p.error[k];
        }
    const double y = value[1];
    shd_interval of_y[3];
    for (int r = 0; r < 3; r++) {
        const double ratio = y > 1e-30 ? value[r] / y : 1;
        of_y[r] = (shd_interval){ratio, ratio};
    }
    const shd_lab_curves f = shd_lab_curves_of(of_y, (shd_interval){y, y}, move);

    shd_lab_difference d = {0, 0, 0};
    if (e->grey) {
        shd_lab_add(&d, f.slope, p.error[0], e->white);
    } else if (p.held) {
        for (int r = 0; r < 3; r++) /* channels that are held in both pictures do not err */
            if (!(p.light[r] - p.error[r] >= 1 || p.light[r] + p.error[r] <= 0))
                shd_lab_add(&d, f.slope, p.error[r], e->screen.channels[r]);
    } else {
        double share[3];
        const double part = e->share + (e->screen.same ? e->noise : 0);
        for (int c = 0; c < 3; c++) {
            share[c] = part * (shd_larger(rgb[c], 0) + e->error);
            shd_lab_add(&d, f.slope, e->more, e->screen.columns[c]);
            if (!e->screen.same) shd_lab_add(&d, f.slope, p.own[c], e->screen.channels[c]);
        }
        shd_lab_add_shares(&d, share, e->screen.columns, part, f.slope, of_y, y + move[1], move);
        add_pixel_terms(&d, e, &a, f.slope);
    }
    return shd_lab_length(&d, f.value, 0);
}
