/* Analytic shapes in their unit form against their implicit equations. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>

#include <cmocka.h>

#define SHD_ISA portable
#include "sight/batch.h"

static const double tube = 0.35;
static const shd_shape solids[] = {SHD_SPHERE, SHD_BOX, SHD_CYLINDER, SHD_CONE, SHD_TORUS};
enum { SOLIDS = sizeof solids / sizeof solids[0] };

/* `direction` need not be unit. Only t > near counts. */
typedef struct test_ray {
    shd_vec3 origin, direction;
    double near;
} test_ray;

typedef struct surface {
    double t;        /* along the ray */
    shd_vec3 point;  /* snapped onto the shape */
    shd_vec3 normal; /* outward, any length but zero */
} surface;

/* The nearest surface with t > ray->near; false: none. One ray fills a batch: slow, but the same
 * code. */
static bool intersect(shd_shape shape, double ring_tube, const test_ray *ray, surface *out) {
    shd_work w;
    shd_surfaces met;
    for (int i = 0; i < SHD_RAYS; i++) {
        shd_set_lane(w.origin, i, ray->origin);
        shd_set_lane(w.direction, i, ray->direction);
        w.near[i] = ray->near;
        w.shift[i] = 0;
        if (shape != SHD_PLANE) shd_approach(&w, i);
    }
    SHD_VARIANT(shd_find_surfaces)(shape, ring_tube, &w);
    if (!(w.t[0] < INFINITY)) return false;
    SHD_VARIANT(shd_place_surfaces)(shape, ring_tube, &w, &met);
    *out = (surface){w.t[0] + w.shift[0], shd_lane(met.point, 0), shd_lane(met.normal, 0)};
    return true;
}

/* Negative inside, positive outside, zero on the surface. */
static double implicit(shd_shape shape, shd_vec3 p) {
    double ring = sqrt(p.x * p.x + p.z * p.z);
    switch (shape) {
    case SHD_SPHERE:
        return shd_length(p) - 1;
    case SHD_BOX:
        return shd_max_abs(p) - 0.5;
    case SHD_CYLINDER:
        return fmax(ring - 1, fabs(p.y) - 0.5);
    case SHD_CONE:
        return fmax(ring - (0.5 - p.y), -0.5 - p.y);
    case SHD_TORUS:
        return sqrt((ring - 1) * (ring - 1) + p.y * p.y) - tube;
    default:
        return 0;
    }
}

static double uniform(double low, double high) {
    return low + (high - low) * (rand() / (RAND_MAX + 1.0));
}

static shd_vec3 random_in(double size) {
    return (shd_vec3){uniform(-size, size), uniform(-size, size), uniform(-size, size)};
}

static shd_vec3 unit(shd_vec3 v) {
    shd_vec3 out = {1, 0, 0};
    assert_true(shd_normalize(v, &out));
    return out;
}

static test_ray random_ray(double size) {
    shd_vec3 from = random_in(size), at = random_in(0.8);
    return (test_ray){from, shd_scale(unit(shd_sub(at, from)), uniform(0.1, 10)), 0};
}

static void hits_lie_on_the_surface_and_nothing_is_before_them(void **state) {
    (void)state;
    srand(1);
    for (size_t k = 0; k < SOLIDS; k++) {
        int hits = 0;
        for (int i = 0; i < 3000; i++) {
            test_ray ray = random_ray(i % 3 ? 3 : 0.6); /* a third of them from near or inside */
            surface s;
            bool hit = intersect(solids[k], tube, &ray, &s);
            double reach = 10 / shd_length(ray.direction);
            if (hit) {
                hits++;
                assert_true(fabs(implicit(solids[k], s.point)) < 1e-12);
                shd_vec3 there = shd_madd(ray.origin, ray.direction, s.t);
                assert_true(shd_length(shd_sub(there, s.point)) < 1e-8);
                reach = s.t;
            }
            /* March: the ray stays on the side on which it began until it hits. */
            double side = implicit(solids[k], ray.origin);
            for (int step = 1; step < 300; step++) {
                shd_vec3 p = shd_madd(ray.origin, ray.direction, reach * step / 300);
                double now = implicit(solids[k], p);
                assert_true(side * now > 0 || fabs(now) < 1e-3);
            }
        }
        assert_true(hits > 1000);
    }
}

