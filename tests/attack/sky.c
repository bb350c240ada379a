#include "attack/sky.h"

#include <stdlib.h>

#include "attack/reflect.h"

static const real PI = (real)3.14159265358979323846264338327950288L;

/* A texel's channel; around in columns, and at its ends in rows. */
static double texel(const sky_map *map, int i, int j, int c) {
    i = (i + map->width) % map->width;
    j = j < 0 ? 0 : j >= map->height ? map->height - 1 : j;
    return (double)map->texels[3 * (j * map->width + i) + c];
}

/* Radiance at a place in texels, whose middles are halves. */
static double between_texels(const sky_map *map, double x, double y, int c) {
    const double left = floor(x - 0.5), above = floor(y - 0.5), a = x - 0.5 - left,
                 b = y - 0.5 - above;
    const int i = (int)left, j = (int)above;
    return (1 - b) * ((1 - a) * texel(map, i, j, c) + a * texel(map, i + 1, j, c)) +
           b * ((1 - a) * texel(map, i, j + 1, c) + a * texel(map, i + 1, j + 1, c));
}

double *sky_cut(const sky_map *map, int side, real turn, size_t *count) {
    const int across = map->width * side, down = map->height * side;
    double *out = malloc((size_t)across * (size_t)down * 7 * sizeof *out), *at = out;
    for (int j = 0; out && j < down; j++) {
        const real top = PI * j / down, bottom = PI * (j + 1) / down, theta = (top + bottom) / 2,
                   angle = 2 * PI / across * (COSINE(top) - COSINE(bottom));
        for (int i = 0; i < across; i++, at += 7) {
            /* The middle of the map is -z, and what is to the right of it +x. */
            const real phi = 2 * PI * ((i + (real)0.5) / across - (real)0.5) - turn;
            at[0] = (double)(SINE(theta) * SINE(phi));
            at[1] = (double)COSINE(theta);
            at[2] = (double)(-SINE(theta) * COSINE(phi));
            for (int c = 0; c < 3; c++)
                at[3 + c] = between_texels(map, (i + 0.5) / side, (j + 0.5) / side, c);
            at[6] = (double)angle;
        }
    }
    *count = (size_t)across * (size_t)down;
    return out;
}

static void sum_all(const double *at, size_t count, const stuff *m, point n, point v, real sum[3]) {
    for (int c = 0; c < 3; c++) sum[c] = 0;
    for (size_t k = 0; k < count; k++, at += 7) {
        const point l = {at[0], at[1], at[2]};
        real of[3];
        unsigned cases;
        if (!(dot(n, l) > 0)) continue;
        reflect_light(m, n, v, unit(l), &cases, of);
        for (int c = 0; c < 3; c++) sum[c] += of[c] * at[3 + c] * at[6] / PI;
    }
}

void sky_light(const lamp *l, const stuff *m, point n, point v, real low[3], real high[3]) {
    real coarse[3], fine[3];
    sum_all(l->coarse, l->coarse_count, m, n, v, coarse);
    sum_all(l->fine, l->fine_count, m, n, v, fine);
    for (int c = 0; c < 3; c++) {
        const real by = l->color[c], off = SIZE(fine[c] - coarse[c]) + SIZE(fine[c]) / 100000;
        low[c] += by * fine[c] - SIZE(by) * off;
        high[c] += by * fine[c] + SIZE(by) * off;
    }
}
