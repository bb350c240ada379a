/* Westin tables against radiosity, against plain ray marching, and against what must hold. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "base/digest.h"
#include "bound/light/weights.h"
#include "shade/westin.h"
#include "shade/westin_relief.h"

#define DEGREE (SHD_PI / 180)

static const shd_microgeometry FLAT = {.type = SHD_GROOVES},
                               GROOVES = {.type = SHD_GROOVES, .angle = 50 * DEGREE},
                               WEAVE = {.type = SHD_WEAVE, .warp = 0.45, .weft = 0.35},
                               HEIGHTS = {.type = SHD_HEIGHTFIELD, .slope = 0.8};

static shd_westin *make(const shd_microgeometry *micro) {
    shd_error error;
    shd_westin *table = malloc(sizeof *table);
    assert_non_null(table);
    assert_int_equal(shd_westin_make(micro, NULL, table, &error), SHD_OK);
    return table;
}

/* Those of the microgeometries above are made once. */
static const shd_microgeometry *const MICROS[] = {&GROOVES, &WEAVE, &HEIGHTS};
static const shd_westin *made[3];

static int make_tables(void **state) {
    (void)state;
    for (size_t m = 0; m < 3; m++) made[m] = make(MICROS[m]);
    return 0;
}

static int free_tables(void **state) {
    (void)state;
    for (size_t m = 0; m < 3; m++) free((void *)(uintptr_t)made[m]);
    return 0;
}

static shd_vec3 way(double rise, double turn) {
    rise *= DEGREE;
    turn *= DEGREE;
    return (shd_vec3){sin(rise) * cos(turn), sin(rise) * sin(turn), cos(rise)};
}

static double reflect(const shd_westin *table, shd_vec3 light, shd_vec3 view, double kd) {
    double out[3];
    shd_westin_reflect(table, light, view, (double[]){kd, kd, kd}, out);
    return out[1];
}

/* cmocka's own comparison is of floats. */
static void assert_near(double got, double wanted, double most) {
    if (!(fabs(got - wanted) <= most)) fail_msg("%.17g is not %.17g within %g", got, wanted, most);
}

static void flat_grooves_are_lambertian(void **state) {
    (void)state;
    shd_westin *table = make(&FLAT);
    for (double rise = 0; rise < 90; rise += 7.3)
        for (double turn = 0; turn < 360; turn += 31) {
            double out[3];
            const double kd[3] = {1, 0.5, -0.25};
            shd_westin_reflect(table, way(rise, turn), way(88 - rise / 2, 3 * turn), kd, out);
            /* of sums of 4096 floats */
            for (int c = 0; c < 3; c++) assert_near(out[c], kd[c], 1e-5);
        }
    assert_true(shd_westin_noise(table).max < 1e-6);
    free(table);
}

/* ---- Limits. ---- */

/* `v`, moved by `by` in any direction. */
static shd_vec3 beside(shd_vec3 v, double by) {
    const double a = rand(), b = rand(), c = rand();
    shd_vec3 out = v;
    shd_normalize(shd_madd(v, (shd_vec3){a - b, b - c, c - a}, by / RAND_MAX / 2), &out);
    return out;
}

static shd_vec3 any_way(int i) {
    static const double rises[] = {0, 0.006, 0.3, 3, 7.9, 8.1, 12, 45, 84, 89.9, 90};
    const double turn = 360.0 * rand() / RAND_MAX;
    return way(i % 4 ? rises[rand() % 11] : 90.0 * rand() / RAND_MAX, turn);
}

/* What bounds take tables for: no value is above the largest node, and directions that are off
 * change what is reflected by no more than is told, wherever rises are above 1e-4. */