static void normals_are_the_gradient(void **state) {
    (void)state;
    srand(2);
    for (size_t k = 0; k < SOLIDS; k++) {
        for (int i = 0; i < 1000; i++) {
            test_ray ray = random_ray(3);
            surface s;
            if (!intersect(solids[k], tube, &ray, &s)) continue;
            shd_vec3 n = unit(s.normal);
            const double h = 1e-6;
            shd_vec3 p = s.point;
            double at[3][2];
            for (int c = 0; c < 3; c++) {
                for (int side = 0; side < 2; side++) {
                    shd_vec3 q = p;
                    double *value = c == 0 ? &q.x : c == 1 ? &q.y : &q.z;
                    *value += side ? h : -h;
                    at[c][side] = implicit(solids[k], q);
                }
            }
            shd_vec3 g =
                unit((shd_vec3){at[0][1] - at[0][0], at[1][1] - at[1][0], at[2][1] - at[2][0]});
            /* Edges, where two faces meet within the step, have no gradient. */
            shd_vec3 outside = shd_madd(p, n, 1e-4), inside = shd_madd(p, n, -1e-4);
            assert_true(implicit(solids[k], outside) > 0);
            if (implicit(solids[k], inside) < -0.9e-4 * (solids[k] == SHD_CONE ? 0.7 : 1))
                assert_true(shd_dot(n, g) > 1 - 1e-6);
        }
    }
}

static void plane_and_disc_lie_in_y_0(void **state) {
    (void)state;
    surface s;
    test_ray down = {{0.5, 2, 0.25}, {0, -2, 0}, 0}, up = {{0.5, 2, 0.25}, {0, 1, 0}, 0};
    test_ray wide = {{0.9, 2, 0.9}, {0, -2, 0}, 0}, level = {{0, 1, 0}, {1, 0, 0}, 0};
    assert_true(intersect(SHD_PLANE, 0, &down, &s) && s.t == 1 && s.point.y == 0);
    assert_true(intersect(SHD_DISC, 0, &down, &s) && fabs(s.t - 1) < 1e-15);
    assert_false(intersect(SHD_PLANE, 0, &up, &s));
    assert_false(intersect(SHD_DISC, 0, &up, &s));
    assert_true(intersect(SHD_PLANE, 0, &wide, &s));
    assert_false(intersect(SHD_DISC, 0, &wide, &s));
    assert_false(intersect(SHD_PLANE, 0, &level, &s));
}

/* Spheres 1e3 to 1e6 radii away: rays aimed 1e-6 of the radius inside and outside of the rim. */
static void far_spheres_are_hit_and_missed_rightly(void **state) {
    (void)state;
    srand(3);
    for (double distance = 1e3; distance < 2e6; distance *= 10) {
        int naive_wrong = 0, tried = 0;
        for (int i = 0; i < 2000; i++) {
            shd_vec3 from = unit(random_in(1)), side = unit(shd_cross(from, random_in(1)));
            bool inside = i & 1;
            double r = inside ? 1 - 1e-6 : 1 + 1e-6;
            /* the tangent at angle asin(1/D) touches at cos times the radius: aim at the point
             * of the line's closest approach itself, which is at distance r from the centre */
            double sine = r / distance;
            shd_vec3 toward =
                shd_add(shd_scale(from, -sqrt(1 - sine * sine)), shd_scale(side, sine));
            test_ray ray = {shd_scale(from, distance), toward, 0};
            surface s;
            assert_true(intersect(SHD_SPHERE, 0, &ray, &s) == inside);
            float ox = (float)ray.origin.x, oy = (float)ray.origin.y, oz = (float)ray.origin.z;
            float dx = (float)toward.x, dy = (float)toward.y, dz = (float)toward.z;
            float b = ox * dx + oy * dy + oz * dz, c = ox * ox + oy * oy + oz * oz - 1;
            naive_wrong += (b * b - c >= 0) != inside;
            tried++;
        }
        print_message("%g radii away: naive float is wrong in %.1f %%\n", distance,
                      100.0 * naive_wrong / tried);
        assert_true(naive_wrong > tried / 4);
    }
}

static void ray_from_inside_meets_the_far_wall(void **state) {
    (void)state;
    test_ray ray = {{0.1, 0.05, 0}, {0, 0, -1}, 0};
    surface s;
    for (size_t k = 0; k < SOLIDS; k++) {
        if (solids[k] == SHD_TORUS) ray.origin.x = 1;
        assert_true(implicit(solids[k], ray.origin) < 0);
        assert_true(intersect(solids[k], tube, &ray, &s));
        assert_true(s.t > 0 && s.normal.z < 0);
    }
}

