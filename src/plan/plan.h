/* The plan: the scene reduced to what it needs, before any pixel is touched.
 *
 * Constants are folded, black terms are gone, so are lights that reach nothing that is seen (of
 * the picture, and of each object), angles have become what the kernels compare, and the tier and
 * its kernel are chosen. A plan is constant once made, lives in its arena, and may be shared by
 * threads. These reductions are exact: the picture is the one of the full scene. */
#ifndef SHD_PLAN_PLAN_H
#define SHD_PLAN_PLAN_H

#include "base/arena.h"
#include "base/cancel.h"
#include "base/cpu.h"
#include "plan/light.h"
#include "scene/scene.h"

/* A plane of flat faces that a light is in, or near to. */
typedef struct shd_sheet {
    shd_vec3 normal, point; /* unit; world frame */
    double height;          /* of the light, along the normal, or N.L; 0: it is in the plane */
    double size;            /* of the faces and their coordinates */
} shd_sheet;

typedef struct shd_sheets {
    size_t count;
    shd_sheet *list;
} shd_sheets;

/* Why a light of the scene is not in the plan: bits, all of them that say so for some object. */
enum {
    SHD_DROP_AMBIENT = 1, /* it is all in the ambient term */
    SHD_DROP_BLACK = 2,   /* its color is */
    SHD_DROP_UNLIT = 4,   /* no object reflects its color, or there is no object */
    SHD_DROP_BEHIND = 8,  /* behind all that is seen */
    SHD_DROP_CONE = 16,   /* its cone misses the objects */
    SHD_DROP_BUDGET = 32  /* what it adds is under the budget */
};

typedef struct shd_plan_lobe {
    double specular[3];
    double shininess;
} shd_plan_lobe;

typedef struct shd_plan_material {
    double emissive[3];
    double ambient[3];  /* ka Ia */
    double constant[3]; /* ke + ka Ia */
    double diffuse[3];
    bool has_emissive, has_ambient, has_diffuse;
    const shd_plan_lobe *lobes; /* those that are not black */
    size_t lobe_count;
    bool front_only;
} shd_plan_material;

/* An object as its lights see it. */
typedef struct shd_plan_object {
    bool bounded;    /* false: an infinite plane, and the sphere is not set */
    shd_vec3 center; /* of the sphere around it, in the world frame */
    double radius;
    size_t material;        /* in plan->materials: the first that is equal to the object's */
    size_t group;           /* in plan->groups */
    const uint32_t *lights; /* [light_count]: indices in plan->lights, ascending, of those that
                               may reach it; the other ones add exactly 0 to what is seen of it */
    size_t light_count;
} shd_plan_object;

/* Objects that are lit alike: one material, one list of lights. */
typedef struct shd_plan_group {
    size_t material;
    const uint32_t *lights;
    size_t light_count;
} shd_plan_group;

/* Upper bounds; infinite: unknown. */
typedef struct shd_bound {
    double linear;  /* of components of the film, in the working space, from the model's */
    double code;    /* of 8-bit samples of outputs, from those of the exact tier's picture */
    double delta_e; /* CIEDE2000, from the same; what has alpha lies over black */
} shd_bound;

/* A color picture that is summed: the beauty first, then each layer that an output wants. */
typedef struct shd_plane {
    shd_layer_kind kind; /* BEAUTY, EMISSIVE, AMBIENT, DIFFUSE, SPECULAR or LIGHT */
    size_t light;        /* index in shd_scene.lights, for LIGHT */
} shd_plane;

