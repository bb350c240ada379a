#include "shade/around_quick.h"

#include <string.h>

#include "plan/around.h"
#include "shade/around_look.h"
#include "shade/around_parts.h"
#include "shade/gauss.h"

enum { SEEN_MOST = 640, PARTS = 4, CELLS_MOST = 16, DEEPEST = 9 };

/* Blocks are first looked at down to this part of the lobe's width, or to where so little of its
 * peak is left. */
static const float FINE = 1, NEAR = 0.03F;

/* So many blocks share what the sum may be off by, and more those with kinks: hundreds along the
 * horizon. Hundreds may also have less than one part of that, and count by the fewest nodes; what
 * is less than another is left out, of thousands of blocks, and of more cells. */
static const double SHARES = 4, KINKS = 8, LITTLE = 0.03, NOTHING = 3e-4, OF_CELL = 1.0 / 64;

/* Polynomials over cells are better than derivatives say, by so much at least; and those over
 * blocks where a power, from that one on, is all that the lobe is made of. Facets' are worse. */
static const double POWERS = 16, POWERS_LOOSE = 2, FACETS_LOOSE = 0.25, CELLS_LOOSE = 6,
                    CELLS_KINKS = 0.5;

/* The same as shd_looks, of one place. */
typedef struct glance {
    double near, far, high, low, square, kink;
} glance;

typedef struct seen_block {
    glance look;
    const shd_moment_block *block; /* one of `level` */
    int level, column, row;
    int parent; /* the seen block that it is a part of, or -1 */
    bool halved, done;
} seen_block;

/* Blocks of one level, or cells, that are looked at when there are many. */
typedef struct queue {
    shd_looks looks;
    int column[SHD_LOOKS_MOST], row[SHD_LOOKS_MOST];
} queue;

typedef struct quick {
    const shd_surroundings *map;
    const shd_moments *moments;
    const shd_around_lobe *lobe;
    const shd_around_function *f;
    shd_looks_function *look;
    shd_ways32_function *sum32;
    shd_lobe_view view;
    double loose, share;
    int channels;    /* that nodes have: 3, or 1 of a grey map in f32 */
    double least[3]; /* what each channel's sum is, at least, in the scale of looks */
    double by[3];    /* 1 over what a block may be off by */
    shd_around_ways to;
    shd_ways32 ways; /* instead, if f32 holds them */
    int count;
    seen_block seen[SEEN_MOST];
    queue blocks[SHD_MOMENT_LEVELS], cells;
} quick;

/* ---- Looks. ---- */

static shd_lobe_view view_lobe(const shd_around_lobe *lobe) {
    const double s = lobe->sharpness;
    shd_lobe_view v = {.lobe = lobe,
                       .viewing = shd_larger(shd_dot(lobe->normal, lobe->view), 0),
                       .own = shd_around_width(lobe->model, s),
                       .scale = 1 / SHD_PI};
    if (lobe->model == SHD_MODEL_PHONG_NORMALIZED) v.scale = (s + 2) / (2 * SHD_PI);
    if (lobe->model == SHD_MODEL_COOK_TORRANCE) {
        v.inverse = 1 / (s * s);
        v.peak = shd_larger(2 * s * s - 1, 0);
        v.scale = v.inverse / (4 * SHD_PI);
    }
    return v;
}

static double loose_of(const shd_around_lobe *lobe) {
    if (lobe->model == SHD_MODEL_COOK_TORRANCE) return FACETS_LOOSE;
    return lobe->sharpness >= POWERS ? POWERS_LOOSE : 1; /* no sigma is as much */
}

static const shd_moment_block *block_at(const quick *q, int level, int column, int row) {
    return shd_moment_blocks_of(q->moments, level) +
           (size_t)row * (size_t)q->moments->levels[level].columns + column;
}

static bool has_light(const shd_moment_block *b) {
    return b->light[0] + b->light[1] + b->light[2] > 0;
}

static void place_look(shd_looks *to, const float middle[3], float reach) {
    const size_t k = to->count++;
    for (int c = 0; c < 3; c++) to->middle[c][k] = middle[c];
    to->reach[k] = reach;
}

static inline glance look_of(const shd_looks *from, size_t k) {
    return (glance){(double)from->near[k], (double)from->far[k],    (double)from->high[k],
                    (double)from->low[k],  (double)from->square[k], (double)from->kink[k]};
}

/* ---- First looks. ---- */

