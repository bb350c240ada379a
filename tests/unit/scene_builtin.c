/* Built-in meshes: closed, their normals unit and outward, of the size that is promised. */
#include <stdlib.h>
#include <string.h>

#include "scene/builtin.h"
#include "unit/scene_support.h"

/* The ends of an edge, by their coordinates: where patches meet, vertices are told twice. */
typedef struct edge {
    shd_vec3 from, to;
} edge;

static int order_edges(const void *a, const void *b) {
    const double *p = a, *q = b;
    for (int i = 0; i < 6; i++)
        if (p[i] < q[i] || p[i] > q[i]) return p[i] < q[i] ? -1 : 1;
    return 0;
}

/* Each edge is run once each way, so that every sheet is closed and turned alike. */
static void assert_closed(const shd_mesh *mesh) {
    const size_t count = 3 * mesh->triangle_count;
    edge *there = malloc(count * sizeof *there), *back = malloc(count * sizeof *back);
    for (size_t i = 0; i < count; i++) {
        const size_t next = i % 3 == 2 ? i - 2 : i + 1;
        there[i].from = back[i].to = shd_vec3_at(mesh->positions, mesh->indices[i]);
        there[i].to = back[i].from = shd_vec3_at(mesh->positions, mesh->indices[next]);
    }
    qsort(there, count, sizeof *there, order_edges);
    qsort(back, count, sizeof *back, order_edges);
    size_t open = 0, twice = 0;
    for (size_t i = 0; i < count; i++) {
        open += order_edges(&there[i], &back[i]) != 0;
        twice += i > 0 && order_edges(&there[i - 1], &there[i]) == 0;
    }
    free(there);
    free(back);
    assert_int_equal(open, 0);
    assert_int_equal(twice, 0);
}

static double volume_of(const shd_mesh *mesh) {
    double sum = 0;
    for (size_t i = 0; i < mesh->triangle_count; i++) {
        const uint32_t *c = mesh->indices + 3 * i;
        const shd_vec3 p = shd_vec3_at(mesh->positions, c[0]);
        sum += shd_dot(p, shd_cross(shd_vec3_at(mesh->positions, c[1]),
                                    shd_vec3_at(mesh->positions, c[2]))) /
               6;
    }
    return sum;
}

/* Normals are unit, and on the side of each triangle that its corners say. Triangles are as thin
 * as 1e-3 where patches come to a point; cosines there are still above 0. */
static void assert_normals(const shd_mesh *mesh) {
    size_t inward = 0, long_ones = 0;
    for (size_t i = 0; i < mesh->vertex_count; i++)
        long_ones += fabs(shd_length(shd_vec3_at(mesh->normals, i)) - 1) > 1e-14;
    for (size_t i = 0; i < mesh->triangle_count; i++) {
        const uint32_t *c = mesh->indices + 3 * i;
        const shd_vec3 p = shd_vec3_at(mesh->positions, c[0]),
                       n = shd_cross(shd_sub(shd_vec3_at(mesh->positions, c[1]), p),
                                     shd_sub(shd_vec3_at(mesh->positions, c[2]), p));
        for (int k = 0; k < 3; k++) inward += shd_dot(n, shd_vec3_at(mesh->normals, c[k])) <= 0;
    }
    assert_int_equal(long_ones, 0);
    assert_int_equal(inward, 0);
}

static void each_is_closed_and_faces_outward(void **state) {
    (void)state;
    for (int which = 0; which < SHD_BUILTIN_COUNT; which++) {
        shd_arena *arena = shd_arena_new(64 << 20);
        const shd_mesh *mesh = shd_builtin_mesh((shd_builtin)which, arena);
        assert_non_null(mesh);
        assert_closed(mesh);
        assert_true(volume_of(mesh) > 1);
        assert_normals(mesh);
        shd_arena_drop(arena);
    }
}

