/* Lights and lobes as the kernels read them. Only for shade/. */
#pragma once

#include "shade/lighting.h"

typedef enum shd_light_kind {
    SHD_KIND_DIRECTIONAL,
    SHD_KIND_POINT,      /* without attenuation */
    SHD_KIND_ATTENUATED, /* point */
    SHD_KIND_SPOT,
    SHD_KIND_WIDE /* of any kind; f64 does it, because f32 cannot hold it */
} shd_light_kind;

/* A light in f32, in the plan's frame. It takes two cache lines; point lights need only the
 * first. */
typedef struct shd_packed_light {
    _Alignas(64) float at[3]; /* position, or the direction toward it */
    float a, b, c, least;     /* 1/(a + b d + c d^2), d = max(distance, least); the largest is 1 */
    float color[3];           /* Il times what a, b and c were divided by */
    /* Squared distances in f32 as integers, fewer than `span` from `nearest` on. Nearer and farther
     * points are done in f64. */
    uint32_t nearest, span;
    int32_t kind;                               /* shd_light_kind */
    uint32_t group;                             /* the lights of a group are summed in f32 */
    float low[3];                               /* the part of `at` that rounding took */
    float outer, inner, inverse_fade, exponent; /* as shd_plan_light; 1/(outer - inner) or 0 */
    float axis[3];
    /* Nearer to `outer` than this, f64 tells on which side 1 - cos t is. 0 with a penumbra. */
    float rim;
    bool quick; /* it may be summed quickly: it falls off as shd_lighting.quick does */
} shd_packed_light;

/* A plane of flat faces that the light is in or near to. There N.(light - p) is `height`, turned as
 * N is, for all points p of the plane. A point is of the plane if the square of its normal's
 * difference and its place differ by less than these. */
typedef struct shd_packed_sheet {
    double normal[3], offset; /* normal.p, in the frame of shd_wide_light */
    double height;
    double same_normal, same_place, slack; /* same_place (|x| + |y| + |z|) + slack */
} shd_packed_sheet;

/* The same light in f64. For points in f64 it is in the world's frame times the plan's scale, and
 * positions are subtracted as they are. For those in f32 it is in the plan's frame. */
typedef struct shd_wide_light {
    _Alignas(64) double at[3];
    double a, b, c, least;
    double color[3];
    double axis[3], outer, inner, inverse_fade, exponent;
    int32_t kind; /* SHD_KIND_WIDE: beyond f64, too, so that the reference does it */
    uint32_t sheet_count;
    const shd_packed_sheet *sheets;
    double gain; /* what `color` holds beside Il */
} shd_wide_light;

/* Of a term of a material in a light's spectrum: a weight w[i] of each channel comes to the color c
 * sum_i w[i] mix[i][c] (shd_term_light is linear). */
typedef double shd_packed_mix[3][3];

enum { SHD_LOG_TERMS = 5 };

/* (R.V)^ns = 2^t in f32. t is a polynomial of z for short lobes, and otherwise follows from a
 * logarithm. */
typedef struct shd_packed_lobe {
    float reach;              /* The lobe is 0 if z = |L - W|^2 = 2 (1 - R.V) is above this. */
    bool is_short;            /* whether the lobe falls to nothing within 60 degrees */
    float log[SHD_LOG_TERMS]; /* short lobes: t = z (log[0] + z (log[1] + ...)) */
    float shininess;
} shd_packed_lobe;

enum { SHD_ENERGY_TERMS = 28 };

/* The energy of a normalized Phong lobe of exponent 2 half: with c = N.L and s^2 = 1 - c^2,
 *     E = (2 pi c + beta s^(2 half + 2) psi) / (2 half + 2),
 * psi a Chebyshev series of ((kappa - c) / (kappa + c) - middle) twice / 2. Its relative error is
 * below 1e-11. */
typedef struct shd_packed_energy {
    double half, beta, kappa, middle, twice, terms[SHD_ENERGY_TERMS];
} shd_packed_energy;

enum { SHD_WIDE_LOBES = 8, SHD_WIDE_ROWS = 3 + 3 * SHD_WIDE_LOBES };

/* The same in f32, with terms that matter there:
 *     pi c / E = gain c / (slope c + beta (1 - c^2)^exponent psi),
 * and the series is one of (kappa - c) / (kappa + c) twice + shift. */
typedef struct shd_packed_energy32 {
    float exponent, beta, kappa, twice, shift, gain, slope, low, terms[SHD_ENERGY_TERMS];
    int count; /* of the terms; `low` is shd_normalized_low */
} shd_packed_energy32;

/* A material beside Phong's in f32. */
typedef struct shd_packed_model {
    float even, rough;                   /* Oren-Nayar's N.L (even + rough s) */
    float cut;                           /* lobes are nothing where they are below exp(-cut) */
    const shd_packed_energy32 *energies; /* [lobe_count]; NULL but for normalized Phong lobes */
} shd_packed_model;

enum { SHD_QUICK_BALL = 8 };

/* The points of a call, and what is done with them: points in f64 (`points`), whose sums go to
 * diffuse64 and specular64, or in f32 (`narrow`), whose sums are rounded. The pointers of the
 * others are NULL. */
