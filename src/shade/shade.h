/* The model: how a point is lit. Visibility is behind it, the output's colors are ahead of it.
 *
 * Shading is split as the equation (docs/model.md) is: a kernel turns geometry into weights that
 * hold no color (wd = f s (N.L)+ and, for each lobe, ws = f s g (R.V)+^ns), and the colors multiply
 * and sum them:
 *
 *     I = ke + ka Ia + kd sum_j wd_j Il_j + sum_lobes ks sum_j ws_j Il_j
 *
 * Kernels cannot fail: everything was checked before. Points are worked on in blocks of up to
 * SHD_BLOCK that share a material; a point's result does not depend on the others in its block,
 * to the bit. */
#ifndef SHD_SHADE_SHADE_H
#define SHD_SHADE_SHADE_H

#include "base/arena.h"
#include "plan/plan.h"
#include "shade/lighting.h"

enum { SHD_BLOCK = 64 /* points in a block */ };

/* Surface points, all of one material. World frame, f64. Lanes up to the next multiple of
 * SHD_LANES must hold finite values (repeat the last point); their results are ignored. */
typedef struct shd_points {
    size_t count;                  /* 1 to SHD_BLOCK */
    double position[3][SHD_BLOCK]; /* x, y, z */
    double normal[3][SHD_BLOCK];   /* N: unit, already turned to the viewer where two-sided */
    double view[3][SHD_BLOCK];     /* V: unit, toward the viewer */
} shd_points;

/* Weights of one light at a block's points; specular holds lobe_count rows. */
typedef struct shd_weights {
    double diffuse[SHD_BLOCK];
    double (*specular)[SHD_BLOCK];
} shd_weights;

/* A block prepared for the lights: W = 2(N.V)N - V, the mirrored view, and what f32 needs.
 * Positions in f32 are a sum of two floats, so that a light close to the surface keeps its
 * direction. */
typedef struct shd_prepared {
    size_t lanes;
    const shd_points *points;
    double mirror[3][SHD_BLOCK];
    float high[3][SHD_BLOCK], low[3][SHD_BLOCK]; /* (position - plan origin) * plan scale */
    float normal32[3][SHD_BLOCK], mirror32[3][SHD_BLOCK];
} shd_prepared;

/* A light in f32, in the plan's frame. */
typedef struct shd_light32 {
    bool fits;             /* false: f32 cannot hold this light, the reference does it */
    float high[3], low[3]; /* position, the sum of both; or the direction toward it in `high` */
    float a, b, c, min_distance; /* the largest of a, b, c is 1 */
    double gain;
    float axis[3], outer, inner, inverse_fade, exponent;
} shd_light32;

shd_light32 shd_narrow_light(const shd_plan *plan, const shd_plan_light *light);

/* Weights of a light by the f64 reference. `lobes` gives the exponents. Writes every lane. */
void shd_weigh_exact(const shd_plan_light *light, const shd_plan_lobe *lobes, size_t lobe_count,
                     const shd_prepared *block, shd_weights *out);

/* The loops over lanes, compiled once an instruction set; all variants give the same bits. */
typedef struct shd_shade_kernel {
    /* Mirrors the views, and narrows to f32 where the plan's tier wants it. */
    void (*prepare)(const shd_plan *plan, const shd_points *points, shd_prepared *block);
    /* As shd_weigh_exact, in f32: the standard tier. */
    void (*weigh)(const shd_light32 *light, const shd_plan_light *kind, const shd_plan_lobe *lobes,
                  size_t lobe_count, const shd_prepared *block, shd_weights *out);
    /* Sums by channel, of as many lanes (a multiple of SHD_LANES): out = value;
     * sum += weight color; sum += term color. */
    void (*fill)(double (*out)[SHD_BLOCK], const double value[3], size_t lanes);
    void (*add_weight)(double (*sum)[SHD_BLOCK], const double *weight, const double color[3],
                       size_t lanes);
    void (*add_scaled)(double (*sum)[SHD_BLOCK], double (*term)[SHD_BLOCK], const double color[3],
                       size_t lanes);
} shd_shade_kernel;

extern const shd_shade_kernel shd_shade_kernel_portable, shd_shade_kernel_avx2,
    shd_shade_kernel_avx512;

/* NULL where it was not compiled in. */
const shd_shade_kernel *shd_shade_kernel_of(shd_isa isa);

/* The reference at one lane: for tests, and where f32 cannot hold what a lane needs. */
void shd_weigh_exact_lane(const shd_plan_light *light, const shd_plan_lobe *lobes,
                          size_t lobe_count, const shd_prepared *block, size_t lane,
                          shd_weights *out);

/* The equations for one light at one point, in f64. Returns wd = f s (N.L)+; *factor is f s where
 * the light is before the surface, else 0, and *off = 1 - R.V, for shd_weigh_lobe. */
double shd_weigh_light(const shd_plan_light *light, shd_vec3 position, shd_vec3 normal,
                       shd_vec3 mirror, double *factor, double *off);

/* ws = factor (R.V)+^shininess. */
double shd_weigh_lobe(double shininess, double factor, double off);

/* Working memory of one thread. */
typedef struct shd_shader shd_shader;

/* NULL where the arena is full. */
shd_shader *shd_shader_new(const shd_plan *plan, shd_arena *arena);

/* Shades a block: radiance[plane][channel][lane] for the plan's planes, in the working space.
 * Lanes from points->count on are undefined. */
void shd_shade(shd_shader *shader, const shd_plan_material *material, const shd_points *points,
               double (*radiance)[3][SHD_BLOCK]);

#endif
