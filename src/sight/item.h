/* What a sight is made of. Inside of sight/.
 *
 * Rays meet an analytic shape in its unit form: a sphere, disc, cylinder (height 1, centered) or
 * cone (base at y = -1/2, apex at y = 1/2) of radius 1, a box with sides of 1, a torus with a ring
 * of radius 1 and a tube of the ratio of its radii. shd_object_frame maps it to the world. */
#pragma once

#include <assert.h>

#include "plan/nodes.h"
#include "sight/mesh.h"
#include "sight/sight.h"

/* The picture as its rays see it. The camera's vectors are unit and at right angles, so that
 * nothing can overflow. Rays begin at the picture's center, so that mirrored pixels get mirrored
 * rays. */
typedef struct shd_lens {
    const shd_camera *camera;
    double width, height;      /* of the picture, in pixels */
    double half_x, half_y;     /* of the image plane: at distance 1, or of the view volume */
    double middle_x, middle_y; /* half of the picture, in pixels */
    double step_x, step_y;     /* of the image plane, from pixel to pixel */
} shd_lens;

/* The unit vector from p toward the viewer. */
static inline shd_vec3 shd_lens_view(const shd_lens *lens, shd_vec3 p) {
    shd_vec3 view = lens->camera->back;
    if (lens->camera->projection == SHD_PERSPECTIVE)
        shd_normalize(shd_sub(lens->camera->position, p), &view);
    return view;
}

/* No object is seen closer to the eye than this part of its size: by rounding, each ray would tell
 * for itself whether an eye on the surface has that before or behind itself. */
#define SHD_BLIND 1e-12

/* A rectangle in pixels, with more room than rounding takes. */
typedef struct shd_frame {
    float left, right, top, bottom;
} shd_frame;

/* A sphere that stays one, in units of its radius: all that tiers in f32 meet and show it by. */
typedef struct shd_seen_ball {
    shd_vec3 eye;    /* the camera's position from its center */
    shd_vec3 center; /* in the plan's frame */
    double size;     /* the radius */
    float turned;    /* -1: normals that face away are negated; else 1 */
    bool far;        /* the eye is so far away that rays have to be moved twice */
} shd_seen_ball;

/* An object as rays meet it. */
typedef struct shd_item {
    shd_shape shape; /* SHD_MESH for tessellated shapes too */
    bool front_only;
    bool similar; /* the map from the unit form turns, mirrors and moves, and scales all alike */
    bool smooth;  /* the mesh's normals are interpolated at each sample */
    const shd_seen_ball
        *ball;           /* of a similar sphere, whose maps do not turn, for that shows nothing */
    double size;         /* that scale, if it is similar */
    double blind;        /* hits up to this t do not count; 0 for planes, which are met exactly */
    shd_vec3 eye;        /* the camera's position in the unit form's frame */
    shd_affine to_frame; /* to the plan's frame */
    double tube;         /* the ratio of a torus's radii */
    /* Maps of the unit form. The origin of from_world is not used, because points are taken
     * relative to to_world.origin first. */
    shd_affine to_world, from_world;
    shd_affine normal_map;
    double widest,
        longest;      /* how much from_world and to_world lengthen: of ellipsoids, for drafts */
    shd_vec3 forward; /* the rays' direction there, in an orthographic camera */
    const shd_facets *facets; /* NULL: it has none */
    /* Of SHD_MESH: */
    shd_triangles triangles;
    shd_mesh_view view;
    const double *units; /* [vertex_count][3]: these normals, unit */
} shd_item;

/* Where in the picture an object may be seen, in the camera's frame (x right, y up, z forward), by
 * points (p, q) of the image plane: at z = 1 in perspective, else lengths. */
typedef enum shd_outline_kind {
    SHD_OUTLINE_NONE,  /* nowhere */
    SHD_OUTLINE_ALL,   /* anywhere */
    SHD_OUTLINE_CONE,  /* in the cone around a sphere */
    SHD_OUTLINE_ROUND, /* in a circle, in an orthographic camera */
    SHD_OUTLINE_HALF   /* on one side of a line: a p + b q + c < 0 */
} shd_outline_kind;

typedef struct shd_outline {
    shd_vec3 center; /* the sphere's, from the camera; or a, b, c */
    double radius;   /* the sphere's; or what rounding may add */
    double tangent;  /* of a cone: the length of tangents to the sphere */
} shd_outline;

