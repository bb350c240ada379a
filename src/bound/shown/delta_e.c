/* Bounds of CIEDE2000.
 *
 * The slopes of L, a and b (lab.h) depend on the color. So the colors of an excess are looked at in
 * steps of Y. In each step, X and Z are as far from Y as these colors can have them. A channel that
 * the screen holds at 1 does not err, and the other channels then err each for itself. */

#include "bound/shown/lab.h"
#include "bound/shown/shown.h"

/* The largest factor by which Y rises in a step. The coarse one is for searches, and for pixels
 * that mix samples, whose errors come mostly from what is left out. */
static const double STEP = 1.2, COARSE_STEP = 1.35;
static const double DARKEST = 1e-4; /* the Y at which steps begin */

/* A list of excesses and a screen for it. */
typedef struct setting {
    const shd_excess_list *list;
    shd_screen screen;
    double white[3];           /* XYZ of all of the working space's channels together */
    double error;              /* of any color */
    double error_y;            /* what that makes of Y */
    double step;               /* Y may rise by this factor within a step */
    double limit;              /* a bound above this may be told as any other one above it */
    double noise;              /* relative: of f32 on the way to a channel */
    shd_interval of_y_held[3]; /* X / Y, 1 and Z / Y of all colors of the screen */
} setting;

/* Ratios of some colors to their Y. */
typedef struct ratios {
    shd_interval xyz[3]; /* of X, Y and Z */
    double part[3], sum; /* the largest of r, g and b in the working space, and of r + g + b */
} ratios;

/* The colors of an excess on the screen. "Gain" is what they have above the excess's floor. */
typedef struct colors {
    const setting *on;
    const shd_excess *excess;
    const shd_much *much; /* of the excess's terms */
    bool coherent;        /* no channel is held at 0, so that errors keep their directions */
    double held;          /* a channel may be held at 1 if Y is at least this */
    shd_interval y;
    shd_interval channel[3];  /* the screen's channels, held in [0, 1] */
    shd_interval value[3];    /* X, Y and Z of these */
    ratios free, gain;        /* of colors without held channels, and of the gain */
    double floor[3], main[3]; /* X, Y and Z of the floor, and of the main direction of errors */
    double least[3][3];       /* the least ratio of channel [r] to channel [k], at most 1 */
    double channel_of_y[3];   /* the largest ratio of a channel to Y */
    double terms[SHD_MOST_TERMS][3]; /* X, Y and Z of each term */
    double terms_floor;              /* the least Y of all terms together */
} colors;

/* Finds one of the eight ends of the parts. They have the extremes of ratios, which are monotone in
 * each part. False: the end is black, and the colors beside it are between the other ends. */
static bool find_end(const colors *s, const shd_parts *parts, int corner, double part[3]) {
    double sum = 0;
    for (int c = 0; c < 3; c++) {
        part[c] = corner >> c & 1 ? parts->most[c] : parts->least[c];
        if (s->on->list->nonnegative) part[c] = shd_larger(part[c], 0);
        sum += part[c];
    }
    return sum != 0;
}

/* Widens the ratios by a color's. Returns its Y. */
static double note_ratios(ratios *to, const double part[3], const shd_screen *screen) {
    double xyz[3];
    shd_apply(screen->xyz, part, xyz);
    const double of_y = 1 / xyz[1];
    for (int r = 0; r < 3; r++) {
        shd_widen(&to->xyz[r], xyz[r] * of_y);
        to->part[r] = shd_larger(to->part[r], part[r] * of_y);
    }
    to->sum = shd_larger(to->sum, (part[0] + part[1] + part[2]) * of_y);
    return xyz[1];
}

/* Finds what depends on the chromaticities of the colors and of the gain. */
static void look_at_parts(const shd_excess *e, colors *s) {
    const shd_screen *screen = &s->on->screen;
    for (int r = 0; r < 3; r++) {
        s->free.xyz[r] = s->gain.xyz[r] = SHD_NO_INTERVAL;
        for (int k = 0; k < 3; k++) s->least[r][k] = s->on->list->nonnegative ? 1 : 0;
    }
    for (int corner = 0; corner < 8; corner++) {
        double part[3], channel[3];
        if (find_end(s, &e->gain, corner, part)) note_ratios(&s->gain, part, screen);
        if (!find_end(s, &e->parts, corner, part)) continue;
        const double y = note_ratios(&s->free, part, screen), of_y = 1 / y;
        shd_apply(screen->rgb, part, channel);
        if (!(y > 0)) s->coherent = false;
        for (int r = 0; r < 3; r++) {
            if (channel[r] < -1e-6) s->coherent = false;
            s->channel_of_y[r] = shd_larger(s->channel_of_y[r], channel[r] * of_y);
            for (int k = 0; k < 3 && s->held < INFINITY; k++)
                if (channel[k] > 0)
                    s->least[r][k] = shd_smaller(s->least[r][k], channel[r] / channel[k]);
        }
    }
}

