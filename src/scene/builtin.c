#include "scene/builtin.h"

const shd_mesh *shd_builtin_mesh(shd_builtin which, shd_arena *arena) {
    shd_pieces p;
    shd_mesh *mesh = shd_arena_alloc(arena, 1, sizeof *mesh);
    if (!mesh || !(which == SHD_TEAPOT ? shd_make_teapot : shd_make_ball)(arena, &p)) return NULL;
    shd_vec3 low = p.positions[0], high = low;
    for (size_t i = 1; i < p.vertex_count; i++) {
        low = shd_vec3_min(p.positions[i], low);
        high = shd_vec3_max(p.positions[i], high);
    }
    *mesh = (shd_mesh){.vertex_count = p.vertex_count,
                       .triangle_count = p.triangle_count,
                       .positions = &p.positions[0].x,
                       .normals = &p.normals[0].x,
                       .indices = p.indices[0],
                       .uvs = p.uvs[0],
                       .low = low,
                       .high = high,
                       .type = shd_shape_names[SHD_SHAPE_COUNT + which]};
    return mesh;
}
