#include "render/tiles/smooth.h"

#include <string.h>

#include "base/pattern.h"
#include "plan/around.h"
#include "plan/tier.h"
#include "shade/surrounded.h"

enum { SIDE = 4, NODES = SIDE * SIDE, MIDDLE = NODES, CHECKS = 4, RAYS = NODES + 1 + CHECKS };
enum { LEVELS = 3, CELLS = 1 + 4 + 16 };

/* Pixels of a cell's side; those of its nodes, which with half a pixel are near to Chebyshev's. */
static const int sides[LEVELS] = {32, 16, 8};
static const int pixels[LEVELS][SIDE] = {{1, 9, 22, 30}, {0, 4, 11, 15}, {0, 2, 5, 7}};

/* The pixels of places between nodes at which walks are held against the polynomial. Across and
 * down, what it leaves out may have other signs, and may change its sign in the middle of either,
 * so that few of them alone may see nothing of it. */
static const int checks[LEVELS][CHECKS][2] = {{{16, 16}, {16, 27}, {27, 16}, {27, 27}},
                                              {{8, 8}, {8, 13}, {13, 8}, {13, 13}},
                                              {{4, 4}, {4, 6}, {6, 4}, {6, 6}}};

/* Nodes' walks take this part of the share. The rest is for what polynomials are off: the most that
 * their cubic part is, and what the checks are off. */
static const double WALKS = 0.5, CUBIC = 1e-3, OFF = 5e-4;

/* Of a lobe's width: how far normals and views of a cell turn together, and what a sample's may be
 * off its polynomials. */
static const double TURNS = 1, STRAY = 3e-4;

/* What a lobe's part on the horizon, where Blinn's ends as off a cliff, may add. */
static const double CLIFF = 5e-4;

typedef struct cell {
    uint32_t object;        /* plus 1; 0: it is nobody's */
    bool met;               /* all nodes, the middle and the checks meet the object */
    uint8_t looked, holds;  /* bit k: of pair k */
    double turned[6][RAYS]; /* N and V */
    double (*logs)[NODES];  /* [3 pairs]: of weights; -INFINITY: none has any */
} cell;

struct shd_smooth {
    shd_known known;
    uint8_t *has;
    double **rows;
    shd_hits hits;
    cell cells[CELLS];
};

static bool is_walked(const shd_plan *plan, const shd_plan_light *light) {
    return light->environment && plan->moments && plan->moments[light->around];
}

/* Pairs of a material, at most SHD_KNOWN_MOST. */
static void list_pairs(const shd_plan *plan, const shd_plan_material *m, const uint32_t *which,
                       size_t lights, shd_known *out) {
    out->count = 0;
    for (size_t j = 0; j < lights; j++) {
        if (!is_walked(plan, &plan->lights[which[j]])) continue;
        for (size_t t = m->has_diffuse ? 0 : 1; t < 1 + m->lobe_count; t++) {
            if (shd_is_symmetric(m->model, t) || out->count == SHD_KNOWN_MOST) continue;
            out->light[out->count] = which[j];
            out->term[out->count++] = (uint32_t)t;
        }
    }
}

static size_t most_pairs(const shd_plan *plan) {
    size_t most = 0;
    for (size_t g = 0; g < plan->group_count; g++) {
        const shd_plan_group *group = &plan->groups[g];
        const shd_plan_material *m = &plan->materials[group->material];
        shd_known known = {.count = 0};
        if (!group->faceted && shd_may_share_walks(plan, m))
            list_pairs(plan, m, group->lights, group->light_count, &known);
        if (known.count > most) most = known.count;
    }
    return most;
}

shd_smooth *shd_smooth_lay_out(const shd_plan *plan, size_t length, shd_scratch *memory) {
    const size_t pairs = most_pairs(plan);
    if (!pairs) return NULL;
    shd_smooth counted, *made = shd_scratch_take(memory, 1, sizeof *made),
                        *s = made ? made : &counted;
    memset(s, 0, sizeof *s);
    s->has = shd_scratch_take(memory, length, sizeof *s->has);
    s->rows = shd_scratch_rows64(memory, 3 * pairs, length);
    shd_hits_lay_out(plan, RAYS, memory, &s->hits);
    double(*logs)[NODES] = shd_scratch_take(memory, CELLS * 3 * pairs, sizeof *logs);
    for (size_t k = 0; logs && k < CELLS; k++) s->cells[k].logs = logs + 3 * pairs * k;
    return made;
}

void shd_smooth_begin(shd_smooth *smooth) {
    for (size_t k = 0; smooth && k < CELLS; k++) smooth->cells[k].object = 0;
}

