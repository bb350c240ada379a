/* Bounds of CIEDE2000.
 *
 * Of two near colors it is at most the length of (dL / SL, (1 + G) da, db): the weights SC, SH and
 * the rotation only shorten what is left (a test walks through chroma and hue), and a* is stretched
 * by 1.5 at most, less where there is chroma. L, a and b are differences of the cube roots f of X,
 * Y and Z over the white's, and f(X) moves by the slope of f between both colors times the move of
 * X. The slopes depend on the color: the colors of an excess are taken by their Y in steps, and in
 * each X and Z are as far from Y as these colors can have them. Channels that the screen holds at 1
 * do not err, and the other ones then each go their own way. */
#include <math.h>
#include <string.h>

#include "plan/bound.h"
#include "plan/parts.h"

/* Colors are taken by their Y in steps of this factor. */
static const double STEP = 1.35;

typedef struct range {
    double low, high;
} range;

/* What the colors of an excess are on a screen: linear light of its channels, and X, Y, Z. */
typedef struct screen {
    double rgb[3][3], to_xyz[3][3], xyz[3][3]; /* of the working space, of rgb, of both */
    double noise;                              /* relative: of f32 on the way to a channel */
    bool same;                  /* rgb is the working space: equal channels stay so to the bit */
    bool coherent;              /* no channel is held at 0: errors keep their directions */
    double held;                /* from this Y on a channel may be held at 1 */
    range channel[3], value[3]; /* of each color: held in [0, 1], and X, Y, Z of those */
    range of_y[3];              /* X / Y, 1, Z / Y of colors that are not held; the same of */
    range gain_of_y[3];         /* what they have above the floor; X, Y, Z of that; */
    double floor[3];
    range of_y_held[3];     /* of all that the screen has */
    double least[3][3];     /* of channel [r] beside channel [k], at most 1 */
    double channel_of_y[3]; /* largest channel / Y, */
    /* r / Y, .. and (r + g + b) / Y in the working space, of all and of what is above the floor */
    double part_of_y[3], sum_of_y, gain_part_of_y[3], gain_sum_of_y;
} screen;

static void widen(range *r, double value) {
    r->low = shd_smaller(r->low, value);
    r->high = shd_larger(r->high, value);
}

static const range NONE = {INFINITY, -INFINITY};

/* Of the colors' chromaticities. Ratios are monotone in each part: the corners have the extremes.
 */
static void look_at_parts(const shd_parts *parts, screen *s) {
    for (int r = 0; r < 3; r++) {
        s->of_y[r] = NONE;
        for (int k = 0; k < 3; k++) s->least[r][k] = 1;
    }
    for (int corner = 0; corner < 8; corner++) {
        double part[3], xyz[3] = {0, 0, 0}, channel[3] = {0, 0, 0}, sum = 0;
        for (int c = 0; c < 3; c++) {
            part[c] = corner >> c & 1 ? parts->most[c] : parts->least[c];
            sum += part[c];
        }
        for (int r = 0; r < 3; r++) {
            for (int c = 0; c < 3; c++) {
                channel[r] += s->rgb[r][c] * part[c];
                xyz[r] += s->xyz[r][c] * part[c];
            }
            if (channel[r] < -1e-6) s->coherent = false;
        }
        if (!(xyz[1] > 0)) s->coherent = false;
        for (int r = 0; r < 3; r++) {
            widen(&s->of_y[r], xyz[r] / xyz[1]);
            s->channel_of_y[r] = shd_larger(s->channel_of_y[r], channel[r] / xyz[1]);
            s->part_of_y[r] = shd_larger(s->part_of_y[r], part[r] / xyz[1]);
            for (int k = 0; k < 3; k++)
                if (channel[k] > 0)
                    s->least[r][k] = shd_smaller(s->least[r][k], channel[r] / channel[k]);
        }
        s->sum_of_y = shd_larger(s->sum_of_y, sum / xyz[1]);
    }
    for (int k = 0; k < 3; k++) {
        double y = 0; /* where channel k is 1 */
        for (int r = 0; r < 3; r++)
            y += s->to_xyz[1][r] * (r == k ? 1 : shd_larger(s->least[r][k], s->channel[r].low));
        s->held = shd_smaller(s->held, y);
    }
}

