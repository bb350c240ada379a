/* Loops over the values of a tile, compiled once an instruction set; all variants give the same
 * bits. Arrays need no alignment. */
#pragma once

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/cpu.h"
#include "plan/nodes.h"

enum {
    SHD_TILE = 32, /* pixels of a side; the grid of tiles begins at the picture's (0,0) */
    SHD_TILE_PIXELS = SHD_TILE * SHD_TILE
};

/* A term of the radiance: a color times sums of light, three channels or one for all. */
typedef struct shd_paint_term {
    float color[3];
    const float *sums[3]; /* the same three times if lights are grey */
} shd_paint_term;

/* Whether `length` cells follow each other. */
static inline bool shd_is_span(const uint16_t *cell, size_t length) {
    if ((size_t)(cell[length - 1] - cell[0]) != length - 1) return false;
    uint16_t apart = 0;
    for (size_t i = 1; i < length; i++) apart |= (uint16_t)(cell[i] ^ (uint16_t)(cell[0] + i));
    return !apart;
}

/* Weights of what lies around each value of a block, up to `rim` <= SHD_FRINGE to each side. */
typedef struct shd_lattice {
    uint64_t pixels; /* that are wanted, as bits row by row */
    size_t pitch;    /* from row to row of what is read */
    int rim;
    const double *weights; /* [2 rim + 1][2 rim + 1] */
    double least;          /* no sum is less */
} shd_lattice;

typedef struct shd_paint_kernel {
    /* out[c][i] = constant[c] coverage[i] + sum over terms of color[c] sums[c][i]. A NULL coverage
     * is 1. */
    void (*mix)(const float constant[3], const float *coverage, const shd_paint_term *terms,
                size_t term_count, size_t count, float *const out[3]);
    void (*fill)(float *values, size_t count, float value);
    /* pixels[c][cell[i]] = values[c][i]; cells rise. */
    void (*scatter)(const float *const values[3], const uint16_t *cell, size_t count,
                    float *const pixels[3]);
    /* values[i] += (1 - cover[i]) background */
    void (*fill_rest)(float *values, const float *cover, float background, size_t count);
    /* values[i] /= cover[i]; 0 if that is 0 */
    void (*divide)(float *values, const float *cover, size_t count);
    /* out[i] = mean of values[i + k count] over k < samples: their sum in f64, in this order, times
     * 1 / samples. */
    void (*average)(const float *values, size_t count, int samples, float *out);
    /* The same, of values that weigh differently. */
    void (*weigh)(const float *values, size_t count, const double *weights, size_t samples,
                  float *out);
    /* The same of values around each one, for all wanted pixels: the sum of weights[j][i] times
     * values[(y + j) * pitch + x + i]. Others are read, too, whatever they are. */
    void (*filter)(const double *values, const shd_lattice *lattice, float *out);
    /* The same as `average` for values[i] that belong to place[i] < count <= SHD_TILE_PIXELS; 0 if
     * a place has none. */
    void (*gather)(const float *values, const uint16_t *place, size_t values_count, size_t count,
                   int samples, float *out);
    /* The box around points, and the sum of their normals. `count` is at least 1. */
    void (*bound)(const float *const position[3], const float *const normal[3], size_t count,
                  float low[3], float high[3], float sum[3]);
    /* The least cosine of an angle between `axis`, a unit vector, and a normal. */
    float (*spread)(const float *const normal[3], const float axis[3], size_t count);
} shd_paint_kernel;

extern const shd_paint_kernel shd_paint_kernel_portable, shd_paint_kernel_avx2,
    shd_paint_kernel_avx512;
