#include "attack/prints.h"

enum { MOST_CORNERS = 12, MOST_CELLS = 3000 };

/* A convex part of the chart, in the pattern's own units. */
typedef struct polygon {
    real at[MOST_CORNERS][2];
    int count;
} polygon;

/* The part where `sign` times what it has on an axis is at most `sign` times `edge`. */
static polygon cut(const polygon *p, int axis, real edge, int sign) {
    polygon out = {.count = 0};
    for (int k = 0; k < p->count; k++) {
        const real *a = p->at[k], *b = p->at[(k + 1) % p->count];
        const real in = sign * (edge - a[axis]), next = sign * (edge - b[axis]);
        if (in >= 0 && out.count < MOST_CORNERS) {
            out.at[out.count][0] = a[0];
            out.at[out.count++][1] = a[1];
        }
        if ((in < 0) == (next < 0) || out.count == MOST_CORNERS) continue;
        const real along = in / (in - next);
        for (int c = 0; c < 2; c++) out.at[out.count][c] = a[c] + along * (b[c] - a[c]);
        out.at[out.count++][axis] = edge;
    }
    return out;
}

static polygon cut_to(const polygon *p, int axis, real from, real to) {
    const polygon below = cut(p, axis, to, 1);
    return cut(&below, axis, from, -1);
}

/* Its area, and the mean of its first axis. */
static real area_of(const polygon *p, real *middle) {
    real sum = 0, moment = 0;
    const real *o = p->at[0];
    for (int k = 1; k + 1 < p->count; k++) {
        const real *a = p->at[k], *b = p->at[k + 1];
        const real twice = (a[0] - o[0]) * (b[1] - o[1]) - (a[1] - o[1]) * (b[0] - o[0]);
        sum += twice;
        moment += twice * (o[0] + a[0] + b[0]) / 3;
    }
    *middle = sum != 0 ? moment / sum : p->count ? o[0] : 0;
    return SIZE(sum) / 2;
}

static void extent_of(const polygon *p, int axis, real *low, real *high) {
    *low = *high = p->at[0][axis];
    for (int k = 1; k < p->count; k++) {
        *low = smaller(*low, p->at[k][axis]);
        *high = larger(*high, p->at[k][axis]);
    }
}

/* Rounds down. */
static real whole(real x) {
    const real at = (real)(long long)x;
    return at > x ? at - 1 : at;
}

static bool is_odd(real cell) {
    return cell - 2 * whole(cell / 2) != 0;
}

/* ---- Means. ---- */

/* What w may be. */
typedef struct range {
    real low, high;
} range;

static const range ANYTHING = {0, 1};

/* How much of a whole cell's square, or of a strip of it, has w = 1. */
static real share_of(const print *p, const polygon *all, real i, real j, real *area) {
    real middle;
    const real in = p->kind == GRID_PRINT ? p->width / 2 : 0;
    const polygon strip = cut_to(all, 1, j + in, j + 1 - in);
    if (strip.count < 3) return *area = 0;
    const polygon cell = cut_to(&strip, 0, i + in, i + 1 - in);
    return *area = cell.count < 3 ? 0 : area_of(&cell, &middle);
}

/* Checks and lines, of all that there is. False: there are too many. */
static bool mean_of_cells(const print *p, const polygon *all, real area, real *mean) {
    real low[2], high[2], sum = 0;
    for (int c = 0; c < 2; c++) extent_of(all, c, &low[c], &high[c]);
    if ((high[1] - low[1] + 1) * (high[0] - low[0] + 1) > MOST_CELLS) return false;
    for (real j = whole(low[1]); j <= high[1]; j += 1)
        for (real i = whole(low[0]); i <= high[0]; i += 1) {
            real of;
            share_of(p, all, i, j, &of);
            if (p->kind == GRID_PRINT || is_odd(i + j)) sum += of;
        }
    *mean = p->kind == GRID_PRINT ? 1 - sum / area : sum / area;
    return true;
}

static real ramp_at(const print *p, real s, real cell) {
    if (p->wrap == WRAP_CLAMP) return smaller(larger(s, 0), 1);
    return p->wrap == WRAP_MIRROR && is_odd(cell) ? 1 - (s - cell) : s - cell;
}

static bool mean_of_ramp(const print *p, const polygon *all, real area, real *mean) {
    real low, high, sum = 0, middle;
    extent_of(all, 0, &low, &high);
    if (high - low > MOST_CELLS) return false;
    for (real i = whole(low); i <= high; i += 1) {
        const polygon cell = cut_to(all, 0, i, i + 1);
        if (cell.count < 3) continue;
        const real of = area_of(&cell, &middle);
        sum += of * ramp_at(p, middle, i);
    }
    *mean = sum / area;
    return true;
}