/* ---- Polynomials through nodes. ---- */

/* Where a sample is in a cell. */
typedef struct spot {
    double x[SIDE], y[SIDE]; /* weights */
} spot;

/* Nodes are in the middles of their pixels. */
static void weigh_nodes(int level, double at, double out[SIDE]) {
    const int *node = pixels[level];
    for (int i = 0; i < SIDE; i++) {
        out[i] = 1;
        for (int k = 0; k < SIDE; k++)
            if (k != i) out[i] *= (at - 0.5 - node[k]) / (node[i] - node[k]);
    }
}

static double polynomial_at(const double values[NODES], const spot *at) {
    double sum = 0;
    for (int j = 0; j < SIDE; j++) {
        const double *v = values + SIDE * j;
        sum += at->y[j] * (at->x[0] * v[0] + at->x[1] * v[1] + at->x[2] * v[2] + at->x[3] * v[3]);
    }
    return sum;
}

/* The most of the cubic part of a row, or of a column, of nodes. */
static double cubic_of(int level, const double *values, int step) {
    const int *node = pixels[level];
    const double half = (node[SIDE - 1] - node[0] + 1) / 2.0;
    double sum = 0;
    for (int i = 0; i < SIDE; i++) {
        double by = 1;
        for (int k = 0; k < SIDE; k++)
            if (k != i) by *= node[i] - node[k];
        sum += values[i * step] / by;
    }
    return fabs(sum) * half * half * half / 4;
}

/* ---- Cells. ---- */

typedef struct asked {
    const shd_scenery *scenery;
    const shd_smooth_run *run;
    shd_smooth *smooth;
} asked;

static shd_vec3 vector_of(const cell *c, int from, int node) {
    return (shd_vec3){c->turned[from][node], c->turned[from + 1][node], c->turned[from + 2][node]};
}

static spot spot_of(int level, double x, double y) {
    spot out;
    weigh_nodes(level, x, out.x);
    weigh_nodes(level, y, out.y);
    return out;
}

/* Casts rays through the nodes, at the object alone. */
static bool meet_nodes(const asked *a, int level, int left, int top, uint32_t object, cell *c) {
    const int samples = a->scenery->plan->scene->raster.samples;
    int32_t x[RAYS], y[RAYS];
    uint8_t sample[RAYS];
    memset(sample, (int)shd_center_sample((size_t)samples), sizeof sample);
    for (int k = 0; k < NODES; k++) {
        x[k] = left + pixels[level][k % SIDE];
        y[k] = top + pixels[level][k / SIDE];
    }
    x[MIDDLE] = left + sides[level] / 2;
    y[MIDDLE] = top + sides[level] / 2;
    for (int k = 0; k < CHECKS; k++) {
        x[MIDDLE + 1 + k] = left + checks[level][k][0];
        y[MIDDLE + 1 + k] = top + checks[level][k][1];
    }
    const shd_shots shots = {RAYS, x, y, sample};
    shd_hits *hits = &a->smooth->hits;
    hits->count = 0;
    if (shd_sight_shoot(a->scenery->sight, &object, 1, &shots, hits) != RAYS) return false;
    for (int k = 0; k < RAYS; k++)
        for (int i = 0; i < 3; i++) {
            c->turned[i][k] = hits->normal[i][k];
            c->turned[3 + i][k] = hits->view[i][k];
        }
    return true;
}

/* How far normals and views turn together, as the lobe of a model sees it. */
static double turn_of(shd_model model, shd_vec3 n, shd_vec3 v, shd_vec3 by_normal,
                      shd_vec3 by_view) {
    const double normal = shd_length(by_normal), view = shd_length(by_view);
    if (model == SHD_MODEL_PHONG_NORMALIZED) return 2 * normal + view;
    if (model == SHD_MODEL_OREN_NAYAR) return normal + view;
    return normal + view / (2 * shd_larger(shd_dot(n, v), 0.02));
}

static double width_of(const shd_plan_material *m, size_t term) {
    return shd_around_width(m->model, term ? m->lobes[term - 1].shininess : 0);
}

/* What a sample that sees n and v is off the cell's polynomials. */
static double stray_of(shd_model model, const cell *c, const spot *at, shd_vec3 n, shd_vec3 v) {
    double is[6];
    for (int k = 0; k < 6; k++) is[k] = polynomial_at(c->turned[k], at);
    return turn_of(model, n, v, shd_sub((shd_vec3){is[0], is[1], is[2]}, n),
                   shd_sub((shd_vec3){is[3], is[4], is[5]}, v));
}

