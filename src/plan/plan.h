/* The plan: the scene reduced to what it needs, before any pixel is touched.
 *
 * Constants are folded. Black terms are gone, and so are lights that reach nothing that is seen of
 * the picture, or of an object. Angles have become what the kernels compare. All this is exact: the
 * picture is that of the full scene. A plan is constant. It lives in its arena; any thread. */
#pragma once

#include "base/arena.h"
#include "base/cancel.h"
#include "base/cpu.h"
#include "plan/bend.h"
#include "plan/light.h"
#include "scene/scene.h"

/* A plane of flat faces that a light is in, or near to. */
typedef struct shd_sheet {
    shd_vec3 normal, point; /* unit; world frame */
    double height; /* the light's, along the normal, or N.L; 0: the light is in the plane */
    double size;   /* of the faces and their coordinates */
} shd_sheet;

typedef struct shd_sheets {
    size_t count;
    shd_sheet *list;
} shd_sheets;

/* Why a light of the scene is not in the plan. There is a bit for each reason of some object. */
enum {
    SHD_DROP_AMBIENT = 1, /* it is all in the ambient term */
    SHD_DROP_BLACK = 2,   /* its color is black */
    SHD_DROP_UNLIT = 4,   /* no object reflects its color, or there is no object */
    SHD_DROP_BEHIND = 8,  /* it is behind all that is seen */
    SHD_DROP_CONE = 16,   /* its cone misses the objects */
    SHD_DROP_BUDGET = 32  /* what it adds is under the budget */
};

typedef shd_lobe shd_plan_lobe;

/* A material where rays carry bins (plan->tinted): [bins->count] each, and one block of 9 [count].
 * Coefficients that are grey are the same in all bins. */
typedef struct shd_tint {
    const double *opacity, *reflection, *transmission;
    const double (*emissive)[3], (*ambient)[3]; /* ke and ka Ia: what each bin adds to the color */
} shd_tint;

/* Of a table of microgeometry (shade/westin.h), with the sum over bounces for facets of any
 * reflectance up to 1: its largest value, and by how much two nodes differ at most that are
 * neighbors in rise, in turn, or in turn beside the normal (SHD_WESTIN_NEAR). */
typedef struct shd_table_limits {
    double most, rise, turn, near;
} shd_table_limits;

/* Directions whose sine of the rise is less read no node but the first three from the normal. */
static const double SHD_WESTIN_NEAR = 0.14;

/* What an environment adds by one exponent, by direction, as a table (shade/prefilter.h). */
typedef struct shd_glow {
    const struct shd_prefilter *table; /* NULL: there is none; it is summed by quadrature */
    double error;                      /* no sum that it gives is farther off */
} shd_glow;

/* A lobe's exponent or roughness that is a pattern or a picture of numbers. */
typedef struct shd_gloss {
    const shd_texture *texture; /* NULL: it is one number */
    double least, most;
} shd_gloss;

typedef struct shd_plan_material {
    double emissive[3];
    double ambient[3];  /* ka Ia */
    double constant[3]; /* ke + ka Ia */
    double diffuse[3];
    bool has_emissive, has_ambient, has_diffuse;
    const shd_plan_lobe *lobes; /* those that are not black */
    size_t lobe_count;
    bool front_only;
    bool antialiased; /* lobes are widened where objects bend (shade/bend.h) */
    bool pointwise;   /* lobes differ from point to point: that, a map of normals, or `gloss` */
    shd_model model;
    const shd_material *from;      /* what of it only extended scenes have */
    const shd_table_limits *table; /* of its microgeometry; NULL: none, or not simulated yet */
    /* [1 + lobe_count][plan->bins->count]: the reflectances of the diffuse term and of the lobes,
     * whose colors above are then 1; NULL: they are RGB. */
    const double *bins;
    size_t bin_count; /* of all of `bins` */
    /* [(plan->bins->count + 2) / 3]: three bins each of a Cook-Torrance material's index, the last
     * one repeated; NULL: it is the same in a channel's bins. */
    const shd_fresnel *indices;
    const shd_tint *tint;                     /* NULL: rays carry three channels */
    const struct shd_plan_textures *textures; /* its patterns (plan/textures.h); NULL: none */
    const shd_texture *normal; /* its map of normals (shade/bump.h); NULL: it has none */
    /* [lobe_count]; lobes are then the sharpest that they are anywhere. NULL: none is a texture. */
    const shd_gloss *gloss;
} shd_plan_material;

