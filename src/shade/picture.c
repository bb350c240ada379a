#include "shade/picture.h"

#include <math.h>
#include <stdint.h>

#include "base/vec3.h"

/* Texels that a footprint is walked along by, at most. */
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

static inline between between_texels(double place, int side, shd_wrap wrap) {
    /* Beyond 2^52 there is nothing between whole numbers. */
    const double middle = shd_larger(-0x1p52, shd_smaller(place - 0.5, 0x1p52));
    const int64_t toward = (int64_t)middle, index = toward - (middle < (double)toward);
    const double share = middle - (double)index;
    if (index >= 0 && index + 1 < side) return (between){{(size_t)index, (size_t)index + 1}, share};
    return (between){{wrapped(index, side, wrap), wrapped(index + 1, side, wrap)}, share};
}

/* Adds the level at a point, in texels from its upper left corner. */
static inline void add_point(const shd_level *level, shd_wrap wrap, double across, double down_by,
                             double weight, double sum[4]) {
    const between x = between_texels(across, level->width, wrap),
                  y = between_texels(down_by, level->height, wrap);
    const size_t width = (size_t)level->width;
    const float *a = level->rgba + 4 * (y.at[0] * width + x.at[0]),
                *b = level->rgba + 4 * (y.at[0] * width + x.at[1]),
                *c = level->rgba + 4 * (y.at[1] * width + x.at[0]),
                *d = level->rgba + 4 * (y.at[1] * width + x.at[1]);
    const double down = weight * y.share, up = weight - down, bu = up * x.share, au = up - bu,
                 dd = down * x.share, cd = down - dd;
    for (int k = 0; k < 4; k++)
        sum[k] += au * (double)a[k] + bu * (double)b[k] + cd * (double)c[k] + dd * (double)d[k];
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
    for (int k = 0; k < 2 && y * (1 - SHD_FOOTPRINT_ALIKE) > x; k++) {
        const double main = p.main[k];
        p.main[k] = p.side[k];
        p.side[k] = main;
    }
    return p;
}

/* Points along a side, which is as long as `sizes` texels: from `first` on, a `step` of the side
 * apart. They are in pairs about the middle, and the outermost count as much as the side reaches
 * into what they stand for, so that nothing jumps where one more pair is needed. */
typedef struct comb {
    int count;
    double first, step;
    double outer; /* weight of the first and of the last one */
} comb;

static comb comb_of(double sizes) {
    if (sizes < 0.25) return (comb){1, 0, 0, 1};
    if (sizes <= 2) return (comb){2, -0.25, 0.5, 1};
    const int pairs = (int)ceil(sizes / 2);
    const double step = 1 / sizes;
    return (comb){2 * pairs, (0.5 - pairs) * step, step, sizes / 2 - (pairs - 1)};
}

static double weight_at(const comb *c, int i) {
    return i == 0 || i == c->count - 1 ? c->outer : 1;
}

/* The mean of the points over the footprint. */
static void find_mean(const shd_level *level, shd_wrap wrap, const shd_footprint *f,
                      const comb *along, const comb *across, double out[4]) {
    const patch p = patch_of(level, f);
    double sum[4] = {0}, whole = 0;
    for (int j = 0; j < across->count; j++) {
        const double b = across->first + j * across->step, wide = weight_at(across, j);
        for (int i = 0; i < along->count; i++) {
            const double a = along->first + i * along->step, weight = wide * weight_at(along, i);
            add_point(level, wrap, p.at[0] + a * p.main[0] + b * p.side[0],
                      p.at[1] + a * p.main[1] + b * p.side[1], weight, sum);
            whole += weight;
        }
    }
    for (int k = 0; k < 4; k++) out[k] = sum[k] / whole;
}

void shd_picture_whole(const shd_pyramid *picture, double out[4]) {
    const float *texel = picture->levels[picture->count - 1].rgba;
    for (int k = 0; k < 4; k++) out[k] = (double)texel[k];
}

void shd_picture_mean(const shd_pyramid *picture, shd_wrap wrap, const shd_footprint *f,
                      double out[4]) {
    const patch p = patch_of(picture->levels, f);
    const double size = shd_larger(1, shd_larger(p.narrow / 2, p.length / MOST_ALONG));
    const int last = picture->count - 1;
    /* Levels whose texels are 2^level and twice that, and the share of the second one. */
    int level;
    const double share = 2 * frexp(size, &level) - 1;
    level--;
    if (level >= last) {
        shd_picture_whole(picture, out);
        return;
    }
    const comb along = comb_of(p.length / size), across = comb_of(p.narrow / size);
    find_mean(&picture->levels[level], wrap, f, &along, &across, out);
    if (share > 0) {
        double next[4];
        find_mean(&picture->levels[level + 1], wrap, f, &along, &across, next);
        for (int k = 0; k < 4; k++) out[k] += share * (next[k] - out[k]);
    }
    for (int k = 0; k < 4; k++)
        out[k] = shd_larger(shd_smaller(out[k], (double)picture->texels->high[k]),
                            (double)picture->texels->low[k]);
}