static void see_block(quick *q, int level, int column, int row, int parent) {
    const shd_moment_block *b = block_at(q, level, column, row);
    if (has_light(b))
        q->seen[q->count++] = (seen_block){
            .block = b, .level = level, .column = column, .row = row, .parent = parent};
}

static void halve_seen(quick *q, int at) {
    seen_block *s = &q->seen[at];
    const shd_moment_level *finer = &q->moments->levels[s->level - 1];
    s->halved = true;
    for (int j = 2 * s->row; j < 2 * s->row + 2 && j < finer->rows; j++)
        for (int i = 2 * s->column; i < 2 * s->column + 2 && i < finer->columns; i++)
            see_block(q, s->level - 1, i, j, at);
}

/* From the largest blocks on. */
static void see_blocks(quick *q) {
    shd_looks *looks = &q->cells.looks; /* nobody has it yet */
    const int top = q->moments->level_count - 1;
    for (int j = 0; j < q->moments->levels[top].rows; j++)
        for (int i = 0; i < q->moments->levels[top].columns; i++) see_block(q, top, i, j, -1);
    for (int from = 0; from < q->count;) {
        const int end = q->count - from < SHD_LOOKS_MOST ? q->count : from + SHD_LOOKS_MOST;
        looks->count = 0;
        for (int k = from; k < end; k++)
            place_look(looks, q->seen[k].block->middle, q->seen[k].block->reach);
        q->look(&q->view, looks);
        for (size_t k = 0; k < looks->count; k++, from++) {
            seen_block *s = &q->seen[from];
            s->look = look_of(looks, k);
            if (s->level > 0 && looks->plain[k] > FINE * FINE && looks->near[k] > NEAR &&
                q->count + PARTS <= SEEN_MOST)
                halve_seen(q, from);
            else if (s->look.near > 0)
                for (int c = 0; c < 3; c++)
                    q->least[c] += s->look.far * s->look.low * (double)s->block->light[c];
        }
    }
    looks->count = 0;
}

/* ---- Nodes. ---- */

static void end_nodes(quick *q) {
    if (q->f->point)
        q->sum32(q->f->point, &q->ways, q->to.out);
    else
        shd_end_ways(&q->to);
}

static inline void add_node(quick *q, shd_turned turn, shd_turned down, const double v[3]) {
    const shd_vec3 d = shd_turned_to(turn, down);
    if (!q->f->point) {
        shd_add_way(&q->to, d, v[0], v[1], v[2]);
        return;
    }
    shd_ways32 *ways = &q->ways;
    if (ways->points == SHD_WAYS32_MOST) end_nodes(q);
    const size_t i = ways->points++;
    ways->toward[0][i] = (float)d.x;
    ways->toward[1][i] = (float)d.y;
    ways->toward[2][i] = (float)d.z;
    for (int c = 0; c < q->channels; c++) ways->weight[c][i] = (float)v[c];
}

/* n by n nodes in rows, of which each overwrites what the one before it has written too far. */
static void add_narrow(quick *q, const seen_block *s, int order) {
    enum { ROW = SHD_WAYS32_ROW };
    const int n = shd_moment_order(order), side = shd_moment_side_at(order);
    const shd_turned *downs =
        shd_moment_downs_of(q->moments, s->level) + SHD_MOMENT_SIDE * s->row + side;
    const float *restrict cosines =
        shd_moment_turns32_of(q->moments, s->level) + 2 * SHD_MOMENT_SIDE * s->column + side;
    shd_ways32 *ways = &q->ways;
    if (ways->points + (size_t)(n * n) > SHD_WAYS32_MOST) end_nodes(q);
    for (int m = 0; m < n; m++) {
        const float sine = (float)downs[m].sine, cosine = (float)downs[m].cosine;
        const size_t at = ways->points + (size_t)(m * n);
        const int from = shd_moment_nodes_at(order) + m * n;
        float *restrict x = ways->toward[0] + at, *restrict y = ways->toward[1] + at,
                        *restrict z = ways->toward[2] + at;
        for (int e = 0; e < ROW; e++) {
            x[e] = -sine * cosines[SHD_MOMENT_SIDE + e];
            y[e] = cosine;
            z[e] = sine * cosines[e];
        }
        for (int c = 0; c < q->channels; c++)
            memcpy(ways->weight[c] + at, s->block->weights[c] + from, ROW * sizeof(float));
    }
    ways->points += (size_t)(n * n);
}

