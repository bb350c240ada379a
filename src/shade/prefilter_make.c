/* How tables of environments are made. */
#include <string.h>

#include "shade/gauss.h"
#include "shade/power.h"
#include "shade/prefilter_parts.h"

/* ---- Radiance over parts of the sphere. ---- */

/* A part of a row of texels' middles: texels [width][3] at a latitude. */
static void blend_rows(const shd_surroundings *map, double down, float *row) {
    const double y = fmin(fmax(down * map->height / SHD_PI - 0.5, 0), map->height - 1);
    const int top = (int)y, below = top + 1 < map->height ? top + 1 : top;
    const float t = (float)(y - top);
    const size_t n = 3 * (size_t)map->width;
    const float *a = map->texels + n * (size_t)top, *b = map->texels + n * (size_t)below;
    for (size_t k = 0; k < n; k++) row[k] = a[k] + t * (b[k] - a[k]);
}

static void add_from_row(const shd_surroundings *map, const float *row, double turn, double by,
                         double sum[3]) {
    const int w = map->width;
    const double x = turn * w / (2 * SHD_PI) - 0.5 + w;
    const int left = (int)x;
    const double s = x - left;
    const float *a = row + 3 * (left % w), *b = row + 3 * ((left + 1) % w);
    for (int c = 0; c < 3; c++) sum[c] += by * ((1 - s) * (double)a[c] + s * (double)b[c]);
}

enum { WIDEST = 2048 };

/* Integrals over `count` equal parts of the band from `top` to `bottom`: out [count][3]. */
static void sum_band(const shd_surroundings *map, double top, double bottom, int count,
                     double (*out)[3]) {
    float row[3 * WIDEST];
    const double texel = SHD_PI / map->height, wide = 2 * SHD_PI / count;
    const int down = 1 + (int)((bottom - top) / texel * 1.5),
              across = 1 + (int)(wide / (2 * SHD_PI / map->width) * 1.5);
    memset(out, 0, (size_t)count * sizeof *out);
    for (int d = 0; d < 2 * down; d++) {
        const shd_gauss_node g = shd_gauss2[d & 1];
        const double at = top + (bottom - top) * (d / 2 + g.at) / down,
                     by = (bottom - top) / down * g.weight * sin(at);
        blend_rows(map, at, row);
        for (int i = 0; i < count; i++)
            for (int a = 0; a < 2 * across; a++) {
                const shd_gauss_node e = shd_gauss2[a & 1];
                add_from_row(map, row, wide * (i + (a / 2 + e.at) / across),
                             by * wide / across * e.weight, out[i]);
            }
    }
}

/* By how much the brightest channel of texels in and around a cell differs, times its size. */
static float contrast_of(const shd_surroundings *map, double top, double bottom, double left,
                         double right) {
    const int h = map->height, w = map->width;
    const int j0 = (int)floor(top * h / SHD_PI - 0.5), j1 = (int)ceil(bottom * h / SHD_PI - 0.5),
              i0 = (int)floor(left * w / (2 * SHD_PI) - 0.5),
              i1 = (int)ceil(right * w / (2 * SHD_PI) - 0.5);
    float low = INFINITY, high = 0;
    for (int j = j0 < 0 ? 0 : j0; j <= j1 && j < h; j++)
        for (int i = i0; i <= i1; i++) {
            const float *t = map->texels + 3 * (j * w + (i + w) % w);
            const float most = fmaxf(t[0], fmaxf(t[1], t[2]));
            low = fminf(low, most);
            high = fmaxf(high, most);
        }
    return (high - low) * (float)((bottom - top) * (right - left) * sin((top + bottom) / 2));
}

/* The hottest cells so far, the hottest first. */
typedef struct hot_list {
    int count, most;
    float contrast[SHD_WATCHED_MOST];
    uint32_t cell[SHD_WATCHED_MOST];
} hot_list;

static void note_hot(hot_list *list, float contrast, uint32_t cell) {
    if (list->count == list->most && contrast <= list->contrast[list->most - 1]) return;
    int at = list->count < list->most ? list->count++ : list->most - 1;
    for (; at > 0 && list->contrast[at - 1] < contrast; at--) {
        list->contrast[at] = list->contrast[at - 1];
        list->cell[at] = list->cell[at - 1];
    }
    list->contrast[at] = contrast;
    list->cell[at] = cell;
}