/* Whether a pair's lobe may be smooth all over the cell. */
static bool may_hold(const asked *a, const cell *c, const spot *middle, size_t pair) {
    const shd_plan_material *m = a->run->material;
    const double width = width_of(m, a->smooth->known.term[pair]);
    const shd_vec3 n = vector_of(c, 0, MIDDLE), v = vector_of(c, 3, MIDDLE);
    for (int k = 0; k < NODES; k++) {
        const shd_vec3 other = vector_of(c, 0, k), view = vector_of(c, 3, k);
        if (!(shd_dot(other, view) > 0)) return false;
        if (!(turn_of(m->model, n, v, shd_sub(other, n), shd_sub(view, v)) <= TURNS * width))
            return false;
    }
    return stray_of(m->model, c, middle, n, v) <= STRAY * width;
}

static void walk_node(const asked *a, const cell *c, uint32_t object, size_t pair, int node,
                      double row[3]) {
    const shd_scenery *scenery = a->scenery;
    const shd_known *known = &a->smooth->known;
    shd_surface at = {.normal = vector_of(c, 0, node),
                      .view = vector_of(c, 3, node),
                      .material = a->run->material,
                      .object = object};
    at.mirror = shd_sub(shd_scale(at.normal, 2 * shd_dot(at.normal, at.view)), at.view);
    shd_walk_environment(scenery->plan, scenery->lighting,
                         &scenery->plan->lights[known->light[pair]], &at, known->term[pair],
                         WALKS * SHD_QUICK_SHARE, row);
}

/* Whether the polynomials of a row or a column are flat enough. */
static bool is_flat(int level, double (*logs)[NODES], int first, int step) {
    for (int i = 0; i < 3; i++)
        if (logs[i][0] > -INFINITY && !(cubic_of(level, logs[i] + first, step) <= CUBIC))
            return false;
    return true;
}

/* Channels in which nothing arrives are as dark at all nodes. */
static bool take_node(const asked *a, const cell *c, uint32_t object, size_t pair, int node) {
    double row[3];
    walk_node(a, c, object, pair, node, row);
    for (int i = 0; i < 3; i++) {
        double *logs = c->logs[3 * pair + (size_t)i];
        logs[node] = row[i] > 0 ? log(row[i]) : -INFINITY;
        if (!(row[i] >= 0) || (logs[node] > -INFINITY) != (logs[0] > -INFINITY)) return false;
    }
    return true;
}

/* What Blinn's lobe is on the horizon at most: cos^n of half of the way from V to it. */
static double cliff_of(const asked *a, const cell *c, size_t pair) {
    const shd_known *known = &a->smooth->known;
    const shd_plan_material *m = a->run->material;
    const shd_light *from = a->scenery->plan->lights[known->light[pair]].environment;
    if (m->model != SHD_MODEL_BLINN_PHONG) return 0;
    double least = 1;
    for (int k = 0; k < NODES; k++)
        least = shd_smaller(least, shd_dot(vector_of(c, 0, k), vector_of(c, 3, k)));
    return pow(cos(asin(least) / 2), m->lobes[known->term[pair] - 1].shininess) *
           shd_around_most(from, 0);
}

/* Whether that is nothing beside what arrives. */
static bool is_no_cliff(const asked *a, const cell *c, size_t pair) {
    const double cliff = cliff_of(a, c, pair);
    for (size_t i = 3 * pair; cliff > 0 && i < 3 * pair + 3; i++)
        for (int k = 0; k < NODES; k++)
            if (c->logs[i][k] > -INFINITY && !(cliff <= CLIFF * exp(c->logs[i][k]))) return false;
    return true;
}

/* Whether a walk at a check makes what the polynomial does there. */
static bool is_close(const asked *a, int level, uint32_t object, size_t pair, int check,
                     const cell *c) {
    const int *pixel = checks[level][check];
    const spot at = spot_of(level, pixel[0] + 0.5, pixel[1] + 0.5);
    double row[3];
    walk_node(a, c, object, pair, MIDDLE + 1 + check, row);
    for (int i = 0; i < 3; i++) {
        const double *logs = c->logs[3 * pair + (size_t)i];
        if (!(logs[0] > -INFINITY) && row[i] == 0) continue;
        if (!(fabs(log(row[i]) - polynomial_at(logs, &at)) <= OFF)) return false;
    }
    return true;
}