static void add_block(quick *q, const seen_block *s, int order) {
    const int n = shd_moment_order(order), side = shd_moment_side_at(order);
    if (q->f->point) {
        add_narrow(q, s, order);
        return;
    }
    const shd_moments *moments = q->moments;
    const shd_turned *turns = shd_moment_turns_of(moments, s->level) + SHD_MOMENT_SIDE * s->column +
                              side,
                     *downs =
                         shd_moment_downs_of(moments, s->level) + SHD_MOMENT_SIDE * s->row + side;
    for (int m = 0, k = shd_moment_nodes_at(order); m < n; m++)
        for (int e = 0; e < n; e++, k++) {
            double v[3];
            for (int c = 0; c < 3; c++) v[c] = (double)s->block->weights[c][k];
            add_node(q, turns[e], downs[m], v);
        }
}

/* ---- What nodes may be off. ---- */

/* How much of what a block may be off by its light is, where the lobe is as bright as there. */
static inline double worth_of(const quick *q, double most, const float light[3]) {
    double all = 0;
    for (int c = 0; c < 3; c++) all = shd_larger(all, (double)light[c] * q->by[c]);
    return all * most;
}

/* What of the most on the block nodes may be off. */
static double allowed_of(const quick *q, const glance *look, double worth, double kinks) {
    const double most = look->near * look->high, least = look->far * look->low;
    return shd_larger(1 / worth, most > 0 ? q->share / 2 * least / most : 0) - kinks * look->kink;
}

/* ---- Cells. ---- */

/* A part of a cell, from s, t of [0, 1] on, and `size` wide and high of it. */
typedef struct part {
    const float *upper, *lower; /* rows of texels */
    size_t left, right;         /* components of columns */
    shd_turned turn, down;      /* of the cell's middle */
    double wide, high;          /* of the cell */
    double s, t, size;
} part;

static part cell_at(const quick *q, int i, int j) {
    const shd_surroundings *map = q->map;
    const size_t wide = (size_t)map->width;
    const int h = map->height;
    return (part){.upper = map->texels + 3 * wide * (size_t)(j > 0 ? j - 1 : 0),
                  .lower = map->texels + 3 * wide * (size_t)(j < h ? j : h - 1),
                  .left = 3 * (size_t)i,
                  .right = 3 * (((size_t)i + 1) % wide),
                  .turn = shd_cell_turns_of(q->moments)[i],
                  .down = shd_cell_downs_of(q->moments)[j],
                  .wide = 2 * SHD_PI / map->width,
                  .high = (j > 0 && j < h ? 1 : 0.5) * SHD_PI / h,
                  .size = 1};
}

/* An angle and a little more: no cell is higher or wider than a fourth of a map. */
static inline shd_turned turn_on(shd_turned from, double by) {
    const double x = by * by, sine = by * (1 + x * (-1.0 / 6 + x * (1.0 / 120 - x * (1.0 / 5040)))),
                 cosine = 1 + x * (-0.5 + x * (1.0 / 24 + x * (-1.0 / 720 + x * (1.0 / 40320))));
    return (shd_turned){from.cosine * cosine - from.sine * sine,
                        from.sine * cosine + from.cosine * sine};
}

static double across_of(const part *p) {
    return p->wide * p->size * shd_smaller(p->down.sine + p->high / 2, 1);
}

static inline float larger_of(float a, float b) {
    return a > b ? a : b;
}

static void light_of(const part *p, float light[3]) {
    const float size = (float)(across_of(p) * p->high * p->size);
    for (size_t k = 0; k < 3; k++)
        light[k] = size * larger_of(larger_of(p->upper[p->left + k], p->upper[p->right + k]),
                                    larger_of(p->lower[p->left + k], p->lower[p->right + k]));
}

static const shd_gauss_node middle[1] = {{0.5, 1}};
static void add_part(quick *q, const part *p, const shd_gauss_node *nodes, int n) {
    shd_turned turns[3];
    for (int e = 0; e < n; e++)
        turns[e] = turn_on(p->turn, p->wide * (p->s + p->size * nodes[e].at - 0.5));
    for (int d = 0; d < n; d++) {
        const double t = p->t + p->size * nodes[d].at;
        const shd_turned down = turn_on(p->down, p->high * (t - 0.5));
        const double along = p->wide * p->high * p->size * p->size * nodes[d].weight * down.sine;
        double left[3], right[3];
        for (size_t k = 0; k < (size_t)q->channels; k++) {
            const double a = (double)p->upper[p->left + k], b = (double)p->upper[p->right + k];
            left[k] = along * (a + t * ((double)p->lower[p->left + k] - a));
            right[k] = along * (b + t * ((double)p->lower[p->right + k] - b));
        }
        for (int e = 0; e < n; e++) {
            const double s = p->s + p->size * nodes[e].at, by = nodes[e].weight;
            double v[3];
            for (int k = 0; k < q->channels; k++) v[k] = by * (left[k] + s * (right[k] - left[k]));
            add_node(q, turns[e], down, v);
        }
    }
}

