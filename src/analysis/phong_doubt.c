/* What is known of a solution: its errors, and which of its terms this light does not tell. */
#include <string.h>

#include "analysis/phong_parts.h"

/* What of a term is no sum of the others: less is lost in sums of f32 light. */
static const double ALIKE = 3e-5;

/* The light of a coefficient of 1, over the errors of rows: less tells nothing. */
static const double UNSEEN = 0.01;

/* Three rows a pixel. */
static const double FEW = 3 * 8;

/* How much farther Student's distribution reaches than the normal one, at one standard deviation:
 * Fisher's expansion, to 0.015 for one degree of freedom and 0.001 for more. */
static double reach_of_few(double freedom) {
    const double y = 1 / freedom;
    return 1 + y * (0.5 + y * (0.25 + y * 0.0625));
}

double shd_fit_variance(const shd_fitting *f, double rest, size_t errors, double parameters) {
    const double all = (double)errors, freedom = all - parameters;
    if (!(freedom > 0)) return f->rows->relative ? INFINITY : fmax(all, 1);
    const double found = rest / freedom, reach = reach_of_few(freedom),
                 wide = found * reach * reach;
    if (f->rows->relative) return wide;
    return fmax(wide, 1);
}

static int look_alike(const shd_products *p, int term) {
    for (int j = 0; j < SHD_COLUMNS; j++) {
        if (j == term || !(p->columns[j][j] > 0)) continue;
        const double cross = p->columns[term][j];
        if (1 - cross * cross / (p->columns[term][term] * p->columns[j][j]) < ALIKE * ALIKE)
            return j;
    }
    return -1;
}

/* Fewer rows than unknowns, one of which is the exponent, leave any of them open; so does light in
 * no unit if nothing is left to measure its errors by. */
static bool are_too_few(const shd_fit_channel *channel, double variance) {
    size_t unknowns = channel->doubt[SHD_FIT_SPECULAR] != SHD_FIT_UNSEEN;
    for (int i = 0; i < SHD_COLUMNS; i++) unknowns += channel->doubt[i] != SHD_FIT_UNSEEN;
    return channel->rows < unknowns || !isfinite(variance);
}

static void doubt_all(shd_fit_channel *out, bool uses[SHD_COLUMNS]) {
    for (int i = 0; i < SHD_COLUMNS; i++) {
        if (out->doubt[i] != SHD_FIT_UNSEEN) out->doubt[i] = SHD_FIT_TOO_FEW;
        uses[i] = false;
    }
}

static void doubt_terms(const shd_products *p, bool lobe, double variance, shd_fit_channel *out,
                        bool uses[SHD_COLUMNS]) {
    const double least = isfinite(variance) ? UNSEEN * UNSEEN * variance : 0;
    for (int i = 0; i < SHD_COLUMNS; i++) {
        shd_products own = *p;
        if (!lobe && i != SHD_FIT_SPECULAR)
            for (int j = 0; j < SHD_COLUMNS; j++) own.columns[2][j] = own.columns[j][2] = 0;
        out->doubt[i] = SHD_FIT_SURE;
        out->like[i] = -1;
        if (!(p->columns[i][i] > least))
            out->doubt[i] = SHD_FIT_UNSEEN;
        else if (shd_column_share(&own, i) < ALIKE)
            out->doubt[i] = SHD_FIT_LIKE_OTHERS;
        if (out->doubt[i] == SHD_FIT_LIKE_OTHERS) out->like[i] = look_alike(&own, i);
        uses[i] = out->doubt[i] == SHD_FIT_SURE;
    }
}

static double rest_at(const shd_fit_rows *rows, const shd_candidate *best, const float *lobe,
                      size_t i) {
    const double *x = best->x[i % 3];
    return (double)rows->light[i] - x[0] - x[1] * (double)rows->diffuse[i] - x[2] * (double)lobe[i];
}

/* How the light of a channel follows the exponent: sums of ks dS/du with the terms, with itself,
 * and with what is left. */
typedef struct slope {
    double columns[SHD_COLUMNS], square, rest;
} slope;

/* Returns on how many rows that is: if it is the same on n rows and 0 on others, n. */
static double sum_slopes(const shd_fitting *f, const shd_candidate *best, const float *low,
                         const float *middle, const float *high, double width, slope out[3]) {
    const shd_fit_rows *rows = f->rows;
    double sum = 0, squares = 0;
    memset(out, 0, 3 * sizeof *out);
    for (size_t i = 0; i < 3 * rows->count; i++) {
        if (shd_is_cancelled_at(f->cancelled, i)) break;
        const int c = (int)(i % 3);
        const double w = (double)rows->weight[i];
        const double d =
            w * best->x[c][SHD_FIT_SPECULAR] * ((double)high[i] - (double)low[i]) / width;
        out[c].columns[0] += d * w;
        out[c].columns[1] += d * w * (double)rows->diffuse[i];
        out[c].columns[2] += d * w * (double)middle[i];
        out[c].square += d * d;
        out[c].rest += d * w * rest_at(rows, best, middle, i);
        sum += d * d;
        squares += d * d * d * d;
    }
    return squares > 0 ? sum * sum / squares : 0;
}

