#include "shade/environment.h"

#include "shade/gauss.h"
#include "shade/power.h"

enum { GRADES = 12, ROWS_MOST = 2048 };

/* Powers below this share of the lobe's peak are left out. */
static const double FAINT = 1e-13;

/* The part of the sphere x.axis > least. */
typedef struct cap {
    shd_vec3 axis;
    double least;
} cap;

typedef struct sum {
    const shd_surroundings *map;
    cap lobe, half;
    shd_power power;
    double step;  /* between texels, in latitude */
    double width; /* of the lobe: 1 / sqrt(n) */
    double all[3];
} sum;

/* Where a meridian, on which x.axis is axis.y cos t + across sin t, is in the cap: one interval of
 * [0, pi]. False: nowhere. */
static bool cross_cap(const cap *c, double across, double *low, double *high) {
    const double reach = hypot(c->axis.y, across);
    if (!(c->least < reach)) return false;
    const double middle = atan2(across, c->axis.y), half = acos(fmax(c->least / reach, -1));
    double from = middle - half, to = middle + half;
    if (to <= 0) from += 2 * SHD_PI, to += 2 * SHD_PI;
    if (from >= SHD_PI) from -= 2 * SHD_PI, to -= 2 * SHD_PI;
    *low = fmax(from, *low);
    *high = fmin(to, *high);
    return *low < *high;
}

/* One piece of a meridian between two rows of texels, a and b [3] at its latitudes `at` and `at` +
 * step; `flat`: beyond the first or the last row, where radiance is a's. */
static void sum_piece(sum *s, double low, double high, double across, const double *a,
                      const double *b, double at, bool flat, double weight) {
    const int parts = 1 + (int)((high - low) / (0.6 * s->width));
    const double part = (high - low) / parts;
    const int n = part > 0.2 * s->width ? 3 : 2;
    const shd_gauss_node *nodes = n == 3 ? shd_gauss3 : shd_gauss2;
    for (int p = 0; p < parts; p++)
        for (int k = 0; k < n; k++) {
            const double t = low + part * (p + nodes[k].at), sine = sin(t),
                         z = s->lobe.axis.y * cos(t) + across * sine;
            if (!(z > 0)) continue;
            const double by = weight * part * nodes[k].weight * sine * shd_power_of(&s->power, z),
                         f = flat ? 0 : (t - at) / s->step;
            for (int c = 0; c < 3; c++) s->all[c] += by * (a[c] + f * (b[c] - a[c]));
        }
}

/* The meridian at the longitude `turn`, whose texels are `f` of the way from column i to the next.
 */
static void sum_meridian(sum *s, double turn, size_t i, double f, double weight) {
    const shd_surroundings *map = s->map;
    const double sine = sin(turn), cosine = cos(turn);
    const double across = s->lobe.axis.z * cosine - s->lobe.axis.x * sine;
    double low = 0, high = SHD_PI;
    if (!cross_cap(&s->lobe, across, &low, &high) ||
        !cross_cap(&s->half, s->half.axis.z * cosine - s->half.axis.x * sine, &low, &high))
        return;
    const size_t w = (size_t)map->width, next = (i + 1) % w;
    const int last = map->height - 1, from = (int)fmax(floor(low / s->step - 0.5), -1);
    double rows[2][3];
    for (int j = from; j <= last; j++) {
        const double top = (j + 0.5) * s->step;
        if (top >= high) break;
        for (int k = 0; k < 2; k++) {
            if (k == 0 && j > from) continue; /* it is there from the last piece */
            const int row = j + k < 0 ? 0 : j + k > last ? last : j + k;
            const float *t = map->texels + 3 * w * (size_t)row;
            for (size_t c = 0; c < 3; c++)
                rows[(j + k) & 1][c] =
                    (1 - f) * (double)t[3 * i + c] + f * (double)t[3 * next + c];
        }
        const double begin = fmax(low, top), end = fmin(high, j == last ? SHD_PI : top + s->step);
        if (begin < end)
            sum_piece(s, begin, end, across, rows[j & 1], rows[(j + 1) & 1], top,
                      j < 0 || j == last, weight);
    }
}

