/* Blocks of tables of environments: how they are laid out, and filled. */
#include "shade/prefilter_parts.h"

bool shd_prefilter_serves(double exponent, bool lobe) {
    return lobe ? exponent >= 2 && exponent <= 4096 : exponent == 1;
}

/* A fifth of the width of usual lobes between nodes, never wider than a texel. */
static int columns_of(double exponent) {
    return exponent <= 72 ? 256 : exponent <= 300 ? 512 : 1024;
}

static int cell_rows_of(double exponent) {
    return (int)fmax(80, ceil(4.5 * SHD_PI * sqrt(fmin(exponent, 1000))));
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
    out->cell_stride =
        lobe ? padded_to((cells + SHD_CELL_LANES) * sizeof(float)) / sizeof(float) : 0;
    out->table_at = padded_to(sizeof *out);
    const size_t nodes = (size_t)(out->columns + 4) * (size_t)(out->rows + 4);
    out->starts_at = out->table_at + padded_to(3 * nodes * sizeof(float));
    out->rows_at = out->starts_at + padded_to(((size_t)out->cell_rows + 1) * sizeof(uint32_t));
    out->cells_at = out->rows_at + padded_to((size_t)out->cell_rows * sizeof(shd_row_place));
    out->hot_count = (int32_t)(cells < SHD_HOT_MOST ? cells : SHD_HOT_MOST);
    out->watched = (int32_t)(cells < SHD_WATCHED_MOST ? cells : SHD_WATCHED_MOST);
    out->hot_parts = SHD_HOT_PARTS;
    out->hot_at = out->cells_at + padded_to(SHD_CELL_ROWS * out->cell_stride * sizeof(float));
    out->contrast_at = out->hot_at + padded_to((size_t)out->watched * sizeof(uint32_t));
    out->hot_cells_at = out->contrast_at + padded_to((size_t)out->watched * sizeof(float));
    const size_t small = SHD_CELL_ROWS * SHD_HOT_PARTS * SHD_HOT_PARTS * sizeof(float);
    out->bytes = out->hot_cells_at + padded_to((size_t)out->hot_count * small);
}

size_t shd_prefilter_size(double exponent, bool lobe) {
    shd_prefilter counted;
    lay_out(exponent, lobe, &counted);
    return counted.bytes;
}

size_t shd_prefilter_scratch(double exponent) {
    return shd_filter_scratch(exponent, columns_of(exponent));
}

/* ---- Making. ---- */

/* The kernel at 1 - L.W: the power, and what a cell's mean of it is above its middle's value, by
 * its second derivatives. The lobe ends where it is 3e-5. */
static double kernel_at(const shd_prefilter *t, double u) {
    const double n = t->exponent, h = (double)t->cell_step,
                 x = fmax(1 - (double)t->reach * u, 1e-9),
                 laplace = n * ((n - 1) * (1 - x * x) / (x * x) - 2);
    return pow(x, n) * (1 + fmin(fmax(h * h / 24 * laplace, -0.5), 1)) / SHD_PI;
}

/* Its 16th root is nearly straight: a polynomial through Chebyshev's points, by Newton's divided
 * differences, has it to 1e-6. */
static void make_kernel(shd_prefilter *t) {
    enum { N = SHD_KERNEL_TERMS };
    double at[N], f[N], out[N] = {0};
    t->reach = (float)(1 - pow(3e-5, 1 / t->exponent));
    t->half = t->cell_step / 2;
    for (int k = 0; k < N; k++) {
        at[k] = (1 - cos(SHD_PI * (k + 0.5) / N)) / 2;
        f[k] = pow(kernel_at(t, at[k]), 1.0 / 16);
    }
    for (int order = 1; order < N; order++)
        for (int k = N - 1; k >= order; k--) f[k] = (f[k] - f[k - 1]) / (at[k] - at[k - order]);
    for (int k = N - 1; k >= 0; k--) { /* out = out (u - at[k]) + f[k] */
        for (int i = N - 1; i > 0; i--) out[i] = out[i - 1] - at[k] * out[i];
        out[0] = f[k] - at[k] * out[0];
    }
    for (int k = 0; k < N; k++) t->kernel[k] = (float)out[k];
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
    return shd_filter_map(map, out, cancelled, scratch) && shd_measure_filter(map, out, cancelled);
}