static real length_of(const real v[2]) {
    return ROOT(v[0] * v[0] + v[1] * v[1]);
}

/* Whether all of it, and what is 0.001 beside it, is within one cell, and of a grid within or
 * without its lines. */
static bool is_even(const print *p, const polygon *all, real *w) {
    const real slack = (real)0.001, in = p->kind == GRID_PRINT ? p->width / 2 : 0;
    real low[2], high[2];
    bool between = true, one = true;
    for (int c = 0; c < 2; c++) {
        extent_of(all, c, &low[c], &high[c]);
        low[c] -= slack, high[c] += slack;
        const real cell = whole(low[c]);
        one = one && high[c] < cell + 1;
        between = between && low[c] > cell + in && high[c] < cell + 1 - in;
    }
    *w = p->kind == GRID_PRINT ? 0 : is_odd(whole(low[0]) + whole(low[1]));
    return p->kind == GRID_PRINT ? between : one;
}

/* Waves finer than pixels fade, from 0.7 to 1.1 of a pixel's narrow side; how is not told. */
static range faded(const print *p, real mean, real narrow) {
    const real gone = p->kind == GRID_PRINT ? 1 - (1 - p->width) * (1 - p->width) : (real)0.5;
    if (narrow >= (real)1.1) return (range){gone, gone};
    if (narrow <= (real)0.7) return (range){mean, mean};
    return (range){smaller(mean, gone), larger(mean, gone)};
}

/* Means of long parallelograms are cut, and those of tiny ones widened by 0.0001. */
static range mean_of(const print *p, const polygon *all, const real x[2], const real y[2]) {
    enum { CUT = 60 };
    real mean, middle, slack = (real)1e-7;
    const real area = area_of(all, &middle), longest = larger(length_of(x), length_of(y)),
               narrow = longest > 0 ? area / longest : 0;
    if (p->kind == NOISE_PRINT || !(longest < (real)1e9)) return ANYTHING;
    if (p->kind != RAMP_PRINT && is_even(p, all, &mean)) return (range){mean, mean};
    if (p->kind != RAMP_PRINT && narrow >= (real)1.1) return faded(p, 0, narrow);
    if (narrow < (real)1e-6) return ANYTHING; /* of uvs without an area */
    if (smaller(SIZE(x[0]), SIZE(x[1])) > CUT || smaller(SIZE(y[0]), SIZE(y[1])) > CUT)
        return ANYTHING;
    if (narrow < (real)0.001 || smaller(length_of(x), length_of(y)) < (real)0.001) {
        if (longest < (real)0.1) return ANYTHING;
        slack = (real)0.005;
    }
    if (p->kind == RAMP_PRINT ? !mean_of_ramp(p, all, area, &mean)
                              : !mean_of_cells(p, all, area, &mean))
        return ANYTHING;
    const range out = p->kind == RAMP_PRINT ? (range){mean, mean} : faded(p, mean, narrow);
    return (range){larger(out.low - slack, 0), smaller(out.high + slack, 1)};
}

/* ---- Charts, of which only a place and its slopes are asked for. ---- */

/* (u, v) of a point in the thing's own frame. */
static void chart_at(const thing *t, const printed_place *place, point p, real out[2]) {
    const point n = place->normal, size = t->solid.size;
    const real radius = t->solid.radius;
    if (t->solid.form == MESH) {
        const point *c = t->corners + 3 * place->triangle, ab = sub(c[1], c[0]),
                    ac = sub(c[2], c[0]), normal = cross(ab, ac), from = sub(p, c[0]);
        const real square = dot(normal, normal), b = dot(cross(from, ac), normal) / square,
                   a = dot(cross(ab, from), normal) / square;
        const real(*uv)[2] = t->uvs + 3 * place->triangle;
        for (int k = 0; k < 2; k++)
            out[k] = uv[0][k] + b * (uv[1][k] - uv[0][k]) + a * (uv[2][k] - uv[0][k]);
    } else if (t->solid.form == BOX) {
        const real x = p.x / size.x, y = p.y / size.y, z = p.z / size.z;
        const bool across = SIZE(n.x) > SIZE(n.y) && SIZE(n.x) > SIZE(n.z),
                   level = SIZE(n.y) > SIZE(n.x) && SIZE(n.y) > SIZE(n.z);
        out[0] = (real)0.5 + (level ? x : across ? (n.x > 0 ? -z : z) : n.z > 0 ? x : -x);
        out[1] = (real)0.5 + (!level ? y : n.y > 0 ? -z : z);
    } else {
        const bool plane = t->solid.form == PLANE;
        out[0] = plane ? p.x : (real)0.5 + p.x / (2 * radius);
        out[1] = plane ? -p.z : (real)0.5 - p.z / (2 * radius);
    }
}

