/* From samples to pixels: the box filter. */
#include <float.h>

#include "render/film.h"

uint64_t shd_saturate(float *values, size_t count, float least, float largest) {
    /* Almost always there is nothing to do, which a loop without branches sees quickly. */
    unsigned outside = 0;
    for (size_t i = 0; i < count; i++) {
        unsigned low = values[i] >= least ? 0 : 1, high = values[i] <= largest ? 0 : 1;
        outside |= low | high;
    }
    if (!outside) return 0;
    uint64_t changed = 0;
    for (size_t i = 0; i < count; i++) {
        float v = values[i];
        if (v >= least && v <= largest) continue;
        values[i] = v > largest ? largest : v < least ? least : 0;
        changed++;
    }
    return changed;
}

/* The f32 of a sum; beyond f32 it is left for shd_saturate to see. */
static float narrow(double value) {
    return (float)value;
}

/* Data layers hold the pixel's sample that is nearest to the camera: averages would be places
 * and directions that are nowhere on the surface. */
static void store_data(const shd_gbuffer *seen, size_t first, int samples, size_t pixel,
                       shd_film *film) {
    size_t nearest = first;
    bool hit = false;
    for (size_t i = first; i < first + (size_t)samples; i++) {
        if (seen->object[i] == SHD_NOTHING) continue;
        if (!hit || seen->depth[i] < seen->depth[nearest]) nearest = i;
        hit = true;
    }
    for (int c = 0; c < 3; c++) {
        if (film->normal)
            film->normal[3 * pixel + (size_t)c] = hit ? narrow(seen->normal[c][nearest]) : 0;
        if (film->position)
            film->position[3 * pixel + (size_t)c] = hit ? narrow(seen->position[c][nearest]) : 0;
    }
    if (film->depth) film->depth[pixel] = hit ? narrow(seen->depth[nearest]) : INFINITY;
    if (film->object) film->object[pixel] = hit ? (float)seen->object[nearest] : -1;
}

/* How many samples of a row's pixels hit something. */
static void count_row(const int32_t *object, int width, int samples, double *restrict hits) {
    if (samples == 1) {
        for (int x = 0; x < width; x++) hits[x] = object[x] != SHD_NOTHING ? 1 : 0;
        return;
    }
    for (int x = 0; x < width; x++) {
        int count = 0;
        for (int i = x * samples; i < (x + 1) * samples; i++) count += object[i] != SHD_NOTHING;
        hits[x] = count;
    }
}

/* The sum of those, in the pattern's order. */
static void sum_row(const int32_t *object, const double *restrict radiance,
                    const double *restrict hits, int width, int samples, double *restrict sum) {
    if (samples == 1) {
        for (int x = 0; x < width; x++) {
            double value = radiance[x]; /* read in any case: the loop vectorizes */
            sum[x] = hits[x] > 0 ? value : 0;
        }
        return;
    }
    for (int x = 0; x < width; x++) {
        double value = 0;
        if (hits[x] == samples)
            for (int i = x * samples; i < (x + 1) * samples; i++) value += radiance[i];
        else if (hits[x] > 0)
            for (int i = x * samples; i < (x + 1) * samples; i++)
                value += object[i] != SHD_NOTHING ? radiance[i] : 0;
        sum[x] = value;
    }
}

/* A power of two divides as its inverse multiplies, to the bit. */
static void divide_row(double *restrict values, int width, int samples) {
    if (samples == 1) return;
    if ((samples & (samples - 1)) == 0)
        for (int x = 0; x < width; x++) values[x] *= 1.0 / samples;
    else
        for (int x = 0; x < width; x++) values[x] /= samples;
}

/* The beauty over the background, or divided by coverage: straight alpha. */
static void filter_beauty(const shd_scene *scene, const shd_gbuffer *seen, const double *radiance,
                          const double *restrict hits, size_t first, int width,
                          float *restrict out) {
    const int samples = scene->raster.samples;
    double sum[SHD_TILE_SIDE];
    float row[3][SHD_TILE_SIDE];
    for (int c = 0; c < 3; c++) {
        const double background = scene->background[c];
        sum_row(seen->object + first, radiance + (size_t)c * seen->count + first, hits, width,
                samples, sum);
        if (scene->transparent) {
            for (int x = 0; x < width; x++) sum[x] /= hits[x] > 0 ? hits[x] : 1;
        } else {
            for (int x = 0; x < width; x++) sum[x] += background * (samples - hits[x]);
            divide_row(sum, width, samples);
        }
        for (int x = 0; x < width; x++) row[c][x] = narrow(sum[x]);
    }
    for (int x = 0; x < width; x++) {
        out[4 * x] = row[0][x];
        out[4 * x + 1] = row[1][x];
        out[4 * x + 2] = row[2][x];
        out[4 * x + 3] = 1;
    }
    for (int x = 0; scene->transparent && x < width; x++)
        out[4 * x + 3] = narrow(hits[x] / samples);
}

/* The box filter: samples of a pixel are summed in the pattern's order. */
uint64_t shd_filter_tile(const shd_plan *plan, const shd_gbuffer *seen, const double *radiance,
                         shd_tile tile, shd_film *film) {
    uint64_t saturated = 0;
    const shd_raster *raster = &plan->scene->raster;
    const int samples = raster->samples;
    const size_t total = seen->count, width = (size_t)tile.w;
    const bool data = film->normal || film->position || film->depth || film->object;
    double hits[SHD_TILE_SIDE], sum[SHD_TILE_SIDE];
    for (int y = 0; y < tile.h; y++) {
        const size_t first = (size_t)y * width * (size_t)samples;
        const size_t pixel =
            (size_t)(tile.y + y - raster->y) * (size_t)film->width + (size_t)(tile.x - raster->x);
        count_row(seen->object + first, tile.w, samples, hits);
        filter_beauty(plan->scene, seen, radiance, hits, first, tile.w, film->rgba + 4 * pixel);
        saturated += shd_saturate(film->rgba + 4 * pixel, 4 * width, -FLT_MAX, FLT_MAX);
        for (size_t p = 1; p < plan->plane_count; p++) {
            float *out = film->planes[p] + 3 * pixel;
            for (size_t c = 0; c < 3; c++) {
                sum_row(seen->object + first, radiance + (3 * p + c) * total + first, hits, tile.w,
                        samples, sum);
                divide_row(sum, tile.w, samples);
                for (size_t x = 0; x < width; x++) out[3 * x + c] = narrow(sum[x]);
            }
            saturated += shd_saturate(out, 3 * width, -FLT_MAX, FLT_MAX);
        }
        for (size_t x = 0; data && x < width; x++)
            store_data(seen, first + x * (size_t)samples, samples, pixel + x, film);
    }
    return saturated;
}
