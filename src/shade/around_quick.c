#include "shade/around_quick.h"

#include "plan/tier.h"
#include "shade/around_look.h"
#include "shade/around_parts.h"
#include "shade/gauss.h"

/* Of seen blocks; of these so many are for the largest ones and for parts of what is halved. */
enum { SEEN_MOST = 640, RESERVED = 192 };

/* Blocks are first looked at down to this part of the lobe's width, or to where so little of its
 * peak is left. */
static const double FINE = 1, NEAR = 0.03;

/* So many blocks share what the sum may be off by, and more those with kinks; what is less than
 * this part of that is left out. */
static const double SHARES = 3, KINKS = 2, NOTHING = 0.03;

typedef struct seen_block {
    shd_lobe_look look;
    const shd_moment_block *block;
    int level, column, row;
    int next; /* the first block that is not in it */
} seen_block;

typedef struct quick {
    const shd_surroundings *map;
    const shd_moments *moments;
    const shd_around_lobe *lobe;
    const shd_around_function *f;
    shd_lobe_view view;
    double least[3]; /* what each channel's sum is, at least, in the scale of looks */
    double by[3];    /* 1 over what a block may be off by */
    shd_around_ways to;
    int count;
    seen_block seen[SEEN_MOST];
} quick;

static const shd_moment_block *block_at(const quick *q, int level, int column, int row) {
    return shd_moment_blocks_of(q->moments, level) +
           (size_t)row * (size_t)q->moments->levels[level].columns + column;
}

static bool look_at_block(const quick *q, const shd_moment_block *b, shd_lobe_look *out) {
    if (!(b->light[0] + b->light[1] + b->light[2] > 0)) return false;
    const shd_vec3 middle = {(double)b->middle[0], (double)b->middle[1], (double)b->middle[2]};
    return shd_look_at_lobe(&q->view, middle, (double)b->reach, out);
}

/* ---- First looks. ---- */

static void see_block(quick *q, int level, int column, int row) {
    const shd_moment_block *b = block_at(q, level, column, row);
    seen_block *s = &q->seen[q->count];
    if (!look_at_block(q, b, &s->look)) return;
    s->block = b;
    s->level = level;
    s->column = column;
    s->row = row;
    const int at = q->count++;
    if (level > 0 && at < SEEN_MOST - RESERVED && s->look.plain > FINE * FINE &&
        s->look.near > NEAR) {
        const shd_moment_level *finer = &q->moments->levels[level - 1];
        for (int j = 2 * row; j < 2 * row + 2 && j < finer->rows; j++)
            for (int i = 2 * column; i < 2 * column + 2 && i < finer->columns; i++)
                see_block(q, level - 1, i, j);
    } else {
        for (int c = 0; c < 3; c++) q->least[c] += s->look.far * s->look.low * (double)b->light[c];
    }
    q->seen[at].next = q->count;
}

/* ---- Cells. ---- */

typedef struct cell {
    const float *upper, *lower;
    size_t left, right;
    double wide, high;
    const shd_turned *turns, *downs; /* of the middle, and of Gauss' rules of 2 and 3 points */
} cell;

static void add_cell(quick *q, const cell *c, const shd_gauss_node *nodes, int n) {
    const shd_turned *turns = c->turns + (n == 2 ? 1 : 3), *downs = c->downs + (n == 2 ? 1 : 3);
    for (int d = 0; d < n; d++) {
        const double t = nodes[d].at;
        const shd_turned down = downs[d];
        for (int e = 0; e < n; e++) {
            const double s = nodes[e].at,
                         by = c->wide * c->high * nodes[d].weight * nodes[e].weight * down.sine;
            double v[3];
            for (size_t k = 0; k < 3; k++) {
                const double a = (double)c->upper[c->left + k], b = (double)c->upper[c->right + k],
                             x = (double)c->lower[c->left + k], y = (double)c->lower[c->right + k];
                const double above = a + s * (b - a), below = x + s * (y - x);
                v[k] = by * (above + t * (below - above));
            }
            shd_add_way(&q->to, shd_turned_to(turns[e], down), v[0], v[1], v[2]);
        }
    }
}

/* How much of what a block may be off by its light is, where the lobe is as bright as there. */
static double worth_of(const quick *q, const shd_lobe_look *look, const double light[3]) {
    double most = 0;
    for (int c = 0; c < 3; c++) most = shd_larger(most, light[c] * q->by[c]);
    return most * look->near * look->high;
}

/* What of the most on the block nodes may be off. */
static double allowed_of(const shd_lobe_look *look, double worth) {
    const double most = look->near * look->high, least = look->far * look->low;
    return shd_larger(1 / worth, most > 0 ? SHD_QUICK_SHARE / 2 * least / most : 0);
}

