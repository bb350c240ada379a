/* A mesh's triangles by the cells of a grid that their middles lie in. Inside of plan/. */
#ifndef SHD_PLAN_CELLS_H
#define SHD_PLAN_CELLS_H

#include "base/cancel.h"
#include "scene/scene.h"

enum { SHD_CELL_SIDE = 4, SHD_CELLS = SHD_CELL_SIDE * SHD_CELL_SIDE * SHD_CELL_SIDE };

typedef struct shd_cell {
    shd_vec3 low, high; /* of its triangles, in the mesh's frame */
    shd_vec3 normals;   /* around which their normals are in the world's frame, unit */
    double cosine;      /* with it, at least; -1: any */
    bool sides[2]; /* which of its triangles' sides may be seen: their fronts, their backs. Not of
                      those that are shaded by their own normals */
    bool any;      /* whether it has triangles */
} shd_cell;

/* The cells of a grid of side^3, `side` up to SHD_CELL_SIDE, in the box around an object that is a
 * mesh. Some 30 ns a triangle, which `cancelled` (or NULL) ends anywhere; of a kept mesh that is
 * seen again in the same way, nothing. */
void shd_plan_cells(const shd_scene *scene, const shd_object *object, const shd_affine *to_world,
                    const shd_affine *normal_map, int side, const atomic_bool *cancelled,
                    shd_cell out[SHD_CELLS]);

/* What was found last of a kept mesh, which is all zeros at first; and its size in bytes, 0 where
 * the mesh is so small that it is looked at faster. Any thread. */
size_t shd_mesh_memo_size(const shd_mesh *mesh);

#endif
