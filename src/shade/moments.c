#include "shade/moments.h"

#include <string.h>

#include "shade/gauss.h"

enum { ORDERS = SHD_MOMENT_ORDERS, SIDE = SHD_MOMENT_SIDE, ALL = SHD_MOMENT_NODES, LEAST = 4 };
enum { HIGHEST = 8, RULE = 5 };

/* Gauss' rule of 5 points on [0, 1]: with it what a cell adds to a node of the highest order is
 * exact, but for the sine. */
static const shd_gauss_node rule[RULE] = {{0.0469100770306680036, 0.118463442528094543757},
                                          {0.230765344947158454482, 0.239314335249683234021},
                                          {0.5, 0.284444444444444444444},
                                          {0.769234655052841545518, 0.239314335249683234021},
                                          {0.953089922969331996400, 0.118463442528094543757}};

/* Chebyshev's nodes on [0, 1], and what divides their polynomials. */
typedef struct node_set {
    double at[SIDE], inverse[SIDE];
} node_set;

static node_set find_nodes(void) {
    node_set out;
    for (int k = 0; k < ORDERS; k++) {
        const int n = shd_moment_order(k), from = shd_moment_side_at(k);
        for (int i = 0; i < n; i++) out.at[from + i] = (1 - cos(SHD_PI * (i + 0.5) / n)) / 2;
        for (int i = 0; i < n; i++) {
            double product = 1;
            for (int j = 0; j < n; j++)
                if (j != i) product *= out.at[from + i] - out.at[from + j];
            out.inverse[from + i] = 1 / product;
        }
    }
    return out;
}

static size_t padded_to(size_t bytes) {
    return (bytes + 63) / 64 * 64;
}

static void lay_out(const shd_surroundings *map, shd_moments *out) {
    const int w = map->width, h = map->height;
    size_t at = padded_to(sizeof *out);
    memset(out, 0, sizeof *out);
    out->width = w;
    out->height = h;
    for (int size = LEAST, k = 0; k < SHD_MOMENT_LEVELS && (k == 0 || 4 * size <= h);
         size *= 2, k++) {
        shd_moment_level *l = &out->levels[out->level_count++];
        l->size = size;
        l->columns = (w + size - 1) / size;
        l->rows = (h + size) / size; /* of h + 1 cells */
        l->turns_at = at;
        at += padded_to((size_t)l->columns * SIDE * sizeof(shd_turned));
        l->downs_at = at;
        at += padded_to((size_t)l->rows * SIDE * sizeof(shd_turned));
        l->turns32_at = at;
        at += padded_to((size_t)l->columns * 2 * SIDE * sizeof(float));
        l->blocks_at = at;
        at += padded_to((size_t)l->columns * (size_t)l->rows * sizeof(shd_moment_block));
    }
    out->cell_turns_at = at;
    at += padded_to((size_t)w * sizeof(shd_turned));
    out->cell_downs_at = at;
    at += padded_to(((size_t)h + 1) * sizeof(shd_turned));
    out->bytes = at;
}

size_t shd_moments_size(const shd_surroundings *map) {
    shd_moments counted;
    lay_out(map, &counted);
    return counted.bytes;
}

/* The polynomials of all orders' nodes at t of [0, 1]. */
static void weigh_nodes(const node_set *set, double t, double out[SIDE]) {
    for (int k = 0; k < ORDERS; k++) {
        const int n = shd_moment_order(k), from = shd_moment_side_at(k);
        const double *at = set->at + from;
        double before[HIGHEST], after = 1;
        before[0] = 1;
        for (int i = 1; i < n; i++) before[i] = before[i - 1] * (t - at[i - 1]);
        for (int i = n - 1; i >= 0; i--) {
            out[from + i] = before[i] * after * set->inverse[from + i];
            after *= t - at[i];
        }
    }
}

typedef struct block_box {
    int left, right, top, bottom;  /* cells */
    double turn, wide, down, high; /* radians */
} block_box;

static block_box box_of(const shd_moments *m, const shd_moment_level *l, int column, int row) {
    block_box b = {.left = column * l->size, .top = row * l->size};
    b.right = b.left + l->size < m->width ? b.left + l->size : m->width;
    b.bottom = b.top + l->size < m->height + 1 ? b.top + l->size : m->height + 1;
    b.turn = shd_cell_turn(m->width, b.left);
    b.wide = shd_cell_turn(m->width, b.right) - b.turn;
    b.down = shd_cell_down(m->height, b.top);
    b.high = shd_cell_down(m->height, b.bottom) - b.down;
    return b;
}

