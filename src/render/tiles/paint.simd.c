#include <string.h>

#include "base/simd.h"
#include "render/tiles/paint.h"

/* The constant and the first terms in one pass. Without a coverage it is 1. */
static inline void begin_sum(float base, const float *restrict coverage, const float *color,
                             const float *const *sums, size_t terms, size_t count,
                             float *restrict to) {
    for (size_t i = 0; i < count; i++) {
        float sum = coverage ? base * coverage[i] : base;
        for (size_t t = 0; t < terms; t++) sum += color[t] * sums[t][i];
        to[i] = sum;
    }
}

static void mix_terms(const float constant[3], const float *coverage, const shd_paint_term *terms,
                      size_t term_count, size_t count, float *const out[3]) {
    enum { FIRST = 2 };
    for (int c = 0; c < 3; c++) {
        const float base = constant[c];
        float color[FIRST];
        const float *sums[FIRST];
        size_t first = 0, t = 0;
        for (; t < term_count && first < FIRST; t++) {
            if (terms[t].color[c] == 0) continue; /* an infinite sum does not show there */
            color[first] = terms[t].color[c];
            sums[first++] = terms[t].sums[c];
        }
        /* Loops vectorize if the number of terms is a constant. */
        if (first == 2)
            begin_sum(base, coverage, color, sums, 2, count, out[c]);
        else if (first == 1)
            begin_sum(base, coverage, color, sums, 1, count, out[c]);
        else
            begin_sum(base, coverage, color, sums, 0, count, out[c]);
        for (; t < term_count; t++) {
            const float weight = terms[t].color[c];
            const float *restrict more = terms[t].sums[c];
            float *restrict to = out[c];
            if (weight == 0) continue;
            for (size_t i = 0; i < count; i++) to[i] += weight * more[i];
        }
    }
}

static void fill_values(float *values, size_t count, float value) {
    for (size_t i = 0; i < count; i++) values[i] = value;
}

/* Cells mostly follow each other, in a row of the tile. */
static void scatter_values(const float *const values[3], const uint16_t *cell, size_t count,
                           float *const pixels[3]) {
    enum { LONG = 8, SHORT = 4 };
    for (size_t i = 0; i < count;) {
        const size_t to = cell[i];
        if (count - i >= LONG && shd_is_span(cell + i, LONG)) {
            for (int c = 0; c < 3; c++) memcpy(pixels[c] + to, values[c] + i, LONG * sizeof(float));
            i += LONG;
        } else if (count - i >= SHORT && shd_is_span(cell + i, SHORT)) {
            for (int c = 0; c < 3; c++)
                memcpy(pixels[c] + to, values[c] + i, SHORT * sizeof(float));
            i += SHORT;
        } else {
            for (int c = 0; c < 3; c++) pixels[c][to] = values[c][i];
            i++;
        }
    }
}

static void fill_rest(float *values, const float *cover, float background, size_t count) {
    for (size_t i = 0; i < count; i++) values[i] += (1 - cover[i]) * background;
}

static void divide_values(float *values, const float *cover, size_t count) {
    for (size_t i = 0; i < count; i++) {
        float some = cover[i] > 0 ? cover[i] : 1;
        values[i] /= some;
    }
}

static void average_samples(const float *values, size_t count, int samples, float *out) {
    enum { AT_ONCE = 64 };
    const double share = 1.0 / samples;
    double sums[AT_ONCE];
    for (size_t first = 0; first < count; first += AT_ONCE) {
        const size_t left = count - first, some = left < AT_ONCE ? left : AT_ONCE;
        for (size_t i = 0; i < some; i++) sums[i] = (double)values[first + i];
        for (size_t k = 1; k < (size_t)samples; k++) {
            const float *more = values + k * count + first;
            for (size_t i = 0; i < some; i++) sums[i] += (double)more[i];
        }
        for (size_t i = 0; i < some; i++) out[first + i] = (float)(sums[i] * share);
    }
}

static void weigh_samples(const float *values, size_t count, const double *weights, size_t samples,
                          float *out) {
    enum { AT_ONCE = 64 };
    double sums[AT_ONCE];
    for (size_t first = 0; first < count; first += AT_ONCE) {
        const size_t left = count - first, some = left < AT_ONCE ? left : AT_ONCE;
        for (size_t i = 0; i < some; i++) sums[i] = weights[0] * (double)values[first + i];
        for (size_t k = 1; k < samples; k++) {
            const float *more = values + k * count + first;
            for (size_t i = 0; i < some; i++) sums[i] += weights[k] * (double)more[i];
        }
        for (size_t i = 0; i < some; i++) out[first + i] = (float)sums[i];
    }
}

enum { WIDE = SHD_W / 2 }; /* doubles of a vector */

/* A block's row, of a lattice with so many weights to a side. */
SHD_INLINE void filter_row(const double *values, const shd_lattice *l, int side, float *out) {
    enum { VECTORS = SHD_BLOCK_SIDE / WIDE };
    shd_vd sums[VECTORS];
    for (int v = 0; v < VECTORS; v++) sums[v] = (shd_vd){0};
    for (int row = 0; row < side; row++)
        for (int column = 0; column < side; column++)
            for (int v = 0; v < VECTORS; v++)
                sums[v] += l->weights[row * side + column] *
                           shd_vd_load(values + (size_t)row * l->pitch + column + v * WIDE);
    const shd_vd least = l->least + (shd_vd){0};
    for (int v = 0; v < VECTORS; v++) {
        const shd_vh narrow = shd_vh_narrow(shd_vd_max(sums[v], least));
        memcpy(out + v * WIDE, &narrow, sizeof narrow);
    }
}

