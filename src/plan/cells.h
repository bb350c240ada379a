/* A mesh's triangles by the cells of a grid that their middles lie in. Inside of plan/. */
#pragma once

#include "base/cancel.h"
#include "scene/scene.h"

enum { SHD_CELL_SIDE = 4, SHD_CELLS = SHD_CELL_SIDE * SHD_CELL_SIDE * SHD_CELL_SIDE };

typedef struct shd_cell {
    shd_vec3 low, high; /* of its triangles, in the mesh's frame */
    shd_vec3 normals;   /* unit, world frame: the triangles' normals are around it */
    double cosine;      /* the least of any normal with it; -1: any */
    /* Whether fronts, and backs, of its triangles may be seen. It is not set if triangles are
     * shaded by their own normals. */
    bool sides[2];
    bool any; /* it has triangles */
} shd_cell;

/* Finds the cells of a grid of side^3, `side` up to SHD_CELL_SIDE, in the box around an object that
 * is a mesh. It takes some 30 ns a triangle, which `cancelled` (or NULL) ends anywhere, and nothing
 * for a kept mesh that is seen again in the same way. In scenes that have kept meshes many times it
 * takes nothing either way: cells are then looked at from nowhere and turned, so that both sides
 * may be seen, and, where a map does not keep angles, any normal. */
void shd_plan_cells(const shd_scene *scene, const shd_object *object, const shd_affine *to_world,
                    const shd_affine *normal_map, int side, const atomic_bool *cancelled,
                    shd_cell out[SHD_CELLS]);

/* The size in bytes of the memo of what was found last of a kept mesh, which is all zeros at first.
 * 0: the mesh is so small that it is looked at faster. Any thread. */
size_t shd_mesh_memo_size(const shd_mesh *mesh);
