#include "shade/westin_relief.h"

#include <math.h>
#include <string.h>

/* ---- Numbers that are the same everywhere. ---- */

void shd_relief_turn(double turns, double *sine, double *cosine) {
    const long quarter = lround(4 * turns);
    const double r = (turns - 0.25 * (double)quarter) * (2 * SHD_PI), q = r * r;
    double s = 0, c = 0; /* Taylor's series: |r| <= pi / 4 */
    for (int k = 18; k > 0; k -= 2) {
        s = (1 - s) * q / (double)(k * (k + 1));
        c = (1 - c) * q / (double)((k - 1) * k);
    }
    s = r * (1 - s);
    c = 1 - c;
    const bool odd = quarter & 1, far = quarter & 2;
    *sine = (far ? -1 : 1) * (odd ? c : s);
    *cosine = (far != odd ? -1 : 1) * (odd ? s : c);
}

/* Steele, Lea and Flood 2014, "Fast splittable pseudorandom number generators": SplitMix64. */
double shd_relief_random(uint64_t seed, uint64_t index) {
    uint64_t z = seed * UINT64_C(0xd1342543de82ef95) + index * UINT64_C(0x9e3779b97f4a7c15);
    z = (z ^ (z >> 30)) * UINT64_C(0xbf58476d1ce4e5b9);
    z = (z ^ (z >> 27)) * UINT64_C(0x94d049bb133111eb);
    return (double)((z ^ (z >> 31)) >> 11) * 0x1p-53;
}

/* ---- Making. ---- */

static void make_grooves(const shd_microgeometry *micro, shd_relief *out) {
    double sine, cosine;
    shd_relief_turn(micro->angle / (2 * SHD_PI), &sine, &cosine);
    out->size = 2;
    out->height[0] = out->height[1] = 0;
    out->height[2] = out->height[3] = sine / cosine;
}

/* The upper side of a thread whose axis is at height `axis` and `off` away. */
static double thread_top(double axis, double off, double radius, double floor) {
    return fabs(off) < radius ? axis + sqrt(radius * radius - off * off) : floor;
}

/* Plain weave: a period of two by two threads, at distances of 1. Where threads cross they touch,
 * each has the same share of the bending, and neighbors cross the other way round. */
static void make_weave(const shd_microgeometry *micro, shd_relief *out) {
    const int n = out->size = 64;
    const double warp = micro->warp, weft = micro->weft, bend = (warp + weft) / 2,
                 floor = -bend - (warp > weft ? warp : weft), cells = n / 2.;
    double wave[SHD_RELIEF_MOST], unused; /* +1 at the first crossing, -1 at the second */
    for (int i = 0; i < n; i++) shd_relief_turn((double)i / n, &unused, &wave[i]);
    for (int y = 0; y < n; y++)
        for (int x = 0; x < n; x++) {
            const int column = (x + n / 4) / (n / 2), row = (y + n / 4) / (n / 2);
            const double along = thread_top((row % 2 ? -bend : bend) * wave[x], y / cells - row,
                                            warp, floor),
                         across = thread_top((column % 2 ? bend : -bend) * wave[y],
                                             x / cells - column, weft, floor);
            out->height[y * n + x] = cells * (along > across ? along : across);
        }
}

/* The triangle's normal. Two triangles a cell, the lower one first, cell by cell. */
static shd_vec3 normal_of(const shd_relief *relief, int triangle) {
    const int cell = triangle / 2, upper = triangle % 2;
    const double inside = 0.25 + 0.5 * upper;
    return shd_relief_at(relief, cell % relief->size + inside, cell / relief->size + inside).normal;
}

static void find_areas(shd_relief *relief) {
    double sum = 0;
    for (int t = 0; t < 2 * relief->size * relief->size; t++)
        relief->area[t] = sum += 0.5 / normal_of(relief, t).z;
}

/* The mean square of the triangles' slopes. */
static double mean_square_slope(const shd_relief *relief) {
    const int count = 2 * relief->size * relief->size;
    double sum = 0;
    for (int t = 0; t < count; t++) {
        const shd_vec3 m = normal_of(relief, t);
        sum += (m.x * m.x + m.y * m.y) / (m.z * m.z);
    }
    return sum / count;
}