typedef struct shd_sums_job {
    const shd_lighting *lighting;
    const shd_plan_material *material;
    const shd_packed_lobe *lobes;  /* the material's, of `narrow` */
    size_t first_lobe, lobe_count; /* those that are summed, at most SHD_WIDE_LOBES */
    const uint32_t *which;
    size_t n;
    const shd_points64 *points;
    const shd_points32 *narrow;
    size_t count; /* of all points */
    /* The points that are summed: whole vectors, except at the end of all points. */
    size_t first, end;
    float *const *diffuse, *const *specular; /* of all lobes; the diffuse rows may be NULL */
    double *const *diffuse64, *const *specular64;
    uint8_t *edges; /* of `narrow`; NULL: nobody asks */
    /* Of quick sums: centers and radii of balls around so many of `which` each; or NULL. */
    const float (*balls)[4];
} shd_sums_job;

/* Sums in f32, of points in f32 only, and in f64. */
typedef void shd_sums_function(const shd_sums_job *job);
shd_sums_function shd_sums32_portable, shd_sums32_avx2, shd_sums32_avx512;
shd_sums_function shd_sums64_portable, shd_sums64_avx2, shd_sums64_avx512;

/* Sums in f32 that are added to the rows: shade/quick.h. */
shd_sums_function shd_quick32_portable, shd_quick32_avx2, shd_quick32_avx512;

/* Sums in f64 of all models, spectra and lights with a shape, of points in f64. */
shd_sums_function shd_brdf64_portable, shd_brdf64_avx2, shd_brdf64_avx512;

/* Sums in f32 of plan->models32, of points in f32 only. */
shd_sums_function shd_models32_portable, shd_models32_avx2, shd_models32_avx512;

typedef struct shd_packed_material {
    const shd_packed_lobe *lobes; /* [lobe_count] */
    /* In f32, or in f64 if a shininess is below 1, whose edge at R.V = 0 is too steep for f32. */
    shd_sums_function *sums;
    const shd_packed_model *model; /* NULL: it is Phong's */
} shd_packed_material;

/* Computes one light at one vector of floats. The contributions of the set bits of `lanes`, from
 * point `first` on, go to rows[SHD_WIDE_ROWS][vector], and 0 in the other lanes. Rows are the
 * channels of the diffuse sum, then 3 + 3 lobe + channel. */
typedef void shd_add_wide_function(const shd_sums_job *job, uint32_t index, size_t first,
                                   unsigned lanes, float *rows);
shd_add_wide_function shd_add_wide_portable, shd_add_wide_avx2, shd_add_wide_avx512;

/* What quick sums read of a light: a quarter of shd_packed_light, so that thousands are in a cache.
 */
typedef struct shd_packed_lamp {
    _Alignas(32) float at[3];
    float color[3];
    bool quick; /* as in shd_packed_light */
} shd_packed_lamp;

/* All lights in the order of their trees (plan/bunches.h), so that those that are summed at once
 * lie together, and points face all of them or none. */
typedef struct shd_lamps {
    uint32_t *quick, *others; /* those that are summed quickly, and those that are not */
    size_t quick_count, other_count;
    float (*balls)[4];       /* as in shd_sums_job, of `quick` */
    shd_packed_lamp *packed; /* [plan->light_count], in the plan's order */
} shd_lamps;

struct shd_lighting {
    const shd_plan *plan;
    shd_sums_function *sums64;      /* the variant of the plan's instruction set */
    const shd_packed_light *lights; /* [plan->light_count]; NULL for the exact tier */
    /* How lights that are summed quickly fall off, and squared distances at which all of them are
     * done in f32. */
    shd_packed_light quick;
    shd_lamps lamps;                      /* of a plan that has bunches */
    const shd_wide_light *wide, *exact;   /* [plan->light_count]: for narrow points, for others */
    const shd_packed_material *materials; /* [plan->material_count] */
    const shd_shadows *shadows;           /* or NULL */
    const struct shd_sketch_group *sketches; /* [plan->group_count] (sketch.h); NULL: none */
    shd_sums_function *brdf64;
    /* [plan->material_count] of [lobe_count]; NULL but for normalized Phong lobes */
    const shd_packed_energy *const *energies;
    const struct shd_westin_colored *westin; /* [plan->material_count]; NULL: there is none */
    /* [plan->material_count] of [light_count][1 + lobe_count], of materials whose weights differ by
     * channel. NULL: the scene is RGB, or memory for them would be too much. */
    const shd_packed_mix *const *mixes;
};

/* Packs a light, and a material's lobes, for the tier. */
shd_packed_light shd_pack_light(const shd_plan *plan, const shd_plan_light *light);
shd_packed_lobe shd_pack_lobe(const shd_plan *plan, double shininess);

/* Packs a material beside Phong's; `energies` are lighting->energies of it. NULL: memory. */
const shd_packed_model *shd_pack_model32(const shd_plan *plan, const shd_plan_material *material,
                                         const shd_packed_energy *energies, shd_arena *arena);

/* Marks the points of a vector whose bits are set. */
static inline void shd_mark_edges(uint8_t *edges, size_t first, unsigned lanes) {
    for (; edges && lanes; lanes &= lanes - 1) edges[first + (size_t)__builtin_ctz(lanes)] = 1;
}

/* Whether the light is in the plane of the point's face, or behind it. `p` is in the light's frame.
 */
bool shd_is_behind_face(const shd_wide_light *light, shd_vec3 p, shd_vec3 normal);

/* As shd_light_sums64, where nothing stops light. */
void shd_open_sums(const shd_lighting *lighting, const shd_plan_material *material,
                   const uint32_t *which, size_t n, const shd_points64 *points,
                   double *const diffuse[3], double *const *specular);

/* Computes one light at one point by the f64 reference, to row[SHD_WIDE_ROWS] as above. */
void shd_add_reference(const shd_sums_job *job, uint32_t index, size_t point, double *row);
