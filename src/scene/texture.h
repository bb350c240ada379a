/* Patterns and pictures: what a coefficient of a material may be in place of one color.
 *
 * A pattern is a field w in [0, 1] over a surface's chart (shade/chart.h), and a coefficient mixes
 * two colors by it: low + (high - low) w. A picture is such a field too, or one for each component
 * of the color, of what its texels are; low is black, and high the tint. The field holds no tint,
 * so that another one changes no weight. Constant; any thread. */
#pragma once

#include <stdbool.h>

#include "base/catalog.h"
#include "base/pyramid.h"

typedef enum shd_pattern_kind {
    SHD_CHECKER,  /* 0 where floor(s) + floor(t) is even, else 1 */
    SHD_GRID,     /* 1 on lines around whole s and t */
    SHD_GRADIENT, /* s, from 0 to 1 */
    SHD_NOISE,    /* smooth random values at whole (s, t), and octaves of that */
    SHD_PATTERN_COUNT,
    SHD_PICTURE = SHD_PATTERN_COUNT /* texels, filtered */
} shd_pattern_kind;

/* What gradients and pictures do beyond [0, 1]. */
typedef enum shd_wrap { SHD_WRAP_CLAMP, SHD_WRAP_REPEAT, SHD_WRAP_MIRROR } shd_wrap;

typedef struct shd_pattern {
    shd_pattern_kind kind;
    double map[2][3]; /* (s, t) = map (u, v, 1): scaled, then turned, then moved */
    shd_wrap wrap;    /* gradient and picture; else 0 */
    double width;     /* of lines, in (0, 1); grid; else 0 */
    int octaves;      /* 1 to 8; noise; else 0 */
    /* Of a picture, whose lower left corner is (s, t) = (0, 0) and upper right one (1, 1); else
     * NULL and 0. `channel`: the one that is looked up, 0 to 3, or SHD_ALL_CHANNELS: a color. */
    const shd_pyramid *picture;
    int channel;
} shd_pattern;

enum { SHD_ALL_CHANNELS = -1 };

typedef struct shd_texture {
    shd_pattern pattern;
    double low[3], high[3]; /* colors of the working space; of a picture 0 and its tint; normals:
                             * shd_material.normal_texture; numbers: where the field is 0 and 1 */
    const char *name;       /* of the picture, as the document has it; else NULL */
} shd_texture;

/* How a document takes a picture. */
typedef struct shd_picture_wish {
    /* "sha256-" and the 64 digits of a file that was put, or the name of one of the operator's.
     * Any text that a client has sent. */
    const char *name;
    /* The space of the picture's values, as the document tells it. NULL: the configuration's rules
     * for files tell it by the file's name or format; where only their default matches, integers
     * are sRGB and floats are linear in the role scene_linear. */
    const shd_space_info *space;
    /* The space that they are wanted in, the scene's working space. NULL: they are no color
     * (normals, opacities), and stay as the file has them: codes become [0,1], floats stay. */
    const shd_space_info *working;
    /* Whether they are wanted as normals: of v = 2 value - 1, (scale v.x, scale v.y, v.z) made
     * unit, or (0, 0, 1) where that has no length. */
    bool normals;
    double scale;
} shd_picture_wish;

extern const char *const shd_pattern_names[]; /* by kind; ended by NULL */

/* Whether they are the same field, whatever their colors. */
static inline bool shd_same_pattern(const shd_pattern *a, const shd_pattern *b) {
    bool same = a->kind == b->kind && a->wrap == b->wrap && a->width == b->width &&
                a->octaves == b->octaves;
    for (int r = 0; r < 2; r++)
        for (int c = 0; c < 3; c++) same = same && a->map[r][c] == b->map[r][c];
    if (!same || a->kind != SHD_PICTURE) return same;
    return a->channel == b->channel &&
           shd_digest_same(&a->picture->texels->key, &b->picture->texels->key);
}

/* Of a texture of numbers, which are the first of its components: the least and the most that it
 * is anywhere. */
void shd_texture_span(const shd_texture *texture, double *least, double *most);

/* Its colors where the field is least and where it is most. */
void shd_texture_ends(const shd_texture *texture, double ends[2][3]);

/* How many fields it is: 3 if it gives each component of a color its own. */
static inline int shd_pattern_fields(const shd_pattern *pattern) {
    return pattern->channel == SHD_ALL_CHANNELS ? 3 : 1;
}