/* Cuts a cell into smaller ones: out[SHD_CELL_ROWS][parts^2]. */
static void cut_cell(const shd_surroundings *map, const shd_prefilter *t, int row, uint32_t column,
                     float *out) {
    const uint32_t *starts = shd_starts_of(t);
    const int parts = t->hot_parts;
    const size_t small = (size_t)parts * (size_t)parts;
    const double wide = 2 * SHD_PI / (starts[row + 1] - starts[row]), high = SHD_PI / t->cell_rows;
    float line[3 * WIDEST];
    memset(out, 0, SHD_CELL_ROWS * small * sizeof *out);
    for (int j = 0; j < parts; j++) {
        const double top = high * (row + (double)j / parts), down = top + high / parts / 2;
        for (int g = 0; g < 2; g++) {
            const double at = top + high / parts * shd_gauss2[g].at;
            blend_rows(map, at, line);
            for (int i = 0; i < parts; i++) {
                const size_t to = (size_t)(j * parts + i);
                const double left = wide * (column + (double)i / parts);
                double sum[3] = {0, 0, 0};
                for (int e = 0; e < 2; e++)
                    add_from_row(map, line, left + wide / parts * shd_gauss2[e].at,
                                 sin(at) * wide * high / (4.0 * parts * parts), sum);
                for (size_t c = 0; c < 3; c++)
                    out[(SHD_CELL_FLUX + c) * small + to] += (float)sum[c];
                const double turn = left + wide / parts / 2;
                out[to] = (float)(-sin(down) * sin(turn));
                out[small + to] = (float)cos(down);
                out[2 * small + to] = (float)(sin(down) * cos(turn));
            }
        }
    }
}

/* A hot cell's direction is where its radiance is. */
static void move_cell(const float *smaller, size_t small, float *cell, size_t stride) {
    double sum[3] = {0, 0, 0}, all = 0;
    for (size_t k = 0; k < small; k++) {
        double by = 0;
        for (size_t c = 0; c < 3; c++) by += (double)smaller[(SHD_CELL_FLUX + c) * small + k];
        for (size_t c = 0; c < 3; c++) sum[c] += by * (double)smaller[c * small + k];
        all += by;
    }
    const double length = sqrt(sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]);
    for (size_t c = 0; c < 3 && all > 0; c++) cell[c * stride] = (float)(sum[c] / length);
}

static void cut_hot(const shd_surroundings *map, const hot_list *list, shd_prefilter *t) {
    memcpy((char *)t + t->hot_at, list->cell, (size_t)list->count * sizeof *list->cell);
    memcpy((char *)t + t->contrast_at, list->contrast,
           (size_t)list->count * sizeof *list->contrast);
    t->watched = list->count;
    float *cells = (float *)(void *)((char *)t + t->hot_cells_at);
    const uint32_t *starts = shd_starts_of(t);
    const size_t size = SHD_CELL_ROWS * (size_t)t->hot_parts * (size_t)t->hot_parts;
    for (int k = 0; k < t->hot_count; k++) {
        int row = 0;
        while (starts[row + 1] <= list->cell[k]) row++;
        cut_cell(map, t, row, list->cell[k] - starts[row], cells + (size_t)k * size);
        move_cell(cells + (size_t)k * size, size / SHD_CELL_ROWS,
                  (float *)(void *)((char *)t + t->cells_at) + list->cell[k], t->cell_stride);
    }
}

bool shd_make_cells(const shd_surroundings *map, shd_prefilter *t, const atomic_bool *cancelled) {
    uint32_t *starts = (uint32_t *)(void *)((char *)t + t->starts_at);
    float *cells = (float *)(void *)((char *)t + t->cells_at);
    const size_t stride = t->cell_stride;
    shd_row_place *places = (shd_row_place *)(void *)((char *)t + t->rows_at);
    const int rows = t->cell_rows;
    double band[2 * WIDEST][3];
    hot_list hot = {.most = t->watched};
    starts[0] = 0;
    memset(cells, 0, SHD_CELL_ROWS * stride * sizeof *cells);
    for (int j = 0; j < rows; j++) {
        if (shd_is_cancelled(cancelled)) return false;
        const int count = shd_cells_in_row(rows, j);
        const double top = SHD_PI * j / rows, down = SHD_PI * (j + 0.5) / rows;
        sum_band(map, top, top + SHD_PI / rows, count, band);
        places[j] = (shd_row_place){cos(down), sin(down)};
        starts[j + 1] = starts[j] + (uint32_t)count;
        for (int i = 0; i < count; i++) {
            const double turn = 2 * SHD_PI * (i + 0.5) / count, wide = 2 * SHD_PI / count;
            note_hot(&hot, contrast_of(map, top, top + SHD_PI / rows, wide * i, wide * (i + 1)),
                     starts[j] + (uint32_t)i);
            float *cell = cells + starts[j] + i;
            cell[0] = (float)(-sin(down) * sin(turn));
            cell[stride] = (float)cos(down);
            cell[2 * stride] = (float)(sin(down) * cos(turn));
            for (size_t c = 0; c < 3; c++) cell[(SHD_CELL_FLUX + c) * stride] = (float)band[i][c];
        }
    }
    cut_hot(map, &hot, t);
    return true;
}

