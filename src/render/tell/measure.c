#include "render/tell/measure.h"

#include <float.h>
#include <string.h>

#include "base/bits.h"
#include "bound/light/extended.h"
#include "bound/shown/picture.h"
#include "render/show/conversion.h"
#include "render/show/output.h"

enum { BLOCK = 1024 }; /* pixels that are converted and compared at once */

/* ---- Blocks ---- */

/* One thread's memory, and what it has counted. No order of blocks changes these. */
typedef struct tally {
    float shown[2][4 * BLOCK], seen[2][4 * BLOCK]; /* exact and other; for codes and for Lab */
    uint8_t codes[2][4 * BLOCK];
    uint64_t apart[256]; /* [n]: samples whose codes differ by n */
    double largest, linear, delta_e;
    double most; /* bound of CIEDE2000 */
    double seconds[2];
} tally;

typedef struct measuring {
    const shd_rendering *rendering;
    const shd_showing *showing;
    const shd_picture_errors *errors; /* NULL: the film's colors tell no more than the plan */
    const float *exact;
    float *film;
    size_t pixels;
    tally *tallies; /* [slot] */
    /* Sums of f64 depend on their order, so every block has its own. */
    struct block_sums {
        double linear, delta_e;
    } * sums; /* [block] */
} measuring;

/* Makes a block as it is shown, and as it goes to Lab. */
static void show_block(const shd_showing *showing, const float *rgba, size_t count, float *shown,
                       float *seen) {
    memcpy(shown, rgba, 4 * count * sizeof *shown);
    if (showing->flatten) shd_output_flatten(showing->matte, shown, count);
    if (showing->detour) {
        memcpy(seen, shown, 4 * count * sizeof *seen);
        shd_color_apply(showing->detour, seen, count);
    }
    shd_color_apply(showing->transform, shown, count);
    shd_saturate(shown, 4 * count, -FLT_MAX, FLT_MAX);
}

static double difference_of_colors(const shd_lab_space *space, const float *a, const float *b) {
    /* Most pixels of a background are the same. */
    if (a[0] == b[0] && a[1] == b[1] && a[2] == b[2]) return 0;
    double lab[2][3];
    shd_lab_of(space, a, lab[0]);
    shd_lab_of(space, b, lab[1]);
    return shd_delta_e_2000(lab[0], lab[1]);
}

/* The largest bound of a block's pixels, which are seen as they are and, with alpha, over black. */
static double bound_block(const shd_picture_errors *errors, const float *rgba, size_t count) {
    double most = 0;
    for (size_t i = 0; i < count; i++) {
        const float *at = rgba + 4 * i;
        if (i > 0 && !memcmp(at, at - 4, 4 * sizeof *at)) continue;
        const double alpha = (double)at[3], rgb[3] = {(double)at[0], (double)at[1], (double)at[2]};
        if (!(alpha > 0)) continue;
        most = fmax(most, shd_picture_delta_e(errors, rgb));
        const double over[3] = {alpha * rgb[0], alpha * rgb[1], alpha * rgb[2]};
        if (alpha < 1) most = fmax(most, shd_picture_delta_e(errors, over));
    }
    return most;
}

/* Leaves a block's differences in the film's pixels: three linear ones and CIEDE2000. */
static void measure_block(void *context, size_t index, unsigned slot) {
    measuring *m = context;
    if (shd_is_cancelled(m->rendering->cancelled)) return;
    const shd_showing *showing = m->showing;
    tally *t = &m->tallies[slot];
    struct block_sums *sum = &m->sums[index];
    size_t first = index * BLOCK, left = m->pixels - first, count = left < BLOCK ? left : BLOCK;
    const float *exact = m->exact + 4 * first;
    float *film = m->film + 4 * first;

    const float *seen[2];
    for (int k = 0; k < 2; k++) {
        const double began = shd_thread_seconds();
        show_block(showing, k ? film : exact, count, t->shown[k], t->seen[k]);
        t->seconds[k] += shd_thread_seconds() - began;
        shd_pack_row(&showing->pack, t->shown[k], (int)count, t->codes[k]);
        seen[k] = showing->detour ? t->seen[k] : t->shown[k];
    }
    if (m->errors) t->most = fmax(t->most, bound_block(m->errors, film, count));
    for (size_t i = 0; i < count * (size_t)showing->pack.count; i++) {
        int apart = t->codes[0][i] - t->codes[1][i];
        t->apart[apart < 0 ? -apart : apart]++;
    }
    for (size_t i = 0; i < count; i++) {
        for (size_t c = 0; c < 3; c++) {
            double value = (double)exact[4 * i + c];
            double error = fabs((double)film[4 * i + c] - value);
            t->largest = fmax(t->largest, fabs(value));
            t->linear = fmax(t->linear, error);
            sum->linear += error;
            film[4 * i + c] = (float)fmin(error, FLT_MAX);
        }
        const double delta_e =
            difference_of_colors(&showing->lab, seen[0] + 4 * i, seen[1] + 4 * i);
        t->delta_e = fmax(t->delta_e, delta_e);
        sum->delta_e += delta_e;
        film[4 * i + 3] = (float)delta_e;
    }
}

/* ---- Totals ---- */