static shd_turned turned(double angle) {
    return (shd_turned){cos(angle), sin(angle)};
}

/* Along a straight way of longitudes and latitudes from the middle no step is longer than where the
 * sine is largest. */
static void place_block(const block_box *b, shd_moment_block *out) {
    const double down = b->down + b->high / 2, least = b->down, most = b->down + b->high,
                 sine = least < SHD_PI / 2 && most > SHD_PI / 2 ? 1 : fmax(sin(least), sin(most));
    const shd_vec3 d = shd_turned_to(turned(b->turn + b->wide / 2), turned(down));
    out->middle[0] = (float)d.x;
    out->middle[1] = (float)d.y;
    out->middle[2] = (float)d.z;
    out->reach = (float)(hypot(b->high, b->wide * sine) / 2 * (1 + 1e-6) + 1e-6);
}

/* Adds light at a latitude, of which `row` is what each node of each order has along it. */
static void add_along(const double along[SIDE], const double row[SIDE], double sums[ALL]) {
    for (int k = 0; k < ORDERS; k++) {
        const int n = shd_moment_order(k), side = shd_moment_side_at(k);
        double *to = sums + shd_moment_nodes_at(k);
        for (int m = 0; m < n; m++, to += n)
            for (int i = 0; i < n; i++) to[i] += along[side + m] * row[side + i];
    }
}

/* Adds one cell's part of a block's weights: by Gauss' rule, which has radiance times a node's
 * polynomial exactly, and the sine to 1e-9. */
static void add_cell(const shd_surroundings *map, const node_set *set, const block_box *b, int i,
                     int j, double sums[3][ALL]) {
    const int w = map->width, h = map->height;
    const float *upper = map->texels + 3 * (size_t)w * (size_t)(j > 0 ? j - 1 : 0),
                *lower = map->texels + 3 * (size_t)w * (size_t)(j < h ? j : h - 1);
    const size_t a = 3 * (size_t)i, c = 3 * (size_t)((i + 1) % w);
    const double down = shd_cell_down(h, j), high = shd_cell_down(h, j + 1) - down,
                 wide = 2 * SHD_PI / w, turn = shd_cell_turn(w, i);
    double across[RULE][SIDE], along[SIDE];
    for (int e = 0; e < RULE; e++)
        weigh_nodes(set, (turn + wide * rule[e].at - b->turn) / b->wide, across[e]);
    for (int d = 0; d < RULE; d++) {
        const double at = down + high * rule[d].at, t = rule[d].at,
                     by = rule[d].weight * high * wide * sin(at);
        weigh_nodes(set, (at - b->down) / b->high, along);
        for (size_t k = 0; k < 3; k++) {
            const double left = (double)upper[a + k] * (1 - t) + (double)lower[a + k] * t,
                         right = (double)upper[c + k] * (1 - t) + (double)lower[c + k] * t;
            if (left == 0 && right == 0) continue;
            double row[SIDE] = {0};
            for (int e = 0; e < RULE; e++) {
                const double v =
                    ((1 - rule[e].at) * left + rule[e].at * right) * rule[e].weight * by;
                for (int n = 0; n < SIDE; n++) row[n] += v * across[e][n];
            }
            add_along(along, row, sums[k]);
        }
    }
}

/* Nodes of any order share all light; rounding to f32 leaves that of the lowest. */
static void store_block(double sums[3][ALL], shd_moment_block *out) {
    for (int k = 0; k < 3; k++) {
        for (int n = 0; n < ALL; n++) out->weights[k][n] = (float)sums[k][n];
        out->light[k] = (float)(sums[k][0] + sums[k][1] + sums[k][2] + sums[k][3]);
    }
}

/* A block's polynomials of an order are those through the nodes of the smaller blocks in it. */
static void add_order(const double across[SIDE][SIDE], const double along[SIDE][SIDE], int k,
                      const float *from, double *to) {
    const int n = shd_moment_order(k), side = shd_moment_side_at(k);
    from += shd_moment_nodes_at(k);
    to += shd_moment_nodes_at(k);
    for (int y = 0; y < n; y++) {
        double row[HIGHEST] = {0};
        for (int x = 0; x < n; x++)
            for (int i = 0; i < n; i++)
                row[i] += (double)from[n * y + x] * across[side + x][side + i];
        for (int m = 0; m < n; m++)
            for (int i = 0; i < n; i++) to[n * m + i] += along[side + y][side + m] * row[i];
    }
}

