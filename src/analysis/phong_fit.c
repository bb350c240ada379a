#include <string.h>

#include "analysis/phong_parts.h"

enum { GRID = 32, ROUNDS = 6, STARTS = 2 };

/* Solves for `count` exponents, evenly from `first` on. Their lobes stay in the scratch. */
static shd_status try_some(const shd_fitting *f, double first, double step, size_t count,
                           shd_candidate out[], shd_error *error) {
    double exponents[SHD_FIT_LOBES];
    for (size_t k = 0; k < count; k++) {
        out[k].at = first + step * (double)k;
        exponents[k] = shd_fit_exponent(out[k].at);
    }
    shd_status status = f->lobes(f->context, exponents, count, f->scratch, error);
    for (size_t k = 0; k < count && status == SHD_OK; k++) {
        status = shd_fit_add_lobe(f, f->scratch[k], out[k].products, error);
        if (status == SHD_OK) shd_fit_solve(&out[k]);
    }
    return status;
}

/* ---- The search ---- */

/* Narrows the valley around `best`, whose neighbors are `step` away. */
static shd_status descend(const shd_fitting *f, double step, double end, shd_candidate *best,
                          shd_error *error) {
    for (int round = 0; round < ROUNDS; round++) {
        shd_candidate some[SHD_FIT_LOBES];
        const double low = fmax(best->at - step, 0), high = fmin(best->at + step, end);
        step = (high - low) / (SHD_FIT_LOBES + 1);
        const shd_status status = try_some(f, low + step, step, SHD_FIT_LOBES, some, error);
        if (status != SHD_OK) return status;
        for (int k = 0; k < SHD_FIT_LOBES; k++)
            if (some[k].rest < best->rest) *best = some[k];
    }
    return SHD_OK;
}

/* The deepest valleys of the grid, the best first. Returns how many there are. */
static int find_valleys(const shd_candidate grid[GRID], int out[STARTS]) {
    int count = 0;
    for (int k = 0; k < GRID; k++) {
        if ((k > 0 && grid[k - 1].rest <= grid[k].rest) ||
            (k < GRID - 1 && grid[k + 1].rest < grid[k].rest))
            continue;
        int at = count;
        while (at > 0 && grid[k].rest < grid[out[at - 1]].rest) at--;
        if (at == STARTS) continue;
        if (count < STARTS) count++;
        for (int i = count - 1; i > at; i--) out[i] = out[i - 1];
        out[at] = k;
    }
    return count;
}

static shd_status search(const shd_fitting *f, shd_candidate *best, double *flattest,
                         shd_error *error) {
    shd_candidate grid[GRID];
    int valleys[STARTS];
    const double end = log1p(SHD_FIT_MOST), step = end / (GRID - 1);
    shd_status status = SHD_OK;
    for (int k = 0; k < GRID && status == SHD_OK; k += SHD_FIT_LOBES)
        status = try_some(f, step * k, step, SHD_FIT_LOBES, grid + k, error);
    if (status != SHD_OK) return status;
    *flattest = 0;
    for (int k = 0; k < GRID; k++) *flattest = fmax(*flattest, grid[k].rest);
    const int count = find_valleys(grid, valleys);
    *best = grid[valleys[0]];
    for (int i = 0; i < count && status == SHD_OK; i++) {
        shd_candidate here = grid[valleys[i]];
        status = descend(f, step, end, &here, error);
        if (status == SHD_OK && here.rest < best->rest) *best = here;
    }
    return status;
}

static double left_without(const shd_fitting *f) {
    double x[SHD_COLUMNS], sum = 0;
    for (int c = 0; c < 3; c++) sum += shd_least_squares(&f->base[c], x);
    return sum;
}

static void count_rows(const shd_fitting *f, shd_phong_fit *out) {
    for (size_t i = 0; i < 3 * f->rows->count && !shd_is_cancelled_at(f->cancelled, i); i++)
        out->channels[i % 3].rows += f->rows->weight[i] > 0;
}

/* The solution without a highlight. What one would be told by is that of a usual exponent. */
static void forget_lobe(const shd_fitting *f, shd_candidate *best) {
    best->at = log1p(SHD_FIT_USUAL);
    for (int c = 0; c < 3; c++) {
        double x[SHD_COLUMNS];
        shd_least_squares(&f->base[c], x);
        memcpy(best->x[c], x, sizeof x);
    }
}

/* Whether it does by the deviations that were told, which know what errors have in common. */
static bool stands_out(const shd_phong_fit *found) {
    double sum = 0;
    for (int c = 0; c < 3; c++) {
        const double value = found->channels[c].value[SHD_FIT_SPECULAR],
                     deviation = found->channels[c].deviation[SHD_FIT_SPECULAR];
        if (isfinite(deviation) && deviation > 0) sum += value * value / (deviation * deviation);
        if (value > 0 && !(deviation > 0 && isfinite(deviation))) return true; /* who knows */
    }
    return sum > SHD_FIT_STANDS_OUT;
}

shd_status shd_phong_fit_find(const shd_fit_rows *rows, shd_fit_lobes *lobes, void *context,
                              float *scratch[SHD_FIT_LOBES], const atomic_bool *cancelled,
                              shd_phong_fit *out, shd_error *error) {
    shd_fitting f = {.rows = rows,
                     .lobes = lobes,
                     .context = context,
                     .scratch = scratch,
                     .cancelled = cancelled};
    shd_candidate best;
    double flattest;
    shd_phong_fit found = {.doubt = SHD_FIT_SURE};
    shd_status status = shd_fit_sum_base(&f, error);
    if (status == SHD_OK) status = search(&f, &best, &flattest, error);
    if (status != SHD_OK) return status;
    count_rows(&f, &found);
    size_t errors = 0;
    for (int c = 0; c < 3; c++) errors += shd_fit_errors(&f, found.channels[c].rows, c);
    const double variance = shd_fit_variance(&f, best.rest, errors, 10);
    const bool lobe = left_without(&f) - best.rest > SHD_FIT_STANDS_OUT * variance;
    if (!lobe) forget_lobe(&f, &best);
    if (!lobe)
        found.doubt = SHD_FIT_NO_LOBE;
    else if (flattest - best.rest < SHD_FIT_STANDS_OUT * variance)
        found.doubt = SHD_FIT_FLAT;
    else if (!(best.at < log1p(SHD_FIT_MOST) - 1e-3))
        found.doubt = SHD_FIT_BEYOND;
    status = shd_fit_tell_errors(&f, &best, lobe, &found, error);
    if (status == SHD_OK && lobe && !stands_out(&found)) {
        found.doubt = SHD_FIT_NO_LOBE;
        forget_lobe(&f, &best);
        status = shd_fit_tell_errors(&f, &best, false, &found, error);
    }
    if (status == SHD_OK) *out = found;
    return status;
}