/* An object as its lights see it. */
typedef struct shd_plan_object {
    bool bounded;    /* false: an infinite plane, and the sphere is not set */
    shd_vec3 center; /* of the sphere around it, in the world frame */
    double radius;
    size_t material; /* in plan->materials: the first that is equal to the object's */
    size_t group;    /* in plan->groups */
    /* [light_count]: ascending indices in plan->lights. Others add exactly 0 to what is seen. */
    const uint32_t *lights;
    size_t light_count;
} shd_plan_object;

/* Objects that are lit alike: one material, one list of lights. */
typedef struct shd_plan_group {
    size_t material;
    /* Their light is interpolated from their faces or corners, and multiplied by patterns at each
     * sample (tiles/facets.h); false: no pattern, or phong. */
    bool faceted;
    const uint32_t *lights;
    size_t light_count;
} shd_plan_group;

/* Upper bounds of errors. Infinite: not known. */
typedef struct shd_bound {
    double linear;  /* of the film's components, in the working space, against the model */
    double code;    /* of outputs' 8-bit samples, against the exact tier's picture */
    double delta_e; /* CIEDE2000, against the same, over black if there is alpha */
} shd_bound;

/* A color picture that is summed up: the beauty, or a layer that an output wants. */
typedef struct shd_plane {
    shd_layer_kind
        kind;     /* BEAUTY, EMISSIVE, AMBIENT, DIFFUSE, SPECULAR, LOBE, LIGHT, SHADOW or BOUNCE */
    size_t light; /* index in shd_scene.lights for LIGHT, in shd_material.lobes for LOBE */
} shd_plane;