/* By the blocks of the information matrix, because terms of two channels have only the exponent in
 * common. */
typedef struct spread {
    double inverse[3][SHD_COLUMNS][SHD_COLUMNS];
    double follow[3][SHD_COLUMNS]; /* how the terms go as u = log(1 + n) grows */
    double variance, step;         /* of u, and what is left to its minimum; 0: not known */
} spread;

static spread spread_errors(const shd_candidate *best, const slope slopes[3],
                            const double variance[3], bool uses[3][SHD_COLUMNS]) {
    spread s = {.variance = 0};
    double information = 0, scale = 0, toward = 0;
    for (int c = 0; c < 3; c++) {
        double taken = 0;
        if (!shd_invert_products(&best->products[c], uses[c], s.inverse[c]))
            memset(uses[c], 0, sizeof uses[c]);
        for (int i = 0; i < SHD_COLUMNS; i++) {
            for (int j = 0; j < SHD_COLUMNS; j++)
                s.follow[c][i] -= s.inverse[c][i][j] * slopes[c].columns[j];
            taken -= s.follow[c][i] * slopes[c].columns[i];
        }
        if (!(variance[c] > 0)) continue;
        information += (slopes[c].square - taken) / variance[c];
        scale += slopes[c].square / variance[c];
        toward += slopes[c].rest / variance[c];
    }
    if (!(information > ALIKE * ALIKE * scale)) return s;
    s.variance = 1 / information;
    s.step = toward / information;
    return s;
}

static void tell_errors(const shd_candidate *best, const spread *s, const double variance[3],
                        const shd_plateaus *more, bool uses[3][SHD_COLUMNS], shd_phong_fit *out) {
    const double by = exp(best->at); /* dn/du = 1 + n */
    const double of_u = s->variance + more->exponent;
    for (int c = 0; c < 3; c++) {
        double(*v)[SHD_FIT_TERMS] = out->channels[c].covariance;
        const double *follow = s->follow[c], *cross = more->cross[c];
        for (int i = 0; i < SHD_COLUMNS; i++) {
            for (int j = 0; j < SHD_COLUMNS; j++)
                v[i][j] = variance[c] * s->inverse[c][i][j] + more->own[c][i][j] +
                          cross[i] * follow[j] + follow[i] * cross[j] +
                          follow[i] * follow[j] * of_u;
            v[i][SHD_FIT_SHININESS] = v[SHD_FIT_SHININESS][i] = (cross[i] + follow[i] * of_u) * by;
            out->channels[c].deviation[i] = uses[c][i] ? sqrt(v[i][i]) : INFINITY;
        }
        v[SHD_FIT_SHININESS][SHD_FIT_SHININESS] = of_u * by * by;
    }
    out->deviation = s->variance > 0 ? sqrt(of_u) * by : INFINITY;
}

/* One step of Gauss and Newton's method, from where the search has come so near that sums of
 * squares hardly differ any more. */
static void finish(shd_candidate *best, const spread *s) {
    if (!(fabs(s->step) < 1e-3) || best->at + s->step < 0) return;
    best->at += s->step;
    for (int c = 0; c < 3; c++)
        for (int i = 0; i < SHD_COLUMNS; i++)
            if (best->x[c][i] > 0)
                best->x[c][i] = fmax(best->x[c][i] + s->follow[c][i] * s->step, 0);
}

/* Without a highlight there may still be one of this exponent, if a specular of a vague size would
 * not stand out. */
static const double SHARP = 1000, VAGUE = 0.02;

static void doubt_sharp(const shd_fitting *f, const float *sharp, const double variance[3],
                        shd_phong_fit *out) {
    double sums[3] = {0};
    for (size_t i = 0; i < 3 * f->rows->count; i++) {
        if (shd_is_cancelled_at(f->cancelled, i)) return;
        const double light = (double)f->rows->weight[i] * VAGUE * (double)sharp[i];
        sums[i % 3] += light * light;
    }
    for (int c = 0; c < 3; c++) {
        shd_fit_doubt *doubt = &out->channels[c].doubt[SHD_FIT_SPECULAR];
        if (*doubt == SHD_FIT_SURE && sums[c] < SHD_FIT_STANDS_OUT * variance[c])
            *doubt = SHD_FIT_SHARP;
    }
}

static bool is_vague(double value, double deviation) {
    return deviation > VAGUE && deviation > value / 4;
}