/* Places a look at a part. */
static void see_part(const part *p, shd_looks *to) {
    const double across = across_of(p), high = p->high * p->size, off = p->size / 2 - 0.5;
    shd_vec3 d;
    if (p->size < 1)
        d = shd_turned_to(turn_on(p->turn, p->wide * (p->s + off)),
                          turn_on(p->down, p->high * (p->t + off)));
    else
        d = shd_turned_to(p->turn, p->down);
    place_look(to, (const float[3]){(float)d.x, (float)d.y, (float)d.z},
               (float)(sqrt(across * across + high * high) / 2));
}

/* Beside a pole cells are narrow, and as many as are together as wide as high are off alike. */
static bool take_part(quick *q, const part *p, const glance *look, bool last) {
    float light[3];
    light_of(p, light);
    const double most = look->near * look->high, x = look->square,
                 worth = shd_larger(p->high * p->size / across_of(p), 1) * worth_of(q, most, light);
    if (worth <= NOTHING * OF_CELL) return true;
    if (worth <= LITTLE / 4) {
        const int n = look->kink > 0 ? 2 : 1;
        add_part(q, p, n == 1 ? middle : shd_gauss2, n);
        return true;
    }
    const bool cliff = shd_ends_as_off_a_cliff(q->lobe->model);
    const double allowed = CELLS_LOOSE * allowed_of(q, look, worth, cliff ? KINKS : CELLS_KINKS);
    const bool few = 0.04 * x * sqrt(x) <= allowed;
    if (!few && !last && !(1.1e-3 * x * x * sqrt(x) <= allowed)) return false;
    add_part(q, p, few ? shd_gauss2 : shd_gauss3, few ? 2 : 3);
    return true;
}

static void walk_parts(quick *q, const part *whole, int depth) {
    shd_looks looks; /* it is large */
    part parts[PARTS];
    looks.count = 0;
    for (int k = 0; k < PARTS; k++) {
        part *p = &parts[k];
        *p = *whole;
        p->size /= 2;
        p->s += k % 2 * p->size;
        p->t += k / 2 * p->size;
        see_part(p, &looks);
    }
    q->look(&q->view, &looks);
    for (size_t k = 0; k < PARTS; k++) {
        const glance look = look_of(&looks, k);
        if (look.near > 0 && !take_part(q, &parts[k], &look, depth == DEEPEST))
            walk_parts(q, &parts[k], depth + 1);
    }
}

/* Those that end as off a cliff are cut there. */
static void end_cells(quick *q) {
    queue *cells = &q->cells;
    q->look(&q->view, &cells->looks);
    for (size_t k = 0; k < cells->looks.count; k++) {
        const glance look = look_of(&cells->looks, k);
        const int i = cells->column[k], j = cells->row[k];
        if (!(look.near > 0)) continue;
        const part whole = cell_at(q, i, j);
        if (take_part(q, &whole, &look, false)) continue;
        if (shd_ends_as_off_a_cliff(q->lobe->model) && look.kink > 0)
            shd_around_cell(q->map, q->lobe, q->f, i, j, q->to.out);
        else
            walk_parts(q, &whole, 1);
    }
    cells->looks.count = 0;
}

static void add_to_cells(quick *q, int i, int j) {
    queue *cells = &q->cells;
    const part whole = cell_at(q, i, j);
    cells->column[cells->looks.count] = i;
    cells->row[cells->looks.count] = j;
    see_part(&whole, &cells->looks);
}

/* ---- Blocks. ---- */

/* The same of blocks. */
static double narrow_of(const quick *q, const seen_block *s) {
    const double sine = shd_moment_downs_of(q->moments, s->level)[SHD_MOMENT_SIDE * s->row].sine;
    return 1 / shd_smaller(shd_larger(2 * sine, 1e-2), 1);
}

/* The polynomial of n by n nodes is off by about that part of a normal distribution's peak, of the
 * square x of what the block reaches in its widths. True: the block has been counted. */