/* The most that channel c of the working space is at Y. */
static double channel_at(const colors *s, int c, double y) {
    const shd_excess *e = s->excess;
    const double value = shd_smaller(e->most[c], y * s->free.part[c]);
    if (s->on->list->mixed) return value;
    return shd_smaller(value, e->floor[c] + shd_larger(y - s->floor[1], 0) * s->gain.part[c]);
}

/* The most that all of them together are. */
static double sum_at(const colors *s, double y) {
    const shd_excess *e = s->excess;
    double sum = y * s->free.sum, most = 0, floor = 0;
    for (int c = 0; c < 3; c++) {
        most += e->most[c];
        floor += e->floor[c];
    }
    if (!s->on->list->mixed)
        sum = shd_smaller(sum, floor + shd_larger(y - s->floor[1], 0) * s->gain.sum);
    return shd_smaller(sum, most);
}

/* X / Y or Z / Y at Y, by the floor and the gain. */
static shd_interval ratio_at(const colors *s, int r, double y) {
    const double above = shd_larger(y - s->floor[1], 0), of_y = 1 / y;
    return (shd_interval){(s->floor[r] + s->gain.xyz[r].low * above) * of_y,
                          (s->floor[r] + s->gain.xyz[r].high * above) * of_y};
}

/* `limit` 0: there is none. */
static setting setting_of(const shd_excess_list *list, const shd_shown *shown, double limit) {
    setting s = {.list = list,
                 .screen = shd_screen_of(shown),
                 .step = list->mixed || limit > 0 ? COARSE_STEP : STEP,
                 .limit = limit > 0 ? limit : INFINITY,
                 .error = shd_bound_linear(list),
                 .noise = shd_curve_noise(shown->screen_curve)};
    const double(*channels)[3] = s.screen.channels;
    shd_apply(s.screen.xyz, (const double[3]){1, 1, 1}, s.white);
    for (int r = 0; r < 3; r++) {
        s.of_y_held[r] = SHD_NO_INTERVAL;
        for (int c = 0; c < 3; c++) shd_widen(&s.of_y_held[r], channels[c][r] / channels[c][1]);
    }
    for (int c = 0; c < 3; c++) s.error_y += fabs(s.screen.xyz[1][c]) * s.error;
    return s;
}

/* X, Y or Z of channels in intervals, by its row of to_xyz. */
static shd_interval sum_channels(const double row[3], const shd_interval channel[3]) {
    shd_interval sum = {0, 0};
    for (int r = 0; r < 3; r++) {
        sum.low += row[r] * channel[r].low;
        sum.high += row[r] * channel[r].high;
    }
    return sum;
}

/* The Y that the colors have. */
static shd_interval lightness_of(const colors *s) {
    const shd_excess_list *list = s->on->list;
    double low = 0;
    for (int c = 0; c < 3; c++)
        low += s->on->screen.xyz[1][c] * (s->excess->floor[c] - s->on->error);
    /* A channel held at 0 adds to Y. Darker colors cover a part of their pixel: see SHD_MIXTURE. */
    low = list->nonnegative ? shd_larger(s->value[1].low, shd_smaller(shd_smaller(low, 1), s->held))
                            : 0;
    return (shd_interval){low > DARKEST ? low : 0, s->value[1].high};
}

