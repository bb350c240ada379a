#include "shade/around.h"

#include <string.h>

#include "shade/around_parts.h"
#include "shade/gauss.h"

/* How far a block or a cell may reach, of the lobe's width; and what has a kink, of that which the
 * kink is wide. */
static const double BLOCK = 0.45, CELL = 0.42, KINK = 0.08;

/* Lobes count up to e^-14 of their peaks. */
static const double FAINT = 14;

/* Blocks count by nodes of this order. */
enum { DEEPEST = 24, ORDER = 1, NODES = 4 };

typedef struct walk {
    const shd_surroundings *map;
    const shd_moments *moments;
    const shd_around_lobe *lobe;
    double viewing; /* N.V */
    shd_around_ways to;
} walk;

/* ---- How the lobe is around a direction. ---- */

typedef struct look {
    double side;  /* N.L */
    double width; /* over which f changes */
    double faint; /* f is e^-faint of its peak at most */
    double kink;  /* what is in the way may be as large as this; INFINITY: there is none */
} look;

static double angle_between(double cosine) {
    return acos(fmin(fmax(cosine, -1), 1));
}

static double faint_power(double n, double angle) {
    return angle <= 0 ? 0 : angle >= SHD_PI / 2 ? INFINITY : -n * log(cos(angle));
}

/* Beckmann's distribution rises beside its middle if it is rough. */
static double faint_facets(double m, double angle) {
    if (angle <= 0) return 0;
    if (angle >= SHD_PI / 2) return INFINITY;
    const double x = tan(angle) * tan(angle);
    return fmax(x / (m * m) - 2 * log1p(x), 0);
}

/* Of H = (L + V) / |L + V|, which L turns by as much over |L + V|, and by half toward V. */
static void look_at_half(const walk *w, shd_vec3 c, double reach, look *out) {
    const shd_around_lobe *l = w->lobe;
    const bool blinn = l->model == SHD_MODEL_BLINN_PHONG;
    const shd_vec3 sum = shd_add(c, l->view);
    const double length = shd_length(sum), rest = fmax(length - reach, 0), m = l->sharpness,
                 own = blinn ? 1 / sqrt(fmax(m, 1)) : m * sqrt(0.5);
    double tilt = (angle_between(shd_dot(c, l->mirror)) - reach) / 2;
    if (2 * reach < length)
        tilt = fmax(tilt, angle_between(shd_dot(l->normal, sum) / length) - 1.05 * reach / length);
    out->faint = blinn ? faint_power(m, tilt) : faint_facets(m, tilt);
    out->width = rest * fmin(own, 0.4);
}

/* Where G becomes another of its three: 2 N.H N.V / V.H is 2 (N.L + N.V) N.V / (1 + L.V), and so
 * on. */
static double kink_of_facets(const walk *w, shd_vec3 c, double side, double reach) {
    const double v = w->viewing, between = 1 + shd_dot(w->lobe->view, c),
                 length = sqrt(2 * fmax(between, 0));
    const double by_view = 2 * (side + v) * v - between, by_light = 2 * (side + v) * side - between,
                 steep = 2 * (2 * fabs(side) + 2 * reach + v) + 1;
    const bool near = (fabs(by_view) < (2 * v + 1) * reach && v < side + reach) ||
                      (fabs(by_light) < steep * reach && side < v + reach) ||
                      (fabs(side - v) < reach && by_view < (2 * v + 1) * reach) || side < reach;
    return near ? KINK * length : INFINITY;
}

/* The horizon is a kink where f is 0 on it, and N.L = N.V may be; so is the edge of a low power. */
static look look_at(const walk *w, shd_vec3 c, double reach) {
    const shd_around_lobe *l = w->lobe;
    look out = {shd_dot(l->normal, c), 0.8, 0, INFINITY};
    if (!(out.side > -reach)) return out;
    const double n = l->sharpness, v = fmax(w->viewing, 0);
    if (l->model == SHD_MODEL_OREN_NAYAR) {
        if (fabs(shd_dot(l->view, c) - out.side * v) < reach || out.side < reach) out.kink = KINK;
        if (fabs(out.side - v) < reach) out.kink = KINK * fmax(v, 0.2);
    } else if (l->model == SHD_MODEL_COOK_TORRANCE) {
        look_at_half(w, c, reach, &out);
        out.kink = kink_of_facets(w, c, out.side, reach);
    } else if (l->model == SHD_MODEL_BLINN_PHONG) {
        look_at_half(w, c, reach, &out);
    } else {
        const double shine = shd_dot(c, l->mirror);
        out.faint = faint_power(n, angle_between(shine) - reach);
        out.width = fmin(1 / sqrt(fmax(n, 1)), 0.6);
        const bool rises = out.side < reach && !shd_ends_as_off_a_cliff(l->model);
        if (rises || (n < 4 && shine < reach)) out.kink = KINK * out.width;
    }
    return out;
}

