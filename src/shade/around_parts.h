/* What walks over environments have in common. Only for shade/around*.c. */
#pragma once

#include "shade/around.h"

/* Directions with light, which are summed when there are many. */
typedef struct shd_around_ways {
    const shd_around_function *f;
    double (*out)[SHD_WAY_SUMS];
    shd_ways ways;
} shd_around_ways;

static inline void shd_begin_ways(shd_around_ways *to, const shd_around_function *f,
                                  double (*out)[SHD_WAY_SUMS]) {
    to->f = f;
    to->out = out;
    to->ways.points = 0;
    to->ways.sums = 3;
}

/* Sums what is left. */
static inline void shd_end_ways(shd_around_ways *to) {
    shd_ways *ways = &to->ways;
    if (!ways->points) return;
    ways->count = ways->points;
    for (; ways->count % SHD_WAYS_STEP; ways->count++)
        for (int c = 0; c < 3; c++) {
            ways->toward[c][ways->count] = ways->toward[c][ways->points - 1];
            ways->weight[c][ways->count] = 0;
        }
    to->f->sum(to->f->context, ways, to->out);
    ways->points = 0;
}

/* Adds the light r, g, b from d, over pi. */
static inline void shd_add_way(shd_around_ways *to, shd_vec3 d, double r, double g, double b) {
    shd_ways *ways = &to->ways;
    const size_t i = ways->points++;
    ways->toward[0][i] = d.x;
    ways->toward[1][i] = d.y;
    ways->toward[2][i] = d.z;
    ways->weight[0][i] = r / SHD_PI;
    ways->weight[1][i] = g / SHD_PI;
    ways->weight[2][i] = b / SHD_PI;
    if (ways->points == SHD_WAYS_MOST) shd_end_ways(to);
}

/* Adds what shd_around_sum makes of one cell. */
void shd_around_cell(const shd_surroundings *map, const shd_around_lobe *lobe,
                     const shd_around_function *f, int i, int j, double (*out)[SHD_WAY_SUMS]);
