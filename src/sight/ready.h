/* A mesh with all that rays need of it wherever the camera is, for meshes that are kept for many
 * scenes. */
#pragma once

#include <stdatomic.h>

#include "base/arena.h"
#include "scene/scene.h"

/* Made in an arena. */
typedef struct shd_ready_mesh {
    const shd_mesh *mesh;
    shd_mesh_kept kept;
} shd_ready_mesh;

/* Builds the tree, as shd_sight_new would. SHD_MEMORY or SHD_CANCELLED. */
shd_status shd_ready_mesh_make(const shd_mesh *mesh, const shd_digest *digest,
                               const atomic_bool *cancelled, shd_arena *arena, shd_ready_mesh *out,
                               shd_error *error);

/* Copies all of it to one block, aligned to 64 bytes, which begins with the mesh. NULL: only
 * counts. Returns how many bytes it takes. */
size_t shd_ready_mesh_copy(const shd_ready_mesh *ready, void *block);