static void no_value_exceeds_what_tables_tell(void **state) {
    (void)state;
    srand(11);
    double tightest = 0;
    for (size_t m = 0; m < 3; m++) {
        const shd_westin *table = made[m];
        const shd_plan_material material = {.model = SHD_MODEL_WESTIN, .table = &table->limits};
        assert_true(table->limits.most > 1 && table->limits.most < 2900);
        assert_true(table->limits.near <= table->limits.turn);
        for (int i = 0; i < 300000; i++) {
            const double by = pow(10, -1 - rand() % 9), kd = i % 3 ? 1 : 0.4;
            const shd_vec3 light = any_way(i), view = any_way(i / 4), l = beside(light, by),
                           v = beside(view, by);
            const double here = light.z * reflect(table, light, view, kd) / kd,
                         there = l.z * reflect(table, l, v, kd) / kd;
            const double poles[] = {light.z, view.z, l.z, v.z};
            bool counts = true; /* no N.L or N.V is on the edge, nor any rise */
            for (int k = 0; k < 4; k++)
                counts &= poles[k] > 0 && (1 - poles[k]) * (1 + poles[k]) > 1e-8;
            assert_true(here <= table->limits.most);
            if (!counts) continue;
            shd_glance g = {.direction = shd_length(shd_sub(light, l)) +
                                         shd_length(shd_sub(view, v)) + 1e-15};
            g.lit.facing_high = shd_larger(light.z, l.z);
            const shd_weight told = shd_weight_of(&material, 0, &g, 1);
            tightest = shd_larger(tightest, fabs(here - there) / told.error);
            if (!(fabs(here - there) <= told.error))
                fail_msg("%zu: %g becomes %g by %g: told %g", m, here, there, by, told.error);
        }
    }
    print_message("of what is told of tables, at most %.2g\n", tightest);
    assert_true(tightest > 0.02); /* it is not told too loosely, either */
}

/* ---- Radiosity of V-grooves. ---- */

enum { STRIPS = 600 };

typedef struct grooves {
    double tangent, sine, cosine;
    double between[STRIPS][STRIPS]; /* from a strip to all of the other side */
} grooves;

/* Strips u = (k + 1/2) / STRIPS from the valley, on both sides; the kernel of strips that are
 * endless along the groove is cos cos / (2 r) by their width. */
static void make_grooves(grooves *g, double angle) {
    g->tangent = tan(angle);
    g->sine = sin(angle);
    g->cosine = cos(angle);
    for (int a = 0; a < STRIPS; a++)
        for (int b = 0; b < STRIPS; b++) {
            const double u = (a + 0.5) / STRIPS, v = (b + 0.5) / STRIPS, across = u + v,
                         up = (v - u) * g->tangent, r = hypot(across, up),
                         from = (g->sine * across + g->cosine * up) / r,
                         to = (g->sine * across - g->cosine * up) / r;
            g->between[a][b] = from * to / (2 * r) / STRIPS / g->cosine;
        }
}

/* What the strip k of the side (-1, 1) sees of a direction. */
static double sees(const grooves *g, int side, int k, shd_vec3 d) {
    const double facing = -side * g->sine * d.y + g->cosine * d.z, u = (k + 0.5) / STRIPS,
                 at = side * u;
    if (facing <= 0) return 0;
    const double ridge = d.y > 0 ? 1 - at : 1 + at; /* how far the ridge is along the ray */
    return u * g->tangent + d.z / fabs(d.y) * ridge >= g->tangent ? facing : 0;
}

static double radiosity(const grooves *g, shd_vec3 light, shd_vec3 view, double kd) {
    static double sent[2][STRIPS], next[2][STRIPS];
    for (int s = 0; s < 2; s++)
        for (int k = 0; k < STRIPS; k++) sent[s][k] = sees(g, 2 * s - 1, k, light);
    for (int bounce = 0; bounce < 24; bounce++) { /* 0.6^24 is 5e-6 */
        for (int s = 0; s < 2; s++)
            for (int k = 0; k < STRIPS; k++) {
                double arrives = 0;
                for (int l = 0; l < STRIPS; l++) arrives += g->between[k][l] * sent[1 - s][l];
                next[s][k] = sees(g, 2 * s - 1, k, light) + kd * arrives;
            }
        memcpy(sent, next, sizeof sent);
    }
    double sum = 0;
    for (int s = 0; s < 2; s++)
        for (int k = 0; k < STRIPS; k++) sum += sees(g, 2 * s - 1, k, view) * sent[s][k];
    return kd * sum / (2 * STRIPS * g->cosine * light.z * view.z);
}