static void find_colors(const setting *on, const shd_excess *e, colors *s) {
    const shd_excess_list *list = on->list;
    *s = (colors){.on = on, .excess = e, .coherent = list->nonnegative, .held = INFINITY};
    s->much = list->much[e - list->excess];
    bool held = false;
    for (int r = 0; r < 3; r++) {
        shd_interval at = {0, 0};
        for (int c = 0; c < 3; c++) {
            const double m = on->screen.rgb[r][c], high = e->most[c] + on->error;
            const double low = list->nonnegative && !list->mixed ? e->floor[c] - on->error
                               : list->nonnegative               ? -on->error
                                                                 : -high;
            at.low += shd_smaller(m * low, m * high);
            at.high += shd_larger(m * low, m * high);
        }
        if (list->mixed) at.high = INFINITY;
        held |= !(at.high <= 1);
        s->channel[r] = (shd_interval){shd_smaller(shd_larger(at.low, 0), 1),
                                       shd_smaller(shd_larger(at.high, 0), 1)};
    }
    for (int r = 0; r < 3; r++) s->value[r] = sum_channels(on->screen.to_xyz[r], s->channel);
    /* Equal channels are all held, or none is. */
    if (held && !list->grey) s->held = 0;
    shd_apply(on->screen.xyz, e->floor, s->floor);
    shd_apply(on->screen.xyz, e->main, s->main);
    look_at_parts(e, s);
    for (size_t t = 0; e->terms && t < e->term_count; t++) {
        shd_apply(on->screen.xyz, e->terms[t].color, s->terms[t]);
        s->terms_floor += s->much[t].low * s->terms[t][1];
    }
    if (s->held < INFINITY) {
        s->held = INFINITY;
        for (int k = 0; k < 3; k++) {
            double y = 0; /* where channel k is 1 */
            for (int r = 0; r < 3; r++)
                y += on->screen.to_xyz[1][r] *
                     (r == k ? 1 : shd_larger(s->least[r][k], s->channel[r].low));
            s->held = shd_smaller(s->held, y);
        }
    }
    s->y = lightness_of(s);
}

/* Errors of the colors of a step. */
typedef struct moves {
    double main;       /* of lights and highlights, along the main direction */
    double rest[3];    /* of them in each channel, beside that direction */
    double own[3];     /* of each channel of the working space by itself */
    double share[3];   /* of each channel, in proportion to it */
    double grey;       /* of all channels alike */
    double channel[3]; /* of each of the screen's channels */
} moves;

/* The errors of colors without held channels, whose Y is at most `y`. */
static moves free_moves(const colors *s, double y) {
    const shd_excess *e = s->excess;
    const setting *on = s->on;
    const shd_excess_list *list = on->list;
    moves m = {.main = e->main_absolute};
    double base = 0;
    for (int c = 0; c < 3; c++) base += list->mixed ? 0 : e->base[c];
    const double sum = sum_at(s, y);
    const double limit =
        shd_smaller(e->main_limited, e->ratio * shd_larger(sum - base, 0) + e->distance * sum);
    m.main += limit;
    for (int c = 0; c < 3; c++) {
        m.rest[c] = e->rest_absolute[c] + shd_smaller(e->rest_limited[c], limit);
        if (!list->grey) m.own[c] = list->more;
        if (!list->grey) m.share[c] = list->color * channel_at(s, c, y);
        if (!list->grey || !on->screen.same)
            m.channel[c] = on->noise * shd_smaller(s->channel[c].high, y * s->channel_of_y[c]);
        for (int k = 0; k < 3 && !on->screen.same; k++)
            m.channel[c] += SHD_MATRIX_NOISE * fabs(on->screen.rgb[c][k]) * channel_at(s, k, y);
    }
    if (list->grey) m.grey = (list->color + (on->screen.same ? on->noise : 0)) * y + list->more;
    return m;
}

/* The error of the screen's channel r if it shows `light`, but for the part of it in proportion to
 * the channel, which is `share`. Y is at most `y`, or infinite if some channel is held at 1. */
static double channel_move(const colors *s, int r, double light, double y, double *share) {
    const shd_excess *e = s->excess;
    const setting *on = s->on;
    const shd_excess_list *list = on->list;
    /* `same`: it is a channel of the working space. `sum`: it is a sum of such channels, each of
     * which is then no more than it. */
    const bool same = on->screen.rgb[r][(r + 1) % 3] == 0 && on->screen.rgb[r][(r + 2) % 3] == 0;
    bool sum = same || list->nonnegative;
    for (int c = 0; c < 3; c++) {
        if (on->screen.rgb[r][c] < -1e-6) sum = false;
        if (on->screen.rgb[r][c] < 0) light -= on->screen.rgb[r][c] * e->most[c];
    }
    const double color = list->color + (same ? 0 : SHD_MATRIX_NOISE);
    double move = 0;
    *share = (on->noise + (sum ? color : 0)) * light;
    for (int c = 0; c < 3; c++) {
        const double weight = fabs(on->screen.rgb[r][c]);
        double value = e->most[c], limited = e->limited[c];
        if (sum && weight > 0) value = shd_smaller(value, light / weight);
        /* A channel that is held at 0 adds to Y. */
        if (y < INFINITY && list->nonnegative) value = shd_smaller(value, channel_at(s, c, y));
        if (list->nonnegative) {
            const double base = list->mixed ? 0 : e->base[c];
            limited =
                shd_smaller(limited, e->ratio * shd_larger(value - base, 0) + e->distance * value);
        }
        move += weight * (e->absolute[c] + limited + list->more + (sum ? 0 : color * value));
    }
    return move;
}