static void doubt_values(shd_phong_fit *out) {
    for (int c = 0; c < 3; c++) {
        shd_fit_channel *channel = &out->channels[c];
        for (int i = 0; i < SHD_COLUMNS; i++)
            if (channel->doubt[i] == SHD_FIT_SURE && isfinite(channel->deviation[i]) &&
                is_vague(channel->value[i], channel->deviation[i]))
                channel->doubt[i] = SHD_FIT_VAGUE;
    }
    if (out->doubt == SHD_FIT_SURE && !isfinite(out->deviation)) out->doubt = SHD_FIT_FLAT;
    if (out->doubt == SHD_FIT_SURE && out->deviation > (1 + out->shininess) / 4)
        out->doubt = SHD_FIT_VAGUE;
}

static void sum_rests(const shd_fitting *f, const shd_candidate *best, const float *lobe,
                      shd_phong_fit *out) {
    const shd_fit_rows *rows = f->rows;
    double sums[3] = {0}, weighted[3] = {0};
    for (size_t i = 0; i < 3 * rows->count; i++) {
        if (shd_is_cancelled_at(f->cancelled, i)) break;
        const double w = (double)rows->weight[i], rest = rest_at(rows, best, lobe, i);
        if (!(w > 0)) continue;
        sums[i % 3] += rest * rest;
        weighted[i % 3] += w * w * rest * rest;
    }
    for (int c = 0; c < 3; c++) {
        shd_fit_channel *channel = &out->channels[c];
        const double count = fmax((double)channel->rows, 1),
                     errors = fmax((double)shd_fit_errors(f, channel->rows, c), 1);
        channel->rms = sqrt(sums[c] / count);
        channel->weighted = sqrt(weighted[c] / errors);
    }
}

/* The lobes at the best exponent, and beside it: everything that is told of the solution. */
shd_status shd_fit_tell_errors(const shd_fitting *f, shd_candidate *best, bool lobe,
                               shd_phong_fit *out, shd_error *error) {
    enum { BESIDE = 3, ALL = 4 };
    const double half = 2e-3, end = log1p(SHD_FIT_MOST),
                 low = fmin(fmax(best->at - half, 0), end - 2 * half);
    shd_candidate some[BESIDE];
    slope slopes[3];
    double variance[3];
    bool uses[3][SHD_COLUMNS];
    int few = 0; /* channels of too few rows */
    const double exponents[ALL] = {shd_fit_exponent(low), shd_fit_exponent(best->at),
                                   shd_fit_exponent(low + 2 * half), SHARP};
    shd_status status = f->lobes(f->context, exponents, lobe ? BESIDE : ALL, f->scratch, error);
    if (status == SHD_OK) status = shd_fit_add_lobe(f, f->scratch[1], some[1].products, error);
    if (status != SHD_OK) return status;
    memcpy(best->products, some[1].products, sizeof best->products);
    if (lobe) shd_fit_solve(best);
    sum_rests(f, best, f->scratch[1], out);
    for (int c = 0; c < 3; c++) {
        shd_fit_channel *channel = &out->channels[c];
        const size_t errors = shd_fit_errors(f, channel->rows, c);
        const double rest = channel->weighted * channel->weighted * (double)errors;
        variance[c] = shd_fit_variance(f, rest, errors, SHD_COLUMNS + 1 / 3.0);
        doubt_terms(&best->products[c], lobe, variance[c], channel, uses[c]);
        if (!are_too_few(channel, variance[c])) continue;
        doubt_all(channel, uses[c]);
        variance[c] = 0; /* it tells nothing of the exponent, either */
        few++;
    }
    if (!lobe) doubt_sharp(f, f->scratch[BESIDE], variance, out);
    const double on =
        sum_slopes(f, best, f->scratch[0], f->scratch[1], f->scratch[2], 2 * half, slopes);
    if (out->doubt == SHD_FIT_SURE && few == 3) out->doubt = SHD_FIT_TOO_FEW;
    if (out->doubt == SHD_FIT_SURE && on < FEW) out->doubt = SHD_FIT_FEW;
    const spread errors = spread_errors(best, slopes, variance, uses);
    const shd_plateau_parts parts = {.rows = f->rows,
                                     .x = best->x,
                                     .lobes = f->scratch,
                                     .width = 2 * half,
                                     .inverse = errors.inverse,
                                     .follow = errors.follow,
                                     .variance = variance,
                                     .exponent = errors.variance};
    shd_plateaus more = {.exponent = 0};
    if (!f->rows->relative) shd_fit_find_plateaus(&parts, f->scratch + BESIDE, f->cancelled, &more);
    if (lobe) finish(best, &errors);
    tell_errors(best, &errors, variance, &more, uses, out);
    for (int c = 0; c < 3; c++) memcpy(out->channels[c].value, best->x[c], sizeof best->x[c]);
    out->shininess = shd_fit_exponent(best->at);
    doubt_values(out);
    return shd_is_cancelled(f->cancelled) ? shd_fit_cancelled(error) : SHD_OK;
}
