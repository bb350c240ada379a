/* The plan: the scene reduced to what it needs, before any pixel is touched.
 *
 * Constants are folded, black terms and lights are gone, angles have become what the kernels
 * compare, and the tier and its kernel are chosen. A plan is constant once made, lives in its
 * arena, and may be shared by threads. Every reduction made here is exact: the picture is the
 * one of the full scene. */
#ifndef SHD_PLAN_PLAN_H
#define SHD_PLAN_PLAN_H

#include "base/arena.h"
#include "base/cpu.h"
#include "base/vec3.h"
#include "scene/scene.h"

/* A light that reaches surfaces: directional, point or spot, with a color that is not black. */
typedef struct shd_plan_light {
    size_t index;     /* in shd_scene.lights */
    bool directional; /* no position, no attenuation */
    bool attenuated;  /* false: 1/(a + b d + c d^2) is the constant `gain` */
    bool spot;
    shd_vec3 position; /* point, spot */
    shd_vec3 toward;   /* directional: unit vector from any surface to the light */
    shd_vec3 axis;     /* spot: unit vector along which it shines */
    double color[3];   /* Il */
    double a, b, c;    /* attenuation divided by its largest term; see `gain` */
    double gain;       /* 1 / that largest term */
    double min_distance;
    /* Spot cones as 1 - cos of the half-angle, which |axis + L|^2 / 2 is compared with: near
     * the axis cosines cancel and chords do not. inner <= outer <= 2. */
    double outer, inner;
    double exponent;
} shd_plan_light;

typedef struct shd_plan_lobe {
    double specular[3];
    double shininess;
} shd_plan_lobe;

typedef struct shd_plan_material {
    double emissive[3];
    double ambient[3]; /* ka Ia */
    double diffuse[3];
    bool has_diffuse;
    const shd_plan_lobe *lobes; /* those that are not black */
    size_t lobe_count;
    bool front_only;
} shd_plan_material;

/* A color picture that is summed: the beauty first, then each layer that an output wants. */
typedef struct shd_plane {
    shd_layer_kind kind; /* BEAUTY, EMISSIVE, AMBIENT, DIFFUSE, SPECULAR or LIGHT */
    size_t light;        /* index in shd_scene.lights, for LIGHT */
} shd_plane;

typedef struct shd_plan {
    const shd_scene *scene;
    shd_tier tier; /* the tier that runs: SHD_STANDARD or SHD_EXACT */
    shd_isa isa;   /* of the kernels; the bits do not depend on it */
    const shd_plan_light *lights;
    size_t light_count;
    const shd_plan_material *materials; /* as shd_scene.materials */
    size_t max_lobes;                   /* of any material */
    const shd_plane *planes;
    size_t plane_count;
    bool wants[SHD_LAYER_KINDS]; /* whether any output has a layer of the kind */
    /* Positions are shaded in f32 as (p - origin) * scale, where they are near 1 in size;
     * scale is a power of 2, made from the scene alone so that it is the same for any region. */
    shd_vec3 origin;
    double scale;
    const char *summary; /* "tier=standard; lights=3/4", for people and the Shaded-Plan header */
} shd_plan;

/* Plans for kernels of the instruction set `isa`. SHD_MEMORY is the only error: a scene that was
 * read can be planned. */
shd_status shd_plan_make(const shd_scene *scene, shd_isa isa, shd_arena *arena,
                         const shd_plan **out, shd_error *error);

/* The sphere around an object in the world frame. False for infinite objects. */
bool shd_object_bounds(const shd_object *object, shd_vec3 *center, double *radius);

/* The box around an object in its own frame, its dimensions applied. False for infinite ones. */
bool shd_object_box(const shd_object *object, shd_vec3 *low, shd_vec3 *high);

#endif
