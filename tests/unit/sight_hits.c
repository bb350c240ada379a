/* The hard cases of sight, end to end: a scene's JSON to hits, in every variant of the kernels,
 * beside the formula in f32 that fails them. */
#include <float.h>

#include "unit/see.h"

/* The slopes of the ray through pixel i's centre, of a field whose half has the tangent `half`. */
static void slopes(uint32_t i, double half, double *p, double *q) {
    *p = ((double)(i % SIDE) + 0.5 - SIDE / 2) / (SIDE / 2) * half;
    *q = (SIDE / 2 - 0.5 - (double)(i / SIDE)) / (SIDE / 2) * half;
}

/* A unit sphere that almost fills the picture, from `distance` radii. The ray (p, q, -1) meets it
 * where p^2 + q^2 <= 1 / (distance^2 - 1). With e = distance sin(angle) the foot's distance, N is
 * e across and sqrt(1 - e^2) toward the camera, turned by the ray's angle. */
static void check_distance(shd_engine *engine, double distance, double tolerance, shd_isa isa) {
    const double half = 1.05 / sqrt(distance * distance - 1);
    char *json = text_of("{" PICTURE EXACT ", \"camera\": {\"position\": [0, 0, %.17g], \"fov\": "
                         "%.17g}, \"objects\": [{\"type\": \"sphere\"}]}",
                         distance, 2 * atan(half) * 180 / SHD_PI);
    seen s = see(engine, json, isa);
    size_t hits = 0, naive_wrong = 0;
    double worst = 0;
    for (uint32_t i = 0; i < ALL; i++) {
        double p, q;
        slopes(i, half, &p, &q);
        long double slope2 = (long double)p * p + (long double)q * q, d = distance;
        long double inside = 1 - slope2 * (d * d - 1); /* of (1 + slope2) / slope2 ... */
        bool hit = hits < s.hits.count && s.hits.shot[hits] == i;
        float fd = (float)distance, fl = sqrtf((float)(1 + slope2)), fz = -1 / fl;
        float fb = fd * fz, fc = fd * fd - 1;
        naive_wrong += (fb * fb - fc >= 0) != (inside >= 0);
        if (fabsl(inside) > 1e-6L) assert_true(hit == (inside > 0));
        if (!hit) continue;
        /* t of (p, q, -1): the smaller root of (1 + slope2) t^2 - 2 d t + d^2 - 1. */
        long double t = (d * d - 1) / (d + sqrtl(inside > 0 ? inside : 0));
        long double n[3] = {p * t, q * t, d - t};
        double facing = 0, error = 0;
        for (int c = 0; c < 3; c++) {
            facing += s.hits.normal[c][hits] * s.hits.view[c][hits];
            error = fmax(error, fabs((double)(n[c] - (long double)s.hits.normal[c][hits])));
        }
        worst = fmax(worst, error * facing); /* along the surface 1 / N.V times as much */
        hits++;
    }
    if (isa == SHD_PORTABLE)
        print_message("%g radii away: naive float is wrong for %zu of %d rays; N is off by %.1e\n",
                      distance, naive_wrong, ALL, worst);
    assert_int_equal(hits, s.hits.count);
    assert_true(hits > ALL / 2 && hits < ALL);
    assert_true(worst < tolerance);
    if (distance > 9e3) assert_true(naive_wrong > ALL / 50);
    drop_seen(&s);
    free(json);
}

static void far_spheres_have_their_outline_and_normals(void **state) {
    /* A ray's direction is rounded to 2^-53, `distance` of which is the foot's error in radii. */
    for (shd_isa isa = 0; every_variant(&isa); isa++)
        for (double distance = 10; distance < 2e8; distance *= 10)
            check_distance(*state, distance, 1e-15 * (distance + 10), isa);
}

