/* Light sums: what a material's colors multiply, for any number of points.
 *
 *     D = sum_j wd_j Il_j,   S_k = sum_j ws_jk Il_j,   I = constant + kd D + sum_k ks_k S_k
 *
 * The weights are those of docs/model.md: wd = f s (N.L)+ and ws = f s g (R.V)+^ns. Neither D nor S
 * holds a material's color. Everything here is constant or belongs to the caller, so that threads
 * share a shd_lighting. Kernels cannot fail: everything was checked before.
 *
 * A point's sums depend only on that point and the list of lights, and on what is known of the
 * light of environments there (shd_known), to the bit: not on its neighbors, on the instruction
 * set, or on lights that add exactly 0. Lights are summed in the order of `which`, in f32 over
 * groups of SHD_LIGHT_GROUP neighbors in the scene's list, and in f64 over the groups. The exact
 * tier sums in f64. If no instruction fuses f32 products into sums (shd_isa_fuses), the bits of
 * f32 are others. Another light in the scene's list, even a black one, may move lights into other
 * groups and change last bits. */
#pragma once

#include "base/arena.h"
#include "plan/occluders.h"
#include "plan/plan.h"
#include "plan/tier.h"

enum {
    SHD_LANES = 16 /* arrays of points are as long as the next multiple of this */
};

/* Points of one material. Every array has `count` entries. From there to the next multiple of
 * SHD_LANES it has any finite ones (repeat the last); their results mean nothing. 64-byte aligned
 * arrays are faster. */

/* What some environments add at points by terms that maps are walked for (shade/surrounded.h), if
 * it is known before: the weights of each pair of a light and a term. */
enum { SHD_KNOWN_MOST = 8 };
typedef struct shd_known {
    size_t count;
    uint32_t light[SHD_KNOWN_MOST]; /* in plan->lights */
    uint32_t term[SHD_KNOWN_MOST];
    const uint8_t *has;  /* [point]: bit k: it is known of pair k */
    double *const *rows; /* [3 k + channel][point] */
} shd_known;

/* For the standard tier, in the plan's frame: (p - plan->origin) plan->scale. */
typedef struct shd_points32 {
    size_t count;
    const float *position[3];
    const float *low[3];    /* the part of `position` that rounding took; low[0] NULL: none */
    const float *normal[3]; /* N */
    const float *mirror[3]; /* W = 2(N.V)N - V, rounded from f64 */
} shd_points32;

/* In f64, in the world's frame. */
typedef struct shd_points64 {
    size_t count;
    const double *position[3], *normal[3], *view[3];
    const int32_t *object;    /* index in shd_scene.objects; read only if plan->extended */
    const uint32_t *triangle; /* of meshes and faceted objects; NULL: nobody asks */
    double *shadowed;         /* to which the seconds of rays to lights are added; NULL: to none */
    /* [2 lobe] and [2 lobe + 1] at [sharp_at + point]: what a lobe's exponent or roughness is
     * there, and what it is multiplied by (shade/bend.h); of a material with a map of normals, then
     * [2 lobe_count + c]: the normal that the surface itself has. NULL: lobes are the material's
     * own. */
    const double *const *sharp;
    size_t sharp_at;
    /* [channel] at [facets_at + point]: what the facets of microgeometry reflect there, or the
     * index n of Cook and Torrance's, 1 and more, infinite too, whose k is 0; NULL: what the
     * material's do */
    const double *const *facets;
    size_t facets_at;
    const shd_known *known; /* of points from [known_at] on; NULL: nothing is */
    size_t known_at;
} shd_points64;

/* One point of a surface, in the world's frame. */
typedef struct shd_surface {
    shd_vec3 position, normal, view; /* normal and view are unit */
    shd_vec3 mirror;                 /* W = 2(N.V)N - V */
    const shd_plan_material *material;
    size_t object;
    uint32_t triangle;          /* of a mesh or a faceted object; set if the scene is traced */
    const shd_fresnel *index;   /* for three bins of a spectrum; NULL: the material's own */
    const double *const *sharp; /* as in shd_points64, at [sharp_at]; or NULL */
    size_t sharp_at;
    const double *const *facets; /* as in shd_points64, at [facets_at]; or NULL */
    size_t facets_at;
    const shd_known *known; /* as in shd_points64, at [known_at]; or NULL */
    size_t known_at;
    const shd_coefficients *rays; /* what it makes of rays; NULL: the material's own */
} shd_surface;

