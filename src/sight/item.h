/* What a sight is made of. Inside of sight/. */
#ifndef SHD_SIGHT_ITEM_H
#define SHD_SIGHT_ITEM_H

#include "sight/camera.h"
#include "sight/mesh.h"
#include "sight/shapes.h"
#include "sight/sight.h"

/* An object as rays meet it. */
typedef struct shd_item {
    shd_shape shape; /* SHD_MESH for tessellated shapes too */
    double tube;
    bool front_only;
    bool similar; /* its unit form is turned or mirrored, scaled alike in all directions, and moved
                   */
    bool ball;    /* a similar sphere; its maps do not turn, for a ball cannot tell */
    double size;  /* that scale, where similar */
    shd_affine to_world, from_world; /* of the unit form; from_world.origin is not used: points
                                        are taken relative to to_world.origin first */
    shd_affine to_frame;             /* of the unit form to the plan's frame */
    shd_affine normal_map;
    shd_vec3 eye;     /* the camera's position in the unit form's frame */
    shd_vec3 forward; /* the rays' direction there; orthographic */
    double nearest;   /* no ray meets it at a smaller t */
    double blind;     /* nor does it count up to this one; 0 for planes, which are met exactly */
    bool far;         /* the eye is so far away that f64 wants the origin moved twice (balls) */
    shd_triangles triangles; /* SHD_MESH */
    shd_mesh_view view;
    bool smooth;         /* interpolate the mesh's normals at each sample: */
    const double *units; /* [vertex_count][3], these, unit */
    const shd_facets *facets;
} shd_item;

/* Where in the picture an object may be seen. In the camera's frame (x right, y up, z forward),
 * on the image plane's coordinates: at z = 1 (perspective), or lengths (orthographic). */
typedef enum shd_outline_kind {
    SHD_OUTLINE_NONE,  /* nowhere */
    SHD_OUTLINE_ALL,   /* anywhere */
    SHD_OUTLINE_CONE,  /* within the cone around a sphere */
    SHD_OUTLINE_ROUND, /* within a circle; orthographic */
    SHD_OUTLINE_HALF   /* where a p + b q + c < 0 */
} shd_outline_kind;

typedef struct shd_outline {
    shd_outline_kind kind;
    shd_vec3 center; /* of the sphere, from the camera; or a, b, c */
    double radius;
    double tangent; /* the length of tangents to the sphere; cone */
    double margin;  /* for rounding */
} shd_outline;

/* Nothing of an object is seen outside of these, in pixels: arrays, for loops that vectorize. */
typedef struct shd_frames {
    float *left, *right, *top, *bottom;
} shd_frames;

struct shd_sight {
    const shd_plan *plan;
    const atomic_bool *cancelled;
    shd_lens lens;
    shd_item *items; /* as shd_scene.objects */
    size_t count;
    uint32_t *order;                   /* [count]: nearer ones first, as far as can be told */
    shd_outline *outlines;             /* [count]: in that order, */
    shd_frames frames;                 /* as these are */
    double offset_x[64], offset_y[64]; /* the sample pattern */
};

/* Fills order and outlines, and what items need of their distance. False: the arena is full. */
bool shd_sight_outline(shd_sight *sight, shd_arena *arena);

#endif
