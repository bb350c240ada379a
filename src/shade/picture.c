#include "shade/picture.h"

#include <math.h>
#include <stdint.h>

#include "base/vec3.h"

/* A footprint's length over the width of texels that it is walked along by, at most. */
enum { MOST_ALONG = 32 };

static double length_of(const double v[2]) {
    return sqrt(v[0] * v[0] + v[1] * v[1]);
}

/* ---- One point of a level. ---- */

/* The texel that stands at a whole number, which may be beyond the level's side. */
static size_t wrapped(int64_t index, int side, shd_wrap wrap) {
    if (index >= 0 && index < side) return (size_t)index;
    if (wrap == SHD_WRAP_CLAMP) return index < 0 ? 0 : (size_t)side - 1;
    const int64_t period = wrap == SHD_WRAP_MIRROR ? 2 * (int64_t)side : side;
    int64_t at = index % period;
    if (at < 0) at += period;
    return (size_t)(at < side ? at : period - 1 - at);
}

/* The two texels that a place lies between, and the share of the second one. */
typedef struct between {
    size_t at[2];
    double share;
} between;

static between between_texels(double place, int side, shd_wrap wrap) {
    /* Beyond 2^52 there is nothing between whole numbers. */
    const double middle = shd_larger(-0x1p52, shd_smaller(place - 0.5, 0x1p52)),
                 whole = floor(middle);
    const int64_t index = (int64_t)whole;
    return (between){{wrapped(index, side, wrap), wrapped(index + 1, side, wrap)}, middle - whole};
}

/* Adds the level at a point, in texels from its upper left corner. */
static void add_point(const shd_level *level, shd_wrap wrap, const double at[2], double sum[4]) {
    const between x = between_texels(at[0], level->width, wrap),
                  y = between_texels(at[1], level->height, wrap);
    const size_t width = (size_t)level->width;
    const float *a = level->rgba + 4 * (y.at[0] * width + x.at[0]),
                *b = level->rgba + 4 * (y.at[0] * width + x.at[1]),
                *c = level->rgba + 4 * (y.at[1] * width + x.at[0]),
                *d = level->rgba + 4 * (y.at[1] * width + x.at[1]);
    const double right = x.share, down = y.share, ad = (1 - right) * (1 - down),
                 bd = right * (1 - down), cd = (1 - right) * down, dd = right * down;
    for (int k = 0; k < 4; k++)
        sum[k] += ad * (double)a[k] + bd * (double)b[k] + cd * (double)c[k] + dd * (double)d[k];
}

/* ---- A footprint. ---- */

/* The footprint in texels of a level, from its upper left corner: down is what the picture's up is
 * not. `main` is the longer side. */
typedef struct patch {
    double at[2], main[2], side[2];
    double length, narrow; /* of `main`, and of the parallelogram across it */
} patch;

static patch patch_of(const shd_level *level, const shd_footprint *f) {
    const double width = level->width, height = level->height;
    patch p = {.at = {f->at[0] * width, (1 - f->at[1]) * height},
               .main = {f->x[0] * width, -f->x[1] * height},
               .side = {f->y[0] * width, -f->y[1] * height}};
    const double x = length_of(p.main), y = length_of(p.side),
                 area = fabs(p.main[0] * p.side[1] - p.main[1] * p.side[0]);
    p.length = shd_larger(x, y);
    p.narrow = p.length > 0 ? area / p.length : 0;
    for (int k = 0; k < 2 && y > x; k++) {
        const double main = p.main[k];
        p.main[k] = p.side[k];
        p.side[k] = main;
    }
    return p;
}

static int points_of(double texels, int most) {
    return texels <= 1 ? 1 : texels >= most ? most : (int)ceil(texels);
}

/* The mean of points over the footprint, no farther apart than texels. */
static void find_mean(const shd_level *level, shd_wrap wrap, const shd_footprint *f,
                      double out[4]) {
    const patch p = patch_of(level, f);
    const int along = points_of(p.length, 2 * MOST_ALONG), across = points_of(p.narrow, 8);
    double sum[4] = {0};
    for (int j = 0; j < across; j++) {
        const double b = (j + 0.5) / across - 0.5;
        for (int i = 0; i < along; i++) {
            const double a = (i + 0.5) / along - 0.5;
            add_point(level, wrap,
                      (double[]){p.at[0] + a * p.main[0] + b * p.side[0],
                                 p.at[1] + a * p.main[1] + b * p.side[1]},
                      sum);
        }
    }
    for (int k = 0; k < 4; k++) out[k] = sum[k] / (along * across);
}

void shd_picture_whole(const shd_pyramid *picture, double out[4]) {
    const float *texel = picture->levels[picture->count - 1].rgba;
    for (int k = 0; k < 4; k++) out[k] = (double)texel[k];
}

void shd_picture_mean(const shd_pyramid *picture, shd_wrap wrap, const shd_footprint *f,
                      double out[4]) {
    const patch p = patch_of(picture->levels, f);
    const double size = shd_larger(p.narrow / 2, p.length / MOST_ALONG);
    int level = 0, last = picture->count - 1;
    double share = 0; /* of the next level: their sizes are 2^level and twice that */
    if (size > 1) {
        share = 2 * frexp(size, &level) - 1;
        level--;
    }
    if (level >= last) {
        shd_picture_whole(picture, out);
        return;
    }
    find_mean(&picture->levels[level], wrap, f, out);
    if (share > 0) {
        double next[4];
        find_mean(&picture->levels[level + 1], wrap, f, next);
        for (int k = 0; k < 4; k++) out[k] += share * (next[k] - out[k]);
    }
    for (int k = 0; k < 4; k++)
        out[k] = shd_larger(shd_smaller(out[k], (double)picture->texels->high[k]),
                            (double)picture->texels->low[k]);
}