/* From inside the nearer root is behind the camera: N is turned to it. */
static void from_inside_a_sphere_its_far_wall_is_seen(void **state) {
    static const char *const cameras[] = {"\"position\": [0.3, 0.2, 0.1]",
                                          "\"type\": \"orthographic\", \"height\": 1.2, "
                                          "\"position\": [0.1, 0.05, 0.2]"};
    for (shd_isa isa = 0; every_variant(&isa); isa++)
        for (int k = 0; k < 8; k++) {
            bool front = k & 1, exact = k & 2;
            char *json =
                text_of("{" PICTURE ", \"accuracy\": {\"tier\": \"%s\"}, \"camera\": {%s, "
                        "\"target\": [0, 0, -1]}, \"objects\": [{\"type\": \"sphere\", "
                        "\"material\": {\"side\": \"%s\"}}]}",
                        exact ? "exact" : "standard", cameras[k / 4], front ? "front" : "both");
            seen s = see(*state, json, isa);
            assert_int_equal(s.hits.count, ALL);
            const shd_vec3 eye = s.request->scene->camera.position;
            for (size_t i = 0; i < s.hits.count; i++) {
                double n[3], w[3], length = 0, outward = 0, toward = 0;
                const shd_plan *plan = s.request->rendering.plan;
                const double origin[3] = {plan->origin.x, plan->origin.y, plan->origin.z};
                const double camera[3] = {eye.x, eye.y, eye.z};
                for (int c = 0; c < 3; c++) {
                    double p = exact ? s.hits.position[c][i]
                                     : (double)s.hits.position32[c][i] / plan->scale + origin[c];
                    n[c] = exact ? s.hits.normal[c][i] : (double)s.hits.normal32[c][i];
                    length += p * p;
                    outward += n[c] * p;
                    toward += n[c] * (camera[c] - p);
                    if (exact) continue;
                    w[c] = (double)s.hits.mirror32[c][i];
                    /* W mirrors V about N, whichever way N is turned */
                    assert_true(fabs(w[c]) <= 1 + 1e-7);
                }
                assert_true(fabs(length - 1) < (exact ? 1e-14 : 1e-6));
                assert_true(fabs(fabs(outward) - 1) < (exact ? 1e-14 : 1e-6));
                assert_true((outward < 0) != front);
                if (k < 4) assert_true((toward > 0) != front);
            }
            drop_seen(&s);
            free(json);
        }
}

/* The eye on a surface whose normal is up in the picture: rays of the lower half go inside and see
 * the far wall, and none sees the place where the eye is. */
static void an_eye_on_a_surface_looks_past_it(void **state) {
    static const struct {
        const char *object, *camera;
        bool plane, hollow; /* tessellated, the surface is the same; there is an inside */
    } cases[] = {
        {"\"sphere\"", "[0, 0, 1], \"target\": [1, 0, 1], \"up\": [0, 0, 1]", false, true},
        {"\"sphere\", \"transform\": {\"scale\": [1, 3, 2]}",
         "[0, 0, 2], \"target\": [1, 0.3, 2], \"up\": [0, 0, 1]", false, true},
        {"\"box\"", "[0.1, 0.2, 0.5], \"target\": [1, 0.3, 0.5], \"up\": [0, 0, 1]", true, true},
        {"\"cylinder\"", "[0, 0, 1], \"target\": [1, 0.3, 1], \"up\": [0, 0, 1]", false, true},
        {"\"cylinder\"", "[0.1, 1, 0.5], \"target\": [0, 1, 0]", true, true},
        {"\"cone\"", "[0.1, -1, 0.5], \"target\": [0, -1, 0], \"up\": [0, -1, 0]", true, true},
        {"\"torus\"", "[1.25, 0, 0], \"target\": [1.25, 0.3, 1], \"up\": [1, 0, 0]", false, true},
        {"\"disc\", \"radius\": 10", "[0, 0, 4]", true, false},
    };
    for (shd_isa isa = 0; every_variant(&isa); isa++)
        for (size_t k = 0; k < 2 * (sizeof cases / sizeof cases[0]); k++) {
            const bool flat = k & 1;
            if (flat && !cases[k / 2].plane) continue;
            char *json = text_of("{" PICTURE EXACT ", \"camera\": {\"position\": %s}, "
                                 "\"objects\": [{\"type\": %s, \"interpolation\": \"%s\"}]}",
                                 cases[k / 2].camera, cases[k / 2].object, flat ? "flat" : "phong");
            seen s = see(*state, json, isa);
            assert_int_equal(s.hits.count, cases[k / 2].hollow ? ALL / 2 : 0);
            for (size_t i = 0; i < s.hits.count; i++) assert_true(s.hits.shot[i] >= ALL / 2);
            drop_seen(&s);
            free(json);
        }
}

static size_t count_first(const shd_hits *hits) {
    size_t first = 0;
    for (size_t i = 0; i < hits->count; i++) first += hits->object[i] == 0;
    return first;
}

/* The second object's surface lies in the first one's, or the other way around; rounding does not
 * decide by pixels which of them is nearer. */