static void thin_torus_far_away_is_met_on_its_tube(void **state) {
    (void)state;
    srand(4);
    const double thin = 1e-4;
    for (int i = 0; i < 1000; i++) {
        double angle = uniform(0, 2 * SHD_PI), off = uniform(-0.9, 0.9) * thin;
        shd_vec3 at = {(1 + off) * cos(angle), 0, (1 + off) * sin(angle)};
        test_ray ray = {{50, 1000, 20}, {0, 0, 0}, 0};
        ray.direction = unit(shd_sub(at, ray.origin));
        surface s;
        assert_true(intersect(SHD_TORUS, thin, &ray, &s));
        double ring = sqrt(s.point.x * s.point.x + s.point.z * s.point.z) - 1;
        assert_true(fabs(sqrt(ring * ring + s.point.y * s.point.y) - thin) < 1e-15);
        shd_vec3 there = shd_madd(ray.origin, ray.direction, s.t);
        assert_true(shd_length(shd_sub(there, s.point)) < 1e-12);
    }
}

/* (distance from the tube's circle)^2 - r^2 */
static double tube_square(double r, shd_vec3 p) {
    double off = sqrt(p.x * p.x + p.z * p.z) - 1;
    return (off - r) * (off + r) + p.y * p.y;
}

/* Rays of all kinds, many of them along tangents or in planes of symmetry, against marching in
 * steps of a thousandth: the torus is met in the first step that ends inside of it, or a ray that
 * is inside leaves it, unless what lies between is thinner than a step. */
static void tori_are_met_where_marching_meets_them(void **state) {
    (void)state;
    srand(5);
    static const double tubes[] = {0.02, 0.35, 0.9, 1, 1.6};
    enum { STEPS = 4000 };
    int hits = 0, misses = 0;
    for (int i = 0; i < 4000; i++) {
        const double r = tubes[i % 5], reach = 2 * (1 + r), step = 2 * reach / STEPS;
        double u = uniform(0, 2 * SHD_PI), v = uniform(0, 2 * SHD_PI);
        if (i % 3 == 0) v = SHD_PI / 2 * (i % 4); /* the equators, and the circles on top */
        shd_vec3 n = {cos(u) * cos(v), sin(v), sin(u) * cos(v)};
        shd_vec3 at = shd_madd((shd_vec3){cos(u), 0, sin(u)}, n, r * uniform(0.9, 1.1));
        shd_vec3 d = unit(shd_cross(n, random_in(1)));
        if (i % 4 == 1) d = unit(random_in(1));
        if (i % 7 == 2) d = (shd_vec3){0, 1, 0};
        if (i % 7 == 3) d = (shd_vec3){1, 0, 0};
        test_ray ray = {shd_madd(at, d, i % 11 ? -reach : uniform(-1, 1)), d, 0};
        const bool inside = tube_square(r, ray.origin) < 0;
        surface s;
        const bool hit = intersect(SHD_TORUS, r, &ray, &s);
        double met = INFINITY, thinnest = fabs(tube_square(r, ray.origin));
        for (int k = 1; k <= STEPS && met == INFINITY; k++) {
            double now = tube_square(r, shd_madd(ray.origin, d, k * step));
            if ((now < 0) != inside) met = k * step;
            thinnest = fmin(thinnest, fabs(now));
        }
        if (hit) {
            hits++;
            shd_vec3 there = shd_madd(ray.origin, d, s.t);
            assert_true(shd_length(shd_sub(there, s.point)) < 1e-7);
            assert_true(fabs(tube_square(r, s.point)) < 1e-14);
            assert_true(s.t <= met + 1e-9);
            /* nearer than marching says: it slipped through, or stepped over a thin part */
            if (s.t < met - step - 1e-9) assert_true(thinnest < 4 * step * step + 1e-12);
        } else {
            misses++;
            assert_true(met == INFINITY);
        }
    }
    assert_true(hits > 1000 && misses > 400);
}

/* How far a point of a ray is outside of the tube. */
static long double clearance(double r, const test_ray *ray, long double t) {
    const long double x = ray->origin.x + ray->direction.x * t,
                      y = ray->origin.y + ray->direction.y * t,
                      z = ray->origin.z + ray->direction.z * t;
    return hypotl(hypotl(x, z) - 1, y) - r;
}

/* Rays at thin and thick tubes, from inside, far away and past their rims, against steps as long as
 * the tube is far, which cannot pass it. */