typedef struct shd_plan {
    const shd_scene *scene;
    const atomic_bool *cancelled; /* raised: all that works with the plan ends; or NULL */
    shd_tier tier;                /* the one that runs: with a budget, the cheapest that meets it */
    shd_isa isa; /* of the kernels: the widest that this machine has; the bits do not depend on
                    it (but see shd_isa_fuses, and the tier of a budget, which depends on what
                    its lights cost), so tests may choose another that it has */
    const shd_plan_light *lights; /* those that may reach some object */
    size_t light_count;
    const shd_sheets *sheets; /* [light_count]: on which side of faces they are; NULL: of none */
    const uint8_t *drops;     /* [scene->light_count]: SHD_DROP bits; 0: it is in `lights` */
    const shd_plan_material *materials; /* as shd_scene.materials */
    size_t max_lobes;                   /* of any material */
    const shd_plan_object *objects;     /* as shd_scene.objects */
    const shd_plan_group *groups;
    size_t group_count;
    bool grey_lights; /* r = g = b in every one of `lights` */
    bool grey;        /* ... and in all materials and the background: channels are equal */
    bool opaque;      /* the background is: alpha is 1 everywhere */
    const shd_plane *planes;
    size_t plane_count;
    bool wants[SHD_LAYER_KINDS]; /* whether any output has a layer of the kind */
    /* Positions are shaded in f32 as (p - origin) * scale, where they are near 1 in size;
     * scale is a power of 2, made from the scene alone so that it is the same for any region. */
    shd_vec3 origin;
    double scale;
    /* Whether a position needs more than f32's 24 bits in that frame: some light is near an
     * object, some light or lobe is so steep that it is done in f64, or a cone has a hard rim. */
    bool split_positions;
    /* What a sum of lights may leave out of a component of value I, in the working space:
     * drop_tolerance + drop_relative I. 0 and 0: all lights count. */
    double drop_tolerance, drop_relative;
    double dropped;                     /* what the lights that are gone for a budget add at most */
    shd_bound bound;                    /* of the picture's error, all of these counted */
    const struct shd_plan_sweep *sweep; /* for shd_plan_cull */
    const char *summary; /* "tier=standard; lights=3/4; error<=2.1e-06 linear, 1 code, 0.012
                            deltaE2000", for people and the Shaded-Plan header; what is not known
                            is left out. "; asked=draft" follows a tier that was not asked for */
} shd_plan;

/* What is chosen for a plan: see bound/bound.h. */
typedef struct shd_choice {
    const shd_plan *plan; /* the draft, or what is left of it without lights */
    shd_tier tier;
    double drop_tolerance, drop_relative, dropped; /* as in shd_plan */
    shd_bound bound;
} shd_choice;

/* A plan for kernels of the instruction set `isa`, but for what is chosen: tier, tolerances and
 * bound. `whole`: without the reductions that leave lights out and merge materials, with every
 * light that has a color for every object and every patch; tests compare pictures of both.
 * `cancelled` (or NULL) ends it, and goes into the plan. False: memory, or cancelled. */
bool shd_plan_draft(const shd_scene *scene, shd_isa isa, bool whole, const atomic_bool *cancelled,
                    shd_arena *arena, const shd_plan **out);

/* A draft without some of its lights: those with `out_of_budget` ([light_count]). False: as
 * above. */
bool shd_plan_without(const shd_plan *draft, const bool *out_of_budget, shd_arena *arena,
                      const shd_plan **out);

/* The plan that was chosen. False: memory. */
bool shd_plan_finish(const shd_choice *choice, shd_arena *arena, const shd_plan **out);

enum { SHD_BOUND_TEXT = 32 };

double shd_bound_in(const shd_bound *bound, shd_metric metric);

/* Rounded up to two digits, 2.1e-06, or to as many more as keep it within `most`, the budget that
 * the bound meets (infinite: there is none). */
void shd_print_bound(double bound, double most, char out[SHD_BOUND_TEXT]);

/* The same of the plan's bound: within the budget where the plan has one in that metric. */
void shd_plan_print_bound(const shd_plan *plan, shd_metric metric, char out[SHD_BOUND_TEXT]);

/* The index in plan->lights of the scene's light `index`; false: it was dropped. */
bool shd_plan_find_light(const shd_plan *plan, size_t index, uint32_t *out);

/* Surface points that are close to each other, a tile's for example. World frame. */
typedef struct shd_patch {
    shd_vec3 center; /* of a sphere around the points */
    double radius;
    shd_vec3 axis;     /* unit; of a cone around their normals N, turned as they are shaded */
    double cos_spread; /* of the half-angle of that cone; -1: any normal */
} shd_patch;

/* Of the lights `in[0..count)` (indices in plan->lights, ascending) those that may reach the
 * patch; `out` has room for all and may be `in`. Returns how many. The other ones add exactly 0
 * there: they are behind all normals, or their cones miss the sphere. Some 10 ns a light. */
size_t shd_plan_cull(const shd_plan *plan, const shd_patch *patch, const uint32_t *in, size_t count,
                     uint32_t *out);

#endif