static void of_surfaces_in_each_other_the_first_object_is_seen(void **state) {
#define BOX  "{\"type\": \"box\", \"size\": [2, 2, 2], \"transform\": {\"translate\": [0, -1, 0]}"
#define DISC "{\"type\": \"disc\"}"
    static const char *const pairs[][2] = {
        {"{\"type\": \"plane\"}", DISC},
        {DISC, "{\"type\": \"plane\"}"},
        {DISC, BOX "}"},
        {BOX "}", DISC},
        {BOX "}", BOX ", \"interpolation\": \"flat\"}"},
        {BOX ", \"interpolation\": \"flat\"}", BOX "}"},
        {"{\"type\": \"cylinder\"}", "{\"type\": \"cylinder\", \"height\": 1}"},
    };
    static const char *const cameras[] = {"\"fov\": 50",
                                          "\"type\": \"orthographic\", \"height\": 3"};
    for (shd_isa isa = 0; every_variant(&isa); isa++)
        for (size_t k = 0; k < 2 * (sizeof pairs / sizeof pairs[0]); k++) {
            const char *const *pair = pairs[k / 2];
            char *alone = text_of("{" PICTURE ", \"camera\": {%s, \"position\": [1.3, 2.1, 3.7]}, "
                                  "\"objects\": [%s]}",
                                  cameras[k % 2], pair[0]);
            char *both = text_of("{" PICTURE ", \"camera\": {%s, \"position\": [1.3, 2.1, 3.7]}, "
                                 "\"objects\": [%s, %s]}",
                                 cameras[k % 2], pair[0], pair[1]);
            seen first = see(*state, alone, isa), s = see(*state, both, isa);
            assert_true(first.hits.count > 300);
            assert_int_equal(count_first(&s.hits), first.hits.count);
            drop_seen(&first);
            drop_seen(&s);
            free(alone);
            free(both);
        }
}

/* Batches that hit a disc first and balls after it, and balls before: in the standard tier, which
 * makes what is seen of balls alone for the lanes that hit, as in the exact one. */
static void balls_beside_a_disc_are_seen_in_every_tier(void **state) {
    static const char *const objects[] = {
        "{\"type\": \"disc\", \"transform\": {\"translate\": [-1, 0, 0], \"rotate\": [90, 0, 0]}}",
        "{\"type\": \"sphere\", \"transform\": {\"translate\": [1, 0.4, 0], \"scale\": -0.5}}",
        "{\"type\": \"sphere\", \"radius\": 0.4, \"transform\": {\"translate\": [0.7, -0.4, 0]}}"};
    for (shd_isa isa = 0; every_variant(&isa); isa++)
        for (int k = 0; k < 3; k++) {
            char *json[2];
            for (int e = 0; e < 2; e++)
                json[e] = text_of("{" PICTURE "%s, \"objects\": [%s, %s, %s]}", e ? EXACT : "",
                                  objects[k], objects[(k + 1) % 3], objects[(k + 2) % 3]);
            seen s = see(*state, json[0], isa), exact = see(*state, json[1], isa);
            assert_int_equal(s.hits.count, exact.hits.count);
            for (size_t i = 0; i < s.hits.count; i++) {
                assert_int_equal(s.hits.shot[i], exact.hits.shot[i]);
                assert_int_equal(s.hits.object[i], exact.hits.object[i]);
                for (int c = 0; c < 3; c++)
                    assert_true(fabs((double)s.hits.normal32[c][i] - exact.hits.normal[c][i]) <
                                1e-6);
            }
            assert_true(s.hits.count > 500);
            drop_seen(&s);
            drop_seen(&exact);
            free(json[0]);
            free(json[1]);
        }
}

/* Their points lie in the plane y = -0.3, and none is lit by a light in it. */
static void points_of_a_level_mesh_are_level(void **state) {
    for (shd_isa isa = 0; every_variant(&isa); isa++) {
        seen s =
            see(*state,
                "{" PICTURE EXACT ", \"camera\": {\"position\": [0, 1, 4]}, \"objects\": "
                "[{\"type\": \"mesh\", \"positions\": [-2, -0.3, -2, -2, -0.3, 2, 2, -0.3, 2]}]}",
                isa);
        assert_true(s.hits.count > 300);
        for (size_t i = 0; i < s.hits.count; i++) assert_true(s.hits.position[1][i] == -0.3);
        drop_seen(&s);
    }
}

/* Normals of (x, y, 10 z) on the unit sphere: the gradient, and what the map itself would give. */
static void normals_of_scaled_spheres_are_the_gradient(void **state) {
    for (shd_isa isa = 0; every_variant(&isa); isa++) {
        seen s = see(*state,
                     "{" PICTURE EXACT ", \"camera\": {\"position\": [3, 0.5, 1]}, \"objects\": "
                     "[{\"type\": \"sphere\", \"transform\": {\"scale\": [1, 1, 0.1]}}]}",
                     isa);
        double worst = 0, naive = 0;
        for (size_t i = 0; i < s.hits.count; i++) {
            shd_vec3 n = {s.hits.normal[0][i], s.hits.normal[1][i], s.hits.normal[2][i]};
            shd_vec3 p = {s.hits.position[0][i], s.hits.position[1][i], s.hits.position[2][i]};
            shd_vec3 gradient = {p.x, p.y, p.z * 100}, carried = p;
            assert_true(shd_normalize(gradient, &gradient) && shd_normalize(carried, &carried));
            if (shd_dot(gradient, n) < 0) gradient = shd_scale(gradient, -1);
            worst = fmax(worst, shd_length(shd_sub(gradient, n)));
            naive = fmax(naive, acos(fmin(1, fabs(shd_dot(carried, n)))) * 180 / SHD_PI);
        }
        assert_true(s.hits.count > 200);
        assert_true(worst < 1e-12);
        assert_true(naive > 78); /* 78.6 degrees at the worst place */
        drop_seen(&s);
    }
}