static bool take_block(quick *q, const seen_block *s) {
    const glance *look = &s->look;
    const double worth = narrow_of(q, s) * worth_of(q, look->near * look->high, s->block->light),
                 x = look->square;
    if (worth <= NOTHING) return true;
    if (worth <= LITTLE) {
        add_block(q, s, 0);
        return true;
    }
    const double off[SHD_MOMENT_ORDERS] = {0.25 * x, 7.8e-3 * x * x, 1.6e-4 * x * x * x,
                                           2.6e-6 * x * x * x * x},
                 allowed = q->loose * allowed_of(q, look, worth, KINKS);
    for (int k = 0; k < SHD_MOMENT_ORDERS; k++)
        if (off[k] <= allowed) {
            add_block(q, s, k);
            return true;
        }
    return false;
}

static void end_blocks(quick *q, int level);

/* Looks at the parts of a block later. */
static void walk_into(quick *q, const seen_block *s) {
    if (s->level == 0) {
        const int size = q->moments->levels[0].size;
        const int right = (s->column + 1) * size, bottom = (s->row + 1) * size;
        if (q->cells.looks.count + CELLS_MOST > SHD_LOOKS_MOST) end_cells(q);
        for (int j = s->row * size; j < bottom && j <= q->map->height; j++)
            for (int i = s->column * size; i < right && i < q->map->width; i++)
                add_to_cells(q, i, j);
        return;
    }
    const int level = s->level - 1;
    const shd_moment_level *finer = &q->moments->levels[level];
    queue *to = &q->blocks[level];
    if (to->looks.count + PARTS > SHD_LOOKS_MOST) end_blocks(q, level);
    for (int j = 2 * s->row; j < 2 * s->row + 2 && j < finer->rows; j++)
        for (int i = 2 * s->column; i < 2 * s->column + 2 && i < finer->columns; i++) {
            const shd_moment_block *b = block_at(q, level, i, j);
            if (!has_light(b)) continue;
            to->column[to->looks.count] = i;
            to->row[to->looks.count] = j;
            place_look(&to->looks, b->middle, b->reach);
        }
}

static void end_blocks(quick *q, int level) {
    queue *from = &q->blocks[level];
    q->look(&q->view, &from->looks);
    for (size_t k = 0; k < from->looks.count; k++) {
        const seen_block s = {.look = look_of(&from->looks, k),
                              .block = block_at(q, level, from->column[k], from->row[k]),
                              .level = level,
                              .column = from->column[k],
                              .row = from->row[k]};
        if (s.look.near > 0 && !take_block(q, &s)) walk_into(q, &s);
    }
    from->looks.count = 0;
}

/* Those of the first looks: a block before its parts. */
static void take_seen(quick *q) {
    for (int k = 0; k < q->count; k++) {
        seen_block *s = &q->seen[k];
        s->done =
            !(s->look.near > 0) || (s->parent >= 0 && q->seen[s->parent].done) || take_block(q, s);
        if (!s->done && !s->halved) walk_into(q, s);
    }
    for (int level = q->moments->level_count - 1; level >= 0; level--) end_blocks(q, level);
    end_cells(q);
}

void shd_around_sum_quickly(const shd_surroundings *map, const shd_moments *moments,
                            const shd_around_lobe *lobe, const shd_around_function *f, double share,
                            double floor, double (*out)[SHD_WAY_SUMS]) {
    static shd_looks_function *const looks[SHD_ISA_COUNT] = SHD_VARIANTS(shd_look_at_lobe);
    static shd_ways32_function *const sums[SHD_ISA_COUNT] = SHD_VARIANTS(shd_sum_ways32);
    if (lobe->model == SHD_MODEL_COOK_TORRANCE && !(shd_dot(lobe->normal, lobe->view) > 0)) return;
    quick q; /* it is large */
    q.map = map;
    q.moments = moments;
    q.lobe = lobe;
    q.f = f;
    q.look = looks[f->isa];
    q.sum32 = sums[f->isa];
    q.view = view_lobe(lobe);
    q.loose = loose_of(lobe);
    q.share = share;
    q.channels = f->point && moments->grey ? 1 : 3;
    q.ways.points = 0;
    q.ways.grey = q.channels == 1;
    q.count = 0;
    for (int k = 0; k < SHD_MOMENT_LEVELS; k++) q.blocks[k].looks.count = 0;
    for (int c = 0; c < 3; c++) q.least[c] = 0;
    shd_begin_ways(&q.to, f, out);
    see_blocks(&q);
    for (int c = 0; c < 3; c++)
        q.by[c] = SHARES / shd_larger(share * q.least[c], shd_larger(floor / q.view.scale, 1e-300));
    take_seen(&q);
    end_nodes(&q);
}
