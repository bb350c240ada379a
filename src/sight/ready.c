#include "sight/ready.h"

#include <string.h>

#include "base/cancel.h"
#include "plan/cells.h"
#include "sight/mesh.h"
#include "sight/tree.h"

enum { ALIGNMENT = 64 };

shd_status shd_ready_mesh_make(const shd_mesh *mesh, const shd_digest *digest,
                               const atomic_bool *cancelled, shd_arena *arena, shd_ready_mesh *out,
                               shd_error *error) {
    const shd_triangles triangles = shd_triangles_of(mesh);
    shd_ready_mesh ready = {.mesh = mesh, .kept = {.digest = *digest}};
    shd_status status = shd_mesh_tree_new(&triangles, cancelled, arena, &ready.kept.tree, error);
    if (status == SHD_OK && mesh->normals &&
        !shd_triangle_units(&triangles, cancelled, arena, &ready.kept.units))
        status = shd_fail(error, SHD_MEMORY, "", "the limit `memory` is reached by the mesh");
    if (status == SHD_OK && shd_is_cancelled(cancelled))
        status = shd_fail(error, SHD_CANCELLED, "", "the mesh was cancelled");
    if (status == SHD_OK) *out = ready;
    return status;
}

/* A block in which things are put one behind the other. */
typedef struct pile {
    unsigned char *block; /* NULL: it is only measured */
    size_t used;
} pile;

/* Puts a copy, or zeros if `from` is NULL. Returns its place: NULL if there is nothing. */
static void *put_in_pile(pile *p, const void *from, size_t count, size_t size) {
    const size_t at = p->used, bytes = count * size;
    p->used += (bytes + ALIGNMENT - 1) / ALIGNMENT * ALIGNMENT;
    if (!p->block || !bytes) return NULL;
    return from ? memcpy(p->block + at, from, bytes) : memset(p->block + at, 0, bytes);
}

size_t shd_ready_mesh_copy(const shd_ready_mesh *ready, void *block) {
    pile p = {block, 0};
    shd_mesh mesh = *ready->mesh, *mesh_at = put_in_pile(&p, &mesh, 1, sizeof mesh);
    shd_mesh_kept kept = ready->kept, *kept_at = put_in_pile(&p, &kept, 1, sizeof kept);
    shd_mesh_tree tree = *kept.tree, *tree_at = put_in_pile(&p, &tree, 1, sizeof tree);
    const size_t normals = mesh.normals ? mesh.vertex_count : 0;
    mesh.positions = put_in_pile(&p, mesh.positions, mesh.vertex_count, 3 * sizeof *mesh.positions);
    mesh.normals = put_in_pile(&p, mesh.normals, normals, 3 * sizeof *mesh.normals);
    mesh.uvs = put_in_pile(&p, mesh.uvs, mesh.uvs ? mesh.vertex_count : 0, 2 * sizeof *mesh.uvs);
    mesh.indices = put_in_pile(&p, mesh.indices, mesh.triangle_count, 3 * sizeof *mesh.indices);
    kept.units = put_in_pile(&p, kept.units, normals, 3 * sizeof *kept.units);
    tree.branches = put_in_pile(&p, tree.branches, tree.branch_count, sizeof *tree.branches);
    kept.memo = put_in_pile(&p, NULL, shd_mesh_memo_size(&mesh), 1);
    tree.turns = put_in_pile(&p, tree.turns, tree.turn_count, sizeof *tree.turns);
    tree.leaves = put_in_pile(&p, tree.leaves, tree.leaf_count, sizeof *tree.leaves);
    if (!block) return p.used;
    mesh.kept = kept_at;
    kept.tree = tree_at;
    *tree_at = tree;
    *kept_at = kept;
    *mesh_at = mesh;
    return p.used;
}