typedef struct shd_plan {
    const shd_scene *scene;
    const atomic_bool *cancelled; /* if it is raised, all work with the plan ends; or NULL */
    shd_tier tier;                /* the one that runs: with a budget, the cheapest that meets it */
    /* The kernels' instruction set: the widest that this machine has, but in tests. It changes no
     * bit, but see shd_isa_fuses. A budget's tier depends on what lights cost by it. */
    shd_isa isa;
    const shd_plan_light *lights; /* those that may reach some object */
    size_t light_count;
    const shd_sheets *sheets; /* [light_count]: of faces whose planes the light is near; or NULL */
    const uint8_t *drops;     /* [scene->light_count]: SHD_DROP bits; 0: it is in `lights` */
    /* As shd_scene.materials, and behind these the parts of a spectral scene's (plan/textures.h).
     */
    const shd_plan_material *materials;
    size_t part_count;
    size_t max_lobes;  /* of any material */
    size_t max_terms;  /* of any material: the diffuse one, lobes, and slots of patterns */
    size_t max_fields; /* of patterns of any material */
    bool textured;     /* some object has a pattern or a picture */
    bool rayed[3];     /* some material's opacity, reflection, transmission is one */
    bool hued;         /* and one of these has another field for each component of a color */
    /* One of these, or a map of normals, is on a mesh or on faces: hits tell of triangles. */
    bool charted;
    bool faceted;     /* some object is lit at its faces or corners: the same */
    bool antialiased; /* some object's highlights are widened where it bends */
    bool bent_meshes; /* and one of these is a mesh, so that hits tell of triangles */
    bool bumped;      /* some object has a map of normals: what follows from its own normals alone
                       * does not hold of it */
    bool glossed;     /* some object has exponents or roughness that are a pattern or a picture */
    const shd_plan_object *objects; /* as shd_scene.objects */
    const shd_plan_group *groups;
    size_t group_count;
    bool grey_lights;        /* r = g = b in all of `lights` */
    bool grey;               /* channels are equal, in `lights`, all materials and the background */
    bool opaque;             /* the background is, so that alpha is 1 everywhere */
    const shd_plane *planes; /* the beauty first */
    size_t plane_count;
    bool wants[SHD_LAYER_KINDS]; /* whether any output has a layer of the kind */
    /* Positions are shaded in f32 as (p - origin) * scale, which is about 1 in size. The scale is a
     * power of 2 and made from the scene alone, so that it is the same for any region. */
    shd_vec3 origin;
    double scale;
    /* Whether positions need more than f32's 24 bits in that frame, because some light is near an
     * object, some light or lobe is so steep that it is done in f64, or a cone has a hard rim. */
    bool split_positions;
    /* A sum of lights may leave drop_tolerance + drop_relative I out of a component of value I, in
     * the working space. 0 and 0: all lights count. */
    double drop_tolerance, drop_relative;
    double dropped; /* the most that lights add which a budget has left out */
    /* The same lights in a tree (plan/bunches.h), if they are many and sums of them may leave out
     * something; or NULL. */
    const struct shd_bunches *bunches;
    /* What a light with a shape may be off as a point, of the most that it adds, under a budget of
     * linear error; 0: no more than rounding. */
    double point_off;
    /* What one sample at a pixel's center, which `draft` takes where a surface is smooth, may be
     * off the mean of all samples (bound/light/means.h). 0 and 0: all samples are taken. */
    shd_mean_room mean_room;
    /* Whether `draft` draws blocks that see one ball, ellipsoid or plane in f32 from rays to
     * colors, and triangles of one mesh from where rays meet them on (shade/sketch.h), where that
     * is not of another way. */
    bool sketched;
    shd_bound bound; /* of the picture's error, which counts all of these */
    bool whole;      /* as shd_plan_draft has it */
    /* Whether the scene has what goes beyond Phong's model and lights that are points: another
     * model, a light with a shape, or traced rays. All of it is lit in the exact tier's f64
     * (shade/extended.h), so that kernels and bounds of all other scenes know nothing of it. */
    bool extended;
    bool beyond_points; /* extended by more than models of reflection, or beyond f32's range */
    /* Whether the scene is extended by nothing but models that have kernels in f32, so that it has
     * the standard tier, too (shade/models32.simd.c). */
    bool models32;
    /* [scene->material_count]: what the microgeometry of each material reflects (shade/westin.h);
     * NULL for others. NULL: there is none, or it is not simulated yet. */
    const struct shd_westin *const *westin;
    /* [shd_all_materials][SHD_ENVIRONMENTS_MOST][1 + max_lobes]: of the diffuse term and the
     * lobes under each environment; NULL: all are summed by quadrature, as in the exact tier. */
    const shd_glow *glows;
    /* [SHD_ENVIRONMENTS_MOST]: the maps of environments in blocks (shade/moments.h), where a term
     * has no table. NULL: there is none. */
    const struct shd_moments *const *moments;
    const shd_bins *bins; /* the channels of spectral scenes; NULL: RGB */
    /* Whether rays carry bins, because coefficients of a spectral scene's rays are colored. Others
     * multiply all bins alike, and so a color. */
    bool tinted;
    bool beyond;                   /* tinted, and an opacity is below 0 or above 1 in some bin */
    const double (*background)[3]; /* tinted: [bins->count], what each bin adds to the color */
    /* [shd_all_materials][light_count][1 + max_lobes][3]: shd_term_color's, or NULL. */
    const double *term_colors;
    /* For people and the Shaded-Plan header: "tier=standard; lights=3/4; error<=2.1e-06 linear, 1
     * code, 0.012 deltaE2000". Bounds that are not known are left out. "; asked=draft" follows a
     * tier that was not asked for, and "; groups=211" lights that are in bunches. "; cut<=0.0043"
     * comes last if rays go on: plan/paths.h. */
    const char *summary;
} shd_plan;

