/* Meshes through Embree, placed in f64: against every triangle tried in f64. And the pattern of
 * samples. */
#include <math.h>
#include <pthread.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <unistd.h>

#include <cmocka.h>

#include "sight/mesh.h"

static double uniform(double low, double high) {
    return low + (high - low) * (rand() / (RAND_MAX + 1.0));
}

typedef struct fixture {
    shd_arena *arena;
    shd_tracer *tracer;
    shd_triangles triangles;
    shd_mesh_tree *tree;
} fixture;

/* A tessellated torus, scaled and moved. */
static fixture make_torus(double scale, double offset) {
    fixture f = {shd_arena_new(1 << 24), shd_tracer_new(), {0}, NULL};
    assert_true(shd_tessellate(SHD_TORUS, 0.4, 24, f.arena, &f.triangles));
    double *positions = (double *)f.triangles.positions;
    for (size_t i = 0; i < 3 * f.triangles.vertex_count; i++)
        positions[i] = positions[i] * scale + offset;
    shd_error error;
    assert_int_equal(shd_mesh_tree_new(&f.triangles, f.tracer, NULL, f.arena, &f.tree, &error),
                     SHD_OK);
    return f;
}

static void drop(fixture *f) {
    shd_mesh_tree_drop(f->tree);
    shd_tracer_drop(f->tracer);
    shd_arena_drop(f->arena);
}

/* The nearest t over all triangles, in f64; `margin` is how far inside of its triangle the hit
 * is, in barycentric weights. */
static double brute_force(const shd_triangles *t, const shd_ray *ray, double *margin) {
    double nearest = INFINITY;
    *margin = 1;
    for (size_t i = 0; i < t->triangle_count; i++) {
        shd_vec3 a = shd_triangle_corner(t, i, 0);
        shd_vec3 ab = shd_sub(shd_triangle_corner(t, i, 1), a);
        shd_vec3 ac = shd_sub(shd_triangle_corner(t, i, 2), a);
        shd_vec3 n = shd_cross(ab, ac);
        double along = shd_dot(ray->direction, n);
        if (along == 0) continue;
        double distance = shd_dot(shd_sub(a, ray->origin), n) / along;
        shd_vec3 p = shd_sub(shd_madd(ray->origin, ray->direction, distance), a);
        double u = shd_dot(shd_cross(p, ac), n) / shd_dot(n, n);
        double v = shd_dot(shd_cross(ab, p), n) / shd_dot(n, n);
        double least = fmin(fmin(u, v), 1 - u - v);
        if (fabs(least) < *margin && distance > 0) *margin = fabs(least);
        if (least >= 0 && distance > 0 && distance < nearest) nearest = distance;
    }
    return nearest;
}

static void hits_are_those_of_every_triangle_tried_in_f64(void **state) {
    (void)state;
    srand(1);
    static const double scales[] = {1, 1e-23, 1e20}, offsets[] = {0, 0.5, 1e3};
    for (size_t k = 0; k < 9; k++) {
        double scale = scales[k % 3], offset = offsets[k / 3] * scale;
        fixture f = make_torus(scale, offset);
        int compared = 0;
        for (int i = 0; i < 300; i++) {
            shd_vec3 center = {offset, offset, offset}, direction;
            shd_vec3 from = {uniform(-9, 9), uniform(2, 9), uniform(-9, 9)};
            shd_vec3 at = {uniform(-1.2, 1.2), uniform(-.3, .3), uniform(-1.2, 1.2)};
            if (!shd_normalize(shd_sub(at, from), &direction)) continue;
            shd_ray ray = {shd_madd(center, from, scale), shd_scale(direction, 3), 0};
            double margin, wanted = brute_force(&f.triangles, &ray, &margin), t, u, v;
            uint32_t triangle;
            bool hit = shd_mesh_tree_intersect(f.tree, &ray, &t, &triangle, &u, &v);
            if (margin < 1e-5) continue; /* near an edge f32 may take the neighbour */
            compared++;
            assert_true(hit == (wanted < INFINITY));
            if (!hit) continue;
            assert_true(fabs(t - wanted) <= 1e-9 * fabs(wanted));
            assert_true(u >= 0 && v >= 0 && u + v <= 1 + 1e-12); /* not near an edge */
            shd_vec3 a = shd_triangle_corner(&f.triangles, triangle, 0);
            shd_vec3 p =
                shd_madd(shd_madd(a, shd_sub(shd_triangle_corner(&f.triangles, triangle, 1), a), u),
                         shd_sub(shd_triangle_corner(&f.triangles, triangle, 2), a), v);
            shd_vec3 there = shd_madd(ray.origin, ray.direction, t);
            assert_true(shd_length(shd_sub(p, there)) < 1e-11 * (scale + offset));
        }
        assert_true(compared > 250);
        drop(&f);
    }
}