/* The largest difference of colors whose Y is in the range. The channels in the bits of `at_1` are
 * held at 1, and each other one errs for itself. */
static double held_bound(const colors *s, shd_interval y, int at_1, double enough) {
    const setting *on = s->on;
    shd_interval channel[3];
    for (int r = 0; r < 3; r++) {
        channel[r] = s->channel[r];
        if (at_1 >> r & 1) channel[r].low = 1;
        for (int k = 0; k < 3; k++)
            if (at_1 >> k & 1) channel[r].low = shd_larger(channel[r].low, s->least[r][k]);
        if (channel[r].low > channel[r].high) return 0; /* there are none */
    }
    const shd_interval held = sum_channels(on->screen.to_xyz[1], channel);
    if (y.high < held.low || y.low > held.high) return 0;
    double move[3] = {0, 0, 0}, alone[3], share[3];
    for (int r = 0; r < 3; r++) {
        const double own = on->screen.to_xyz[1][r];
        const shd_interval given = channel[r];
        alone[r] = share[r] = 0;
        if (at_1 >> r & 1) continue;
        channel[r].high = shd_smaller(given.high, (y.high - held.low) / own + given.low);
        channel[r].low = shd_larger(given.low, (y.low - held.high) / own + given.high);
        alone[r] = channel_move(s, r, channel[r].high + on->error_y,
                                at_1 ? (double)INFINITY : y.high + on->error_y, &share[r]);
        for (int k = 0; k < 3; k++) move[k] += on->screen.to_xyz[k][r] * (alone[r] + share[r]);
    }
    shd_interval of_y[3];
    const double of_high = 1 / y.high, of_low = 1 / shd_larger(y.low, 1e-9);
    for (int k = 0; k < 3; k++) {
        const shd_interval value = sum_channels(on->screen.to_xyz[k], channel);
        of_y[k] = (shd_interval){shd_larger(on->of_y_held[k].low, value.low * of_high),
                                 shd_smaller(on->of_y_held[k].high, value.high * of_low)};
    }
    const shd_lab_curves f = shd_lab_curves_of(of_y, y, move);
    shd_lab_difference d = {.l = 0};
    const double part = on->list->color + on->noise + (on->screen.same ? 0 : SHD_MATRIX_NOISE);
    shd_lab_add_shares(&d, share, on->screen.channels, part, f.slope, of_y, y.high + on->error_y,
                       move);
    for (int r = 0; r < 3; r++) shd_lab_add(&d, f.slope, alone[r], on->screen.channels[r]);
    return shd_lab_length(&d, f.value, enough);
}

/* Adds the errors of lights and highlights term by term, for colors whose Y is at most `y`. */
static void add_known_terms(shd_lab_difference *d, const colors *s, const shd_interval slope[3],
                            double y) {
    const shd_excess *e = s->excess;
    for (size_t t = 1; t < e->term_count; t++) {
        const double *xyz = s->terms[t];
        const shd_much *much = &s->much[t];
        /* There is most of this term if the other ones are at their least. */
        double most = y;
        if (!s->on->list->mixed) most = much->low * xyz[1] + shd_larger(y - s->terms_floor, 0);
        most = xyz[1] > 0 ? shd_smaller(most / xyz[1], much->high) : much->high;
        const double limited = shd_smaller(much->limited, shd_term_rate(e, t) * most);
        shd_lab_add(d, slope, much->absolute + limited, xyz);
    }
}