/* ---- The transform. ---- */

typedef struct wave {
    float re, im;
} wave;

typedef struct filter {
    int n;       /* columns, a power of 2 */
    int waves;   /* so many have any part of the power, the first of n / 2 + 1 */
    int around;  /* samples of the power around the axis: a power of 2, enough for these */
    wave *turns; /* [n / 2] */
    wave *work;  /* [n] */
    wave *map;   /* [n / 2 rows][3][waves] */
    wave *sums;  /* the same, of the table */
    double (*band)[3];
} filter;

/* Along a row the power is no narrower than exp(-n t^2 / 2), whose waves beyond 7 sqrt(n) are less
 * than 1e-10 of it. Low powers end in an edge, and have all. */
static int count_waves(double exponent, int n) {
    const double most = 7 * sqrt(exponent) + 1;
    return exponent > 72 && most < n / 2 ? (int)most + 1 : n / 2 + 1;
}

static size_t take(char **at, size_t bytes) {
    bytes = (bytes + 63) / 64 * 64;
    if (at) *at += bytes;
    return bytes;
}

static size_t lay_out_filter(double exponent, int n, char *memory, filter *f) {
    const size_t w = sizeof(wave), rows = (size_t)n / 2;
    char *at = memory;
    f->n = n;
    f->waves = count_waves(exponent, n);
    f->around = n;
    while (f->around >= 4 * (f->waves - 1)) f->around /= 2;
    f->turns = (wave *)(void *)at;
    size_t bytes = take(&at, (size_t)n / 2 * w);
    f->work = (wave *)(void *)at;
    bytes += take(&at, (size_t)n * w);
    f->map = (wave *)(void *)at;
    bytes += take(&at, rows * 3 * (size_t)f->waves * w);
    f->sums = (wave *)(void *)at;
    bytes += take(&at, rows * 3 * (size_t)f->waves * w);
    f->band = (double(*)[3])(void *)at;
    return bytes + take(&at, (size_t)n * sizeof *f->band);
}

size_t shd_filter_scratch(double exponent, int columns) {
    static char none[64];
    filter counted;
    return lay_out_filter(exponent, columns, none, &counted);
}

/* The discrete Fourier transform of the first n of work in place, or times n its inverse's
 * conjugate. */
static void transform(const filter *f, int n) {
    wave *x = f->work;
    for (int i = 1, j = 0; i < n; i++) {
        int bit = n >> 1;
        for (; j & bit; bit >>= 1) j ^= bit;
        j ^= bit;
        if (i < j) {
            const wave kept = x[i];
            x[i] = x[j];
            x[j] = kept;
        }
    }
    for (int half = 1; half < n; half *= 2) {
        const int step = f->n / 2 / half;
        for (int i = 0; i < n; i += 2 * half)
            for (int k = 0; k < half; k++) {
                const wave w = f->turns[k * step], a = x[i + k], b = x[i + k + half];
                const wave by = {b.re * w.re - b.im * w.im, b.re * w.im + b.im * w.re};
                x[i + k] = (wave){a.re + by.re, a.im + by.im};
                x[i + k + half] = (wave){a.re - by.re, a.im - by.im};
            }
    }
}

static void transform_map(const shd_surroundings *map, const filter *f) {
    const int n = f->n, waves = f->waves;
    for (int j = 0; j < n / 2; j++) {
        sum_band(map, 2 * SHD_PI * j / n, 2 * SHD_PI * (j + 1) / n, n, f->band);
        for (int c = 0; c < 3; c++) {
            for (int i = 0; i < n; i++) f->work[i] = (wave){(float)f->band[i][c], 0};
            transform(f, n);
            memcpy(f->map + ((size_t)j * 3 + (size_t)c) * (size_t)waves, f->work,
                   (size_t)waves * sizeof(wave));
        }
    }
}

/* The power between two latitudes, by the difference of longitudes, to one part of f->work. */
static void put_kernel(const filter *f, const shd_power *power, double least, double from,
                       double to, bool second) {
    const int n = f->around;
    const double same = cos(from) * cos(to), turned = sin(from) * sin(to);
    bool any = true;
    for (int i = 0; i <= n / 2; i++) {
        const double x = same + turned * cos(2 * SHD_PI * i / n);
        float value = 0;
        any = any && x > least;
        if (any) value = (float)(shd_power_of(power, x) / SHD_PI);
        *(second ? &f->work[i].im : &f->work[i].re) = value;
        if (i > 0 && i < n / 2) *(second ? &f->work[n - i].im : &f->work[n - i].re) = value;
    }
}