/* Derivatives of a faint part of a lobe are as faint, but for powers of what is away. */
static bool is_smooth(const look *at, double reach, double part) {
    return reach <= part * at->width * exp(0.13 * fmin(at->faint, 10.6)) && reach <= at->kink;
}

/* ---- Cells and parts of them. ---- */

typedef struct cell {
    const float *upper, *lower; /* rows of texels */
    size_t left, right;         /* components of columns */
    double turn, wide, down, high;
} cell;

typedef struct part {
    double turn, wide, down, high;
} part;

static inline void add_place(walk *w, const cell *c, shd_turned turn, shd_turned down, double s,
                             double t, double by) {
    double v[3];
    for (size_t k = 0; k < 3; k++) {
        const double a = (double)c->upper[c->left + k], b = (double)c->upper[c->right + k],
                     d = (double)c->lower[c->left + k], e = (double)c->lower[c->right + k];
        const double above = a + s * (b - a), below = d + s * (e - d);
        v[k] = by * down.sine * (above + t * (below - above));
    }
    shd_add_way(&w->to, shd_turned_to(turn, down), v[0], v[1], v[2]);
}

static shd_turned turned(double angle) {
    return (shd_turned){cos(angle), sin(angle)};
}

static void add_whole(walk *w, const cell *c, const part *p) {
    shd_turned turns[2];
    for (int e = 0; e < 2; e++) turns[e] = turned(p->turn + p->wide * shd_gauss2[e].at);
    for (int d = 0; d < 2; d++) {
        const double at = p->down + p->high * shd_gauss2[d].at;
        const shd_turned down = turned(at);
        for (int e = 0; e < 2; e++) {
            const double turn = p->turn + p->wide * shd_gauss2[e].at;
            add_place(w, c, turns[e], down, (turn - c->turn) / c->wide, (at - c->down) / c->high,
                      p->wide * p->high * shd_gauss2[d].weight * shd_gauss2[e].weight);
        }
    }
}

/* One meridian of a part, before the horizon: on it N.L is a cosine of latitude. */
static void add_meridian(walk *w, const cell *c, const part *p, double at, double by) {
    const shd_vec3 n = w->lobe->normal;
    const shd_turned turn = turned(at);
    double middle = atan2(n.z * turn.cosine - n.x * turn.sine, n.y);
    if (middle < -SHD_PI / 2) middle += 2 * SHD_PI;
    const double low = fmax(p->down, middle - SHD_PI / 2),
                 high = fmin(p->down + p->high, middle + SHD_PI / 2);
    for (int d = 0; d < 2 && low < high; d++) {
        const double down = low + (high - low) * shd_gauss2[d].at;
        add_place(w, c, turn, turned(down), (at - c->turn) / c->wide, (down - c->down) / c->high,
                  by * (high - low) * shd_gauss2[d].weight);
    }
}

/* Where the horizon goes through the latitude: up to two longitudes, added to cuts within from ..
 * from + wide. */
static int cut_at(shd_vec3 n, double down, double from, double wide, double *cuts) {
    const double aside = hypot(n.x, n.z) * sin(down), x = -n.y * cos(down) / aside;
    int count = 0;
    if (!(fabs(x) < 1)) return 0;
    for (int k = -1; k <= 1; k += 2) {
        double at = k * acos(x) - atan2(n.x, n.z) - from;
        at -= 2 * SHD_PI * floor(at / (2 * SHD_PI));
        if (at < wide) cuts[count++] = from + at;
    }
    return count;
}

/* The horizon is cut where it leaves the part, so that what is between is smooth. */
static void add_cut(walk *w, const cell *c, const part *p) {
    double cuts[6] = {p->turn};
    int count = 1;
    count += cut_at(w->lobe->normal, p->down, p->turn, p->wide, cuts + count);
    count += cut_at(w->lobe->normal, p->down + p->high, p->turn, p->wide, cuts + count);
    for (int i = 1; i < count; i++)
        for (int k = i; k > 0 && cuts[k] < cuts[k - 1]; k--) {
            const double kept = cuts[k];
            cuts[k] = cuts[k - 1];
            cuts[k - 1] = kept;
        }
    cuts[count] = p->turn + p->wide;
    for (int i = 0; i < count; i++) {
        const double wide = cuts[i + 1] - cuts[i];
        for (int e = 0; e < 2 && wide > 0; e++)
            add_meridian(w, c, p, cuts[i] + wide * shd_gauss2[e].at, wide * shd_gauss2[e].weight);
    }
}

static void walk_part(walk *w, const cell *c, const part *p, int depth) {
    const shd_turned down = turned(p->down + p->high / 2);
    const double sine = fmin(fabs(down.sine) + p->high / 2, 1), across = p->wide * sine,
                 reach = hypot(across, p->high) / 2;
    const look at = look_at(w, shd_turned_to(turned(p->turn + p->wide / 2), down), reach);
    if (at.side <= -reach || at.faint > FAINT) return;
    if (depth == DEEPEST || is_smooth(&at, reach, CELL)) {
        if (at.side >= reach)
            add_whole(w, c, p);
        else
            add_cut(w, c, p);
        return;
    }
    part half = *p;
    if (across > p->high) {
        half.wide /= 2;
        walk_part(w, c, &half, depth + 1);
        half.turn += half.wide;
    } else {
        half.high /= 2;
        walk_part(w, c, &half, depth + 1);
        half.down += half.high;
    }
    walk_part(w, c, &half, depth + 1);
}