/* The index of Cook and Torrance's facets at the point, which may be put into `own`. */
static inline const shd_fresnel *shd_index_at(const shd_surface *at, shd_fresnel *own) {
    if (at->index) return at->index;
    if (!at->facets) return &at->material->from->fresnel;
    *own = (shd_fresnel){.n = {0}};
    for (int c = 0; c < 3; c++) own->n[c] = at->facets[c][at->facets_at];
    return own;
}

/* The surface's own normal where a map has turned `normal`. */
static inline shd_vec3 shd_flat_normal(const shd_surface *at) {
    const shd_plan_material *m = at->material;
    if (!m->normal || !at->sharp) return at->normal;
    const double *const *rows = at->sharp + 2 * m->lobe_count;
    return (shd_vec3){rows[0][at->sharp_at], rows[1][at->sharp_at], rows[2][at->sharp_at]};
}

/* Points of one object that lie beside each other, and what is known of them together. */
enum { SHD_CROWD = 64 };
typedef struct shd_crowd {
    size_t count;
    shd_surface at[SHD_CROWD];
    double *seconds; /* that `shares` took are added here; NULL: nobody asks */
    shd_ball around;
    uint64_t outward; /* bit i: a ray from point i to before its surface never meets its object */
} shd_crowd;

/* What tells how much of a light arrives at a point. */
typedef struct shd_shadows {
    const void *context;
    /* Writes the share of each channel that rays carry (shd_ray_channels). Only called if the light
     * would reach the point. Any thread.
     */
    void (*share)(const void *context, const shd_plan_light *light, const shd_surface *at,
                  double *out);
    /* The same of many points: fills what is known of a crowd, whose first three members are set.
     */
    void (*gather)(const void *context, shd_crowd *crowd);
    /* And then, light by light, writes a row for each of the points which[0..n) of it. The clock is
     * read twice, whatever n. */
    void (*shares)(const void *context, const shd_plan_light *light, const shd_crowd *crowd,
                   const uint8_t *which, size_t n, double *out);
} shd_shadows;

/* Which terms of a material: the diffuse one, and lobes first .. end - 1 of shd_plan_material. */
typedef struct shd_terms {
    bool diffuse;
    size_t first, end;
} shd_terms;

/* The plan's lights and lobes in the form that kernels read. */
typedef struct shd_lighting shd_lighting;

/* The lighting lives in `arena`, and borrows the plan and `shadows` (NULL: nothing stops light).
 * NULL if the arena is full. */
shd_lighting *shd_lighting_new(const shd_plan *plan, const shd_shadows *shadows, shd_arena *arena);

/* The sums over the lights which[0..n): ascending indices in plan->lights. `material` is one of
 * plan->materials. diffuse[c] and specular[3 lobe + c] are rows as long as the points' arrays. All
 * rows are written, except that grey lights (plan->grey_lights) write only those with c = 0.
 * `diffuse` may be NULL.
 *
 * edges[i], one a point, is set to 1 if f32 cannot tell on which side of an edge of the model the
 * point is (plan/tier.h): shd_light_again is for those. Others stay as they are. It may be NULL.
 *
 * A sum beyond f32 is infinite, and NaN if infinite light meets infinite negative light. Once
 * plan->cancelled is raised, rows are written in part. */
void shd_light_sums32(const shd_lighting *lighting, const shd_plan_material *material,
                      const uint32_t *which, size_t n, const shd_points32 *points,
                      float *const diffuse[3], float *const *specular, uint8_t *edges);

/* The same without highlights, of diffuse light alone, of lights that have no cone. */
void shd_light_dull32(const shd_lighting *lighting, const shd_plan_material *material,
                      const uint32_t *which, size_t n, const shd_points32 *points,
                      float *const diffuse[3]);

/* The same, all in f64; only `count` entries of the rows are written. */
void shd_light_sums64(const shd_lighting *lighting, const shd_plan_material *material,
                      const uint32_t *which, size_t n, const shd_points64 *points,
                      double *const diffuse[3], double *const *specular);

/* Replaces the sums of points at[0..points->count) of f32 rows, at most SHD_LANES, by sums in f64
 * of `points`. */
void shd_light_again(const shd_lighting *lighting, const shd_plan_material *material,
                     const uint32_t *which, size_t n, const shd_points64 *points,
                     const uint32_t *at, float *const diffuse[3], float *const *specular);

/* In a spectral scene, adds what light `index` of the plan's does on the terms at a point, as what
 * each bin adds to the color: [bins->count], which sum up to the color. */
void shd_light_bins(const shd_lighting *lighting, uint32_t index, const shd_surface *at,
                    const shd_terms *terms, double (*out)[3]);
