/* Meshes that are built in: what an object of type `teapot` or `ball` is. They are made when a
 * scene asks for one. Inside of scene/, and for the request that keeps them. */
#pragma once

#include "scene/scene.h"

/* Makes the mesh in an arena, with unit normals and the chart that docs/textures.md tells, closed,
 * its corners counterclockwise from outside. NULL: the arena is full. Any thread. */
const shd_mesh *shd_builtin_mesh(shd_builtin which, shd_arena *arena);

/* ---- For those that make them ---- */

/* Vertices and triangles, with room for those that were asked for. */
typedef struct shd_pieces {
    shd_vec3 *positions, *normals;
    double (*uvs)[2];
    uint32_t (*indices)[3];
    size_t vertex_count, triangle_count;
} shd_pieces;

bool shd_pieces_new(size_t vertices, size_t triangles, shd_arena *arena, shd_pieces *out);

/* Returns the index of the new vertex. */
uint32_t shd_pieces_add(shd_pieces *pieces, shd_vec3 position, shd_vec3 normal, double u, double v);

/* Adds the triangles of a quadrilateral, whose corners are the first row's two and then, in the
 * same direction, the second row's; seen from outside, rows run down if columns run to the right.
 * Triangles with two corners at one place are left out. */
void shd_pieces_quad(shd_pieces *pieces, const uint32_t first[2], const uint32_t second[2]);

/* Newell's teapot: 32 bicubic patches. The body's radius is 1, its axis y. */
bool shd_make_teapot(shd_arena *arena, shd_pieces *out);

/* A ball of radius 1 around the origin, with a groove, on a stand. */
bool shd_make_ball(shd_arena *arena, shd_pieces *out);
