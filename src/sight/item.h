/* What a sight is made of. Inside of sight/. */
#ifndef SHD_SIGHT_ITEM_H
#define SHD_SIGHT_ITEM_H

#include "sight/camera.h"
#include "sight/mesh.h"
#include "sight/sight.h"

/* An object as rays meet it. */
typedef struct shd_item {
    shd_shape shape; /* SHD_MESH for tessellated shapes too */
    double tube;
    bool front_only;
    shd_affine to_world, from_world; /* of the unit form; from_world.origin is not used: points
                                        are taken relative to to_world.origin first */
    shd_affine normal_map;
    bool bounded;
    shd_vec3 center;
    double radius;
    shd_triangles triangles; /* SHD_MESH */
    shd_mesh_tree *tree;
    bool smooth; /* interpolate the mesh's normals at each sample */
    const shd_facets *facets;
} shd_item;

struct shd_sight {
    const shd_plan *plan;
    shd_lens lens;
    shd_item *items; /* as shd_scene.objects */
    size_t count;
    double offset_x[64], offset_y[64]; /* the sample pattern */
};

/* The point and normal, in the mesh's frame, of a triangle at its barycentrics. */
void shd_item_place(const shd_item *it, uint32_t triangle, double u, double v, shd_vec3 *point,
                    shd_vec3 *normal);

#endif
