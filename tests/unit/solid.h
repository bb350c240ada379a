/* Triangles that tests put together. */
#ifndef SHD_TEST_SOLID_H
#define SHD_TEST_SOLID_H

#include "property/pieces.h"

typedef struct solid {
    size_t vertices, triangles;
    double (*positions)[3];
    uint32_t (*indices)[3];
} solid;

static inline solid new_solid(size_t vertices, size_t triangles) {
    solid s = {0, 0, calloc(vertices, sizeof *s.positions), calloc(triangles, sizeof *s.indices)};
    assert_true(s.positions && s.indices);
    return s;
}

static inline void drop_solid(solid *s) {
    free(s->positions);
    free(s->indices);
}

static inline uint32_t add_vertex(solid *s, double x, double y, double z) {
    double *to = s->positions[s->vertices];
    to[0] = x, to[1] = y, to[2] = z;
    return (uint32_t)s->vertices++;
}

static inline void add_triangle(solid *s, uint32_t a, uint32_t b, uint32_t c) {
    uint32_t *to = s->indices[s->triangles++];
    to[0] = a, to[1] = b, to[2] = c;
}

/* A square in the plane y = height, as two triangles. */
static inline void add_square(solid *s, double half, double height) {
    const uint32_t a = add_vertex(s, -half, height, -half), b = add_vertex(s, half, height, -half),
                   c = add_vertex(s, half, height, half), d = add_vertex(s, -half, height, half);
    add_triangle(s, a, c, b);
    add_triangle(s, a, d, c);
}

/* Needles that lie along `bunches` directions. */
static inline solid new_needles(uint64_t *random, int bunches, double width) {
    solid s = new_solid(3 * 400, 400);
    for (int i = 0; i < 400; i++) {
        uint64_t bunch = 77 + (uint64_t)(i % bunches);
        const shd_vec3 along = random_direction(&bunch), side = random_direction(random),
                       middle = random_direction(random);
        for (int k = 0; k < 3; k++) {
            const shd_vec3 at = shd_madd(shd_madd(middle, along, k == 2 ? -2.0 : 2.0 + 0.1 * k),
                                         side, k == 1 ? width : 0);
            add_vertex(&s, at.x, at.y, at.z);
        }
        add_triangle(&s, 3 * (uint32_t)i, 3 * (uint32_t)i + 1, 3 * (uint32_t)i + 2);
    }
    return s;
}

static inline void add_ball(solid *s, int slices, int stacks, double radius) {
    const uint32_t first = (uint32_t)s->vertices, row = (uint32_t)slices;
    for (int k = 0; k <= stacks; k++)
        for (int i = 0; i < slices; i++) {
            const double theta = SHD_PI * k / stacks, phi = 2 * SHD_PI * i / slices;
            const double ring = k == 0 || k == stacks ? 0 : radius * sin(theta);
            add_vertex(s, ring * cos(phi), radius * cos(theta), ring * sin(phi));
        }
    for (uint32_t k = 0; k < (uint32_t)stacks; k++)
        for (uint32_t i = 0; i < row; i++) {
            const uint32_t a = first + k * row + i, b = first + k * row + (i + 1) % row;
            if (k > 0) add_triangle(s, a, b, b + row);
            if (k + 1 < (uint32_t)stacks) add_triangle(s, a, b + row, a + row);
        }
}

/* The mesh as flat, so that hits name their triangle. */
#endif
