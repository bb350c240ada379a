#include "scene/builtin.h"

bool shd_pieces_new(size_t vertices, size_t triangles, shd_arena *arena, shd_pieces *out) {
    *out = (shd_pieces){
        .positions = shd_arena_alloc(arena, vertices, sizeof *out->positions),
        .normals = shd_arena_alloc(arena, vertices, sizeof *out->normals),
        .uvs = shd_arena_alloc(arena, vertices, sizeof *out->uvs),
        .indices = shd_arena_alloc(arena, triangles, sizeof *out->indices),
    };
    return out->positions && out->normals && out->uvs && out->indices;
}

uint32_t shd_pieces_add(shd_pieces *pieces, shd_vec3 position, shd_vec3 normal, double u,
                        double v) {
    pieces->uvs[pieces->vertex_count][0] = u;
    pieces->uvs[pieces->vertex_count][1] = v;
    pieces->positions[pieces->vertex_count] = position;
    pieces->normals[pieces->vertex_count] = (shd_vec3){0, 1, 0};
    shd_normalize(normal, &pieces->normals[pieces->vertex_count]);
    return (uint32_t)pieces->vertex_count++;
}

static bool same_place(const shd_pieces *pieces, uint32_t i, uint32_t j) {
    const shd_vec3 p = pieces->positions[i], q = pieces->positions[j];
    return !(p.x < q.x || p.x > q.x || p.y < q.y || p.y > q.y || p.z < q.z || p.z > q.z);
}

static void add_corners(shd_pieces *pieces, uint32_t i, uint32_t j, uint32_t k) {
    if (same_place(pieces, i, j) || same_place(pieces, j, k) || same_place(pieces, k, i)) return;
    uint32_t *corner = pieces->indices[pieces->triangle_count++];
    corner[0] = i;
    corner[1] = j;
    corner[2] = k;
}

void shd_pieces_quad(shd_pieces *pieces, const uint32_t first[2], const uint32_t second[2]) {
    add_corners(pieces, first[0], second[0], second[1]);
    add_corners(pieces, first[0], second[1], first[1]);
}
