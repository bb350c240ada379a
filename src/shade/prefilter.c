#include "shade/prefilter.h"

#include <string.h>

#include "shade/prefilter_parts.h"

/* Cubic interpolation between the second and the third of four nodes. */
static void weigh_nodes(float t, float w[4]) {
    const float a = t + 1, b = t, c = 1 - t, d = 2 - t;
    w[0] = -b * c * d / 6;
    w[1] = a * c * d / 2;
    w[2] = a * b * d / 2;
    w[3] = -a * b * c / 6;
}

static void look_up(const shd_prefilter *t, shd_vec3 w, double out[3]) {
    const double turn = atan2(-w.x, w.z), down = atan2(hypot(w.x, w.z), w.y);
    const double u = (turn < 0 ? turn + 2 * SHD_PI : turn) * t->columns / (2 * SHD_PI) + 1.5,
                 v = down * t->rows / SHD_PI + 1.5;
    const int i = (int)u, j = (int)v;
    const size_t wide = (size_t)t->columns + 4;
    const float *node = shd_table_of(t) + 3 * ((size_t)(j - 1) * wide + (size_t)(i - 1));
    float across[4], along[4], sum[3] = {0, 0, 0};
    weigh_nodes((float)(u - i), across);
    weigh_nodes((float)(v - j), along);
    for (int k = 0; k < 4; k++, node += 3 * wide)
        for (int c = 0; c < 3; c++)
            sum[c] += along[k] * (across[0] * node[c] + across[1] * node[3 + c] +
                                  across[2] * node[6 + c] + across[3] * node[9 + c]);
    for (int c = 0; c < 3; c++) out[c] = (double)sum[c];
}

/* Four cells beside each other, of any machine. */
typedef float four __attribute__((vector_size(16)));
typedef int32_t four_masks __attribute__((vector_size(16)));

static inline four all_of(float x) {
    return (four){x, x, x, x};
}

static inline four load_four(const float *at) {
    four out;
    memcpy(&out, at, sizeof out);
    return out;
}

static inline four keep_where(four_masks where, four x) {
    return (four)(where & (four_masks)x);
}

typedef struct lanes {
    four sum[3];
} lanes;

/* Adds `count` cells from `x` on, of half the width `half`, that are below the horizon n.x < 0, as
 * far as the lobe reaches. Cells on the horizon count by about the share of them that is below. */
static void add_cells(const shd_prefilter *t, const float *x, size_t stride, float half,
                      size_t count, const float w[3], const float n[3], lanes *to) {
    const four over = all_of(0.5F / half), inverse = all_of(1 / t->reach), one = all_of(1);
    four sum[3] = {to->sum[0], to->sum[1], to->sum[2]};
    for (size_t i = 0; i < count; i += 4, x += 4) {
        const four at[3] = {load_four(x), load_four(x + stride), load_four(x + 2 * stride)};
        const four height = n[0] * at[0] + n[1] * at[1] + n[2] * at[2],
                   off = (one - (w[0] * at[0] + w[1] * at[1] + w[2] * at[2])) * inverse;
        const int32_t left = (int32_t)(count - i);
        four below = all_of(0.5F) - height * over;
        below = keep_where(below > 0, below);
        below = keep_where(below < one, below) + keep_where(below >= one, one);
        const four u = keep_where(off > 0, off);
        four by = all_of(t->kernel[SHD_KERNEL_TERMS - 1]);
        for (int k = SHD_KERNEL_TERMS - 2; k >= 0; k--) by = by * u + t->kernel[k];
        by *= by;
        by *= by;
        by *= by;
        by *= by * below;
        by = keep_where((u < one) & ((four_masks){0, 1, 2, 3} < left), by);
        for (size_t c = 0; c < 3; c++) sum[c] += by * load_four(x + (3 + c) * stride);
    }
    for (int c = 0; c < 3; c++) to->sum[c] = sum[c];
}

/* The same of a row, from cell `from` on, around it. */
static void add_row(const shd_prefilter *t, int row, int from, int many, const float w[3],
                    const float n[3], lanes *to) {
    const uint32_t *starts = shd_starts_of(t);
    const int count = (int)(starts[row + 1] - starts[row]);
    while (from < 0) from += count;
    while (from >= count) from -= count;
    const int straight = many < count - from ? many : count - from;
    const float *cells = shd_cells_of(t) + starts[row];
    const size_t stride = t->cell_stride;
    add_cells(t, cells + from, stride, t->half, (size_t)straight, w, n, to);
    if (many > straight) add_cells(t, cells, stride, t->half, (size_t)(many - straight), w, n, to);
}

