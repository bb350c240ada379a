/* The plan's parts, in the order in which they are made. Inside of plan/ and bound/. */
#pragma once

#include "plan/plan.h"

/* A distance or a cosine that is smaller than this, beside the lengths that it is compared with,
 * may be an error of f32, and decides nothing. */
#define SHD_PLAN_MARGIN 1e-5

/* Pairs of objects and lights that are looked at one by one, to find what does not reach what, and
 * how far off each may be: some hundred instructions each time. With more, each object has all
 * lights, which tiles still leave out, and clusters of them are looked at. */
enum { SHD_PLAN_PAIRS = 1 << 18 };

/* More than rounding moves lengths and cosines by in f64. */
static const double SHD_PIECE_MARGIN = 1e-6;

/* shd_length and shd_normalize, but for the last digit, and faster if squares are normal. */
static inline double shd_plan_length(shd_vec3 a) {
    const double squared = shd_dot(a, a);
    return squared > 1e-280 && squared < 1e280 ? sqrt(squared) : shd_length(a);
}

static inline bool shd_plan_normalize(shd_vec3 a, shd_vec3 *out) {
    const double squared = shd_dot(a, a);
    if (!(squared > 1e-280 && squared < 1e280)) return shd_normalize(a, out);
    *out = shd_scale(a, 1 / sqrt(squared));
    return true;
}

static inline bool shd_is_black(const double color[3]) {
    return color[0] == 0 && color[1] == 0 && color[2] == 0;
}

static inline bool shd_is_grey(const double color[3]) {
    return color[0] == color[1] && color[1] == color[2];
}

/* The parts of a spectral plan. They do nothing if it is not spectral. `ambient` is [bins], and
 * begins as the scene's. False: memory, or cancelled. */
bool shd_plan_bins(shd_plan *plan, double (**ambient)[3], shd_arena *arena);
bool shd_plan_ambient_bins(const shd_plan *plan, const shd_light *light, double (*ambient)[3]);
bool shd_plan_light_bins(const shd_plan *plan, shd_plan_light *lights, size_t count,
                         shd_arena *arena);
bool shd_plan_material_bins(const shd_plan *plan, double (*ambient)[3], shd_arena *arena,
                            shd_plan_material *material);
bool shd_plan_term_colors(shd_plan *plan, shd_arena *arena);
/* Finds whether the plan is tinted; then each of its materials has a tint. */
bool shd_plan_tinted(shd_plan *plan, shd_arena *arena);
bool shd_plan_tint(shd_plan *plan, double (*ambient)[3], shd_arena *arena,
                   shd_plan_material *material);

/* The most in each bin of any color whose components are no larger than these. */
void shd_bins_lift_most(const shd_bins *bins, const double rgb[3], double *out);

bool shd_same_tint(const shd_plan_material *x, const shd_plan_material *y);

/* The most that bins add to any channel, whatever of each of them arrives, up to all. */
double shd_most_in_bins(const shd_bins *bins, const double (*of)[3]);

/* Whether a spot's cone misses a sphere. `path` leads from the sphere's center to the light. */
bool shd_outside_cone(const shd_plan_light *light, shd_vec3 path, double radius);

/* What tells an object's distance from points. */
typedef struct shd_place {
    const shd_object *object;
    const shd_plan_object *bounds;
    bool known;         /* false: there is no inverse */
    shd_affine inverse; /* of the object's frame, linear */
    double norm;        /* of `inverse`: distances grow by no more than this into that frame */
    shd_vec3 low, high; /* its box there */
} shd_place;

shd_place shd_place_of(const shd_object *object, const shd_plan_object *bounds);

/* A lower bound of the distance of a point of the world from the object's surface. */
double shd_least_distance(const shd_place *place, shd_vec3 point);

/* A lower bound of the distance of a point of the world from any ray of the whole picture. */
double shd_ray_distance(const shd_scene *scene, shd_vec3 point);

/* What tells whether a light is behind all that is seen of an object. See behind.c. */
typedef struct shd_back {
    bool known;         /* false: nothing can be said */
    shd_affine inverse; /* of the object's frame, linear */
    shd_vec3 origin;    /* of the object's frame */
    double norm;        /* of `inverse` */
    shd_vec3 center;    /* of the object's sphere; of a plane, the eye */
    double radius;      /* the sphere's; of a plane, the eye's distance from the origin */
    shd_vec3 faces[6];  /* normals n, turned as they are seen, of flat parts that may be seen */
    double offsets[6];  /* n.x of points x of that face */
    int face_count;
    bool round;        /* there is a curved part, whose normals are in an arc */
    bool flat_circle;  /* these normals are in the plane y = 0, but for the cone's slope */
    shd_vec3 arc;      /* unit: the arc's middle */
    double arc_cosine; /* of the arc's half-angle */
    double slope_radial, slope_axial, reach; /* n.x = radial |x| cos(..) + axial x.y - reach */
} shd_back;

shd_back shd_back_of(const shd_scene *scene, const shd_object *object,
                     const shd_plan_object *bounds);
bool shd_is_behind(const shd_back *back, const shd_plan_light *light);

/* Fills `objects`, `groups`, `lights` and `drops` from `given`, all lights that have a color. */
bool shd_plan_reach(shd_plan *plan, const shd_plan_light *given, size_t count, uint8_t *drops,
                    shd_arena *arena);

struct shd_bundles;

/* Sets the frame, and whether positions are split in it. `bundles` are of the plan's lights, and
 * made if they are needed. False: memory. */
bool shd_plan_frame(shd_plan *plan, struct shd_bundles *bundles, shd_arena *arena);

/* Fills `sheets`. `from` is a plan that has all of its lights, and sheets, or NULL. False: memory.
 */
bool shd_plan_sheets(shd_plan *plan, const shd_plan *from, struct shd_bundles *bundles,
                     shd_arena *arena);

/* How large coordinates are, in the frame's unit, where the object is nearest to the light: on a
 * plane, as far out as the light. */
double shd_plan_size(const shd_plan *plan, const shd_plan_object *object,
                     const shd_plan_light *light);

/* Fills `summary`. False: memory. */
bool shd_plan_summarize(shd_plan *plan, shd_arena *arena);