/* From 1e6 away: in plain f32 the ray's origin alone is off by 0.03. */
static void far_meshes_keep_their_precision(void **state) {
    (void)state;
    srand(2);
    fixture f = make_torus(1, 0);
    int hits = 0;
    for (int i = 0; i < 500; i++) {
        shd_vec3 from = {3e5, 9e5, 2e5}, direction;
        double angle = uniform(0, 2 * SHD_PI), ring = 1 + uniform(-0.3, 0.3);
        shd_vec3 at = {ring * cos(angle), 0, ring * sin(angle)};
        assert_true(shd_normalize(shd_sub(at, from), &direction));
        shd_ray ray = {from, direction, 0};
        double t, u, v;
        uint32_t triangle;
        if (!shd_mesh_tree_intersect(f.tree, &ray, &t, &triangle, &u, &v)) continue;
        hits++;
        shd_vec3 there = shd_madd(ray.origin, ray.direction, t);
        double off = sqrt(there.x * there.x + there.z * there.z) - 1;
        /* near the true tube: chords of 24 slices are off by 1.4 (1 - cos(pi/24)) at most */
        double tube = sqrt(off * off + there.y * there.y);
        assert_true(fabs(tube - 0.4) < 0.016);
    }
    assert_int_equal(hits, 500);
    drop(&f);
}

/* Two triangles of a large square, and rays that meet their common edge as closely as f32 cannot
 * tell: wherever Embree puts them, the point is where the ray meets the plane. */
static void hits_at_a_shared_edge_stay_where_the_ray_meets_the_plane(void **state) {
    (void)state;
    srand(3);
    const double g = 1e5;
    const double positions[] = {-g, 0, -g, g, 0, -g, g, 0, g, -g, 0, g};
    const uint32_t indices[] = {0, 2, 1, 0, 3, 2};
    fixture f = {
        shd_arena_new(1 << 20), shd_tracer_new(), {4, 2, positions, NULL, indices, NULL}, NULL};
    shd_error error;
    assert_int_equal(shd_mesh_tree_new(&f.triangles, f.tracer, NULL, f.arena, &f.tree, &error),
                     SHD_OK);
    for (int i = 0; i < 2000; i++) {
        double along = uniform(-10, 10), off = uniform(-1e-3, 1e-3);
        shd_vec3 at = {along + off, 0, along - off}, from = {3, 2, 5}, direction;
        assert_true(shd_normalize(shd_sub(at, from), &direction));
        shd_ray ray = {from, direction, 0};
        double t, u, v;
        uint32_t triangle;
        assert_true(shd_mesh_tree_intersect(f.tree, &ray, &t, &triangle, &u, &v));
        shd_vec3 p = shd_scale(shd_triangle_corner(&f.triangles, triangle, 0), 1 - u - v);
        p = shd_madd(p, shd_triangle_corner(&f.triangles, triangle, 1), u);
        p = shd_madd(p, shd_triangle_corner(&f.triangles, triangle, 2), v);
        assert_true(shd_length(shd_sub(p, at)) < 1e-14 * g * 100); /* f64 at the corners' size */
    }
    drop(&f);
}

/* Embree aborts on rays that are no numbers. */
static void rays_whose_arithmetic_overflows_miss(void **state) {
    (void)state;
    fixture f = make_torus(1, 0);
    const double far[] = {1e150, 1e200, 1e308, 1.7976931348623143e308, INFINITY, NAN};
    for (size_t i = 0; i < sizeof far / sizeof far[0]; i++) {
        for (int c = 0; c < 3; c++) {
            double from[3] = {0.5, 0.3, 0.7}, along[3] = {0};
            from[c] = far[i];
            along[c] = -1;
            const shd_ray rays[] = {
                {{from[0], from[1], from[2]}, {along[0], along[1], along[2]}, 0},
                {{from[0], from[1], from[2]}, {-0.6, -0.8, 1e-9}, 0},
                {{1, 2, 3}, {from[0], from[1], from[2]}, 0},
                {{1, 2, 3}, {along[0], along[1], along[2]}, far[i]}};
            for (size_t k = 0; k < 4; k++) {
                double t = 0, u = 0, v = 0;
                uint32_t triangle;
                if (shd_mesh_tree_intersect(f.tree, &rays[k], &t, &triangle, &u, &v))
                    assert_true(isfinite(t) && isfinite(u) && isfinite(v));
            }
        }
    }
    drop(&f);
}

static void meshes_smaller_than_normal_numbers_are_taken(void **state) {
    (void)state;
    for (double size = 1e-300; size > 0; size /= 1e6) {
        fixture f = make_torus(size, 0);
        shd_ray ray = {{0, 9, 1}, {0, -1, 0}, 0};
        double t, u, v;
        uint32_t triangle;
        assert_false(shd_mesh_tree_intersect(f.tree, &ray, &t, &triangle, &u, &v));
        drop(&f);
    }
}

