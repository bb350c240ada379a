/* Bounds of CIEDE2000.
 *
 * Of two near colors it is at most the length of (dL / SL, 1.5 da, db): the weights SC, SH and the
 * rotation only shorten what is left (a test walks through chroma and hue), and a* is stretched by
 * 1.5 at most. L, a and b are differences of the cube roots f of X, Y and Z over the white's,
 * f(X) moves by the slope of f between both colors times the move of X. The slopes depend on the
 * color: colors are taken by their Y in steps, and in each X and Z are as far from Y as the
 * picture's colors (or the screen's) can have them. */
#include <math.h>

#include "plan/bound.h"
#include "plan/parts.h"

/* OpenColorIO's f32 on the way to the screen, relative. */
static const double CONVERSION = 1e-6;

typedef struct range {
    double low, high;
} range;

/* What a picture is on a screen. */
typedef struct screen {
    double xyz[3][3];     /* from the working space */
    bool coherent;        /* no color is held at 0: errors keep their directions */
    bool positive;        /* nor do channels take from each other: relative errors stay so */
    range x_of_y, z_of_y; /* X / Y and Z / Y of the picture's colors */
    double sum_of_y;      /* largest (r + g + b) / Y, and of each channel: */
    double part_of_y[3];
    range x_of_y_held, z_of_y_held; /* where a channel may be held at 1: of all of the screen's */
    double held;                    /* that is from this Y on */
    double most;                    /* largest Y */
} screen;

static void widen(range *r, double value) {
    r->low = fmin(r->low, value);
    r->high = fmax(r->high, value);
}

static screen screen_of(const shd_excess_list *list, const shd_shown *shown) {
    screen s = {
        .coherent = list->nonnegative, .positive = list->nonnegative, .held = INFINITY, .most = 1};
    const range none = {INFINITY, -INFINITY};
    s.x_of_y = s.z_of_y = s.x_of_y_held = s.z_of_y_held = none;
    double most = 0;
    for (int r = 0; r < 3; r++) {
        double channel = 0;
        for (int c = 0; c < 3; c++) {
            channel += fabs(shown->screen[r][c]) * list->most[c];
            if (shown->screen[r][c] < 0 || shown->to_xyz[r][c] < 0) s.positive = false;
            s.xyz[r][c] = 0;
            for (int k = 0; k < 3; k++) s.xyz[r][c] += shown->to_xyz[r][k] * shown->screen[k][c];
        }
        most = fmax(most, channel);
    }
    for (int c = 0; c < 3; c++) {
        widen(&s.x_of_y_held, shown->to_xyz[0][c] / shown->to_xyz[1][c]);
        widen(&s.z_of_y_held, shown->to_xyz[2][c] / shown->to_xyz[1][c]);
    }
    if (!(most + list->more <= 1))
        s.held = fmin(shown->to_xyz[1][0], fmin(shown->to_xyz[1][1], shown->to_xyz[1][2]));
    /* Ratios are monotone in each part: the corners have the extremes. */
    for (int corner = 0; corner < 8; corner++) {
        double part[3], xyz[3] = {0, 0, 0}, sum = 0;
        for (int c = 0; c < 3; c++) {
            part[c] = corner >> c & 1 ? list->most_part[c] : list->least_part[c];
            sum += part[c];
        }
        for (int r = 0; r < 3; r++) {
            double channel = 0;
            for (int c = 0; c < 3; c++) {
                channel += shown->screen[r][c] * part[c];
                xyz[r] += s.xyz[r][c] * part[c];
            }
            if (channel < -1e-6) s.coherent = false;
        }
        if (!(xyz[1] > 0)) s.coherent = false;
        widen(&s.x_of_y, xyz[0] / xyz[1]);
        widen(&s.z_of_y, xyz[2] / xyz[1]);
        s.sum_of_y = fmax(s.sum_of_y, sum / xyz[1]);
        for (int c = 0; c < 3; c++) s.part_of_y[c] = fmax(s.part_of_y[c], part[c] / xyz[1]);
    }
    if (!s.coherent) s.held = 0;
    return s;
}

static double lab_curve(double t) {
    return t > 216.0 / 24389 ? cbrt(t) : (24389.0 / 27 * t + 16) / 116;
}

static double lab_slope(double t) {
    return t > 216.0 / 24389 ? 1 / (3 * cbrt(t * t)) : 24389.0 / 27 / 116;
}

/* Slopes that f has between colors of a range that are `error` apart at most. */
static range slopes_of(range at, double error) {
    return (range){lab_slope(at.high + error), lab_slope(fmax(at.low - error, 0))};
}

static double lightness_weight(double l) {
    double off = (l - 50) * (l - 50);
    return 1 + 0.015 * off / sqrt(20 + off);
}

