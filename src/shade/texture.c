#include "shade/texture.h"

#include <math.h>
#include <stdint.h>

#include "base/vec3.h"
#include "shade/picture.h"

static double length_of(const double v[2]) {
    return sqrt(v[0] * v[0] + v[1] * v[1]);
}

/* ---- Noise. ---- */

/* The value at a lattice point, in [0, 1): the same on every machine (the finalizer of
 * MurmurHash3). */
static double lattice(int64_t s, int64_t t, uint64_t octave) {
    uint64_t h = (uint64_t)s * UINT64_C(0x9E3779B97F4A7C15) ^
                 (uint64_t)t * UINT64_C(0xC2B2AE3D27D4EB4F) ^ octave * UINT64_C(0x165667B19E3779F9);
    h = (h ^ h >> 33) * UINT64_C(0xFF51AFD7ED558CCD);
    h = (h ^ h >> 33) * UINT64_C(0xC4CEB9FE1A85EC53);
    h ^= h >> 33;
    return (double)(h >> 11) * 0x1p-53;
}

static double smooth(double x) {
    return x * x * (3 - 2 * x);
}

/* Values between lattice points, with slopes of 0 at these. */
static double noise_at(double s, double t, uint64_t octave) {
    const double fs = floor(s), ft = floor(t), x = smooth(s - fs), y = smooth(t - ft);
    const int64_t i = (int64_t)fs, j = (int64_t)ft;
    const double low = lattice(i, j, octave) * (1 - x) + lattice(i + 1, j, octave) * x,
                 high = lattice(i, j + 1, octave) * (1 - x) + lattice(i + 1, j + 1, octave) * x;
    return low * (1 - y) + high * y;
}

/* What is left of cells of 1 under a filter of this width: all up to a half, nothing from 2 on. */
static double kept_of(double width) {
    if (width <= 0.5) return 1;
    if (width >= 2) return 0;
    return 1 - smooth((width - 0.5) / 1.5);
}

static double noise_mean(int octaves, const shd_footprint *f) {
    enum { MOST_STEPS = 16 };
    const double x = length_of(f->x), y = length_of(f->y);
    const double *side = x >= y * (1 - SHD_FOOTPRINT_ALIKE) ? f->x : f->y, wide = shd_smaller(x, y),
                 length = shd_larger(x, y);
    double sum = 0, whole = 0, share = 1, scale = 1;
    for (int o = 0; o < octaves; o++, share /= 2, scale *= 2) {
        whole += share;
        /* Steps are no wider than half a cell, or than the other side, as far as they reach. */
        const double step = shd_larger(wide * scale, 0.5);
        double steps = ceil(length * scale / step * (1 - SHD_FOOTPRINT_ALIKE));
        steps = shd_larger(1, shd_smaller(steps, MOST_STEPS));
        const double kept = kept_of(shd_larger(wide, length / steps) * scale);
        double mean = 0;
        for (int k = 0; kept > 0 && k < (int)steps; k++) {
            const double along = (k + 0.5) / steps - 0.5;
            mean += noise_at(scale * (f->at[0] + along * side[0]),
                             scale * (f->at[1] + along * side[1]), (uint64_t)o);
        }
        sum += share * (0.5 + kept * (mean / steps - 0.5));
    }
    return sum / whole;
}

/* A value between lattice points has the variance 1/12 times the mean of the squares of its four
 * weights, 0.742857 squared. Along an axis, the mean over a length of a cells keeps about 1 /
 * sqrt(1
 * + 0.54 a^2) of that, which has the slope at short lengths and, to 1 percent, what is left at long
 * ones. */
static double noise_variance(int octaves, const shd_footprint *f) {
    static const double WHOLE = 0.742857 * 0.742857 / 12, FALLS = 0.54;
    const double x = f->x[0] * f->x[0] + f->x[1] * f->x[1],
                 y = f->y[0] * f->y[0] + f->y[1] * f->y[1];
    double sum = 0, whole = 0, share = 1, scale = 1;
    for (int o = 0; o < octaves; o++, share /= 2, scale *= 2) {
        const double by = FALLS * scale * scale;
        whole += share;
        sum += share * share * WHOLE * (1 - 1 / sqrt((1 + by * x) * (1 + by * y)));
    }
    return sum / (whole * whole);
}

/* ---- All of them. ---- */

static shd_footprint map_footprint(const shd_pattern *p, const shd_footprint *uv, double by) {
    shd_footprint out;
    for (int r = 0; r < 2; r++) {
        const double *m = p->map[r];
        out.at[r] = by * (m[0] * uv->at[0] + m[1] * uv->at[1] + m[2]);
        out.x[r] = by * (m[0] * uv->x[0] + m[1] * uv->x[1]);
        out.y[r] = by * (m[0] * uv->y[0] + m[1] * uv->y[1]);
    }
    return out;
}