SHD_INLINE void filter_rows(const double *values, const shd_lattice *l, int side, float *out) {
    for (uint64_t pixels = l->pixels; pixels; pixels >>= SHD_BLOCK_SIDE, values += l->pitch) {
        uint64_t some = pixels & SHD_ROW;
        if (!some) continue;
        float row[SHD_BLOCK_SIDE];
        filter_row(values, l, side, row);
        if (some == SHD_ROW) {
            memcpy(out, row, sizeof row);
            out += SHD_BLOCK_SIDE;
        } else {
            for (; some; some &= some - 1) *out++ = row[__builtin_ctzll(some)];
        }
    }
}

static void filter_values(const double *values, const shd_lattice *l, float *out) {
    if (l->rim == 1)
        filter_rows(values, l, 3, out);
    else
        filter_rows(values, l, 2 * SHD_FRINGE + 1, out);
}

static void gather_samples(const float *values, const uint16_t *place, size_t values_count,
                           size_t count, int samples, float *out) {
    const double share = 1.0 / samples;
    double sums[SHD_TILE_PIXELS];
    for (size_t i = 0; i < count; i++) sums[i] = 0;
    for (size_t i = 0; i < values_count; i++) sums[place[i]] += (double)values[i];
    for (size_t i = 0; i < count; i++) out[i] = (float)(sums[i] * share);
}

/* ---- Bounds: sixteen lanes each on its own, so that every vector width does the same. ---- */

enum { LANES = 16, VECTORS = LANES / SHD_W };

static float most_of_lanes(const shd_vf v[VECTORS]) {
    float lanes[LANES];
    memcpy(lanes, v, sizeof lanes);
    for (int k = 1; k < LANES; k++) lanes[0] = lanes[k] > lanes[0] ? lanes[k] : lanes[0];
    return lanes[0];
}

/* The rest after whole groups of lanes is met as the last group, which repeats some values. */
static void bound_axis(const float *values, size_t count, float *low, float *high) {
    if (count < LANES) {
        *low = *high = values[0];
        for (size_t i = 1; i < count; i++) {
            *low = values[i] < *low ? values[i] : *low;
            *high = values[i] > *high ? values[i] : *high;
        }
        return;
    }
    shd_vf least[VECTORS], most[VECTORS];
    /* The least value is the most of the negated ones. */
    for (int k = 0; k < VECTORS; k++) {
        most[k] = shd_vf_load(values + k * SHD_W);
        least[k] = -most[k];
    }
    for (size_t done = LANES; done < count; done += LANES) {
        const float *at = values + (done + LANES <= count ? done : count - LANES);
        for (int k = 0; k < VECTORS; k++) {
            const shd_vf v = shd_vf_load(at + k * SHD_W);
            least[k] = shd_vf_max(-v, least[k]);
            most[k] = shd_vf_max(v, most[k]);
        }
    }
    *low = -most_of_lanes(least);
    *high = most_of_lanes(most);
}

static float sum_axis(const float *values, size_t count) {
    shd_vf sums[VECTORS];
    for (int k = 0; k < VECTORS; k++) sums[k] = shd_vf_set(0);
    size_t i = 0;
    for (; i + LANES <= count; i += LANES)
        for (int k = 0; k < VECTORS; k++) sums[k] += shd_vf_load(values + i + (size_t)k * SHD_W);
    float lanes[LANES], sum = 0;
    memcpy(lanes, sums, sizeof lanes);
    for (; i < count; i++) sum += values[i];
    for (int k = 0; k < LANES; k++) sum += lanes[k];
    return sum;
}

static void bound_points(const float *const position[3], const float *const normal[3], size_t count,
                         float low[3], float high[3], float sum[3]) {
    for (int c = 0; c < 3; c++) {
        bound_axis(position[c], count, &low[c], &high[c]);
        sum[c] = sum_axis(normal[c], count);
    }
}

static float spread_normals(const float *const normal[3], const float axis[3], size_t count) {
    float least = 1;
    if (count < LANES) {
        for (size_t i = 0; i < count; i++) {
            const float cosine =
                normal[0][i] * axis[0] + normal[1][i] * axis[1] + normal[2][i] * axis[2];
            least = cosine < least ? cosine : least;
        }
        return least;
    }
    const shd_vf x = shd_vf_set(axis[0]), y = shd_vf_set(axis[1]), z = shd_vf_set(axis[2]);
    shd_vf all[VECTORS]; /* negated */
    for (int k = 0; k < VECTORS; k++) all[k] = shd_vf_set(-1);
    for (size_t done = 0; done < count; done += LANES) {
        const size_t at = done + LANES <= count ? done : count - LANES;
        for (int k = 0; k < VECTORS; k++) {
            const size_t i = at + (size_t)k * SHD_W;
            const shd_vf cosine = shd_vf_load(normal[0] + i) * x + shd_vf_load(normal[1] + i) * y +
                                  shd_vf_load(normal[2] + i) * z;
            all[k] = shd_vf_max(-cosine, all[k]);
        }
    }
    return -most_of_lanes(all);
}

const shd_paint_kernel SHD_VARIANT(shd_paint_kernel) = {
    mix_terms,     fill_values,   scatter_values, fill_rest,    divide_values, average_samples,
    weigh_samples, filter_values, gather_samples, bound_points, spread_normals};