static void grooves_agree_with_radiosity(void **state) {
    (void)state;
    static grooves g;
    static const double angles[] = {20, 50};
    for (size_t a = 0; a < 2; a++) {
        shd_westin *table = make(&(shd_microgeometry){SHD_GROOVES, .angle = angles[a] * DEGREE});
        make_grooves(&g, angles[a] * DEGREE);
        double squares = 0;
        const int count = 16;
        for (int k = 0; k < count; k++) {
            const shd_vec3 light = way(5 + 17 * k % 65, 40 * k),
                           view = way(3 + 29 * k % 65, 77 * k);
            const double wanted = radiosity(&g, light, view, 0.6),
                         error = reflect(table, light, view, 0.6) - wanted;
            squares += error * error / count;
            /* Splines smooth the edges of shadows, over 5.6 and 11.25 degrees. */
            assert_true(fabs(error) < 0.03);
        }
        assert_true(sqrt(squares) < 0.012);
        free(table);
    }
}

/* ---- Plain ray marching, which knows no triangles. ---- */

static bool is_hidden(const shd_relief *relief, const shd_relief_point *from, shd_vec3 d) {
    const double step = 0.03, level = hypot(d.x, d.y);
    for (double s = step; from->z + s * d.z / level < relief->highest; s += step) {
        const double x = from->x + s * d.x / level, y = from->y + s * d.y / level, n = relief->size;
        const shd_relief_point at =
            shd_relief_at(relief, x - n * floor(x / n), y - n * floor(y / n));
        if (at.z > from->z + s * d.z / level + 1e-9) return true;
    }
    return false;
}

static shd_vec3 turned(shd_vec3 d, double by) {
    return (shd_vec3){d.x * cos(by) - d.y * sin(by), d.x * sin(by) + d.y * cos(by), d.z};
}

/* rho_1, and its standard error. */
static double march(const shd_relief *relief, shd_vec3 light, shd_vec3 view, double *error) {
    enum { POINTS = 12000 };
    double sum = 0, squares = 0;
    for (uint64_t k = 0; k < POINTS; k++) {
        const shd_relief_point at =
            shd_relief_at(relief, relief->size * shd_relief_random(77, 3 * k),
                          relief->size * shd_relief_random(77, 3 * k + 1));
        const double by = relief->isotropic ? 2 * SHD_PI * shd_relief_random(77, 3 * k + 2) : 0;
        const shd_vec3 l = turned(light, by), v = turned(view, by);
        const double cl = shd_dot(at.normal, l), cv = shd_dot(at.normal, v);
        double value = 0;
        if (cl > 0 && cv > 0 && !is_hidden(relief, &at, l) && !is_hidden(relief, &at, v))
            value = cl * cv / (at.normal.z * light.z * view.z);
        sum += value / POINTS;
        squares += value * value / POINTS;
    }
    *error = sqrt((squares - sum * sum) / POINTS);
    return sum;
}

static void first_bounces_agree_with_marched_rays(void **state) {
    (void)state;
    const shd_vec3 ways[][2] = {{way(20, 10), way(50, 100)}, {way(62, -40), way(35, -70)}};
    static shd_relief relief;
    for (size_t m = 0; m < 3; m++) {
        const shd_westin *table = made[m];
        shd_relief_make(MICROS[m], &relief);
        for (size_t k = 0; k < 2; k++) {
            const double dim = 1e-9;
            double error;
            const double wanted = march(&relief, ways[k][0], ways[k][1], &error),
                         got = reflect(table, ways[k][0], ways[k][1], dim) / dim;
            assert_true(fabs(got - wanted) < 4 * error + 0.02);
            assert_true(error < 0.02);
        }
    }
}

