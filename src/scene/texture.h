/* Patterns: what a coefficient of a material may be in place of one color.
 *
 * A pattern is a field w in [0, 1] over a surface's chart (shade/chart.h), and a coefficient mixes
 * two colors by it: low + (high - low) w. The field holds no color, so that a tint changes no
 * weight. Constant; any thread. */
#pragma once

#include <stdbool.h>

typedef enum shd_pattern_kind {
    SHD_CHECKER,  /* 0 where floor(s) + floor(t) is even, else 1 */
    SHD_GRID,     /* 1 on lines around whole s and t */
    SHD_GRADIENT, /* s, from 0 to 1 */
    SHD_NOISE,    /* smooth random values at whole (s, t), and octaves of that */
    SHD_PATTERN_COUNT
} shd_pattern_kind;

/* What a gradient does beyond [0, 1]. */
typedef enum shd_wrap { SHD_WRAP_CLAMP, SHD_WRAP_REPEAT, SHD_WRAP_MIRROR } shd_wrap;

typedef struct shd_pattern {
    shd_pattern_kind kind;
    double map[2][3]; /* (s, t) = map (u, v, 1): scaled, then turned, then moved */
    shd_wrap wrap;    /* gradient; else 0 */
    double width;     /* of lines, in (0, 1); grid; else 0 */
    int octaves;      /* 1 to 8; noise; else 0 */
} shd_pattern;

typedef struct shd_texture {
    shd_pattern pattern;
    double low[3], high[3]; /* colors of the working space */
} shd_texture;

extern const char *const shd_pattern_names[]; /* by kind; ended by NULL */

/* Whether they are the same field, whatever their colors. */
static inline bool shd_same_pattern(const shd_pattern *a, const shd_pattern *b) {
    bool same = a->kind == b->kind && a->wrap == b->wrap && a->width == b->width &&
                a->octaves == b->octaves;
    for (int r = 0; r < 2; r++)
        for (int c = 0; c < 3; c++) same = same && a->map[r][c] == b->map[r][c];
    return same;
}