/* The largest difference of colors whose Y is in the range and of which no channel is held. */
static double free_bound(const colors *s, shd_interval y, double enough) {
    const setting *on = s->on;
    const moves m = free_moves(s, y.high + on->error_y);
    shd_interval of_y[3];
    double move[3];
    const double of_high = 1 / y.high, of_low = 1 / shd_larger(y.low, 1e-9);
    for (int r = 0; r < 3; r++) {
        move[r] = 0;
        for (int c = 0; c < 3; c++) {
            move[r] += fabs(on->screen.xyz[r][c]) *
                       (m.main * s->excess->main[c] + m.rest[c] + m.own[c] + m.share[c] + m.grey);
            move[r] += on->screen.to_xyz[r][c] * m.channel[c];
        }
        of_y[r] = s->free.xyz[r];
        shd_interval value = {s->value[r].low * of_high, s->value[r].high * of_low};
        if (!on->list->mixed && y.low > s->floor[1] * 0.5 && y.low > 0) {
            /* The ratio is monotone between the step's ends. */
            const shd_interval a = ratio_at(s, r, shd_larger(y.low, s->floor[1])),
                               b = ratio_at(s, r, y.high);
            value.low = shd_larger(value.low, shd_smaller(a.low, b.low));
            value.high = shd_smaller(value.high, shd_larger(a.high, b.high));
        }
        if (r != 1 && value.low <= of_y[r].high && value.high >= of_y[r].low)
            of_y[r] = (shd_interval){shd_larger(of_y[r].low, value.low),
                                     shd_smaller(of_y[r].high, value.high)};
    }
    const shd_lab_curves f = shd_lab_curves_of(of_y, y, move);
    shd_lab_difference d = {.l = 0};
    shd_lab_add(&d, f.slope, m.grey, on->white);
    shd_lab_add_shares(&d, m.share, on->screen.columns, on->list->color, f.slope, of_y,
                       y.high + on->error_y, move);
    for (int c = 0; c < 3; c++) {
        shd_lab_add(&d, f.slope, m.own[c], on->screen.columns[c]);
        shd_lab_add(&d, f.slope, m.channel[c], on->screen.channels[c]);
    }
    shd_lab_difference lights = d;
    shd_lab_add(&lights, f.slope, m.main, s->main);
    for (int c = 0; c < 3; c++) shd_lab_add(&lights, f.slope, m.rest[c], on->screen.columns[c]);
    const double length = shd_lab_length(&lights, f.value, enough);
    if (length <= enough || !s->excess->terms) return length;
    add_known_terms(&d, s, f.slope, y.high + on->error_y);
    d.l = shd_smaller(d.l, lights.l);
    d.a = shd_smaller(d.a, lights.a);
    d.b = shd_smaller(d.b, lights.b);
    return shd_lab_length(&d, f.value, enough);
}

/* The largest difference of colors whose Y is in the range. Up to `enough`, it is an estimate. */
static double step_bound(const colors *s, shd_interval y, double enough) {
    double worst = s->coherent ? free_bound(s, y, enough) : held_bound(s, y, 0, enough);
    for (int at_1 = 1; at_1 < 7 && y.high >= s->held; at_1++)
        worst = shd_larger(worst, held_bound(s, y, at_1, enough));
    return worst;
}

/* The same, in steps, of a range that has this bound as a whole; `enough` if that is more. A range
 * is divided only if its bound exceeds `enough`, and its worst part is looked at first. */
static double range_bound(const colors *s, shd_interval y, double bound, double enough) {
    enum { MOST_PARTS = 8 };
    shd_interval part[MOST_PARTS];
    double parts[MOST_PARTS];
    const double low = shd_larger(y.low, DARKEST);
    if (bound <= enough || y.high <= s->on->step * low) return shd_larger(bound, enough);
    const int count = (int)shd_smaller(2 + 1.5 * log2(y.high / low), MOST_PARTS);
    const double factor = pow(y.high / low, 1.0 / count);
    for (int i = 0; i < count; i++) {
        part[i].low = i ? part[i - 1].high : y.low;
        part[i].high = i < count - 1 ? shd_larger(part[i].low, DARKEST) * factor : y.high;
        parts[i] = step_bound(s, part[i], enough);
    }
    for (int k = 0; k < count && enough <= s->on->limit; k++) {
        int worst = 0;
        for (int i = 1; i < count; i++)
            if (!(parts[i] <= parts[worst])) worst = i;
        enough = range_bound(s, part[worst], parts[worst], enough);
        parts[worst] = 0;
    }
    return shd_smaller(enough, bound);
}

double shd_bound_delta_e(const shd_excess_list *list, const shd_shown *shown, double enough) {
    if (!shown->seen || list->textured) return INFINITY;
    const double mixture = list->mixed ? SHD_MIXTURE : 1;
    const setting on = setting_of(list, shown, enough / mixture);
    if (!isfinite(on.error)) return INFINITY;
    double worst = enough / mixture, bound[SHD_EXCESSES];
    colors all[SHD_EXCESSES];
    for (size_t i = 0; i < list->count; i++) {
        find_colors(&on, &list->excess[i], &all[i]);
        bound[i] = step_bound(&all[i], all[i].y, worst);
        if (!(bound[i] >= 0)) return INFINITY; /* not a number */
    }
    for (size_t k = 0; k < list->count && worst <= on.limit; k++) {
        size_t most = 0;
        for (size_t i = 1; i < list->count; i++)
            if (bound[i] > bound[most]) most = i;
        worst = range_bound(&all[most], all[most].y, bound[most], worst);
        if (!(worst < 1e3)) return INFINITY;
        bound[most] = 0;
    }
    return enough > 0 && worst <= on.limit ? enough : worst * mixture;
}
