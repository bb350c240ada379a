#include "shade/prefilter.h"

#include <string.h>

#include "shade/prefilter_parts.h"

/* ---- The block. ---- */

bool shd_prefilter_serves(double exponent, bool lobe) {
    return lobe ? exponent >= 2 && exponent <= 8192 : exponent == 1;
}

/* A fifth of the width of usual lobes between nodes, never wider than a texel. */
static int columns_of(double exponent) {
    return exponent <= 72 ? 256 : exponent <= 300 ? 512 : exponent <= 4096 ? 1024 : 2048;
}

static int cell_rows_of(double exponent) {
    return (int)fmax(80, ceil(4.5 * SHD_PI * sqrt(fmin(exponent, 1000))));
}

int shd_cells_in_row(int rows, int row) {
    return (int)ceil(2 * rows * sin(SHD_PI * (row + 0.5) / rows));
}

static size_t padded_to(size_t bytes) {
    return (bytes + 63) / 64 * 64;
}

static void lay_out(double exponent, bool lobe, shd_prefilter *out) {
    *out = (shd_prefilter){.exponent = exponent,
                           .columns = columns_of(exponent),
                           .rows = columns_of(exponent) / 2,
                           .cell_rows = lobe ? cell_rows_of(exponent) : 0};
    size_t cells = 0;
    for (int j = 0; j < out->cell_rows; j++) cells += (size_t)shd_cells_in_row(out->cell_rows, j);
    out->cell_step = lobe ? (float)(SHD_PI / out->cell_rows) : 0;
    out->kernel_at = padded_to(sizeof *out);
    out->table_at = out->kernel_at + padded_to((SHD_KERNEL_STEPS + 2) * sizeof(float));
    const size_t nodes = (size_t)(out->columns + 4) * (size_t)(out->rows + 4);
    out->starts_at = out->table_at + padded_to(3 * nodes * sizeof(float));
    out->cells_at = out->starts_at + padded_to(((size_t)out->cell_rows + 1) * sizeof(uint32_t));
    out->bytes = out->cells_at + padded_to(cells * sizeof(shd_cell));
}

size_t shd_prefilter_size(double exponent, bool lobe) {
    shd_prefilter counted;
    lay_out(exponent, lobe, &counted);
    return counted.bytes;
}

size_t shd_prefilter_scratch(double exponent) {
    return shd_filter_scratch(columns_of(exponent));
}

/* ---- Reading. ---- */

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

/* Adds a row's cells from `first` on, around the row, that are below the horizon n.x < 0, as far as
 * the lobe reaches. Cells on the horizon count by about the share of them that is below. */
static void add_cells(const shd_prefilter *t, const shd_cell *row, int count, int first, int many,
                      const float w[3], const float n[3], float sum[3]) {
    const float *kernel = shd_kernel_of(t), scale = SHD_KERNEL_STEPS / t->reach, half = t->half,
                over = 0.5f / half;
    int i = first % count;
    if (i < 0) i += count;
    for (int k = 0; k < many; k++, i = i + 1 == count ? 0 : i + 1) {
        const shd_cell *cell = &row[i];
        const float height = n[0] * cell->at[0] + n[1] * cell->at[1] + n[2] * cell->at[2];
        if (height >= half) continue;
        const float off =
            1 - (w[0] * cell->at[0] + w[1] * cell->at[1] + w[2] * cell->at[2]);
        if (off >= t->reach) continue;
        const float at = off > 0 ? off * scale : 0;
        const int step = (int)at;
        float by = kernel[step] + (at - (float)step) * (kernel[step + 1] - kernel[step]);
        if (height > -half) by *= 0.5f - height * over;
        for (int c = 0; c < 3; c++) sum[c] += by * cell->flux[c];
    }
}

void shd_prefilter_cut(const shd_prefilter *t, shd_vec3 w, shd_vec3 normal, double out[3]) {
    const float wf[3] = {(float)w.x, (float)w.y, (float)w.z},
                nf[3] = {(float)normal.x, (float)normal.y, (float)normal.z};
    const uint32_t *starts = shd_starts_of(t);
    const shd_cell *cells = shd_cells_of(t);
    const double down = atan2(hypot(w.x, w.z), w.y), turn = atan2(-w.x, w.z),
                 least = 1 - (double)t->reach, reach = acos(fmax(least, -1)),
                 step = (double)t->cell_step, cosine = cos(down), sine = sin(down);
    const int first = (int)fmax(floor((down - reach) / step - 0.5), 0),
              last = (int)fmin(ceil((down + reach) / step - 0.5), t->cell_rows - 1);
    float sum[3] = {0, 0, 0};
    for (int j = first; j <= last; j++) {
        const int count = (int)(starts[j + 1] - starts[j]);
        const double row = (j + 0.5) * step, aside = sin(row) * sine,
                     side = least - cos(row) * cosine;
        int from = 0, many = count;
        if (side >= aside) continue;
        if (side > -aside) {
            const double half = acos(side / aside), per = count / (2 * SHD_PI);
            from = (int)floor((turn - half) * per - 0.5);
            many = (int)ceil((turn + half) * per - 0.5) - from + 1;
            if (many > count) many = count;
        }
        add_cells(t, cells + starts[j], count, from, many, wf, nf, sum);
    }
    for (int c = 0; c < 3; c++) out[c] = (double)sum[c];
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

/* ---- Making. ---- */

/* The kernel at 1 - L.W: the power, and what a cell's mean of it is above its middle's value, by
 * its second derivatives. The lobe ends where it is 3e-5. */
static void make_kernel(shd_prefilter *t) {
    float *kernel = (float *)(void *)((char *)t + t->kernel_at);
    const double n = t->exponent, least = pow(3e-5, 1 / n), h = (double)t->cell_step;
    t->reach = (float)(1 - least);
    t->half = t->cell_step / 2;
    for (int k = 0; k < SHD_KERNEL_STEPS + 2; k++) {
        const double x = fmax(1 - (double)t->reach * k / SHD_KERNEL_STEPS, 1e-9),
                     laplace = n * ((n - 1) * (1 - x * x) / (x * x) - 2);
        kernel[k] = (float)(pow(x, n) * (1 + fmax(h * h / 24 * laplace, -0.5)) / SHD_PI);
    }
}

bool shd_prefilter_make(const shd_surroundings *map, double exponent, bool lobe,
                        const atomic_bool *cancelled, void *scratch, shd_prefilter *out) {
    lay_out(exponent, lobe, out);
    out->most = map->most;
    out->faint = 2e-5 * shd_surroundings_most(map, exponent);
    if (lobe) {
        make_kernel(out);
        if (!shd_make_cells(map, out, cancelled)) return false;
    }
    return shd_filter_map(map, out, cancelled, scratch) &&
           shd_measure_filter(map, out, cancelled);
}
