/* Analytic shapes as polygons, for the interpolations that need faces. Every shape is made of grids
 * of quadrilaterals, which are plane on these shapes, and triangles at poles and centers. Corners
 * run counterclockwise, seen from outside. */
#include "sight/mesh.h"

#include <assert.h>
#include <string.h>

typedef struct grid {
    shd_shape shape;
    int part; /* of a box, its side; of others, 0: the side, 1: the lower cap, 2: the upper one */
    double tube;
    int rows, columns;
} grid;

typedef struct builder {
    shd_vec3 *positions, *normals;
    uint32_t (*indices)[3], *faces;
    size_t vertices, triangles;
    uint32_t face;
} builder;

/* A point of a unit square that faces +z, turned to each of the six sides of a box. */
static void box_point(const grid *g, double a, double b, shd_vec3 *p, shd_vec3 *n) {
    static const shd_vec3 turn[6][3] = {
        {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}},  {{-1, 0, 0}, {0, 1, 0}, {0, 0, -1}},
        {{0, 0, -1}, {0, 1, 0}, {1, 0, 0}}, {{0, 0, 1}, {0, 1, 0}, {-1, 0, 0}},
        {{1, 0, 0}, {0, 0, -1}, {0, 1, 0}}, {{1, 0, 0}, {0, 0, 1}, {0, -1, 0}}};
    const shd_vec3 *t = turn[g->part]; /* images of x, y, z */
    *n = t[2];
    *p = shd_madd(shd_madd(shd_scale(t[0], b - 0.5), t[1], 0.5 - a), t[2], 0.5);
}

/* The point and outward normal at row a and column b of a grid, both in [0,1]. Rows run down,
 * columns run counterclockwise around +y. */
static void grid_point(const grid *g, double a, double b, shd_vec3 *p, shd_vec3 *n) {
    double angle = 2 * SHD_PI * b;
    shd_vec3 around = {sin(angle), 0, cos(angle)};
    if (g->shape == SHD_BOX) {
        box_point(g, a, b, p, n);
    } else if (g->shape == SHD_SPHERE) {
        *n = shd_scale(around, sin(SHD_PI * a));
        n->y = cos(SHD_PI * a);
        *p = *n;
    } else if (g->shape == SHD_TORUS) {
        /* Rows run from the top around the tube. If the tube meets itself on the axis, rows begin
         * and end there, because the rest lies inside. */
        double inner = g->tube > 1 ? asin(1 / g->tube) : SHD_PI / 2;
        double start = g->tube > 1 ? -inner : 0, turn = start + (SHD_PI + 2 * inner) * a;
        *n = shd_scale(around, sin(turn));
        n->y = cos(turn);
        *p = shd_madd(around, *n, g->tube);
    } else if (g->shape == SHD_DISC || g->part > 0) {
        bool lower = g->part == 1;
        *p = shd_scale(around, lower ? 1 - a : a); /* rows run outward above, inward below */
        p->y = g->shape == SHD_DISC ? 0 : lower ? -0.5 : 0.5;
        *n = (shd_vec3){0, lower ? -1 : 1, 0};
    } else if (g->shape == SHD_CYLINDER) {
        *p = (shd_vec3){around.x, 0.5 - a, around.z};
        *n = around;
    } else {
        *p = (shd_vec3){around.x * a, 0.5 - a, around.z * a};
        *n = (shd_vec3){around.x, 1, around.z};
    }
}

static bool same_place(shd_vec3 p, shd_vec3 q) {
    return fabs(p.x - q.x) + fabs(p.y - q.y) + fabs(p.z - q.z) < 1e-9;
}

static bool add_triangle(builder *b, uint32_t i, uint32_t j, uint32_t k) {
    const shd_vec3 p = b->positions[i], q = b->positions[j], r = b->positions[k];
    if (same_place(p, q) || same_place(q, r) || same_place(r, p)) return false;
    memcpy(b->indices[b->triangles], (uint32_t[]){i, j, k}, sizeof *b->indices);
    b->faces[b->triangles++] = b->face;
    return true;
}

static void add_grid(builder *b, const grid *g) {
    uint32_t first = (uint32_t)b->vertices, stride = (uint32_t)g->columns + 1;
    for (int r = 0; r <= g->rows; r++) {
        for (int c = 0; c <= g->columns; c++) {
            /* The seam's last column repeats the first one's bits. */
            bool seam = c == g->columns && g->shape != SHD_BOX;
            grid_point(g, (double)r / g->rows, seam ? 0 : (double)c / g->columns,
                       &b->positions[b->vertices], &b->normals[b->vertices]);
            b->vertices++;
        }
    }
    for (uint32_t r = 0; r < (uint32_t)g->rows; r++) {
        for (uint32_t c = 0; c < (uint32_t)g->columns; c++) {
            uint32_t i = first + r * stride + c; /* i ... i + 1; below: i + stride ... */
            bool lower = add_triangle(b, i, i + stride, i + stride + 1);
            bool upper = add_triangle(b, i, i + stride + 1, i + 1);
            if (lower || upper) b->face++;
        }
    }
}

bool shd_tessellate(shd_shape shape, double tube, int segments, shd_arena *arena,
                    shd_triangles *out) {
    static const int parts[SHD_SHAPE_COUNT] = {
        [SHD_SPHERE] = 1,   [SHD_DISC] = 1, [SHD_BOX] = 6,
        [SHD_CYLINDER] = 3, [SHD_CONE] = 2, [SHD_TORUS] = 1,
    };
    const int count = parts[shape], columns = shape == SHD_BOX ? 1 : segments;
    int rows = shape == SHD_TORUS ? segments : 1;
    if (shape == SHD_SPHERE) rows = segments < 4 ? 2 : segments / 2;
    if (!count) return false;
    const size_t vertices = (size_t)count * (size_t)(rows + 1) * (size_t)(columns + 1),
                 quads = (size_t)count * (size_t)rows * (size_t)columns;
    builder b = {
        .positions = shd_arena_alloc(arena, vertices, sizeof *b.positions),
        .normals = shd_arena_alloc(arena, vertices, sizeof *b.normals),
        .indices = shd_arena_alloc(arena, 2 * quads, sizeof *b.indices),
        .faces = shd_arena_alloc(arena, 2 * quads, sizeof *b.faces),
    };
    if (!b.positions || !b.normals || !b.indices || !b.faces) return false;
    for (int i = 0; i < count; i++) add_grid(&b, &(grid){shape, i, tube, rows, columns});
    assert(b.vertices == vertices && b.triangles <= 2 * quads);
    *out = (shd_triangles){b.vertices,    b.triangles,  &b.positions->x,
                           &b.normals->x, b.indices[0], b.faces};
    return true;
}