static bool is_usable(const shd_footprint *f) {
    /* Beyond this, whole numbers are not told apart from their neighbors any more. */
    static const double MOST = 0x1p40;
    bool good = true;
    for (int k = 0; k < 2; k++)
        good = good && fabs(f->at[k]) < MOST && fabs(f->x[k]) < MOST && fabs(f->y[k]) < MOST;
    return good;
}

/* What is left of checks or lines that a pixel spans so many of, in its narrow direction: what is
 * finer than pixels can show would only be moire, which moves when nothing else does. */
static double shown_of(const shd_footprint *f) {
    const double x = length_of(f->x), y = length_of(f->y);
    const double area = fabs(f->x[0] * f->y[1] - f->x[1] * f->y[0]);
    const double span = (area / shd_larger(x, y) - 0.7) / 0.4;
    return span <= 0 ? 1 : span >= 1 ? 0 : 1 - smooth(span);
}

/* A checker of the sign waves a and b is (1 - a b) / 2, and a is 2 pulse - 1. */
static double checker_mean(const shd_footprint *f) {
    static const shd_pulse even = {0, 0.5};
    const shd_footprint in_checks = {
        {0, 0}, {2 * f->x[0], 2 * f->x[1]}, {2 * f->y[0], 2 * f->y[1]}};
    const double shown = shown_of(&in_checks);
    if (shown == 0) return 0.5; /* of waves that are walked along for long otherwise */
    const double s = shd_pulse_mean(&even, f, 0), t = shd_pulse_mean(&even, f, 1);
    return 0.5 + shown * (s + t - 2 * shd_pulses_mean(&even, f) - 0.5);
}

static double grid_mean(double width, const shd_footprint *f) {
    const shd_pulse between = {width / 2, 1 - width / 2};
    const double mean = (1 - width) * (1 - width), shown = shown_of(f);
    if (shown == 0) return 1 - mean;
    return 1 - mean - shown * (shd_pulses_mean(&between, f) - mean);
}

double shd_pattern_mean(const shd_pattern *pattern, const shd_footprint *uv) {
    /* A checker's wave has the period 2. */
    const shd_footprint mapped = map_footprint(pattern, uv, pattern->kind == SHD_CHECKER ? 0.5 : 1);
    double mean = 0.5;
    if (!is_usable(&mapped)) return mean;
    const shd_footprint f = pattern->kind == SHD_NOISE ? mapped : shd_footprint_of(&mapped);
    switch (pattern->kind) {
    case SHD_CHECKER:
        mean = checker_mean(&f);
        break;
    case SHD_GRID:
        mean = grid_mean(pattern->width, &f);
        break;
    case SHD_GRADIENT:
        mean = shd_ramp_mean(pattern->wrap, &f);
        break;
    case SHD_NOISE:
        mean = noise_mean(pattern->octaves, &f);
        break;
    case SHD_PICTURE:
        break;
    }
    return shd_smaller(shd_larger(mean, 0), 1);
}

double shd_pattern_variance(const shd_pattern *pattern, const shd_footprint *uv, double mean) {
    const shd_footprint f = map_footprint(pattern, uv, 1);
    const bool smooth = pattern->kind == SHD_GRADIENT || pattern->kind == SHD_NOISE;
    const double most = mean * (1 - mean);
    if (!smooth || !is_usable(&f)) return most;
    if (pattern->kind == SHD_NOISE) return shd_smaller(noise_variance(pattern->octaves, &f), most);
    const shd_footprint ramp = shd_footprint_of(&f);
    return shd_smaller(shd_ramp_variance(pattern->wrap, &ramp), most);
}

void shd_texture_mean(const shd_pattern *picture, const shd_footprint *uv, double out[4]) {
    const shd_footprint f = map_footprint(picture, uv, 1);
    if (is_usable(&f))
        shd_picture_mean(picture->picture, picture->wrap, &f, out);
    else
        shd_picture_whole(picture->picture, out);
}

void shd_pattern_means(const shd_pattern *pattern, const shd_footprint *uv, double out[3]) {
    if (pattern->kind != SHD_PICTURE) {
        out[0] = shd_pattern_mean(pattern, uv);
        return;
    }
    double texel[4];
    shd_texture_mean(pattern, uv, texel);
    if (pattern->channel == SHD_ALL_CHANNELS)
        for (int c = 0; c < 3; c++) out[c] = texel[c];
    else
        out[0] = texel[pattern->channel];
}