/* The ratios of a part of the colors. */
static void look_at_gain(const shd_excess *e, screen *s) {
    for (int r = 0; r < 3; r++) {
        s->gain_of_y[r] = NONE;
        s->floor[r] = 0;
        for (int c = 0; c < 3; c++) s->floor[r] += s->xyz[r][c] * e->floor[c];
    }
    for (int corner = 0; corner < 8; corner++) {
        double xyz[3] = {0, 0, 0}, part[3], sum = 0;
        for (int c = 0; c < 3; c++) {
            part[c] = corner >> c & 1 ? e->gain.most[c] : e->gain.least[c];
            sum += part[c];
            for (int r = 0; r < 3; r++) xyz[r] += s->xyz[r][c] * part[c];
        }
        for (int r = 0; r < 3; r++) {
            widen(&s->gain_of_y[r], xyz[r] / xyz[1]);
            s->gain_part_of_y[r] = shd_larger(s->gain_part_of_y[r], part[r] / xyz[1]);
        }
        s->gain_sum_of_y = shd_larger(s->gain_sum_of_y, sum / xyz[1]);
    }
}

/* The most that a channel of the working space is at Y, and all of them together. */
static double value_at(const shd_excess_list *list, const shd_excess *e, const screen *s, int c,
                       double y) {
    double value = shd_smaller(e->most[c], y * s->part_of_y[c]);
    if (!list->mixed)
        value =
            shd_smaller(value, e->floor[c] + shd_larger(y - s->floor[1], 0) * s->gain_part_of_y[c]);
    return value;
}

static double sum_at(const shd_excess_list *list, const shd_excess *e, const screen *s, double y) {
    double sum = y * s->sum_of_y, most = 0, floor = 0;
    for (int c = 0; c < 3; c++) {
        most += e->most[c];
        floor += e->floor[c];
    }
    if (!list->mixed)
        sum = shd_smaller(sum, floor + shd_larger(y - s->floor[1], 0) * s->gain_sum_of_y);
    return shd_smaller(sum, most);
}

/* X / Y or Z / Y at Y, by what is above the floor. */
static range ratio_at(const screen *s, int r, double y) {
    const double above = shd_larger(y - s->floor[1], 0);
    return (range){(s->floor[r] + s->gain_of_y[r].low * above) / y,
                   (s->floor[r] + s->gain_of_y[r].high * above) / y};
}

static screen screen_of(const shd_excess_list *list, const shd_excess *e, const shd_shown *shown) {
    screen s = {.noise = shd_curve_noise(shown->screen_curve),
                .coherent = list->nonnegative,
                .same = true,
                .held = INFINITY};
    const double error = shd_bound_linear(list);
    bool held = false;
    memcpy(s.rgb, shown->screen, sizeof s.rgb);
    memcpy(s.to_xyz, shown->to_xyz, sizeof s.to_xyz);
    for (int r = 0; r < 3; r++) {
        range at = {0, 0};
        for (int c = 0; c < 3; c++) {
            const double m = s.rgb[r][c], high = e->most[c] + error;
            s.same &= r == c ? m == s.rgb[0][0] : m == 0;
            const double low = list->nonnegative && !list->mixed ? e->floor[c] - error
                               : list->nonnegative               ? -error
                                                                 : -high;
            at.low += shd_smaller(m * low, m * high);
            at.high += shd_larger(m * low, m * high);
            s.xyz[r][c] = 0;
            for (int k = 0; k < 3; k++) s.xyz[r][c] += s.to_xyz[r][k] * s.rgb[k][c];
        }
        if (list->mixed) at.high = INFINITY;
        held |= !(at.high <= 1);
        s.channel[r] =
            (range){shd_smaller(shd_larger(at.low, 0), 1), shd_smaller(shd_larger(at.high, 0), 1)};
    }
    for (int r = 0; r < 3; r++) {
        s.of_y_held[r] = NONE;
        for (int k = 0; k < 3; k++) {
            s.value[r].low += s.to_xyz[r][k] * s.channel[k].low;
            s.value[r].high += s.to_xyz[r][k] * s.channel[k].high;
            widen(&s.of_y_held[r], s.to_xyz[r][k] / s.to_xyz[1][k]);
        }
    }
    look_at_parts(&e->parts, &s);
    look_at_gain(e, &s);
    /* Equal channels are held together. */
    if (!held || list->grey) s.held = INFINITY;
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
    return (range){lab_slope(at.high + error), lab_slope(shd_larger(at.low - error, 0))};
}