/* A sum of waves with random phases, whose amplitudes fall off as Gauss's curve: by the central
 * limit heights and slopes are nearly normally distributed, as in Beckmann's surfaces. */
static void make_heights(const shd_microgeometry *micro, shd_relief *out) {
    enum { N = 64, WAVES = 10, SEED = 1992 };
    out->size = N;
    out->isotropic = true;
    memset(out->height, 0, sizeof out->height);
    double sine[N], cosine[N];
    for (int i = 0; i < N; i++) shd_relief_turn((double)i / N, &sine[i], &cosine[i]);
    double fall[2 * WAVES * WAVES + 1] = {1}; /* exp(-k^2 / 32), by its square */
    for (int k = 1; k <= 2 * WAVES * WAVES; k++) fall[k] = fall[k - 1] * 0.96923323447634413;
    for (int v = 0; v <= WAVES; v++)
        for (int u = -WAVES; u <= WAVES; u++) {
            if (u * u + v * v > WAVES * WAVES || (v == 0 && u <= 0)) continue;
            double s, c;
            shd_relief_turn(shd_relief_random(SEED, (uint64_t)(v * 64 + u + 32)), &s, &c);
            s *= fall[u * u + v * v];
            c *= fall[u * u + v * v];
            for (int y = 0; y < N; y++)
                for (int x = 0; x < N; x++) {
                    const int at = (u * x + v * y) & (N - 1);
                    out->height[y * N + x] += c * cosine[at] - s * sine[at];
                }
        }
    const double scale = micro->slope / sqrt(mean_square_slope(out));
    for (int i = 0; i < N * N; i++) out->height[i] *= scale;
}

void shd_relief_make(const shd_microgeometry *micro, shd_relief *out) {
    out->isotropic = false;
    if (micro->type == SHD_GROOVES)
        make_grooves(micro, out);
    else if (micro->type == SHD_WEAVE)
        make_weave(micro, out);
    else
        make_heights(micro, out);
    find_areas(out);
    out->lowest = out->highest = out->height[0];
    for (int i = 0; i < out->size * out->size; i++) {
        if (out->height[i] < out->lowest) out->lowest = out->height[i];
        if (out->height[i] > out->highest) out->highest = out->height[i];
    }
}

/* ---- Points. ---- */

static int floor_of(double x) {
    const int i = (int)x;
    return i - (x < i);
}

static double height_at(const shd_relief *relief, int x, int y) {
    const int mask = relief->size - 1;
    return relief->height[(y & mask) * relief->size + (x & mask)];
}

/* The point over (x, y) on the plane of the triangle that (tx, ty) is over. */
static shd_relief_point point_on(const shd_relief *relief, double x, double y, double tx,
                                 double ty) {
    const int i = floor_of(tx), j = floor_of(ty);
    const bool upper = tx - i + (ty - j) > 1;
    const double right = height_at(relief, i + 1, j), top = height_at(relief, i, j + 1),
                 corner = height_at(relief, i + upper, j + upper);
    const double a = upper ? corner - top : right - corner,
                 b = upper ? corner - right : top - corner;
    const double z = corner + a * (x - (i + upper)) + b * (y - (j + upper));
    return (shd_relief_point){x, y, z,
                              shd_scale((shd_vec3){-a, -b, 1}, 1 / sqrt(a * a + b * b + 1))};
}

shd_relief_point shd_relief_at(const shd_relief *relief, double x, double y) {
    return point_on(relief, x, y, x, y);
}

shd_relief_point shd_relief_pick(const shd_relief *relief, const double numbers[3]) {
    const int count = 2 * relief->size * relief->size;
    if (count <= 8)
        return shd_relief_at(relief, numbers[0] * relief->size, numbers[1] * relief->size);
    const double sought = numbers[0] * relief->area[count - 1];
    int low = 0, high = count - 1; /* the first whose sum is above what is sought */
    while (low < high) {
        const int middle = (low + high) / 2;
        if (relief->area[middle] > sought)
            high = middle;
        else
            low = middle + 1;
    }
    double a = numbers[1], b = numbers[2];
    const bool upper = low % 2;
    if ((a + b > 1) != upper) {
        a = 1 - a;
        b = 1 - b;
    }
    const int cell = low / 2;
    const double inside = 0.25 + 0.5 * upper, x = cell % relief->size, y = cell / relief->size;
    return point_on(relief, x + a, y + b, x + inside, y + inside);
}