static void without_triangles_nothing_is_hit(void **state) {
    (void)state;
    fixture f = {shd_arena_new(1 << 24), shd_tracer_new(), {0}, NULL};
    shd_error error;
    assert_true(shd_tessellate(SHD_TORUS, 1e-12, 24, f.arena, &f.triangles));
    assert_int_equal(f.triangles.triangle_count, 0);
    assert_int_equal(shd_mesh_tree_new(&f.triangles, f.tracer, NULL, f.arena, &f.tree, &error),
                     SHD_OK);
    shd_ray ray = {{1, 9, 0}, {0, -1, 0}, 0};
    double t, u, v;
    uint32_t triangle;
    assert_false(shd_mesh_tree_intersect(f.tree, &ray, &t, &triangle, &u, &v));
    drop(&f);
}

typedef struct canceller {
    atomic_bool flag;
    useconds_t pause;
} canceller;

static void *cancel_later(void *context) {
    canceller *c = context;
    usleep(c->pause);
    atomic_store(&c->flag, true);
    return NULL;
}

/* Where a ray meets the mesh, or a negative number. */
static double first_hit(const shd_mesh_tree *tree, const shd_ray *ray) {
    double t, u, v;
    uint32_t triangle;
    return shd_mesh_tree_intersect(tree, ray, &t, &triangle, &u, &v) ? t : -1;
}

static void a_build_ends_when_it_is_cancelled_and_later_ones_are_whole(void **state) {
    (void)state;
    srand(4);
    fixture f = {shd_arena_new(1 << 28), shd_tracer_new(), {0}, NULL};
    assert_true(shd_tessellate(SHD_TORUS, 0.4, 400, f.arena, &f.triangles));
    assert_true(f.triangles.triangle_count > 300000);
    shd_ray rays[200];
    double expected[200];
    for (int round = 0; round < 8; round++) {
        /* At once, then wherever the build is by then, it may be over; in the end not at all. */
        canceller c = {.pause = (useconds_t)(rand() % 200000)};
        atomic_init(&c.flag, round == 1);
        pthread_t thread;
        const bool amid = round > 1 && round < 7;
        if (amid) assert_int_equal(pthread_create(&thread, NULL, cancel_later, &c), 0);
        shd_error error = {SHD_OK, "", ""};
        shd_mesh_tree *tree = NULL;
        const shd_status status =
            shd_mesh_tree_new(&f.triangles, f.tracer, &c.flag, f.arena, &tree, &error);
        if (amid) pthread_join(thread, NULL);
        if (round == 1) assert_int_equal(status, SHD_CANCELLED);
        if (!round || round == 7) assert_int_equal(status, SHD_OK);
        if (status) {
            assert_int_equal(status, SHD_CANCELLED);
            assert_int_equal(error.status, SHD_CANCELLED);
            assert_null(tree);
            continue;
        }
        for (int i = 0; i < 200; i++) {
            if (!round) {
                const shd_vec3 from = {uniform(-1, 1), 3, uniform(-1, 1)}, along = {0, -1, 0};
                rays[i] = (shd_ray){from, along, 0};
                expected[i] = first_hit(tree, &rays[i]);
            }
            assert_true(first_hit(tree, &rays[i]) == expected[i]);
        }
        shd_mesh_tree_drop(tree);
    }
    drop(&f);
}

static void every_pattern_is_stratified_in_both_directions(void **state) {
    (void)state;
    for (int n = 1; n <= 64; n++) {
        int columns[64] = {0}, rows[64] = {0}, reach = 1;
        while (reach < n) reach *= 2;
        for (int i = 0; i < n; i++) {
            double x, y;
            shd_sample_offset(i, n, &x, &y);
            assert_true(x > 0 && x < 1 && y > 0 && y < 1);
            columns[(int)(x * n)]++;
            rows[(int)(y * reach)]++;
        }
        for (int i = 0; i < n; i++) assert_int_equal(columns[i], 1);
        for (int i = 0; i < reach; i++) assert_true(rows[i] <= 1);
    }
}

static void one_sample_is_the_centre(void **state) {
    (void)state;
    double x, y;
    shd_sample_offset(0, 1, &x, &y);
    assert_true(x == 0.5 && y == 0.5);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(hits_are_those_of_every_triangle_tried_in_f64),
        cmocka_unit_test(far_meshes_keep_their_precision),
        cmocka_unit_test(hits_at_a_shared_edge_stay_where_the_ray_meets_the_plane),
        cmocka_unit_test(rays_whose_arithmetic_overflows_miss),
        cmocka_unit_test(meshes_smaller_than_normal_numbers_are_taken),
        cmocka_unit_test(without_triangles_nothing_is_hit),
        cmocka_unit_test(a_build_ends_when_it_is_cancelled_and_later_ones_are_whole),
        cmocka_unit_test(every_pattern_is_stratified_in_both_directions),
        cmocka_unit_test(one_sample_is_the_centre),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