/* Adds a row of the map, times the transform of the power, to one of the table. */
static void add_row(const filter *f, const float *by, int from, int to) {
    const size_t waves = (size_t)f->waves;
    const wave *in = f->map + (size_t)from * 3 * waves;
    wave *out = f->sums + (size_t)to * 3 * waves;
    for (size_t c = 0; c < 3; c++, in += waves, out += waves)
        for (size_t m = 0; m < waves; m++) {
            out[m].re += by[m] * in[m].re;
            out[m].im += by[m] * in[m].im;
        }
}

/* The power between rows a and b of either is that between b and a, and between those that are as
 * far from the other pole. */
static void add_pair(const filter *f, const float *by, int a, int b) {
    const int last = f->n / 2 - 1;
    const bool other = a + b != last;
    add_row(f, by, b, a);
    if (other) add_row(f, by, last - b, last - a);
    if (a == b) return;
    add_row(f, by, a, b);
    if (other) add_row(f, by, last - a, last - b);
}

/* Row a with rows b and b + 1 (or one). An even kernel's transform is real, so that those of two
 * rows fit in one. */
static void add_pairs(const filter *f, int a, int b, int count) {
    float by[2][WIDEST / 2 + 1];
    const float share = (float)(f->n / f->around);
    transform(f, f->around);
    for (int m = 0; m < f->waves; m++) {
        by[0][m] = share * f->work[m].re;
        by[1][m] = share * f->work[m].im;
    }
    for (int k = 0; k < count; k++) add_pair(f, by[k], a, b + k);
}

static void store_row(const filter *f, int row, shd_prefilter *t) {
    const int n = f->n;
    const size_t wide = (size_t)n + 4;
    float *out = (float *)(void *)((char *)t + t->table_at) + 3 * ((size_t)row + 2) * wide;
    for (size_t c = 0; c < 3; c++) {
        const wave *in = f->sums + ((size_t)row * 3 + c) * (size_t)f->waves;
        for (int m = 0; m < n; m++) { /* conjugate, so that the transform is its own inverse */
            const int at = m <= n / 2 ? m : n - m;
            const wave found = at < f->waves ? in[at] : (wave){0, 0};
            f->work[m] = (wave){found.re, m <= n / 2 ? -found.im : found.im};
        }
        transform(f, n);
        for (int i = 0; i < n + 4; i++)
            out[3 * (size_t)i + c] = f->work[(i - 2 + n) % n].re / (float)n;
    }
}

/* Beyond a pole the meridian goes on on the other side. */
static void repeat_rows(shd_prefilter *t) {
    const size_t n = (size_t)t->columns, wide = n + 4, rows = (size_t)t->rows;
    float *table = (float *)(void *)((char *)t + t->table_at);
    for (size_t k = 0; k < 2; k++) {
        const size_t to[2] = {1 - k, rows + 2 + k}, from[2] = {2 + k, rows + 1 - k};
        for (int end = 0; end < 2; end++)
            for (size_t i = 0; i < wide; i++)
                memcpy(table + 3 * (to[end] * wide + i),
                       table + 3 * (from[end] * wide + 2 + (i + n - 2 + n / 2) % n),
                       3 * sizeof(float));
    }
}

bool shd_filter_map(const shd_surroundings *map, shd_prefilter *t, const atomic_bool *cancelled,
                    void *scratch) {
    filter f;
    lay_out_filter(t->exponent, t->columns, scratch, &f);
    const int n = f.n, rows = n / 2;
    for (int k = 0; k < rows; k++)
        f.turns[k] = (wave){(float)cos(2 * SHD_PI * k / n), (float)-sin(2 * SHD_PI * k / n)};
    transform_map(map, &f);
    const shd_power power = shd_power_make(t->exponent);
    const double least = pow(1e-10, 1 / t->exponent), reach = acos(least);
    const int near = (int)ceil(reach * rows / SHD_PI) + 1;
    memset(f.sums, 0, (size_t)rows * 3 * (size_t)f.waves * sizeof *f.sums);
    for (int a = 0; 2 * a < rows; a++) {
        if (shd_is_cancelled(cancelled)) return false;
        const int last = a + near < rows - 1 - a ? a + near : rows - 1 - a;
        for (int b = a; b <= last; b += 2) {
            const int count = b < last ? 2 : 1;
            memset(f.work, 0, (size_t)f.around * sizeof *f.work);
            for (int k = 0; k < count; k++)
                put_kernel(&f, &power, least, SHD_PI * (a + 0.5) / rows,
                           SHD_PI * (b + k + 0.5) / rows, k);
            add_pairs(&f, a, b, count);
        }
    }
    for (int row = 0; row < rows; row++) store_row(&f, row, t);
    repeat_rows(t);
    return true;
}
