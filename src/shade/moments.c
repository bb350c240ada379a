#include "shade/moments.h"

#include <string.h>

#include "shade/gauss.h"

enum { NODES = SHD_MOMENT_NODES, ALL = NODES * NODES, LEAST = 4 };

/* Chebyshev's, on [0, 1]. */
static const double at_nodes[NODES] = {0.0380602337443566, 0.3086582838174551, 0.6913417161825449,
                                       0.9619397662556434};

static size_t padded_to(size_t bytes) {
    return (bytes + 63) / 64 * 64;
}

static void lay_out(const shd_surroundings *map, shd_moments *out) {
    const int w = map->width, h = map->height;
    size_t at = padded_to(sizeof *out);
    memset(out, 0, sizeof *out);
    out->width = w;
    out->height = h;
    for (int size = LEAST, k = 0; k < SHD_MOMENT_LEVELS && (k == 0 || 8 * size <= h);
         size *= 2, k++) {
        shd_moment_level *l = &out->levels[out->level_count++];
        l->size = size;
        l->columns = (w + size - 1) / size;
        l->rows = (h + size) / size; /* of h + 1 cells */
        l->turns_at = at;
        at += padded_to((size_t)l->columns * NODES * sizeof(shd_turned));
        l->downs_at = at;
        at += padded_to((size_t)l->rows * NODES * sizeof(shd_turned));
        l->blocks_at = at;
        at += padded_to((size_t)l->columns * (size_t)l->rows * sizeof(shd_moment_block));
    }
    out->bytes = at;
}

size_t shd_moments_size(const shd_surroundings *map) {
    shd_moments counted;
    lay_out(map, &counted);
    return counted.bytes;
}

/* The nodes' polynomials at t of [0, 1]. */
static void weigh_nodes(double t, double out[NODES]) {
    for (int k = 0; k < NODES; k++) {
        out[k] = 1;
        for (int i = 0; i < NODES; i++)
            if (i != k) out[k] *= (t - at_nodes[i]) / (at_nodes[k] - at_nodes[i]);
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

/* Adds one cell's part of a block's weights: by Gauss' rule, which has radiance times a node's
 * polynomial exactly, and the sine to 1e-9. */
static void add_cell(const shd_surroundings *map, const block_box *b, int i, int j,
                     double sums[3][ALL]) {
    const int w = map->width, h = map->height;
    const float *upper = map->texels + 3 * (size_t)w * (size_t)(j > 0 ? j - 1 : 0),
                *lower = map->texels + 3 * (size_t)w * (size_t)(j < h ? j : h - 1);
    const size_t a = 3 * (size_t)i, c = 3 * (size_t)((i + 1) % w);
    const double down = shd_cell_down(h, j), high = shd_cell_down(h, j + 1) - down,
                 wide = 2 * SHD_PI / w, turn = shd_cell_turn(w, i);
    double across[3][NODES];
    for (int e = 0; e < 3; e++)
        weigh_nodes((turn + wide * shd_gauss3[e].at - b->turn) / b->wide, across[e]);
    for (int d = 0; d < 3; d++) {
        const double at = down + high * shd_gauss3[d].at, t = shd_gauss3[d].at,
                     by = shd_gauss3[d].weight * high * wide * sin(at);
        double along[NODES];
        weigh_nodes((at - b->down) / b->high, along);
        for (size_t k = 0; k < 3; k++) {
            const double left = (double)upper[a + k] * (1 - t) + (double)lower[a + k] * t,
                         right = (double)upper[c + k] * (1 - t) + (double)lower[c + k] * t;
            double row[NODES] = {0};
            for (int e = 0; e < 3; e++) {
                const double s = shd_gauss3[e].at,
                             v = ((1 - s) * left + s * right) * shd_gauss3[e].weight * by;
                for (int n = 0; n < NODES; n++) row[n] += v * across[e][n];
            }
            for (int m = 0; m < NODES; m++)
                for (int n = 0; n < NODES; n++) sums[k][NODES * m + n] += along[m] * row[n];
        }
    }
}

static void store_block(double sums[3][ALL], shd_moment_block *out) {
    out->light = 0;
    for (int k = 0; k < 3; k++) {
        double light = 0;
        for (int n = 0; n < ALL; n++) {
            out->weights[k][n] = (float)sums[k][n];
            light += sums[k][n];
        }
        out->light = fmaxf(out->light, (float)light);
    }
}

/* A block's polynomials are those through the nodes of the smaller blocks in it. */
static void add_smaller(const block_box *b, const block_box *part, const shd_moment_block *from,
                        double sums[3][ALL]) {
    double across[NODES][NODES], along[NODES][NODES];
    for (int n = 0; n < NODES; n++) {
        weigh_nodes((part->turn + part->wide * at_nodes[n] - b->turn) / b->wide, across[n]);
        weigh_nodes((part->down + part->high * at_nodes[n] - b->down) / b->high, along[n]);
    }
    for (int k = 0; k < 3; k++)
        for (int y = 0; y < NODES; y++)
            for (int x = 0; x < NODES; x++) {
                const double value = (double)from->weights[k][NODES * y + x];
                for (int m = 0; m < NODES; m++)
                    for (int n = 0; n < NODES; n++)
                        sums[k][NODES * m + n] += value * along[y][m] * across[x][n];
            }
}

static void make_block(const shd_surroundings *map, const shd_moments *m, int level, int column,
                       int row, shd_moment_block *out) {
    const block_box b = box_of(m, &m->levels[level], column, row);
    double sums[3][ALL];
    memset(sums, 0, sizeof sums);
    place_block(&b, out);
    if (level == 0) {
        for (int j = b.top; j < b.bottom; j++)
            for (int i = b.left; i < b.right; i++) add_cell(map, &b, i, j, sums);
    } else {
        const shd_moment_level *l = &m->levels[level - 1];
        for (int y = 2 * row; y < 2 * row + 2 && y < l->rows; y++)
            for (int x = 2 * column; x < 2 * column + 2 && x < l->columns; x++) {
                const block_box part = box_of(m, l, x, y);
                add_smaller(&b, &part, shd_moment_blocks_of(m, level - 1) + y * l->columns + x,
                            sums);
            }
    }
    store_block(sums, out);
}

static void place_nodes(shd_moments *m, const shd_moment_level *l) {
    shd_turned *turns = (shd_turned *)(void *)((char *)m + l->turns_at),
               *downs = (shd_turned *)(void *)((char *)m + l->downs_at);
    for (int n = 0; n < NODES; n++) {
        for (int i = 0; i < l->columns; i++) {
            const block_box b = box_of(m, l, i, 0);
            turns[NODES * i + n] = turned(b.turn + b.wide * at_nodes[n]);
        }
        for (int j = 0; j < l->rows; j++) {
            const block_box b = box_of(m, l, 0, j);
            downs[NODES * j + n] = turned(b.down + b.high * at_nodes[n]);
        }
    }
}

bool shd_moments_make(const shd_surroundings *map, const atomic_bool *cancelled, shd_moments *out) {
    lay_out(map, out);
    for (int k = 0; k < out->level_count; k++) {
        const shd_moment_level *l = &out->levels[k];
        shd_moment_block *blocks = (shd_moment_block *)(void *)((char *)out + l->blocks_at);
        place_nodes(out, l);
        for (int row = 0; row < l->rows; row++) {
            if (shd_is_cancelled(cancelled)) return false;
            for (int column = 0; column < l->columns; column++)
                make_block(map, out, k, column, row, &blocks[row * l->columns + column]);
        }
    }
    return true;
}