static void measure_codes(const uint64_t apart[256], shd_difference *d) {
    double sum = 0, squares = 0;
    uint64_t total = 0, below = 0;
    for (int i = 0; i < 256; i++) {
        if (apart[i]) d->code.max = i;
        total += apart[i];
        sum += (double)i * (double)apart[i];
        squares += (double)i * i * (double)apart[i];
    }
    d->code.mean = sum / (double)total;
    for (int i = 0; below < total - total / 100; i++) {
        below += apart[i];
        d->code.p99 = i;
    }
    d->equal = (double)apart[0] / (double)total;
    d->psnr = squares > 0 ? 10 * log10(255.0 * 255.0 * (double)total / squares) : INFINITY;
}

/* The value at p99 among `channels` of every four floats. None of them is negative, so they sort as
 * their bits do, and counting their upper and then their lower halves finds it without a copy. 0 if
 * it is cancelled. */
static double select_p99(const measuring *m, const float *values, int channels, uint64_t *counts) {
    const size_t pixels = m->pixels, total = pixels * (size_t)channels;
    uint64_t rank = total - total / 100; /* counted from 1 */
    uint32_t found = 0;
    for (int pass = 0; pass < 2; pass++) {
        memset(counts, 0, 65536 * sizeof *counts);
        for (size_t i = 0; i < pixels; i++) {
            if (shd_is_cancelled_at(m->rendering->cancelled, i)) return 0;
            for (int c = 0; c < channels; c++) {
                const uint32_t bits = shd_bits_of(values[4 * i + (size_t)c]);
                if (pass == 0)
                    counts[bits >> 16]++;
                else if (bits >> 16 == found)
                    counts[bits & 0xffff]++;
            }
        }
        uint32_t at = 0;
        while (counts[at] < rank) rank -= counts[at++];
        found = pass == 0 ? at : found << 16 | at;
    }
    return (double)shd_float_of(found);
}

static void add_up(const measuring *m, unsigned slots, size_t blocks, uint64_t *counts,
                   shd_difference *out, double seconds[2]) {
    uint64_t apart[256] = {0};
    shd_difference d = {0};
    for (unsigned s = 0; s < slots; s++) {
        const tally *t = &m->tallies[s];
        for (int i = 0; i < 256; i++) apart[i] += t->apart[i];
        d.largest = fmax(d.largest, t->largest);
        d.linear.max = fmax(d.linear.max, t->linear);
        d.delta_e.max = fmax(d.delta_e.max, t->delta_e);
        d.most = fmax(d.most, t->most);
        for (int k = 0; k < 2; k++) seconds[k] += t->seconds[k];
    }
    for (size_t b = 0; b < blocks; b++) {
        d.linear.mean += m->sums[b].linear;
        d.delta_e.mean += m->sums[b].delta_e;
    }
    d.linear.mean /= 3 * (double)m->pixels;
    d.delta_e.mean /= (double)m->pixels;
    /* The film holds them in f32, which may round them up beyond the maximum. */
    d.linear.p99 = fmin(select_p99(m, m->film, 3, counts), d.linear.max);
    d.delta_e.p99 = fmin(select_p99(m, m->film + 3, 1, counts), d.delta_e.max);

    const shd_bound *bound = &m->rendering->plan->bound;
    d.most = m->errors ? fmin(d.most, bound->delta_e) : bound->delta_e;
    measure_codes(apart, &d);
    *out = d;
}

/* False: memory. */
static bool find_errors(const shd_rendering *r, const shd_showing *showing,
                        const shd_picture_errors **out) {
    const shd_plan *plan = r->plan;
    const shd_shown shown = shd_shown_of(showing);
    shd_excess_list list;
    *out = NULL;
    if (shd_errs_otherwise(plan)) return true; /* excesses are of Phong's model and of points */
    if (!shd_excess_find(plan, plan->tier, r->arena, &list, NULL)) return false;
    shd_excess_leave_out(&list, plan->drop_tolerance + plan->dropped + plan->mean_room.absolute,
                         plan->drop_relative + plan->mean_room.relative);
    return shd_picture_errors_new(plan, &list, &shown, r->arena, out);
}

shd_status shd_film_measure(shd_rendering *r, const shd_showing *showing, const shd_film *exact,
                            shd_film *film, shd_difference *out, double *exact_seconds,
                            shd_error *error) {
    const unsigned slots = shd_pool_slots(r->engine->pool);
    const size_t pixels = (size_t)film->width * (size_t)film->height,
                 blocks = (pixels + BLOCK - 1) / BLOCK;
    measuring m = {.rendering = r,
                   .showing = showing,
                   .exact = exact->rgba,
                   .film = film->rgba,
                   .pixels = pixels,
                   .tallies = shd_arena_zalloc(r->arena, slots, sizeof *m.tallies),
                   .sums = shd_arena_zalloc(r->arena, blocks, sizeof *m.sums)};
    uint64_t *counts = shd_arena_alloc(r->arena, 65536, sizeof *counts);
    if (!m.tallies || !m.sums || !counts || !find_errors(r, showing, &m.errors))
        return shd_rendering_full(r, "comparison", error);

    shd_pool_for(r->engine->pool, blocks, measure_block, &m);
    double seconds[2] = {0, 0};
    if (!shd_is_cancelled(r->cancelled)) add_up(&m, slots, blocks, counts, out, seconds);
    r->times.color += seconds[1];
    *exact_seconds = seconds[0];
    if (shd_is_cancelled(r->cancelled))
        return shd_fail(error, SHD_CANCELLED, "", "the comparison was cancelled");
    return SHD_OK;
}