static void tori_are_met_where_no_step_can_pass_them(void **state) {
    (void)state;
    srand(8);
    static const double tubes[] = {1e-6, 1e-3, 0.02, 0.25, 0.7, 0.999, 1, 1.3, 40, 3e3, 1e6};
    enum { TUBES = sizeof tubes / sizeof tubes[0], RAYS = 9000, STEPS = 20000 };
    int hits = 0, misses = 0;
    for (int i = 0; i < RAYS; i++) {
        const double r = tubes[i % TUBES], size = 1 + r;
        const double u = uniform(0, 2 * SHD_PI), v = uniform(0, 2 * SHD_PI);
        const shd_vec3 n = {cos(u) * cos(v), sin(v), sin(u) * cos(v)};
        const shd_vec3 rim = shd_madd((shd_vec3){cos(u), 0, sin(u)}, n,
                                      r * (i % 2 ? 1 + uniform(-1e-4, 1e-4) : uniform(0, 2)));
        const shd_vec3 along = unit(i % 2 ? shd_cross(n, random_in(1)) : random_in(1));
        const double back = i % 5 ? 3 * size : i % 10 ? 1000 * size : uniform(0, 1) * size;
        const test_ray ray = {shd_madd(rim, along, -back), along, 0};
        const double side = clearance(r, &ray, 0) < 0 ? -1 : 1;
        long double t = 0, left = 1, rest = 0;
        for (int step = 0; step < STEPS && t < back + 3 * size; step++) {
            left = side * clearance(r, &ray, t);
            if (left < 1e-17L * (back + size)) break;
            t += left;
        }
        surface s;
        const bool hit = intersect(SHD_TORUS, r, &ray, &s);
        if (hit) rest = fabsl(clearance(r, &ray, s.t));
        if (hit) assert_true(rest < 4e-15L * (back + size));
        if (t < back + 3 * size && left < 1e-12L * size) { /* all but met at least */
            if (side * clearance(r, &ray, t + 1e-3L * r) < -1e-6L * r) assert_true(hit);
            if (hit) assert_true(s.t > t - 1e-6L * size && s.t < t + 1e-5L * size);
            hits += hit;
        } else if (t >= back + 3 * size) {
            misses++;
            assert_true(!hit);
        }
    }
    assert_true(hits > RAYS / 3 && misses > RAYS / 10);
}

/* Rays that stay in a torus's hole while they are as high as its tube. Steps in f32 that look for
 * their roots may go far away, and there are none. */
static void nothing_is_met_in_holes_of_tori(void **state) {
    (void)state;
    srand(9);
    for (int i = 0; i < 6000; i++) {
        const double r = uniform(0.02, 0.98), hole = 0.98 * (1 - r);
        shd_work w;
        for (int k = 0; k < SHD_RAYS; k++) {
            const double u = uniform(0, 2 * SHD_PI), v = uniform(0, 2 * SHD_PI),
                         a = hole * sqrt(uniform(0, 1)), b = hole * sqrt(uniform(0, 1));
            const shd_vec3 low = {a * cos(u), -r, a * sin(u)}, high = {b * cos(v), r, b * sin(v)};
            shd_set_lane(w.origin, k, shd_madd(low, shd_sub(high, low), -pow(10, uniform(0, 4))));
            shd_set_lane(w.direction, k, shd_sub(high, low));
            w.near[k] = w.shift[k] = 0;
            shd_approach(&w, k);
        }
        SHD_VARIANT(shd_find_surfaces)(SHD_TORUS, r, &w);
        for (int k = 0; k < SHD_RAYS; k++) assert_true(w.t[k] == INFINITY);
    }
}

static void inverse_roots_are_right_to_2_ulp(void **state) {
    (void)state;
    srand(6);
    double worst = 0;
    for (int i = 0; i < 200000; i++) {
        double x = ldexp(uniform(1, 4), 2 * (rand() % 1000 - 500));
        long double right = 1 / sqrtl(x);
        double ulp = ldexp(1, ilogb((double)right) - 52);
        worst = fmax(worst, (double)fabsl(shd_inverse_root(x) - right) / ulp);
    }
    assert_true(worst <= 2);
    assert_true(shd_inverse_root(1) == 1 && shd_inverse_root(4) == 0.5);
    assert_true(isfinite(shd_inverse_root(0)));
}

/* ---- Tessellation ---- */