/* A scene and the same one `size` times as large. Powers of two change no bit, other sizes round
 * anew. */
static void scenes_of_any_size_are_seen_alike(void **state) {
    static const double sizes[] = {1, 0x1p-66, 0x1p66, 0x1p-76, 1e-20, 1e20, 1e-23};
    for (shd_isa isa = 0; every_variant(&isa); isa++)
        for (int k = 0; k < 4; k++) {
            seen first = {0};
            for (size_t z = 0; z < sizeof sizes / sizeof sizes[0]; z++) {
                double f = sizes[z];
                const bool ortho = k & 1;
                char *json = text_of(
                    "{" PICTURE ", \"accuracy\": {\"tier\": \"%s\"}, \"camera\": {\"type\": "
                    "\"%s\", \"%s\": %.17g, \"position\": "
                    "[%.17g, %.17g, %.17g]}, \"objects\": [{\"type\": \"sphere\", \"radius\": "
                    "%.17g}, {\"type\": \"torus\", \"radius\": %.17g, \"tube\": %.17g}, {\"type\": "
                    "\"cone\", \"radius\": %.17g, \"height\": %.17g, \"transform\": {\"rotate\": "
                    "[20, 30, 40], \"translate\": [%.17g, 0, 0]}}, {\"type\": \"box\", \"size\": "
                    "[%.17g, %.17g, %.17g], \"transform\": {\"translate\": [0, %.17g, 0]}}]}",
                    k & 2 ? "exact" : "standard", ortho ? "orthographic" : "perspective",
                    ortho ? "height" : "fov", ortho ? 3 * f : 40.0, f, 2 * f, 4 * f, 0.5 * f, f,
                    0.25 * f, 0.5 * f, f, f, f, 0.5 * f, f, -f);
                seen s = see(*state, json, isa);
                free(json);
                if (!z) {
                    first = s;
                    assert_true(s.hits.count > 500);
                    continue;
                }
                /* Of 1e-20 and the like the doubles are not in proportion: 2^-53 each. */
                bool power = z < 4;
                assert_int_equal(s.hits.count, first.hits.count);
                for (size_t i = 0; i < s.hits.count; i++) {
                    assert_int_equal(s.hits.shot[i], first.hits.shot[i]);
                    assert_int_equal(s.hits.object[i], first.hits.object[i]);
                    for (int c = 0; c < 3; c++) {
                        if (k & 2) {
                            double n = first.hits.normal[c][i], p = first.hits.position[c][i];
                            assert_true(fabs(s.hits.normal[c][i] - n) <= (power ? 0 : 1e-12));
                            assert_true(fabs(s.hits.position[c][i] / f - p) <= (power ? 0 : 1e-13));
                            continue;
                        }
                        const double size = first.request->rendering.plan->scale,
                                     now = s.request->rendering.plan->scale;
                        double p = (double)first.hits.position32[c][i] / size;
                        double n = (double)first.hits.normal32[c][i];
                        double w = (double)first.hits.mirror32[c][i];
                        double step = power ? 0 : 0x1p-23;
                        assert_true(fabs((double)s.hits.position32[c][i] / (now * f) - p) <=
                                    2 * step);
                        assert_true(fabs((double)s.hits.normal32[c][i] - n) <= step);
                        assert_true(fabs((double)s.hits.mirror32[c][i] - w) <= step);
                    }
                }
                drop_seen(&s);
            }
            drop_seen(&first);
        }
    /* What f32 makes of the squares of such distances. */
    volatile float large = 4e20f, small = 4e-23f;
    assert_true(large * large > FLT_MAX && small * small < FLT_MIN);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(far_spheres_have_their_outline_and_normals),
        cmocka_unit_test(from_inside_a_sphere_its_far_wall_is_seen),
        cmocka_unit_test(an_eye_on_a_surface_looks_past_it),
        cmocka_unit_test(of_surfaces_in_each_other_the_first_object_is_seen),
        cmocka_unit_test(balls_beside_a_disc_are_seen_in_every_tier),
        cmocka_unit_test(points_of_a_level_mesh_are_level),
        cmocka_unit_test(normals_of_scaled_spheres_are_the_gradient),
        cmocka_unit_test(scenes_of_any_size_are_seen_alike),
    };
    return cmocka_run_group_tests(tests, make_engine, drop_engine);
}