/* Where a ray meets the tangent plane. */
static point meet_plane(const printed_place *place, point normal, point origin, point along) {
    return add(origin, times(along, dot(normal, sub(place->at, origin)) / dot(normal, along)));
}

/* The parallelogram in (s, t). False: rays meet the plane nearly along it, or far from the point.
 */
static bool find_part(const thing *t, const gaze *g, const printed_place *place, const print *p,
                      polygon *all, real sides[2][2]) {
    const point normal = unit(apply(t->cofactor, place->normal));
    const real facing = dot(normal, unit(g->way));
    if (SIZE(facing) < (real)1e-5) return false;
    const point middle = meet_plane(place, normal, g->origin, g->way);
    const real ratio = dot(normal, sub(place->at, g->origin)) == 0
                           ? 0
                           : length(sub(middle, g->origin)) / length(sub(place->at, g->origin));
    if (!g->orthographic && !(ratio > (real)0.51 && ratio < (real)1.9)) return false;
    real at[3][2];
    const point steps[2] = {g->right, g->down};
    for (int k = 0; k < 3; k++) {
        point q = middle;
        if (k) {
            const point step = steps[k - 1];
            point slope = sub(step, times(g->way, dot(normal, step) / dot(normal, g->way)));
            if (!g->orthographic)
                slope = times(slope, length(sub(middle, g->origin)) / length(g->way));
            q = add(middle, slope);
        }
        real uv[2];
        chart_at(t, place, apply(t->from_world, sub(q, t->origin)), uv);
        for (int c = 0; c < 2; c++)
            at[k][c] = p->map[c][0] * uv[0] + p->map[c][1] * uv[1] + p->map[c][2];
    }
    static const int signs[4][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
    for (int k = 0; k < 2; k++)
        for (int c = 0; c < 2; c++) sides[k][c] = at[k + 1][c] - at[0][c];
    all->count = 4;
    for (int k = 0; k < 4; k++)
        for (int c = 0; c < 2; c++)
            all->at[k][c] = at[0][c] + (signs[k][0] * sides[0][c] + signs[k][1] * sides[1][c]) / 2;
    return true;
}

/* ---- Coefficients. ---- */

static void mix(const print *p, range w, real low[3], real high[3]) {
    for (int c = 0; c < 3; c++) {
        const real span = p->colors[1][c] - p->colors[0][c], a = p->colors[0][c] + span * w.low,
                   b = p->colors[0][c] + span * w.high;
        low[c] = smaller(a, b);
        high[c] = larger(a, b);
    }
}

bool printed_stuff(const thing *t, const gaze *g, const printed_place *place, stuff *low,
                   stuff *high) {
    const stuff *from = &t->stuff;
    real constant[PRINTS][2][3];
    if (!from->printed) return false;
    *low = *high = *from;
    for (int k = 0; k < PRINTS; k++) {
        const print *p = &from->prints[k];
        real sides[2][2];
        polygon all;
        if (p->kind == NO_PRINT) continue;
        const range w = find_part(t, g, place, p, &all, sides)
                            ? mean_of(p, &all, sides[0], sides[1])
                            : ANYTHING;
        mix(p, w, constant[k][0], constant[k][1]);
    }
    for (size_t k = 0; k < from->lobe_count; k++) {
        if (!from->prints[GLOSS_PRINTS + k].kind) continue;
        low->lobes[k].shininess = constant[GLOSS_PRINTS + k][1][0];
        high->lobes[k].shininess = constant[GLOSS_PRINTS + k][0][0];
    }
    for (int c = 0; c < 3; c++) {
        const bool shines = from->prints[EMISSIVE_PRINT].kind,
                   fills = from->prints[AMBIENT_PRINT].kind;
        real *ends[2] = {&low->constant[c], &high->constant[c]};
        for (int e = 0; e < 2; e++) {
            const real emissive = shines ? constant[EMISSIVE_PRINT][e][c] : from->emissive[c],
                       ambient = fills ? constant[AMBIENT_PRINT][e][c] : from->ambient[c];
            *ends[e] = emissive + ambient * from->filled[c];
            stuff *out = e ? high : low;
            if (from->prints[DIFFUSE_PRINT].kind) out->diffuse[c] = constant[DIFFUSE_PRINT][e][c];
            for (size_t k = 0; k < from->lobe_count; k++)
                if (from->prints[LOBE_PRINTS + k].kind)
                    out->lobes[k].specular[c] = constant[LOBE_PRINTS + k][e][c];
        }
    }
    return true;
}