/* The least SL of colors whose Y is in the range. */
static double least_lightness_weight(range y) {
    double low = 116 * lab_curve(fmax(y.low, 0)) - 16, high = 116 * lab_curve(y.high) - 16;
    if (low <= 50 && high >= 50) return 1;
    return lightness_weight(low > 50 ? low : high);
}

/* The longest difference that a move of X, Y, Z makes; convex in the slopes, whose corners have
 * the extremes. */
static double longest(const range slope[3], double weight, double x, double y, double z) {
    double most = 0;
    for (int corner = 0; corner < 8; corner++) {
        double fx = x * (corner & 1 ? slope[0].high : slope[0].low);
        double fy = y * (corner & 2 ? slope[1].high : slope[1].low);
        double fz = z * (corner & 4 ? slope[2].high : slope[2].low);
        double l = 116 * fy / weight, a = 1.5 * 500 * (fx - fy), b = 200 * (fy - fz);
        most = fmax(most, l * l + a * a + b * b);
    }
    return sqrt(most);
}

/* The largest difference of colors whose Y is in [low, high]. */
static double step_bound(const shd_excess_list *list, const shd_excess *e, const screen *s,
                         double low, double high) {
    const bool held = high >= s->held;
    /* A relative error of every channel alike, or apart: then of X, Y and Z, too. */
    const bool alike = list->grey && !held, apart = s->positive && !alike;
    /* The error as a move along the main direction, and moves of single channels. */
    const double color = list->color + CONVERSION;
    double main = e->main_absolute, rest[3];
    double sum = high * s->sum_of_y;
    if (held) {
        main += e->main_limited;
        for (int c = 0; c < 3; c++) {
            rest[c] = e->rest_absolute[c] + e->rest_limited[c] + list->more;
            if (!apart) rest[c] += color * list->most[c];
        }
    } else {
        main += fmin(e->main_limited, e->ratio * sum);
        for (int c = 0; c < 3; c++) {
            double value = high * s->part_of_y[c];
            double limited = fmin(e->rest_limited[c], e->ratio * (value + sum * e->main[c]));
            rest[c] = e->rest_absolute[c] + limited;
            if (!alike) rest[c] += list->more;
            if (!alike && !apart) rest[c] += color * value;
        }
    }
    const double grey = alike ? color * high + list->more : 0;

    double move[3] = {0, 0, 0}, along[3] = {0, 0, 0}, all[3] = {0, 0, 0};
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++) {
            along[r] += s->xyz[r][c] * e->main[c];
            all[r] += s->xyz[r][c];
            move[r] += fabs(s->xyz[r][c]) * (main * e->main[c] + rest[c] + grey);
        }
    const range x = held ? s->x_of_y_held : s->x_of_y, z = held ? s->z_of_y_held : s->z_of_y;
    const range at[3] = {{low * x.low, high * x.high}, {low, high}, {low * z.low, high * z.high}};
    range slope[3];
    for (int r = 0; r < 3; r++) slope[r] = slopes_of(at[r], move[r]);
    const double weight = least_lightness_weight((range){low - move[1], high + move[1]});

    double bound = 0;
    if (apart) {
        double part[3]; /* x f'(x) does not fall */
        for (int r = 0; r < 3; r++) part[r] = color * at[r].high * lab_slope(at[r].high);
        bound = hypot(hypot(116 * part[1] / weight, 1.5 * 500 * (part[0] + part[1])),
                      200 * (part[1] + part[2]));
    }
    bound += grey * longest(slope, weight, all[0], all[1], all[2]);
    if (!held) bound += main * longest(slope, weight, along[0], along[1], along[2]);
    for (int c = 0; c < 3; c++) {
        double alone = held ? rest[c] + main * e->main[c] : rest[c];
        bound += alone * longest(slope, weight, s->xyz[0][c], s->xyz[1][c], s->xyz[2][c]);
    }
    return bound;
}

double shd_bound_delta_e(const shd_excess_list *list, const shd_shown *shown) {
    if (!shown->seen) return INFINITY;
    const screen s = screen_of(list, shown);
    double worst = 0;
    for (size_t i = 0; i < list->count; i++) {
        const shd_excess *e = &list->excess[i];
        /* Below the constant terms there are only colors that cover a part of their pixel: see
         * codes. */
        double low = 0;
        for (int c = 0; c < 3 && s.coherent; c++) low += s.xyz[1][c] * e->floor[c];
        low = low > 0 ? fmin(low, 1) * (1 - 1e-3) : 0;
        double error = shd_bound_linear(list);
        if (low < 4 * error) low = 0;
        while (low < s.most) {
            double high = low > 1e-4 ? 1.25 * low : low + 1e-4;
            high = high < s.most ? high : s.most;
            worst = fmax(worst, step_bound(list, e, &s, low, high));
            low = high;
        }
    }
    return worst < 1e3 ? worst : INFINITY;
}
