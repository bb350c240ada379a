/* What an environment adds by one exponent, as a table over directions.
 *
 * A table holds 1/pi integral v(L) (L.W)+^n dw at nodes of a grid over longitude and latitude, and
 * is read by cubic interpolation between 4 by 4 of them. It takes no account of the horizon: where
 * the surface's cuts the lobe, what is below is summed over cells of the sphere and taken off.
 * The cells are 4.5 times narrower than the lobe is wide (1 / sqrt(n)), or as narrow as 1000 asks
 for.
 *

 * Of the cells in which radiance differs most, a sun's or a lamp's edge, those that the horizon
 * crosses are summed by smaller ones.
 *
 * Tables are made by a discrete Fourier transform along each row, since around the axis the
 * integral is a convolution. How far off they are is measured when they are made, against
 * shd_environment_integrate: at the places where the table bends most, with horizons through
 * cells by how much radiance differs in them, and at others. The largest difference counts three
 * times, to be no less than what is between those places.
 *
 * A table is one block of bytes without pointers, constant once it is made. Any thread. */
#pragma once

#include <stdint.h>

#include "base/cancel.h"
#include "scene/surroundings.h"

typedef struct shd_prefilter {
    double exponent;
    double error, cut_error; /* of any channel: of the table, and of what is taken off, at most */
    double faint;            /* what may be left out of what is below the horizon */
    double most;             /* the map's brightest channel */
    int32_t columns, rows;   /* of the table, without what is repeated around it */
    int32_t cell_rows;
    float cell_step, half;        /* between rows of cells, and half of that */
    float reach;                  /* the lobe is nothing where 1 - L.W is more */
    float kernel[7];              /* its 16th root, by (1 - L.W) / reach */
    int32_t hot_count, hot_parts; /* cells that have smaller ones, and how many each way */
    int32_t watched;              /* these and the next ones by how much radiance differs in them */
    uint64_t cell_stride, hot_at, contrast_at, hot_cells_at, rows_at, table_at, starts_at, cells_at,
        bytes; /* offsets in the block */
} shd_prefilter;

/* Whether there may be a table of the exponent: the diffuse term's is 1. Lobes below 2 are so wide,
 * and those above 4096 so narrow, that their integral is as good. */
bool shd_prefilter_serves(double exponent, bool lobe);

/* The block's size. */
size_t shd_prefilter_size(double exponent, bool lobe);
/* What making it takes beside it. */
size_t shd_prefilter_scratch(double exponent);

/* Fills a block of that size. `scratch` has shd_prefilter_scratch bytes, aligned to 64. False: it
 * was cancelled. */
bool shd_prefilter_make(const shd_surroundings *map, double exponent, bool lobe,
                        const atomic_bool *cancelled, void *scratch, shd_prefilter *out);

/* The weights around w, in linear Rec.709; with a normal, without what is below its horizon. */
void shd_prefilter_weigh(const shd_prefilter *table, shd_vec3 w, const shd_vec3 *normal,
                         double out[3]);

/* As the last one, but for the table: what of the lobe is not before the normal. For tests, and for
 * measuring the error. */
void shd_prefilter_cut(const shd_prefilter *table, shd_vec3 w, shd_vec3 normal, double out[3]);