/* Takes smaller cells for those that the horizon crosses, if they have some. */
static void add_hot(const shd_prefilter *t, const float w[3], const float n[3], lanes *to) {
    const uint32_t *hot = shd_hot_of(t);
    const float *cells = shd_cells_of(t), *smaller = shd_hot_cells_of(t);
    const size_t stride = t->cell_stride, parts = (size_t)t->hot_parts, small = parts * parts;
    lanes whole = {{{0}, {0}, {0}}};
    for (int k = 0; k < t->hot_count; k++, smaller += SHD_CELL_ROWS * small) {
        const float *x = cells + hot[k];
        const float height = n[0] * x[0] + n[1] * x[stride] + n[2] * x[2 * stride];
        /* Its direction is where its radiance is: corners are within three times that. */
        if (fabsf(height) > 3 * t->half) continue;
        if (1 - (w[0] * x[0] + w[1] * x[stride] + w[2] * x[2 * stride]) >= t->reach) continue;
        add_cells(t, x, stride, t->half, 1, w, n, &whole);
        add_cells(t, smaller, small, t->half / (float)parts, small, w, n, to);
    }
    for (int c = 0; c < 3; c++) to->sum[c] -= whole.sum[c];
}

/* To 7e-5 (M. Abramowitz and I. Stegun, Handbook of Mathematical Functions, 4.4.45), which is a
 * hundredth of the least cell. */
static double about_acos(double x) {
    const double z = fabs(x), y = sqrt(fmax(1 - z, 0)) *
                                  (1.5707288 + z * (-0.2121144 + z * (0.0742610 - z * 0.0187293)));
    return x < 0 ? SHD_PI - y : y;
}

/* An arc of longitudes around the middle: half of its width; 0: there is none; pi: all. It is where
 * flat + round cos(longitude) > 0. */
static double half_arc(double flat, double round) {
    return flat <= -round ? 0 : flat >= round ? SHD_PI : about_acos(-flat / round);
}

void shd_prefilter_cut(const shd_prefilter *t, shd_vec3 w, shd_vec3 normal, double out[3]) {
    const float wf[3] = {(float)w.x, (float)w.y, (float)w.z},
                nf[3] = {(float)normal.x, (float)normal.y, (float)normal.z};
    const uint32_t *starts = shd_starts_of(t);
    const shd_row_place *rows = shd_rows_of(t);
    const double turn = atan2(-w.x, w.z), away = hypot(w.x, w.z), aside = hypot(normal.x, normal.z),
                 down = atan2(away, w.y), least = 1 - (double)t->reach,
                 reach = acos(fmax(least, -1)), step = (double)t->cell_step;
    /* Cells below the horizon are around the longitude opposite to the normal's, `apart` away. */
    double apart = atan2(normal.x, -normal.z) - turn;
    apart -= apart > SHD_PI ? 2 * SHD_PI : apart < -SHD_PI ? -2 * SHD_PI : 0;
    const int first = (int)fmax(floor((down - reach) / step - 0.5), 0),
              last = (int)fmin(ceil((down + reach) / step - 0.5), t->cell_rows - 1);
    lanes all = {{{0}, {0}, {0}}};
    for (int j = first; j <= last; j++) {
        const int count = (int)(starts[j + 1] - starts[j]);
        const double per = count / (2 * SHD_PI), y = rows[j].cosine, x = rows[j].sine,
                     seen = half_arc(y * w.y - least, x * away),
                     below = half_arc((double)t->half - y * normal.y, x * aside);
        if (!(seen > 0) || !(below > 0)) continue;
        double from = -seen, to = seen;
        /* Unless the arcs meet at both of their ends, they have one in common. */
        if (below < SHD_PI && fabs(apart) + seen + below < 2 * SHD_PI) {
            from = fmax(from, apart - below);
            to = fmin(to, apart + below);
            if (from > to) continue;
        }
        /* Both are within two turns of 0. */
        const int around = 4 * count, begin = (int)((turn + from) * per - 0.5 + around) - around,
                  many = (int)((turn + to) * per + 0.5 + around) - around - begin + 1;
        add_row(t, j, begin, many < count ? many : count, wf, nf, &all);
    }
    add_hot(t, wf, nf, &all);
    for (int c = 0; c < 3; c++) {
        out[c] = 0;
        for (int l = 0; l < 4; l++) out[c] += (double)all.sum[c][l];
    }
}

/* What is below the horizon is no more than the brightest times half of the lobe times the n-th
 * power of the cosine of the way from W to the horizon: (L.W)^n over the half sphere is the product
 * of a power of latitude and one of longitude, cos(a + b) <= cos a cos b, and so the part beyond a
 * is cos^n a of a half at most. */
void shd_prefilter_weigh(const shd_prefilter *t, shd_vec3 w, const shd_vec3 *normal,
                         double out[3]) {
    if (!normal) {
        look_up(t, w, out);
        return;
    }
    const double height = shd_dot(w, *normal);
    if (height <= 0) { /* the smaller part is before the surface */
        const double near = (1 - height) * (1 + height);
        out[0] = out[1] = out[2] = 0;
        if (t->most * pow(fmax(near, 0), t->exponent / 2) > t->faint * (t->exponent + 1))
            shd_prefilter_cut(t, w, shd_scale(*normal, -1), out);
        return;
    }
    look_up(t, w, out);
    const double near = fmax((1 - height) * (1 + height), 0);
    if (t->most * pow(near, t->exponent / 2) <= t->faint * (t->exponent + 1)) return;
    double cut[3];
    shd_prefilter_cut(t, w, *normal, cut);
    for (int c = 0; c < 3; c++) out[c] = fmax(out[c] - cut[c], 0);
}