static void sum_meridians(sum *s, double low, double high, size_t i, double left, double step) {
    for (int k = 0; k < 2; k++) {
        const double turn = low + (high - low) * shd_gauss2[k].at;
        sum_meridian(s, turn, i, (turn - left) / step, (high - low) * shd_gauss2[k].weight);
    }
}

/* The same toward an end at which what is summed may jump, or bend. */
static void sum_toward(sum *s, double low, double high, bool at_low, bool at_high, size_t i,
                       double left, double step) {
    const double middle = (low + high) / 2;
    if (at_low && at_high) {
        sum_toward(s, low, middle, true, false, i, left, step);
        sum_toward(s, middle, high, false, true, i, left, step);
        return;
    }
    for (int k = 0; k < GRADES && (at_low || at_high); k++) {
        const double cut = (low + high) / 2;
        if (at_low) {
            sum_meridians(s, cut, high, i, left, step);
            high = cut;
        } else {
            sum_meridians(s, low, cut, i, left, step);
            low = cut;
        }
    }
    sum_meridians(s, low, high, i, left, step);
}

/* Longitudes at which a cap's edge may cross a pole: those at right angles to its axis. */
static void find_jumps(shd_vec3 axis, double jumps[2]) {
    const double turn = atan2(axis.z, axis.x);
    jumps[0] = turn < 0 ? turn + 2 * SHD_PI : turn;
    jumps[1] = jumps[0] < SHD_PI ? jumps[0] + SHD_PI : jumps[0] - SHD_PI;
}

/* From column i to the next. */
static void sum_column(sum *s, size_t i, const double jumps[4], double step) {
    const double left = ((double)i + 0.5) * step, right = left + step;
    double ends[6] = {left};
    bool jump[6] = {false};
    int count = 1;
    for (int k = 0; k < 4; k++) {
        double at = jumps[k];
        if (at < left) at += 2 * SHD_PI;
        if (!(at < right)) continue;
        int to = count++;
        for (; to > 1 && ends[to - 1] > at; to--) {
            ends[to] = ends[to - 1];
            jump[to] = jump[to - 1];
        }
        ends[to] = at;
        jump[to] = true;
    }
    ends[count] = right;
    jump[count] = false;
    for (int k = 0; k < count; k++) {
        /* A narrow lobe changes within a texel. */
        const double gap = ends[k + 1] - ends[k];
        const int parts = 1 + (int)(gap / (0.3 * s->width));
        for (int p = 0; p < parts && gap > 0; p++)
            sum_toward(s, ends[k] + gap * p / parts, ends[k] + gap * (p + 1) / parts,
                       p == 0 && jump[k], p == parts - 1 && jump[k + 1], i, left, step);
    }
}

void shd_environment_integrate(const shd_surroundings *map, double exponent, shd_vec3 w,
                               shd_vec3 n, double out[3]) {
    const double least = exponent > 0 ? pow(FAINT, 1 / exponent) : 0;
    sum s = {.map = map,
             .lobe = {w, least},
             .half = {n, 0},
             .power = shd_power_make(exponent),
             .step = SHD_PI / map->height,
             .width = 1 / sqrt(fmax(exponent, 1))};
    double jumps[4];
    find_jumps(w, jumps);
    find_jumps(n, jumps + 2);
    const double step = 2 * SHD_PI / map->width, reach = acos(least), down = acos(fmin(fmax(w.y, -1), 1)),
                 sine = sin(reach), aside = hypot(w.x, w.z);
    /* The lobe's longitudes, unless it holds a pole. */
    const bool all = down <= reach * (1 + 1e-9) || SHD_PI - down <= reach * (1 + 1e-9) || sine >= aside;
    const double middle = atan2(-w.x, w.z), half = all ? SHD_PI : asin(sine / aside);
    const long long columns = map->width;
    const long long first = all ? 0 : (long long)floor((middle - half) / step - 0.5),
                    last = all ? columns - 1 : (long long)floor((middle + half) / step - 0.5);
    for (long long i = first; i <= last && i < first + columns; i++)
        sum_column(&s, (size_t)(((i % columns) + columns) % columns), jumps, step);
    for (int c = 0; c < 3; c++) out[c] = s.all[c] / SHD_PI;
}