static void walk_cell(walk *w, int i, int j) {
    const shd_surroundings *map = w->map;
    const size_t wide = (size_t)map->width;
    const int h = map->height;
    cell c = {.upper = map->texels + 3 * wide * (size_t)(j > 0 ? j - 1 : 0),
              .lower = map->texels + 3 * wide * (size_t)(j < h ? j : h - 1),
              .left = 3 * (size_t)i,
              .right = 3 * (((size_t)i + 1) % wide),
              .turn = shd_cell_turn(map->width, i),
              .wide = 2 * SHD_PI / map->width,
              .down = shd_cell_down(h, j)};
    c.high = shd_cell_down(h, j + 1) - c.down;
    const part whole = {c.turn, c.wide, c.down, c.high};
    walk_part(w, &c, &whole, 0);
}

/* ---- Blocks. ---- */

static void add_block(walk *w, int level, int column, int row, const shd_moment_block *b) {
    const int side = shd_moment_side_at(ORDER);
    const shd_turned *turns =
                         shd_moment_turns_of(w->moments, level) + SHD_MOMENT_SIDE * column + side,
                     *downs = shd_moment_downs_of(w->moments, level) + SHD_MOMENT_SIDE * row + side;
    for (int m = 0, k = shd_moment_nodes_at(ORDER); m < NODES; m++)
        for (int n = 0; n < NODES; n++, k++)
            shd_add_way(&w->to, shd_turned_to(turns[n], downs[m]), (double)b->weights[0][k],
                        (double)b->weights[1][k], (double)b->weights[2][k]);
}

static void walk_block(walk *w, int level, int column, int row) {
    const shd_moment_level *l = &w->moments->levels[level];
    const shd_moment_block *b =
        shd_moment_blocks_of(w->moments, level) + (size_t)row * (size_t)l->columns + column;
    const double reach = (double)b->reach;
    const shd_vec3 middle = {(double)b->middle[0], (double)b->middle[1], (double)b->middle[2]};
    const look at = look_at(w, middle, reach);
    if (at.side <= -reach || at.faint > FAINT || !(b->light[0] + b->light[1] + b->light[2] > 0))
        return;
    const bool whole = at.side >= reach || !shd_ends_as_off_a_cliff(w->lobe->model);
    if (whole && is_smooth(&at, reach, BLOCK)) {
        add_block(w, level, column, row, b);
        return;
    }
    if (level == 0) {
        for (int j = row * l->size; j < (row + 1) * l->size && j <= w->map->height; j++)
            for (int i = column * l->size; i < (column + 1) * l->size && i < w->map->width; i++)
                walk_cell(w, i, j);
        return;
    }
    const shd_moment_level *finer = l - 1;
    for (int j = 2 * row; j < 2 * row + 2 && j < finer->rows; j++)
        for (int i = 2 * column; i < 2 * column + 2 && i < finer->columns; i++)
            walk_block(w, level - 1, i, j);
}

/* False: the whole lobe is 0. */
static bool begin(walk *w, const shd_surroundings *map, const shd_around_lobe *lobe,
                  const shd_around_function *f, double (*out)[SHD_WAY_SUMS]) {
    w->map = map;
    w->moments = NULL;
    w->lobe = lobe;
    w->viewing = shd_dot(lobe->normal, lobe->view);
    shd_begin_ways(&w->to, f, out);
    return lobe->model != SHD_MODEL_COOK_TORRANCE || w->viewing > 0;
}

void shd_around_sum(const shd_surroundings *map, const shd_moments *moments,
                    const shd_around_lobe *lobe, const shd_around_function *f,
                    double (*out)[SHD_WAY_SUMS]) {
    walk w; /* its ways are large */
    if (!begin(&w, map, lobe, f, out)) return;
    w.moments = moments;
    if (moments) {
        const int top = moments->level_count - 1;
        for (int j = 0; j < moments->levels[top].rows; j++)
            for (int i = 0; i < moments->levels[top].columns; i++) walk_block(&w, top, i, j);
    } else {
        for (int j = 0; j <= map->height; j++)
            for (int i = 0; i < map->width; i++) walk_cell(&w, i, j);
    }
    shd_end_ways(&w.to);
}

void shd_around_cell(const shd_surroundings *map, const shd_around_lobe *lobe,
                     const shd_around_function *f, int i, int j, double (*out)[SHD_WAY_SUMS]) {
    walk w;
    if (!begin(&w, map, lobe, f, out)) return;
    walk_cell(&w, i, j);
    shd_end_ways(&w.to);
}