/* The same of X, Y and Z together, where Y is in a range and the ratios to Y are in theirs. Above
 * the curve's straight part all three fall with the same power of Y, so that differences of their
 * products with any moves are largest at the lowest Y. */
static void find_slopes(const range of_y[3], range y, const double move[3], range slope[3]) {
    bool curved = true;
    for (int r = 0; r < 3; r++) curved &= y.low * of_y[r].low - move[r] > 216.0 / 24389;
    const double high = curved ? y.low : y.high;
    for (int r = 0; r < 3; r++)
        slope[r] = slopes_of((range){y.low * of_y[r].low, high * of_y[r].high}, move[r]);
}

static double lightness_weight(double l) {
    double off = (l - 50) * (l - 50);
    return 1 + 0.015 * off / sqrt(20 + off);
}

/* The least SL of colors whose Y is in the range. */
static double least_lightness_weight(range y) {
    double low = 116 * lab_curve(shd_larger(y.low, 0)) - 16, high = 116 * lab_curve(y.high) - 16;
    if (low <= 50 && high >= 50) return 1;
    return lightness_weight(low > 50 ? low : high);
}

/* A difference in L, a and b, each at most. */
typedef struct difference {
    double l, a, b;
} difference;

static double largest_product(range slope, double x, range other, double y) {
    return shd_larger(fabs(slope.low * x - other.high * y), fabs(slope.high * x - other.low * y));
}

/* Adds what `much` of a move of X, Y and Z makes: linear in the slopes, whose ends have the
 * extremes. */
static void add_move(difference *d, const range slope[3], double much, double x, double y,
                     double z) {
    if (!(much > 0)) return;
    d->l += much * 116 * slope[1].high * fabs(y);
    const double a = x * y > 0 ? largest_product(slope[0], x, slope[1], y)
                               : slope[0].high * fabs(x) + slope[1].high * fabs(y);
    const double b = y * z > 0 ? largest_product(slope[1], y, slope[2], z)
                               : slope[1].high * fabs(y) + slope[2].high * fabs(z);
    d->a += much * 500 * a;
    d->b += much * 200 * b;
}

/* How a* is stretched at most: less where there is much chroma. */
static double stretch_of(const range of_y[3], range y, double moved) {
    double least[3], most[3];
    for (int r = 0; r < 3; r++) {
        least[r] = lab_curve(y.low * of_y[r].low);
        most[r] = lab_curve(y.high * of_y[r].high);
    }
    const double a = 500 * shd_larger(shd_larger(least[0] - most[1], least[1] - most[0]), 0),
                 b = 200 * shd_larger(shd_larger(least[1] - most[2], least[2] - most[1]), 0);
    const double seventh = pow(shd_larger(hypot(a, b) - moved, 0), 7);
    return 1 + 0.5 * (1 - sqrt(seventh / (seventh + 6103515625.0)));
}

/* Errors of the colors of a step: along the main direction, and of single channels. */
typedef struct moves {
    double main, rest[3]; /* of the working space */
    double grey;          /* of all of its channels alike */
    double channel[3];    /* of the screen's */
} moves;

/* Where channels are not held, of colors whose Y is at most `y`. */
static moves free_moves(const shd_excess_list *list, const shd_excess *e, const screen *s,
                        double y) {
    moves m = {.main = e->main_absolute};
    double base = 0;
    for (int c = 0; c < 3; c++) base += list->mixed ? 0 : e->base[c];
    const double sum = sum_at(list, e, s, y);
    const double limit =
        shd_smaller(e->main_limited, e->ratio * shd_larger(sum - base, 0) + e->distance * sum);
    m.main += limit;
    for (int c = 0; c < 3; c++) {
        m.rest[c] = e->rest_absolute[c] + shd_smaller(e->rest_limited[c], limit);
        if (!list->grey) m.rest[c] += list->more + list->color * value_at(list, e, s, c, y);
        if (!list->grey || !s->same)
            m.channel[c] = s->noise * shd_smaller(s->channel[c].high, y * s->channel_of_y[c]);
        for (int k = 0; k < 3 && !s->same; k++)
            m.channel[c] += SHD_MATRIX_NOISE * fabs(s->rgb[c][k]) * value_at(list, e, s, k, y);
    }
    if (list->grey) m.grey = (list->color + (s->same ? s->noise : 0)) * y + list->more;
    return m;
}

