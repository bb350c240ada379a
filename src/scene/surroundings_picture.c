/* Maps of pictures: as many texels as integrals and tables are made for. */
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "scene/surroundings.h"

/* A picture from whose values no curve has made more. Sums of larger ones might overflow. */
static const float MOST = 1e6F;

/* What of a picture is radiance. */
static float radiance_of(float value, size_t *held) {
    if (value >= 0 && value <= MOST) return value;
    ++*held;
    return value > 0 ? MOST : 0;
}

/* Several rows become one where the picture is the finer one; where it is the coarser one, texels
 * are cut by an odd number, so that radiance is the same: middles stay middles, and between them it
 * is linear. */
int shd_surroundings_rows(int height, int wanted) {
    const int least = wanted < SHD_SURROUNDINGS_LEAST ? SHD_SURROUNDINGS_LEAST : wanted;
    if (height > least) return least;
    int cut = 1;
    while (height * cut < SHD_SURROUNDINGS_LEAST) cut += 2;
    return height * cut;
}

/* ---- Fewer texels: means over their solid angles. ---- */

/* A row of the picture's in `width` columns: sums of what of its texels is in each, of which a
 * whole one counts 1. */
static void shrink_row(const float *rgba, int from, int width, double *out, size_t *held) {
    memset(out, 0, 3 * (size_t)width * sizeof *out);
    /* Column i of the picture is i width to (i + 1) width of from width. */
    for (int64_t i = 0; i < from; i++, rgba += 4) {
        const int64_t begin = i * width, end = begin + width, first = begin / from,
                      cut = (first + 1) * from < end ? (first + 1) * from : end;
        const double share = (double)(cut - begin) / width;
        for (int c = 0; c < 3; c++) {
            const double value = (double)radiance_of(rgba[c], held);
            out[3 * first + c] += share * value;
            if (cut < end) out[3 * (first + 1) + c] += (1 - share) * value;
        }
    }
}

/* Bands of the sphere, between two angles from +y. */
static double band(double top, double bottom) {
    return bottom > top ? cos(top) - cos(bottom) : 0;
}

static bool shrink(const shd_texels *picture, const atomic_bool *cancelled, double *row,
                   shd_surroundings *map, float *texels) {
    const int height = picture->height, rows = map->height, width = map->width;
    const size_t wide = 3 * (size_t)width;
    const double per_column = (double)width / picture->width;
    double *sum = row + wide;
    int to = 0;
    memset(sum, 0, wide * sizeof *sum);
    for (int j = 0; j < height; j++) {
        if (shd_is_cancelled(cancelled)) return false;
        const double top = SHD_PI * j / height, bottom = SHD_PI * (j + 1) / height;
        shrink_row(picture->rgba + 4 * (size_t)j * (size_t)picture->width, picture->width, width,
                   row, &map->held);
        for (;; to++) { /* at most two rows: the picture has more */
            const double above = SHD_PI * to / rows, below = SHD_PI * (to + 1) / rows,
                         by = per_column * band(fmax(top, above), fmin(bottom, below)) /
                              band(above, below);
            for (size_t k = 0; k < wide; k++) sum[k] += by * row[k];
            if ((int64_t)(to + 1) * height > (int64_t)(j + 1) * rows) break;
            for (size_t k = 0; k < wide; k++) texels[wide * (size_t)to + k] = (float)sum[k];
            memset(sum, 0, wide * sizeof *sum);
            if ((int64_t)(to + 1) * height == (int64_t)(j + 1) * rows) {
                to++;
                break;
            }
        }
    }
    return true;
}

/* ---- As many, or more. ---- */

static void copy(const shd_texels *picture, const atomic_bool *cancelled, shd_surroundings *map,
                 float *texels) {
    const size_t count = (size_t)map->width * (size_t)map->height;
    for (size_t i = 0; i < count && !shd_is_cancelled_at(cancelled, i); i++)
        for (size_t c = 0; c < 3; c++)
            texels[3 * i + c] = radiance_of(picture->rgba[4 * i + c], &map->held);
}

/* The picture as it is, in `coarse`, and then what it is at the middles of smaller texels. */
static void refine(const shd_texels *picture, float *coarse, shd_surroundings *map, float *texels) {
    shd_surroundings whole = {.width = picture->width, .height = picture->height, .texels = coarse};
    copy(picture, NULL, &whole, coarse);
    map->held = whole.held;
    for (int j = 0; j < map->height; j++)
        for (int i = 0; i < map->width; i++) {
            double rgb[3];
            shd_surroundings_between(&whole, (i + 0.5) / map->width, (j + 0.5) / map->height, rgb);
            for (size_t c = 0; c < 3; c++) *texels++ = (float)rgb[c];
        }
}

/* All longitudes meet at a pole, where nothing can be of each. */
static void even_row(size_t width, float *row) {
    double sum[3] = {0, 0, 0};
    for (size_t k = 0; k < 3 * width; k++) sum[k % 3] += (double)row[k];
    for (size_t k = 0; k < 3 * width; k++) row[k] = (float)(sum[k % 3] / (double)width);
}

bool shd_surroundings_fill(const shd_texels *picture, const atomic_bool *cancelled,
                           shd_surroundings *map, float *texels) {
    const size_t values = 3 * (size_t)picture->width * (size_t)picture->height;
    bool good = true;
    void *work = NULL;
    map->held = 0;
    if (map->height == picture->height) {
        copy(picture, cancelled, map, texels);
        good = !shd_is_cancelled(cancelled);
    } else if (map->height > picture->height) {
        work = malloc(values * sizeof(float));
        good = work;
        if (good) refine(picture, work, map, texels);
    } else {
        work = malloc(2 * 3 * (size_t)map->width * sizeof(double));
        good = work && shrink(picture, cancelled, work, map, texels);
    }
    free(work);
    if (good) {
        even_row((size_t)map->width, texels);
        even_row((size_t)map->width, texels + 3 * (size_t)map->width * ((size_t)map->height - 1));
    }
    map->texels = texels;
    return good;
}