/* `most`: no part of the block that the cell is in has more of the lobe. */
static void walk_cell(quick *q, int i, int j, double most) {
    const shd_surroundings *map = q->map;
    const size_t wide = (size_t)map->width;
    const int h = map->height;
    const cell c = {.upper = map->texels + 3 * wide * (size_t)(j > 0 ? j - 1 : 0),
                    .lower = map->texels + 3 * wide * (size_t)(j < h ? j : h - 1),
                    .left = 3 * (size_t)i,
                    .right = 3 * (((size_t)i + 1) % wide),
                    .wide = 2 * SHD_PI / map->width,
                    .high = (j > 0 && j < h ? 1 : 0.5) * SHD_PI / h,
                    .turns = shd_cell_turns_of(q->moments) + SHD_CELL_NODES * i,
                    .downs = shd_cell_downs_of(q->moments) + SHD_CELL_NODES * j};
    const double across = c.wide * shd_smaller(c.downs[0].sine + c.high / 2, 1),
                 reach = sqrt(across * across + c.high * c.high) / 2;
    double light[3];
    for (size_t k = 0; k < 3; k++) {
        const float above = fmaxf(c.upper[c.left + k], c.upper[c.right + k]),
                    below = fmaxf(c.lower[c.left + k], c.lower[c.right + k]);
        light[k] = across * c.high * (double)fmaxf(above, below);
    }
    shd_lobe_look look = {.near = most, .high = 1};
    if (worth_of(q, &look, light) <= NOTHING / 4 ||
        !shd_look_at_lobe(&q->view, shd_turned_to(c.turns[0], c.downs[0]), reach, &look))
        return;
    const double worth = worth_of(q, &look, light), x = look.square;
    if (worth <= NOTHING / 4) return;
    const double allowed = allowed_of(&look, worth) - KINKS * look.kink;
    if (0.04 * x * sqrt(x) <= allowed)
        add_cell(q, &c, shd_gauss2, 2);
    else if (1.1e-3 * x * x * sqrt(x) <= allowed)
        add_cell(q, &c, shd_gauss3, 3);
    else
        shd_around_cell(map, q->lobe, q->f, i, j, q->to.out);
}

/* ---- Blocks. ---- */

static void add_block(quick *q, int level, int column, int row, int order,
                      const shd_moment_block *b) {
    const int n = shd_moment_order(order), side = shd_moment_side_at(order);
    const shd_turned *turns =
                         shd_moment_turns_of(q->moments, level) + SHD_MOMENT_SIDE * column + side,
                     *downs = shd_moment_downs_of(q->moments, level) + SHD_MOMENT_SIDE * row + side;
    for (int m = 0, k = shd_moment_nodes_at(order); m < n; m++)
        for (int e = 0; e < n; e++, k++)
            shd_add_way(&q->to, shd_turned_to(turns[e], downs[m]), (double)b->weights[0][k],
                        (double)b->weights[1][k], (double)b->weights[2][k]);
}

/* The polynomial of n by n nodes is off by about that part of a normal distribution's peak, of the
 * square x of what the block reaches in its widths. True: the block has been counted. */
static bool take_block(quick *q, int level, int column, int row, const shd_moment_block *b,
                       const shd_lobe_look *look) {
    const double light[3] = {(double)b->light[0], (double)b->light[1], (double)b->light[2]},
                 worth = worth_of(q, look, light), x = look->square;
    if (worth <= NOTHING) return true;
    const double off[SHD_MOMENT_ORDERS] = {0.25 * x, 7.8e-3 * x * x, 1.6e-4 * x * x * x,
                                           2.6e-6 * x * x * x * x},
                 allowed = allowed_of(look, worth) - KINKS * look->kink;
    for (int k = 0; k < SHD_MOMENT_ORDERS; k++)
        if (off[k] <= allowed) {
            add_block(q, level, column, row, k, b);
            return true;
        }
    return false;
}

static void walk_block(quick *q, int level, int column, int row);

static void walk_into(quick *q, int level, int column, int row, const shd_lobe_look *look) {
    if (level == 0) {
        const int size = q->moments->levels[0].size;
        for (int j = row * size; j < (row + 1) * size && j <= q->map->height; j++)
            for (int i = column * size; i < (column + 1) * size && i < q->map->width; i++)
                walk_cell(q, i, j, look->near * look->high);
        return;
    }
    const shd_moment_level *finer = &q->moments->levels[level - 1];
    for (int j = 2 * row; j < 2 * row + 2 && j < finer->rows; j++)
        for (int i = 2 * column; i < 2 * column + 2 && i < finer->columns; i++)
            walk_block(q, level - 1, i, j);
}

static void walk_block(quick *q, int level, int column, int row) {
    const shd_moment_block *b = block_at(q, level, column, row);
    shd_lobe_look look;
    if (look_at_block(q, b, &look) && !take_block(q, level, column, row, b, &look))
        walk_into(q, level, column, row, &look);
}

void shd_around_sum_quickly(const shd_surroundings *map, const shd_moments *moments,
                            const shd_around_lobe *lobe, const shd_around_function *f, double floor,
                            double (*out)[SHD_WAY_SUMS]) {
    quick q; /* it is large */
    q.map = map;
    q.moments = moments;
    q.lobe = lobe;
    q.f = f;
    q.view = shd_view_lobe(lobe);
    q.count = 0;
    for (int c = 0; c < 3; c++) q.least[c] = 0;
    if (lobe->model == SHD_MODEL_COOK_TORRANCE && !(shd_dot(lobe->normal, lobe->view) > 0)) return;
    shd_begin_ways(&q.to, f, out);
    const int top = moments->level_count - 1;
    for (int j = 0; j < moments->levels[top].rows; j++)
        for (int i = 0; i < moments->levels[top].columns; i++) see_block(&q, top, i, j);
    for (int c = 0; c < 3; c++)
        q.by[c] = SHARES / shd_larger(SHD_QUICK_SHARE * q.least[c],
                                      shd_larger(floor / q.view.scale, 1e-300));
    for (int k = 0; k < q.count;) {
        const seen_block *s = &q.seen[k];
        const bool last = s->next == k + 1;
        if (take_block(&q, s->level, s->column, s->row, s->block, &s->look))
            k = s->next;
        else if (last)
            walk_into(&q, s->level, s->column, s->row, &s->look), k++;
        else
            k++;
    }
    shd_end_ways(&q.to);
}