/* The error of one of the screen's channels where it shows `light`, and where no channel is held at
 * 1 in a color of Y at most `y`; else that is infinite. */
static double channel_move(const shd_excess_list *list, const shd_excess *e, const screen *s, int r,
                           double light, double y) {
    /* Whether it is one of the working space's. */
    const bool same = s->rgb[r][(r + 1) % 3] == 0 && s->rgb[r][(r + 2) % 3] == 0;
    double move = s->noise * light;
    for (int c = 0; c < 3; c++) {
        double value = e->most[c], limited = e->limited[c];
        if (same && r == c) value = shd_smaller(value, light / s->rgb[r][r]);
        /* What is held at 0 adds to Y. */
        if (isfinite(y) && list->nonnegative)
            value = shd_smaller(value, value_at(list, e, s, c, y));
        if (list->nonnegative) {
            const double base = list->mixed ? 0 : e->base[c];
            limited =
                shd_smaller(limited, e->ratio * shd_larger(value - base, 0) + e->distance * value);
        }
        move += fabs(s->rgb[r][c]) * (e->absolute[c] + limited + list->more +
                                      (list->color + (same ? 0 : SHD_MATRIX_NOISE)) * value);
    }
    return move;
}

/* The length of a difference between colors like these, which moved so. */
static double length_of(const difference *d, const range of_y[3], range y, double moved) {
    const double weight = least_lightness_weight((range){y.low - moved, y.high + moved});
    const double stretch = stretch_of(of_y, y, hypot(1.5 * d->a, d->b));
    return hypot(d->l / weight, hypot(stretch * d->a, d->b));
}

/* The largest difference of colors whose Y is in the range and whose channels in `at_1` are held at
 * 1, while each other one goes its own way. */
static double held_bound(const shd_excess_list *list, const shd_excess *e, const screen *s, range y,
                         double error, int at_1) {
    range channel[3];
    double least = 0, most = 0;
    for (int r = 0; r < 3; r++) {
        channel[r] = s->channel[r];
        if (at_1 >> r & 1) channel[r].low = 1;
        for (int k = 0; k < 3; k++)
            if (at_1 >> k & 1) channel[r].low = shd_larger(channel[r].low, s->least[r][k]);
        if (channel[r].low > channel[r].high) return 0; /* there are none */
        least += s->to_xyz[1][r] * channel[r].low;
        most += s->to_xyz[1][r] * channel[r].high;
    }
    if (y.high < least || y.low > most) return 0;
    double move[3] = {0, 0, 0}, alone[3];
    for (int r = 0; r < 3; r++) {
        const double own = s->to_xyz[1][r];
        const range given = channel[r];
        alone[r] = 0;
        if (at_1 >> r & 1) continue;
        channel[r].high = shd_smaller(given.high, (y.high - least) / own + given.low);
        channel[r].low = shd_larger(given.low, (y.low - most) / own + given.high);
        alone[r] = channel_move(list, e, s, r, channel[r].high + error,
                                at_1 ? (double)INFINITY : y.high + error);
        for (int k = 0; k < 3; k++) move[k] += s->to_xyz[k][r] * alone[r];
    }
    range of_y[3], slope[3];
    for (int k = 0; k < 3; k++) {
        range value = {0, 0};
        for (int r = 0; r < 3; r++) {
            value.low += s->to_xyz[k][r] * channel[r].low;
            value.high += s->to_xyz[k][r] * channel[r].high;
        }
        of_y[k] = (range){shd_larger(s->of_y_held[k].low, value.low / y.high),
                          shd_smaller(s->of_y_held[k].high, value.high / shd_larger(y.low, 1e-9))};
    }
    find_slopes(of_y, y, move, slope);
    difference d = {.l = 0};
    for (int r = 0; r < 3; r++)
        add_move(&d, slope, alone[r], s->to_xyz[0][r], s->to_xyz[1][r], s->to_xyz[2][r]);
    return length_of(&d, of_y, y, move[1]);
}