/* What is chosen for a plan: see bound/bound.h. */
typedef struct shd_choice {
    const shd_plan *plan; /* the draft, or what is left of it without lights */
    shd_tier tier;
    double drop_tolerance, drop_relative, dropped; /* as in shd_plan */
    double point_off;                              /* as in shd_plan */
    shd_mean_room mean_room;                       /* as in shd_plan */
    bool by_quadrature;                            /* without plan->glows */
    shd_bound bound;
} shd_choice;

/* Makes a plan for kernels of the instruction set `isa`, but for what is chosen: tier, tolerances
 * and bound. With `whole`, which is for tests, no materials are merged, and every light that has a
 * color stays everywhere. `cancelled` (or NULL) ends it. False: memory, or cancelled. */
bool shd_plan_draft(const shd_scene *scene, shd_isa isa, bool whole, const atomic_bool *cancelled,
                    shd_arena *arena, const shd_plan **out);

/* Makes a draft without lights whose `out_of_budget` ([light_count]) is set. False: as above. */
bool shd_plan_without(const shd_plan *draft, const bool *out_of_budget, shd_arena *arena,
                      const shd_plan **out);

/* Makes the plan that was chosen. False: memory, or cancelled. */
bool shd_plan_finish(const shd_choice *choice, shd_arena *arena, const shd_plan **out);

/* The length of plan->materials. */
static inline size_t shd_all_materials(const shd_plan *plan) {
    return plan->scene->material_count + plan->part_count;
}

/* Whether models beside Phong's are lit in f32. */
static inline bool shd_has_models32(const shd_plan *plan) {
    return plan->models32 && plan->tier != SHD_EXACT;
}

/* The table of an environment on a term (0: diffuse, 1 + lobe). NULL: there is none. */
static inline const shd_glow *shd_find_glow(const shd_plan *plan, const shd_plan_material *material,
                                            const shd_plan_light *light, size_t term) {
    const size_t m = (size_t)(material - plan->materials);
    const shd_glow *glow =
        plan->glows
            ? &plan->glows[(m * SHD_ENVIRONMENTS_MOST + light->around) * (1 + plan->max_lobes) +
                           term]
            : NULL;
    return glow && glow->table ? glow : NULL;
}

/* The color of a light on a term of a material (0: diffuse, 1 + lobe), which multiplies the term's
 * weight: sum_b k_b w_b over the bins of a spectral scene, where the material's own color is 1. Any
 * thread. Returns `scratch`, or what is kept. */
const double *shd_term_color(const shd_plan *plan, const shd_plan_material *material,
                             const shd_plan_light *light, size_t term, double scratch[3]);

/* In a spectral scene, what weights of the three channels become: weights that differ (Fresnel's
 * reflectance) are lifted as any other reflectance. */
void shd_term_light(const shd_plan *plan, const shd_plan_material *material,
                    const shd_plan_light *light, size_t term, const double weights[3],
                    double out[3]);

/* The same sums of absolute values: no weights of 0 to 1 become more. */
void shd_term_most(const shd_plan *plan, const shd_plan_material *material,
                   const shd_plan_light *light, size_t term, double out[3]);

/* What a surface makes of rays, in the channels that they carry: red, green and blue, or bins. */
typedef struct shd_coefficients {
    size_t count;
    const double *opacity, *reflection, *transmission; /* [count] */
} shd_coefficients;

static inline shd_coefficients shd_coefficients_of(const shd_plan *plan, size_t object) {
    const shd_plan_material *m = &plan->materials[plan->objects[object].material];
    if (!m->tint)
        return (shd_coefficients){3, m->from->opacity, m->from->reflection, m->from->transmission};
    return (shd_coefficients){plan->bins->count, m->tint->opacity, m->tint->reflection,
                              m->tint->transmission};
}

static inline size_t shd_ray_channels(const shd_plan *plan) {
    return plan->tinted ? plan->bins->count : 3;
}

static inline bool shd_is_all(const double *values, size_t count, double value) {
    for (size_t c = 0; c < count; c++)
        if (values[c] != value) return false;
    return true;
}