static void cast_rays_end_on_the_surface(void **state) {
    (void)state;
    static shd_relief relief;
    for (size_t m = 0; m < 3; m++) {
        shd_relief_make(MICROS[m], &relief);
        int hits = 0, leaves = 0;
        for (uint64_t k = 0; k < 2000; k++) {
            const shd_relief_point from = shd_relief_pick(
                &relief, (double[]){shd_relief_random(5, 5 * k), shd_relief_random(5, 5 * k + 1),
                                    shd_relief_random(5, 5 * k + 2)});
            const shd_vec3 d =
                way(120 * shd_relief_random(5, 5 * k + 3), 360 * shd_relief_random(5, 5 * k + 4));
            if (shd_dot(d, from.normal) < 0.01) continue;
            shd_relief_point to;
            const bool hit = shd_relief_cast(&relief, &from, d, &to);
            hits += hit;
            leaves += !hit;
            if (!hit) {
                assert_true(d.z > 0 && !is_hidden(&relief, &from, d));
                continue;
            }
            assert_true(to.x >= 0 && to.x <= relief.size && to.y >= 0 && to.y <= relief.size);
            assert_true(shd_dot(d, to.normal) < 1e-9);
            /* on the surface, within the rounding of heights of up to 30 cells */
            const double off = shd_relief_at(&relief, fmin(to.x, relief.size - 1e-9),
                                             fmin(to.y, relief.size - 1e-9))
                                   .z -
                               to.z;
            assert_true(fabs(off) < 1e-6);
        }
        assert_true(hits > 200 && leaves > 200);
    }
}

/* ---- What must hold for all. ---- */

static double albedo(const shd_westin *table, shd_vec3 view, double kd) {
    enum { N = 128 };
    double sum = 0;
    for (int a = 0; a < N; a++)
        for (int b = 0; b < N; b++) {
            const shd_vec3 light = way(90 * (a + 0.5) / N, 360 * (b + 0.5) / N);
            sum += reflect(table, light, view, kd) * light.z * hypot(light.x, light.y);
        }
    return sum * SHD_PI / (N * N);
}

static void all_light_leaves_white_facets(void **state) {
    (void)state;
    for (size_t m = 0; m < 3; m++) {
        const shd_westin *table = made[m];
        for (double rise = 0; rise < 90; rise += 14.7) {
            /* this sum's own error */
            assert_near(albedo(table, way(rise, 3 * rise), 1), 1, 2e-4);
            const double half = albedo(table, way(rise, 3 * rise), 0.5);
            assert_true(half > 0.2 && half < 0.5);
        }
    }
}

static void light_and_view_may_change_places(void **state) {
    (void)state;
    for (size_t m = 0; m < 3; m++) {
        const shd_westin *table = made[m];
        for (int k = 0; k < 200; k++) {
            const double a = 83. * k, b = 31. * k;
            const shd_vec3 l = way(fmod(a, 90), b), v = way(fmod(b, 90), a);
            const double there = reflect(table, l, v, 0.7), back = reflect(table, v, l, 0.7);
            assert_true(there >= 0);
            assert_near(there, back, 1e-12 * (1 + there));
            /* mirror images of the microgeometry are itself */
            const shd_vec3 lx = {-l.x, l.y, l.z}, vx = {-v.x, v.y, v.z};
            assert_near(there, reflect(table, lx, vx, 0.7), 1e-12 * (1 + there));
            if (table->isotropic)
                assert_near(there, reflect(table, turned(l, 0.3), turned(v, 0.3), 0.7),
                            1e-12 * (1 + there));
        }
    }
}

static void nothing_is_reflected_below_the_horizon(void **state) {
    (void)state;
    const shd_westin *table = made[0];
    assert_true(reflect(table, way(91, 20), way(30, 20), 1) == 0);
    assert_true(reflect(table, way(30, 20), way(91, 20), 1) == 0);
    assert_true(reflect(table, way(30, 20), (shd_vec3){1, 0, 0}, 1) == 0);
    assert_true(reflect(table, way(30, 20), way(89.9999, 0), 1) > 0);
}

static void noise_is_told(void **state) {
    (void)state;
    for (size_t m = 0; m < 3; m++) {
        const shd_westin *table = made[m];
        const shd_westin_error noise = shd_westin_noise(table);
        /* docs/model.md says: up to 0.02, where both ways are level up to 1.5 */
        assert_true(noise.rms > 1e-4 && noise.rms < 0.02);
        assert_true(noise.max > noise.rms && noise.max < 1.5);
    }
}

