#include "shade/environment.h"

#include "shade/gauss.h"
#include "shade/power.h"

enum { GRADES = 10, ROWS_MOST = 256, NODES_MOST = 3 * ROWS_MOST };

/* Powers below this are left out. */
static const double FAINT = 1e-9;

/* The part of the sphere x.axis > least. */
typedef struct cap {
    shd_vec3 axis;
    double least;
} cap;

/* The nodes of whole pieces between rows, if the lobe is wider than these: `count` a piece, in the
 * order of latitude. */
typedef struct ladder {
    int count; /* 0: it is not */
    double sine[NODES_MOST], cosine[NODES_MOST];
} ladder;

typedef struct sum {
    const shd_surroundings *map;
    cap lobe, half;
    shd_power power;
    double step;  /* between texels, in latitude */
    double width; /* of the lobe: 1 / sqrt(n) */
    double all[3];
    ladder ladder;
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

/* Whole pieces first .. end - 1, `rows` being [from piece first on][3] at their upper ends. Loops
 * over nodes are plain, so that compilers make vectors of them. */
static void sum_ladder(sum *s, int first, int end, double across, const double (*rows)[3],
                       double weight) {
    const ladder *l = &s->ladder;
    const int n = l->count, at = n * first, count = n * (end - first);
    const shd_gauss_node *nodes = n == 3 ? shd_gauss3 : shd_gauss2;
    double x[NODES_MOST], by[NODES_MOST];
    for (int k = 0; k < count; k++)
        x[k] = fmax(s->lobe.axis.y * l->cosine[at + k] + across * l->sine[at + k], 0);
    if (s->power.whole == UINT32_MAX) {
        for (int k = 0; k < count; k++) by[k] = x[k] > 0 ? pow(x[k], s->power.exponent) : 0;
    } else {
        for (int k = 0; k < count; k++) by[k] = 1;
        for (uint32_t bits = s->power.whole; bits; bits >>= 1) {
            if (bits & 1)
                for (int k = 0; k < count; k++) by[k] *= x[k];
            for (int k = 0; k < count; k++) x[k] *= x[k];
        }
    }
    double all[3] = {0, 0, 0};
    for (int k = 0, j = 0; j < end - first; j++)
        for (int i = 0; i < n; i++, k++) {
            const double f = nodes[i].at, w = nodes[i].weight * by[k] * l->sine[at + k];
            for (int c = 0; c < 3; c++) all[c] += w * ((1 - f) * rows[j][c] + f * rows[j + 1][c]);
        }
    for (int c = 0; c < 3; c++) s->all[c] += all[c] * weight * s->step;
}

/* The meridian at the longitude `turn`, whose texels are `f` of the way from column i to the next.
 * Piece j is between rows j - 1 and j. */
static void sum_meridian(sum *s, double turn, size_t i, double f, double weight) {
    const shd_surroundings *map = s->map;
    const double sine = sin(turn), cosine = cos(turn);
    const double across = s->lobe.axis.z * cosine - s->lobe.axis.x * sine;
    double low = 0, high = SHD_PI;
    if (!cross_cap(&s->lobe, across, &low, &high) ||
        !cross_cap(&s->half, s->half.axis.z * cosine - s->half.axis.x * sine, &low, &high))
        return;
    const size_t w = (size_t)map->width, next = (i + 1) % w;
    const int height = map->height;
    const int first = (int)fmin(floor(low / s->step + 0.5), height),
              last = (int)fmin(floor(high / s->step + 0.5), height);
    double rows[ROWS_MOST + 2][3];
    for (int j = first; j <= last + 1; j++) {
        const int row = j - 1 < 0 ? 0 : j - 1 < height ? j - 1 : height - 1;
        const float *t = map->texels + 3 * w * (size_t)row;
        for (size_t c = 0; c < 3; c++)
            rows[j - first][c] = (1 - f) * (double)t[3 * i + c] + f * (double)t[3 * next + c];
    }
    for (int j = first; j <= last; j++) {
        const double top = (j - 0.5) * s->step, begin = fmax(low, top),
                     end = fmin(high, top + s->step);
        const bool flat = j == 0 || j == height;
        const double(*row)[3] = (const double(*)[3])rows + (j - first);
        if (j > first && j < last && !flat && s->ladder.count) {
            const int to = last; /* the last piece is cut, or flat */
            sum_ladder(s, j, to, across, row, weight);
            j = to - 1;
            continue;
        }
        if (begin < end) sum_piece(s, begin, end, across, row[0], row[1], top, flat, weight);
    }
}

static void climb(sum *s) {
    const int height = s->map->height;
    ladder *l = &s->ladder;
    l->count = s->step <= 0.2 * s->width ? 2 : s->step <= 0.6 * s->width ? 3 : 0;
    const shd_gauss_node *nodes = l->count == 3 ? shd_gauss3 : shd_gauss2;
    for (int j = 1; j < height && l->count; j++)
        for (int k = 0; k < l->count; k++) {
            const double t = (j - 0.5 + nodes[k].at) * s->step;
            l->sine[j * l->count + k] = sin(t);
            l->cosine[j * l->count + k] = cos(t);
        }
}

/* The latitude at which a meridian leaves or enters the half sphere around the axis. */
static double crossing_of(shd_vec3 axis, double turn) {
    const double across = axis.z * cos(turn) - axis.x * sin(turn);
    return atan2(fabs(axis.y), axis.y < 0 ? across : -across);
}

/* What is summed changes where the horizon crosses texels: it is cut so that no part crosses more
 * than half of a row. */
static void sum_meridians(sum *s, double low, double high, size_t i, double left, double step) {
    double rows = fabs(crossing_of(s->half.axis, high) - crossing_of(s->half.axis, low));
    if (s->power.exponent < 2)
        rows = fmax(rows, fabs(crossing_of(s->lobe.axis, high) - crossing_of(s->lobe.axis, low)));
    const int parts = 1 + (int)(2 * rows / s->step);
    for (int k = 0; k < 2 * parts; k++) {
        const shd_gauss_node g = shd_gauss2[k & 1];
        const double turn = low + (high - low) * (k / 2 + g.at) / parts;
        sum_meridian(s, turn, i, (turn - left) / step, (high - low) / parts * g.weight);
    }
}

/* The same toward an end at which what is summed bends, within the latitudes `bend` of it. */
static void sum_toward(sum *s, double low, double high, double at_low, double at_high, size_t i,
                       double left, double step) {
    const double middle = (low + high) / 2;
    if (at_low > 0 && at_high > 0) {
        sum_toward(s, low, middle, at_low, 0, i, left, step);
        sum_toward(s, middle, high, 0, at_high, i, left, step);
        return;
    }
    const double bend = at_low > 0 ? at_low : at_high;
    for (int k = 0; k < GRADES && bend > 0 && high - low > bend / 4; k++) {
        const double cut = (low + high) / 2;
        if (at_low > 0) {
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

/* From column i to the next. Near a jump the edge of its cap crosses all latitudes within an angle
 * that is about as large as the axis is high. */
static void sum_column(sum *s, size_t i, const double jumps[4], const double bends[2],
                       double step) {
    const double left = ((double)i + 0.5) * step, right = left + step;
    double ends[6] = {left}, bend[6] = {0};
    int count = 1;
    for (int k = 0; k < 4; k++) {
        double at = jumps[k];
        if (at < left) at += 2 * SHD_PI;
        if (!(at < right)) continue;
        int to = count++;
        for (; to > 1 && ends[to - 1] > at; to--) {
            ends[to] = ends[to - 1];
            bend[to] = bend[to - 1];
        }
        ends[to] = at;
        bend[to] = bends[k / 2];
    }
    ends[count] = right;
    bend[count] = 0;
    for (int k = 0; k < count; k++) {
        /* A narrow lobe changes within a texel. */
        const double gap = ends[k + 1] - ends[k];
        const int parts = 1 + (int)(gap / (0.3 * s->width));
        for (int p = 0; p < parts && gap > 0; p++)
            sum_toward(s, ends[k] + gap * p / parts, ends[k] + gap * (p + 1) / parts,
                       p == 0 ? bend[k] : 0, p == parts - 1 ? bend[k + 1] : 0, i, left, step);
    }
}

void shd_environment_integrate(const shd_surroundings *map, double exponent, shd_vec3 w, shd_vec3 n,
                               double out[3]) {
    const double least = exponent > 0 ? pow(FAINT, 1 / exponent) : 0;
    sum s; /* the ladder is large */
    s.map = map;
    s.lobe = (cap){w, least};
    s.half = (cap){n, 0};
    s.power = shd_power_make(exponent);
    s.step = SHD_PI / map->height;
    s.width = 1 / sqrt(fmax(exponent, 1));
    s.all[0] = s.all[1] = s.all[2] = 0;
    double jumps[4];
    const double bends[2] = {fmax(fabs(w.y), 1e-6), fmax(fabs(n.y), 1e-6)};
    find_jumps(w, jumps);
    find_jumps(n, jumps + 2);
    climb(&s);
    const double step = 2 * SHD_PI / map->width, reach = acos(least),
                 down = acos(fmin(fmax(w.y, -1), 1)), sine = sin(reach), aside = hypot(w.x, w.z);
    /* The lobe's longitudes, unless it holds a pole. */
    const bool all =
        down <= reach * (1 + 1e-9) || SHD_PI - down <= reach * (1 + 1e-9) || sine >= aside;
    const double middle = atan2(-w.x, w.z), half = all ? SHD_PI : asin(sine / aside);
    const long long columns = map->width;
    const long long first = all ? 0 : (long long)floor((middle - half) / step - 0.5),
                    last = all ? columns - 1 : (long long)floor((middle + half) / step - 0.5);
    for (long long i = first; i <= last && i < first + columns; i++)
        sum_column(&s, (size_t)(((i % columns) + columns) % columns), jumps, bends, step);
    for (int c = 0; c < 3; c++) out[c] = s.all[c] / SHD_PI;
}