/* The mean of red, green and blue of white light of which such shares are left in the channels that
 * rays carry. */
double shd_mean_share(const shd_plan *plan, const double *share);

/* The largest component of the color of lifted light of which each bin keeps a share of 1 at most,
 * whose own components are 1 at most. */
double shd_lifted_most(const shd_bins *bins);

/* Whether a map turns the object's normals at each sample. Those of faceted objects are turned
 * where their light is found (render/tiles/mapped.h). */
static inline bool shd_turns_normals(const shd_plan *plan, size_t object) {
    return plan->materials[plan->objects[object].material].normal &&
           plan->scene->objects[object].interpolation == SHD_PHONG;
}

/* Whether a map or a pattern changes the object's lobes at each sample. */
static inline bool shd_sharpens(const shd_plan *plan, size_t object) {
    return shd_turns_normals(plan, object) ||
           (plan->materials[plan->objects[object].material].gloss &&
            plan->scene->objects[object].interpolation == SHD_PHONG);
}

/* Fills [bins->count] with what each bin adds to a light's color. */
void shd_light_in_bins(const shd_plan *plan, const shd_light *light, double (*out)[3]);

enum { SHD_BOUND_TEXT = 32 };

double shd_bound_in(const shd_bound *bound, shd_metric metric);

/* Rounded up to two digits, 2.1e-06, or to as many more as keep it within `most`, the budget that
 * the bound meets (infinite: there is none). */
void shd_print_bound(double bound, double most, char out[SHD_BOUND_TEXT]);
/* The same of the plan's bound: within the budget if the plan has one in that metric. */
void shd_plan_print_bound(const shd_plan *plan, shd_metric metric, char out[SHD_BOUND_TEXT]);

/* Whether `draft`, if it is asked for or not, may take fewer samples, and whether it may sketch.
 * Neither: it renders as `standard`, because the document wants layers, or has no sphere or plane
 * whose light could be told to be smooth, and no mesh of large triangles. */
bool shd_plan_may_thin(const shd_plan *plan);
bool shd_plan_may_sketch(const shd_plan *plan);

/* How many of the rules of plan/nodes.h pixels may take instead of all samples in a tier. */
size_t shd_plan_rules(const shd_plan *plan, shd_tier tier);

/* Whether what is lit so may be sketched: by few lights that are no spots, in few lobes that f32
 * holds, and nothing of it takes light away. */
bool shd_plan_sketches(const shd_plan *plan, const shd_plan_group *group);

static inline bool shd_plan_may_draft(const shd_plan *plan) {
    return shd_plan_may_thin(plan) || shd_plan_may_sketch(plan);
}

/* Whether blocks that are smooth take one sample a pixel. */
static inline bool shd_plan_is_thin(const shd_plan *plan) {
    return plan->mean_room.absolute > 0;
}

static inline bool shd_plan_is_draft(const shd_plan *plan) {
    return shd_plan_is_thin(plan) || plan->sketched;
}

/* What the plan's tier is called: `draft` if it takes fewer samples or sketches. */
const char *shd_plan_tier_name(const shd_plan *plan);

/* Finds the scene's light `index` in plan->lights. False: it was dropped. */
bool shd_plan_find_light(const shd_plan *plan, size_t index, uint32_t *out);

/* Surface points that are close to each other, for example a tile's. World frame. */
typedef struct shd_patch {
    shd_vec3 center; /* of a sphere around the points */
    double radius;
    shd_vec3 axis;     /* unit: of a cone around their normals, turned as they are shaded */
    double cos_spread; /* of the cone's half-angle; -1: any normal */
} shd_patch;

/* Copies those lights of `in[0..count)` (ascending indices in plan->lights) to `out` that may reach
 * the patch, and returns how many there are. `out` may be `in`. Other lights add exactly 0 there:
 * they are behind all normals, or their cones miss the sphere. It takes some 10 ns a light. */
size_t shd_plan_cull(const shd_plan *plan, const shd_patch *patch, const uint32_t *in, size_t count,
                     uint32_t *out);