/* The same on every machine: no instruction of the simulation rounds otherwise elsewhere. */
static void tables_are_the_same_everywhere(void **state) {
    (void)state;
    static const char *const digests[] = {
        "3261f3b515e90c98a6de22582645da5d1592208106bbc5af7f871faf37babfda",
        "fc2a22d886c91d4b04f55b861df98fd187dcfeca415d659d7bbc28023f8e5e23",
        "13dadc6aeb42715cfaf5716ef940bf2f06363d56919042dad974925ba8d3c687"};
    for (size_t m = 0; m < 3; m++) {
        const shd_westin *table = made[m];
        char text[SHD_DIGEST_TEXT];
        const shd_digest digest = shd_digest_of(table->rho, sizeof table->rho);
        shd_digest_write(&digest, text);
        assert_string_equal(text, digests[m]);
    }
}

static void a_cancelled_simulation_ends(void **state) {
    (void)state;
    static shd_westin table;
    const atomic_bool cancelled = true;
    shd_error error;
    assert_int_equal(shd_westin_make(&WEAVE, &cancelled, &table, &error), SHD_CANCELLED);
}

/* ---- Tangents. ---- */

static void assert_along(shd_vec3 got, shd_vec3 wanted) {
    assert_near(shd_length(got), 1, 1e-12);
    assert_near(fabs(shd_dot(got, wanted)), 1, 1e-9);
}

static void tangents_follow_shapes(void **state) {
    (void)state;
    shd_object o = {.shape = SHD_SPHERE, .radius = 2, .height = 1, .tube = 0.5, .size = {1, 2, 3}};
    for (int k = 0; k < 3; k++) o.transform.linear[k][k] = 1;
    const shd_vec3 x = {1, 0, 0}, y = {0, 1, 0}, z = {0, 0, 1};
    assert_along(shd_surface_tangent(&o, shd_scale(z, 2), z), x);
    assert_along(shd_surface_tangent(&o, shd_scale(x, 2), x), z);
    assert_along(shd_surface_tangent(&o, shd_scale(y, 2), y), x); /* the pole has no around */
    o.shape = SHD_BOX;
    assert_along(shd_surface_tangent(&o, y, y), x);
    assert_along(shd_surface_tangent(&o, x, x), z);
    o.shape = SHD_DISC;
    assert_along(shd_surface_tangent(&o, z, y), x);
    /* Turned by 90 degrees about y, with another size: x becomes -z. */
    o.transform = (shd_affine){{{0, 0, 3}, {0, 1, 0}, {-2, 0, 0}}, {5, 5, 5}};
    assert_along(shd_surface_tangent(&o, (shd_vec3){5, 5, 5}, y), z);
    o.shape = SHD_CYLINDER;
    assert_along(shd_surface_tangent(&o, (shd_vec3){5 + 6, 5, 5}, x), z);
    const shd_vec3 t = shd_surface_tangent(&o, (shd_vec3){9, 5, 7}, way(90, 30));
    assert_near(shd_dot(t, way(90, 30)), 0, 1e-12);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(flat_grooves_are_lambertian),
        cmocka_unit_test(no_value_exceeds_what_tables_tell),
        cmocka_unit_test(grooves_agree_with_radiosity),
        cmocka_unit_test(first_bounces_agree_with_marched_rays),
        cmocka_unit_test(cast_rays_end_on_the_surface),
        cmocka_unit_test(all_light_leaves_white_facets),
        cmocka_unit_test(light_and_view_may_change_places),
        cmocka_unit_test(nothing_is_reflected_below_the_horizon),
        cmocka_unit_test(noise_is_told),
        cmocka_unit_test(tables_are_the_same_everywhere),
        cmocka_unit_test(a_cancelled_simulation_ends),
        cmocka_unit_test(tangents_follow_shapes),
    };
    return cmocka_run_group_tests(tests, make_tables, free_tables);
}