/* Newell's numbers: 3.15 high, the spout out to 3.4335 and the handle to -3 (of 2 for 1). */
static void the_teapot_has_its_size(void **state) {
    (void)state;
    shd_arena *arena = shd_arena_new(64 << 20);
    const shd_mesh *mesh = shd_builtin_mesh(SHD_TEAPOT, arena);
    assert_float_equal(mesh->low.y, -0.7875, 0);
    assert_float_equal(mesh->high.y, 0.7875, 0);
    assert_float_equal(mesh->low.z, -mesh->high.z, 0);
    assert_float_equal(mesh->high.z, 1, 0.01); /* the arcs are chords of Bezier curves */
    assert_float_equal(mesh->high.x, 1.717, 0.001);
    assert_float_equal(mesh->low.x, -1.5, 0.05);
    shd_arena_drop(arena);
}

/* No picture is mirrored, none leaves [0, 1], and both columns where u begins and ends are there.
 */
static void charts_are_seen_from_outside(void **state) {
    (void)state;
    for (int which = 0; which < SHD_BUILTIN_COUNT; which++) {
        shd_arena *arena = shd_arena_new(64 << 20);
        const shd_mesh *mesh = shd_builtin_mesh((shd_builtin)which, arena);
        size_t mirrored = 0, outside = 0;
        double sum = 0;
        for (size_t i = 0; i < 2 * mesh->vertex_count; i++)
            outside += !(mesh->uvs[i] >= 0 && mesh->uvs[i] <= 1);
        for (size_t i = 0; i < mesh->triangle_count; i++) {
            const uint32_t *c = mesh->indices + 3 * i;
            const double *p = mesh->uvs + 2 * c[0], *q = mesh->uvs + 2 * c[1],
                         *r = mesh->uvs + 2 * c[2];
            const double area = (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]);
            mirrored += !(area > 0);
            sum += area / 2;
        }
        assert_int_equal(outside, 0);
        assert_int_equal(mirrored, 0);
        /* Each of the ball's two profiles covers the chart once, but for half of its rows at poles;
         * the teapot's pot, lid, handle, spout and five sheets do. */
        const double sheets = which == SHD_TEAPOT ? 9 : 2;
        assert_true(sum < sheets && sum > sheets * 0.7);
        shd_arena_drop(arena);
    }
}

/* u is 1/2 at +z, 3/4 at +x, and the pot's bottom is v = 0. */
static void the_pot_is_charted_as_a_sphere(void **state) {
    (void)state;
    shd_arena *arena = shd_arena_new(64 << 20);
    const shd_mesh *mesh = shd_builtin_mesh(SHD_TEAPOT, arena);
    size_t seen = 0;
    for (size_t i = 0; i < 4 * 441 * 3; i++) { /* rim and body */
        const shd_vec3 p = shd_vec3_at(mesh->positions, i);
        const double u = mesh->uvs[2 * i], round = 0.5 + atan2(p.x, p.z) / (2 * SHD_PI);
        /* Bezier curves are arcs to 2 degrees in their parameter; -z is both 0 and 1. */
        const double off = fabs(u - round);
        assert_true(fmin(off, 1 - off) < 0.006);
        seen += mesh->uvs[2 * i + 1] == 1;
        assert_true(mesh->uvs[2 * i + 1] >= 0.25);
    }
    assert_int_equal(seen, 4 * 21);
    shd_arena_drop(arena);
}

static void no_memory_is_no_mesh(void **state) {
    (void)state;
    shd_arena *arena = shd_arena_new(1 << 16);
    assert_null(shd_builtin_mesh(SHD_TEAPOT, arena));
    assert_null(shd_builtin_mesh(SHD_BALL, arena));
    shd_arena_drop(arena);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(each_is_closed_and_faces_outward),
        cmocka_unit_test(the_teapot_has_its_size),
        cmocka_unit_test(charts_are_seen_from_outside),
        cmocka_unit_test(the_pot_is_charted_as_a_sphere),
        cmocka_unit_test(no_memory_is_no_mesh),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