/* Walks at the nodes, the first row and column first. */
static bool find_pair(const asked *a, int level, uint32_t object, const spot *middle, size_t pair,
                      cell *c) {
    double(*logs)[NODES] = c->logs + 3 * pair;
    if (!may_hold(a, c, middle, pair)) return false;
    for (int k = 0; k < SIDE; k++)
        if (!take_node(a, c, object, pair, k)) return false;
    if (!is_flat(level, logs, 0, 1)) return false;
    for (int k = 1; k < SIDE; k++)
        if (!take_node(a, c, object, pair, SIDE * k)) return false;
    if (!is_flat(level, logs, 0, SIDE)) return false;
    for (int k = SIDE; k < NODES; k++)
        if (k % SIDE && !take_node(a, c, object, pair, k)) return false;
    for (int k = 1; k < SIDE; k++)
        if (!is_flat(level, logs, k * SIDE, 1) || !is_flat(level, logs, k, SIDE)) return false;
    if (!is_no_cliff(a, c, pair)) return false;
    for (int k = 0; k < CHECKS; k++)
        if (!is_close(a, level, object, pair, k, c)) return false;
    return true;
}

/* The cell of a level that a pixel is in, with what is known of the pairs `asked_for`. */
static cell *find_cell(const asked *a, int level, int x, int y, uint32_t object,
                       unsigned asked_for) {
    static const int first[LEVELS] = {0, 1, 5};
    const int side = sides[level], across = SHD_TILE / side, left = x / side * side,
              top = y / side * side;
    cell *c = &a->smooth->cells[first[level] + y % SHD_TILE / side * across + x % SHD_TILE / side];
    if (c->object != object + 1) {
        c->object = object + 1;
        c->looked = c->holds = 0;
        c->met = meet_nodes(a, level, left, top, object, c);
    }
    const unsigned left_out = c->met ? asked_for & ~(unsigned)c->looked : 0;
    if (!left_out) return c;
    const spot middle = spot_of(level, side / 2 + 0.5, side / 2 + 0.5);
    for (size_t k = 0; k < a->smooth->known.count; k++)
        if (left_out >> k & 1 && find_pair(a, level, object, &middle, k, c))
            c->holds = (uint8_t)(c->holds | 1u << k);
    c->looked = (uint8_t)(c->looked | left_out);
    return c;
}

/* What cells tell of a hit. */
static void know_hit(const asked *a, size_t i, const shd_tile_scratch *s) {
    const shd_hits *hits = a->run->hits;
    const shd_plan_material *m = a->run->material;
    shd_smooth *smooth = a->smooth;
    const uint32_t shot = hits->shot[i], object = (uint32_t)hits->object[i];
    const int samples = a->scenery->plan->scene->raster.samples;
    unsigned open = (1u << smooth->known.count) - 1;
    smooth->has[i] = 0;
    if (s->sample[shot] >= samples) return;
    double off[2];
    shd_sample_offset(s->sample[shot], samples, &off[0], &off[1]);
    const shd_vec3 n = {hits->normal[0][i], hits->normal[1][i], hits->normal[2][i]},
                   v = {hits->view[0][i], hits->view[1][i], hits->view[2][i]};
    for (int level = 0; level < LEVELS && open; level++) {
        const int x = s->x[shot], y = s->y[shot], side = sides[level];
        const cell *c = find_cell(a, level, x, y, object, open);
        if (!(c->holds & open)) continue;
        const spot at = spot_of(level, x % side + off[0], y % side + off[1]);
        const double stray = stray_of(m->model, c, &at, n, v);
        for (size_t k = 0; k < smooth->known.count; k++) {
            const double most = STRAY * width_of(m, smooth->known.term[k]);
            if (!((c->holds & open) >> k & 1) || !(stray <= most)) continue;
            for (size_t r = 3 * k; r < 3 * k + 3; r++)
                smooth->rows[r][i] =
                    c->logs[r][0] > -INFINITY ? exp(polynomial_at(c->logs[r], &at)) : 0;
            smooth->has[i] = (uint8_t)(smooth->has[i] | 1u << k);
            open &= ~(1u << k);
        }
    }
}

const shd_known *shd_smooth_know(const shd_scenery *scenery, const shd_smooth_run *run,
                                 const shd_tile_scratch *s) {
    const shd_plan *plan = scenery->plan;
    shd_smooth *smooth = s->smooth;
    if (!smooth || !shd_may_share_walks(plan, run->material)) return NULL;
    list_pairs(plan, run->material, run->which, run->lights, &smooth->known);
    if (!smooth->known.count) return NULL;
    const asked a = {scenery, run, smooth};
    for (size_t i = run->first; i < run->first + run->count; i++) {
        if (shd_is_cancelled(plan->cancelled)) return NULL;
        know_hit(&a, i, s);
    }
    smooth->known.has = smooth->has;
    smooth->known.rows = smooth->rows;
    return &smooth->known;
}