static void add_smaller(const node_set *set, const block_box *b, const block_box *part,
                        const shd_moment_block *from, double sums[3][ALL]) {
    double across[SIDE][SIDE], along[SIDE][SIDE];
    for (int n = 0; n < SIDE; n++) {
        weigh_nodes(set, (part->turn + part->wide * set->at[n] - b->turn) / b->wide, across[n]);
        weigh_nodes(set, (part->down + part->high * set->at[n] - b->down) / b->high, along[n]);
    }
    for (int c = 0; c < 3; c++)
        for (int k = 0; k < ORDERS; k++)
            add_order((const double(*)[SIDE])across, (const double(*)[SIDE])along, k,
                      from->weights[c], sums[c]);
}

static void make_block(const shd_surroundings *map, const node_set *set, const shd_moments *m,
                       int level, int column, int row, shd_moment_block *out) {
    const block_box b = box_of(m, &m->levels[level], column, row);
    double sums[3][ALL];
    memset(sums, 0, sizeof sums);
    place_block(&b, out);
    if (level == 0) {
        for (int j = b.top; j < b.bottom; j++)
            for (int i = b.left; i < b.right; i++) add_cell(map, set, &b, i, j, sums);
    } else {
        const shd_moment_level *l = &m->levels[level - 1];
        for (int y = 2 * row; y < 2 * row + 2 && y < l->rows; y++)
            for (int x = 2 * column; x < 2 * column + 2 && x < l->columns; x++) {
                const block_box part = box_of(m, l, x, y);
                add_smaller(set, &b, &part, shd_moment_blocks_of(m, level - 1) + y * l->columns + x,
                            sums);
            }
    }
    store_block(sums, out);
}

static void place_nodes(const node_set *set, shd_moments *m, const shd_moment_level *l) {
    shd_turned *turns = (shd_turned *)(void *)((char *)m + l->turns_at),
               *downs = (shd_turned *)(void *)((char *)m + l->downs_at);
    float *narrow = (float *)(void *)((char *)m + l->turns32_at);
    for (int n = 0; n < SIDE; n++) {
        for (int i = 0; i < l->columns; i++) {
            const block_box b = box_of(m, l, i, 0);
            const shd_turned turn = turned(b.turn + b.wide * set->at[n]);
            turns[SIDE * i + n] = turn;
            narrow[2 * SIDE * i + n] = (float)turn.cosine;
            narrow[2 * SIDE * i + SIDE + n] = (float)turn.sine;
        }
        for (int j = 0; j < l->rows; j++) {
            const block_box b = box_of(m, l, 0, j);
            downs[SIDE * j + n] = turned(b.down + b.high * set->at[n]);
        }
    }
}

static void place_cells(shd_moments *m) {
    const int w = m->width, h = m->height;
    shd_turned *turns = (shd_turned *)(void *)((char *)m + m->cell_turns_at),
               *downs = (shd_turned *)(void *)((char *)m + m->cell_downs_at);
    for (int i = 0; i < w; i++) turns[i] = turned(shd_cell_turn(w, i) + 2 * SHD_PI / w / 2);
    for (int j = 0; j <= h; j++) {
        const double from = shd_cell_down(h, j);
        downs[j] = turned(from + (shd_cell_down(h, j + 1) - from) / 2);
    }
}

static bool is_grey(const shd_surroundings *map) {
    const size_t count = 3 * (size_t)map->width * (size_t)map->height;
    for (size_t i = 0; i < count; i += 3)
        if (map->texels[i] != map->texels[i + 1] || map->texels[i] != map->texels[i + 2])
            return false;
    return true;
}

bool shd_moments_make(const shd_surroundings *map, const atomic_bool *cancelled, shd_moments *out) {
    const node_set set = find_nodes();
    lay_out(map, out);
    out->grey = is_grey(map);
    place_cells(out);
    for (int k = 0; k < out->level_count; k++) {
        const shd_moment_level *l = &out->levels[k];
        shd_moment_block *blocks = (shd_moment_block *)(void *)((char *)out + l->blocks_at);
        place_nodes(&set, out, l);
        for (int row = 0; row < l->rows; row++) {
            if (shd_is_cancelled(cancelled)) return false;
            for (int column = 0; column < l->columns; column++)
                make_block(map, &set, out, k, column, row, &blocks[row * l->columns + column]);
        }
    }
    return true;
}