/* ---- Ways over the grid: from edge to edge of the triangles. ---- */

typedef struct walk {
    const shd_relief *relief;
    double x, y, dx, dy; /* where it began, and its unit direction */
    /* Lines of constant x, y and x + y: how far the next one is, from line to line, and its number.
     */
    double next[3], step[3];
    int line[3], sign[3];
} walk;

static void aim_at_lines(walk *w, int k, double place, double speed) {
    const int below = floor_of(place);
    w->sign[k] = speed < 0 ? -1 : 1;
    w->line[k] = speed < 0 ? (place > below ? below : below - 1) : below + 1;
    const bool never = fabs(speed) < 1e-12;
    w->step[k] = never ? (double)INFINITY : 1 / fabs(speed);
    w->next[k] = never ? (double)INFINITY : ((double)w->line[k] - place) / speed;
}

static walk walk_from(const shd_relief *relief, double x, double y, double dx, double dy) {
    walk w = {.relief = relief, .x = x, .y = y, .dx = dx, .dy = dy};
    aim_at_lines(&w, 0, x, dx);
    aim_at_lines(&w, 1, y, dy);
    aim_at_lines(&w, 2, x + y, dx + dy);
    return w;
}

/* Goes to the next edge. Returns how far it is from the beginning; *height is the surface's. */
static double walk_on(walk *w, double *height) {
    const double *next = w->next;
    const int k = next[0] < next[1] ? (next[0] < next[2] ? 0 : 2) : (next[1] < next[2] ? 1 : 2);
    const double s = next[k];
    const int line = w->line[k];
    w->next[k] += w->step[k];
    w->line[k] += w->sign[k];
    const double along = k == 1 ? w->x + s * w->dx : k == 0 ? w->y + s * w->dy : w->x + s * w->dx;
    const int i = floor_of(along);
    const double f = along - i;
    double from, to;
    if (k == 0) {
        from = height_at(w->relief, line, i);
        to = height_at(w->relief, line, i + 1);
    } else if (k == 1) {
        from = height_at(w->relief, i, line);
        to = height_at(w->relief, i + 1, line);
    } else {
        from = height_at(w->relief, i, line - i);
        to = height_at(w->relief, i + 1, line - i - 1);
    }
    *height = from + f * (to - from);
    return s;
}

/* Heights have rounding errors, so that slopes over shorter ways than this mean nothing. */
static const double SHORT = 1e-6;

double shd_relief_horizon(const shd_relief *relief, const shd_relief_point *from, double dx,
                          double dy, double least) {
    walk w = walk_from(relief, from->x, from->y, dx, dy);
    const double room = relief->highest - from->z;
    for (double s = 0, height; s * least < room;) {
        s = walk_on(&w, &height);
        if (s > SHORT && height - from->z > least * s) least = (height - from->z) / s;
    }
    return least;
}

bool shd_relief_cast(const shd_relief *relief, const shd_relief_point *from, shd_vec3 way,
                     shd_relief_point *out) {
    enum { STEPS = 1 << 14 }; /* a ray that is so level has gone over thousands of periods */
    const double level = sqrt(way.x * way.x + way.y * way.y);
    if (level < 1e-9) return false;
    const double dx = way.x / level, dy = way.y / level, slope = way.z / level;
    walk w = walk_from(relief, from->x, from->y, dx, dy);
    double before = 0, gap_before = 0;
    for (int k = 0; k < STEPS; k++) {
        double height;
        const double s = walk_on(&w, &height), z = from->z + slope * s, gap = z - height;
        if (s > SHORT && gap_before > 0 && gap <= 0) {
            const double at = before + (s - before) * (gap_before / (gap_before - gap)),
                         middle = (before + s) / 2;
            const double tx = from->x + middle * dx, ty = from->y + middle * dy;
            const int mask = relief->size - 1, i = floor_of(tx) - (floor_of(tx) & mask),
                      j = floor_of(ty) - (floor_of(ty) & mask);
            *out = point_on(relief, from->x + at * dx - i, from->y + at * dy - j, tx - i, ty - j);
            return true;
        }
        if (slope >= 0 && z > relief->highest) return false;
        before = s;
        gap_before = gap;
    }
    return false;
}