/* The part of a pixel by which outlines, and rectangles that they are held against, are widened on
 * all sides. */
#define SHD_WIDER 1e-2

/* Rectangles in pixels: no object is seen outside of its own. Arrays, for loops that vectorize. */
typedef struct shd_frames {
    float *left, *right, *top, *bottom;
} shd_frames;

/* What is asked of each object that may be in the way, and all that is kept of a ball: two cache
 * lines, where an item has a dozen. */
typedef struct shd_seen_object {
    _Alignas(64) shd_frame frame; /* no ray meets it that passes beside this */
    float nearest;                /* no ray meets it at a smaller depth, along the camera's axis */
    uint8_t kind;                 /* of its outline */
    bool tube;                    /* it is a torus, of which more can be told */
    bool is_ball;
    shd_outline outline;
    shd_seen_ball ball; /* if it is one */
} shd_seen_object;

static_assert(sizeof(shd_seen_object) == 128, "all of it is fetched at once");

/* Asks for what is seen of an object ahead of its use: of many objects, few are in caches. */
static inline void shd_fetch_seen(const shd_seen_object *g) {
    __builtin_prefetch(&g->frame);
    __builtin_prefetch(&g->ball);
}

/* What is sorted instead of seen objects, which are large. */
typedef struct shd_distance {
    float nearest; /* not -0 */
    uint32_t object;
} shd_distance;

enum { SHD_CELL = 32 };

struct shd_sight {
    const shd_plan *plan;
    const atomic_bool *cancelled;
    shd_lens lens;
    shd_seen_object *seen; /* as shd_scene.objects */
    /* The same; NULL: a ball, whose item is made when it is asked for. Of many balls, they would
     * fill more memory than caches have. */
    const shd_item **items;
    size_t count;
    bool has_built;          /* a tree */
    bool has_balls;          /* some item is one */
    size_t seen_vertices;    /* of all views that are whole */
    uint32_t *order;         /* [count]: roughly nearer ones first */
    shd_distance *distances; /* [2][count]: what they are sorted by */
    shd_frames frames;       /* [count]: in that order; not set if there are cells */
    /* Cells of the picture, SHD_CELL pixels wide and high, or as wide as the picture: the objects
     * that reach into cell c, row by row, are celled[cells[c]] up to celled[cells[c + 1]], in that
     * order. NULL: there are few objects, or they are large. */
    const uint32_t *cells;
    uint32_t *celled;
    int cells_across, cells_down;
    /* The sample pattern, shd_center_sample and those of shd_rule_sample. */
    double offset_x[65 + SHD_NODES_OWN], offset_y[65 + SHD_NODES_OWN];
};

/* An object's item: that of a ball is made in `room`, of which rays ask for `ball` and the maps. */
const shd_item *shd_item_of(const shd_sight *sight, size_t object, shd_item *room);

/* The size of each component. */
static inline shd_vec3 shd_sizes(shd_vec3 v) {
    return (shd_vec3){fabs(v.x), fabs(v.y), fabs(v.z)};
}

/* Makes the view of an item whose triangles, frame and eye are set, with all its vertices if it is
 * to be whole. False: the arena is full. */
bool shd_mesh_view_make(shd_item *it, const shd_mesh_tree *tree, const shd_lens *lens,
                        bool is_whole, const atomic_bool *cancelled, shd_arena *arena);

/* Objects to cast at. There may be others, but no ray meets these at a smaller depth than `beyond`.
 */
typedef struct shd_targets {
    const uint32_t *objects;
    size_t count;
    double beyond; /* infinity: there are none */
    bool surveyed; /* these are all that their frames tell, and `nearest` ascends */
} shd_targets;

/* The variants of shd_sight_shoot: cast from shot `first` on. Returns the shot before which the
 * others would have had to be known, or how many shots there are. */
typedef size_t shd_shoot_function(const shd_sight *sight, const shd_targets *targets,
                                  const shd_shots *shots, size_t first, shd_hits *out);
shd_shoot_function shd_shoot_portable, shd_shoot_avx2, shd_shoot_avx512;

/* Fills an object's distance, and all of its `seen` but a ball. */
void shd_sight_outline(shd_sight *sight, size_t object);

/* Fills order, and frames or cells, of all distances. False: the arena is full. */
bool shd_sight_order(shd_sight *sight, shd_arena *arena);