/* The same of colors of which no channel is held. */
static double free_bound(const shd_excess_list *list, const shd_excess *e, const screen *s, range y,
                         double error) {
    const moves m = free_moves(list, e, s, y.high + error);
    double along[3] = {0, 0, 0}, all[3] = {0, 0, 0}, move[3] = {0, 0, 0};
    range of_y[3], slope[3];
    for (int r = 0; r < 3; r++) {
        for (int c = 0; c < 3; c++) {
            along[r] += s->xyz[r][c] * e->main[c];
            all[r] += s->xyz[r][c];
            move[r] += fabs(s->xyz[r][c]) * (m.main * e->main[c] + m.rest[c] + m.grey);
            move[r] += s->to_xyz[r][c] * m.channel[c];
        }
        of_y[r] = s->of_y[r];
        range value = {s->value[r].low / y.high, s->value[r].high / shd_larger(y.low, 1e-9)};
        if (!list->mixed && y.low > s->floor[1] * 0.5 && y.low > 0) {
            /* Between the step's ends the ratio goes one way. */
            const range a = ratio_at(s, r, shd_larger(y.low, s->floor[1])),
                        b = ratio_at(s, r, y.high);
            value.low = shd_larger(value.low, shd_smaller(a.low, b.low));
            value.high = shd_smaller(value.high, shd_larger(a.high, b.high));
        }
        if (r != 1 && value.low <= of_y[r].high && value.high >= of_y[r].low)
            of_y[r] =
                (range){shd_larger(of_y[r].low, value.low), shd_smaller(of_y[r].high, value.high)};
    }
    find_slopes(of_y, y, move, slope);
    difference d = {.l = 0};
    add_move(&d, slope, m.grey, all[0], all[1], all[2]);
    add_move(&d, slope, m.main, along[0], along[1], along[2]);
    for (int c = 0; c < 3; c++) {
        add_move(&d, slope, m.rest[c], s->xyz[0][c], s->xyz[1][c], s->xyz[2][c]);
        add_move(&d, slope, m.channel[c], s->to_xyz[0][c], s->to_xyz[1][c], s->to_xyz[2][c]);
    }
    return length_of(&d, of_y, y, move[1]);
}

/* The largest difference of colors whose Y is in the range. `error` is that of any of them. */
static double step_bound(const shd_excess_list *list, const shd_excess *e, const screen *s, range y,
                         double error) {
    double worst =
        s->coherent ? free_bound(list, e, s, y, error) : held_bound(list, e, s, y, error, 0);
    for (int at_1 = 1; at_1 < 7 && y.high >= s->held; at_1++)
        worst = shd_larger(worst, held_bound(list, e, s, y, error, at_1));
    return worst;
}

double shd_bound_delta_e(const shd_excess_list *list, const shd_shown *shown) {
    if (!shown->seen) return INFINITY;
    const double error = shd_bound_linear(list);
    if (!isfinite(error)) return INFINITY;
    double worst = 0;
    for (size_t i = 0; i < list->count; i++) {
        const shd_excess *e = &list->excess[i];
        const screen s = screen_of(list, e, shown);
        double low = 0, all = 0;
        for (int c = 0; c < 3; c++) {
            all += fabs(s.xyz[1][c]);
            low += s.xyz[1][c] * (e->floor[c] - error);
        }
        /* What is held at 0 adds to Y. Darker ones cover a part of their pixel: see SHD_MIXTURE. */
        low = list->nonnegative
                  ? shd_larger(s.value[1].low, shd_smaller(shd_smaller(low, 1), s.held))
                  : 0;
        low = low > 1e-4 ? low : 0;
        do {
            double high = low > 1e-4 ? STEP * low : low + 1e-4;
            if (low < s.held && high > s.held) high = s.held;
            high = shd_smaller(high, s.value[1].high);
            worst = shd_larger(worst, step_bound(list, e, &s, (range){low, high}, all * error));
            low = high;
        } while (low < s.value[1].high);
    }
    if (list->mixed) worst *= SHD_MIXTURE;
    return worst < 1e3 ? worst : INFINITY;
}