static void tessellations_are_closed_and_face_outward(void **state) {
    (void)state;
    for (size_t k = 0; k < SOLIDS; k++) {
        shd_arena *arena = shd_arena_new(1 << 24);
        shd_triangles t;
        assert_true(shd_tessellate(solids[k], tube, 12, arena, &t));
        double volume = 0;
        for (size_t i = 0; i < t.triangle_count; i++) {
            shd_vec3 a = shd_triangle_corner(&t, i, 0), n = shd_triangle_normal(&t, i);
            volume += shd_dot(a, n) / 6;
            for (int c = 0; c < 3; c++) {
                const double *vn = t.normals + 3 * (size_t)t.indices[3 * i + (size_t)c];
                shd_vec3 smooth = {vn[0], vn[1], vn[2]};
                assert_true(shd_dot(smooth, n) > 0);
                assert_true(fabs(implicit(solids[k], shd_triangle_corner(&t, i, c))) < 1e-12);
            }
        }
        /* Every edge has its opposite, by place: nothing leaks. */
        for (size_t i = 0; i < 3 * t.triangle_count; i++) {
            shd_vec3 a = shd_triangle_corner(&t, i / 3, (int)(i % 3));
            shd_vec3 b = shd_triangle_corner(&t, i / 3, (int)((i + 1) % 3));
            int opposite = 0;
            for (size_t j = 0; j < 3 * t.triangle_count; j++) {
                shd_vec3 c = shd_triangle_corner(&t, j / 3, (int)(j % 3));
                shd_vec3 d = shd_triangle_corner(&t, j / 3, (int)((j + 1) % 3));
                opposite += shd_length(shd_sub(a, d)) < 1e-9 && shd_length(shd_sub(b, c)) < 1e-9;
            }
            assert_int_equal(opposite, 1);
        }
        const double full[SOLIDS] = {4 * SHD_PI / 3, 1, SHD_PI, SHD_PI / 3,
                                     2 * SHD_PI * SHD_PI * tube * tube};
        assert_true(volume > 0.75 * full[k] && volume < 1.0001 * full[k]);
        assert_true(t.triangle_count <= shd_tessellation_triangles(solids[k], 12));
        shd_arena_drop(arena);
    }
}

/* What is seen of a torus is as far from its circle as its tube is thick, whichever way it is met.
 */
static void a_tube_that_meets_itself_has_no_surface_inside(void **state) {
    (void)state;
    shd_arena *arena = shd_arena_new(1 << 24);
    shd_triangles t;
    assert_true(shd_tessellate(SHD_TORUS, 1.5, 16, arena, &t));
    shd_vec3 sum = {0, 0, 0};
    for (size_t i = 0; i < 3 * t.triangle_count; i++) {
        shd_vec3 p = shd_triangle_corner(&t, i / 3, (int)(i % 3));
        assert_true(fabs(tube_square(1.5, p)) < 1e-12);
        if (i % 3 == 0) sum = shd_add(sum, shd_triangle_normal(&t, i / 3));
    }
    assert_true(shd_length(sum) < 1e-12); /* closed */
    shd_arena_drop(arena);
}

static void faces_are_plane_polygons(void **state) {
    (void)state;
    for (size_t k = 0; k < SOLIDS; k++) {
        shd_arena *arena = shd_arena_new(1 << 24);
        shd_triangles t;
        assert_true(shd_tessellate(solids[k], tube, 16, arena, &t));
        assert_true(t.faces[0] == 0);
        for (size_t i = 1; i < t.triangle_count; i++) {
            assert_true(t.faces[i] == t.faces[i - 1] || t.faces[i] == t.faces[i - 1] + 1);
            if (t.faces[i] != t.faces[i - 1]) continue;
            shd_vec3 a = unit(shd_triangle_normal(&t, i - 1));
            shd_vec3 b = unit(shd_triangle_normal(&t, i));
            assert_true(shd_dot(a, b) > 1 - 1e-9);
        }
        shd_arena_drop(arena);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(hits_lie_on_the_surface_and_nothing_is_before_them),
        cmocka_unit_test(normals_are_the_gradient),
        cmocka_unit_test(plane_and_disc_lie_in_y_0),
        cmocka_unit_test(far_spheres_are_hit_and_missed_rightly),
        cmocka_unit_test(ray_from_inside_meets_the_far_wall),
        cmocka_unit_test(thin_torus_far_away_is_met_on_its_tube),
        cmocka_unit_test(nothing_is_met_in_holes_of_tori),
        cmocka_unit_test(tori_are_met_where_marching_meets_them),
        cmocka_unit_test(tori_are_met_where_no_step_can_pass_them),
        cmocka_unit_test(inverse_roots_are_right_to_2_ulp),
        cmocka_unit_test(tessellations_are_closed_and_face_outward),
        cmocka_unit_test(a_tube_that_meets_itself_has_no_surface_inside),
        cmocka_unit_test(faces_are_plane_polygons),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
