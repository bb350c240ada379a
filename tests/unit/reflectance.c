/* The figures of materials: quadrature against closed forms and against other quadrature. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>

#include <cmocka.h>

#include "render/tell/albedo.h"
#include "render/tell/figures.h"
#include "render/tell/quadrature.h"
#include "shade/brdf.h"

/* ---- Quadrature ---- */

typedef struct curve {
    double place;
    size_t points;
} curve;

/* x^23, a bend, and a peak of width 1e-4. */
static void draw_curve(void *context, double x, double out[3]) {
    curve *c = context;
    const double off = (x - c->place) / 1e-4;
    c->points++;
    out[0] = pow(x, 23);
    out[1] = fabs(x - c->place);
    out[2] = 1 / (1 + off * off);
}

static void quadrature_finds_bends_and_peaks(void **state) {
    (void)state;
    curve c = {.place = 0.3, .points = 0};
    size_t left = 100000;
    const shd_quadrature q = {draw_curve, &c, 1e-11, &left};
    const double ends[] = {0, 0.3, 1};
    shd_integral sum;
    shd_integrate(&q, ends, 3, &sum);
    assert_float_equal(sum.value[0], 1.0 / 24, 1e-15);
    assert_float_equal(sum.value[1], (0.09 + 0.49) / 2, 1e-15);
    assert_float_equal(sum.value[2], 1e-4 * (atan(7e3) + atan(3e3)), 1e-14);
    assert_true(sum.error <= 1e-11);
    /* The bend where no end is. */
    c.place = 0.7 / SHD_PI;
    const double whole[] = {0, 1};
    shd_integrate(&q, whole, 2, &sum);
    assert_float_equal(sum.value[1], (c.place * c.place + (1 - c.place) * (1 - c.place)) / 2,
                       1e-11);
}

/* Each panel that is cut once more takes two of 12 points beside its own. */
static void quadrature_keeps_to_its_points(void **state) {
    (void)state;
    curve c = {.place = 0.123456, .points = 0};
    size_t left = 600;
    const shd_quadrature q = {draw_curve, &c, 0, &left};
    const double ends[] = {0, 1};
    shd_integral sum;
    shd_integrate(&q, ends, 2, &sum);
    assert_int_equal(left, 0);
    assert_true(c.points < 600 + 24 * 40);
    assert_true(sum.error > 0);
}

/* ---- Albedo ---- */

typedef struct subject {
    shd_material from;
    shd_plan_lobe lobes[2];
    shd_plan_material material;
    shd_object object;
    shd_scene scene;
    shd_plan_object seen;
    shd_plan plan;
    shd_reflectance of;
} subject;

typedef struct shares {
    double share[3], error;
} shares;

/* A material whose diffuse color and lobe are 1, or one of them. */
static void make(subject *s, shd_model model, bool diffuse, bool lobe, double sharpness) {
    *s = (subject){.from = {.model = model,
                            .sigma = sharpness,
                            .fresnel = {.n = {INFINITY, INFINITY, INFINITY}}},
                   .lobes = {{{1, 1, 1}, sharpness}}};
    s->material = (shd_plan_material){.model = model,
                                      .has_diffuse = diffuse,
                                      .lobes = s->lobes,
                                      .lobe_count = lobe,
                                      .from = &s->from};
    for (int c = 0; c < 3; c++) s->material.diffuse[c] = diffuse ? 1 : 0;
    s->scene = (shd_scene){
        .materials = &s->from, .material_count = 1, .objects = &s->object, .object_count = 1};
    s->plan = (shd_plan){
        .scene = &s->scene, .materials = &s->material, .objects = &s->seen, .extended = true};
    s->of = (shd_reflectance){.plan = &s->plan, .material = &s->material};
}

static double degrees(double angle) {
    return angle * (SHD_PI / 180);
}

static shares albedo_at(const subject *s, double angle) {
    shares out;
    assert_true(shd_albedo_find(&s->of, degrees(angle), 1e-11, out.share, &out.error));
    assert_true(out.share[0] == out.share[1] && out.share[1] == out.share[2]);
    return out;
}

static const double angles[] = {0, 1, 20, 45, 70, 85, 89};
enum { ANGLES = sizeof angles / sizeof angles[0] };

static void expect_share(const subject *s, double angle, double wanted, double tolerance) {
    const shares is = albedo_at(s, angle);
    if (fabs(is.share[0] - wanted) > tolerance * fmax(1, wanted) || is.error > 1e-10)
        fail_msg("at %g degrees %.15g, not %.15g; error %g", angle, is.share[0], wanted, is.error);
}

static void lambert_sends_on_its_color(void **state) {
    (void)state;
    subject s;
    make(&s, SHD_MODEL_PHONG, true, false, 0);
    for (int i = 0; i < ANGLES; i++) expect_share(&s, angles[i], 1, 1e-12);
}

static const double exponents[] = {0, 0.5, 1, 10, 1000, 1e6};
enum { EXPONENTS = sizeof exponents / sizeof exponents[0] };

/* E(N.L, n) / (pi N.L), by the closed form of shade/brdf.h, which is 2 / (n + 2) at the normal. */
static void phong_lobe_is_its_closed_form(void **state) {
    (void)state;
    for (int e = 0; e < EXPONENTS; e++) {
        subject s;
        const double n = exponents[e];
        make(&s, SHD_MODEL_PHONG, false, true, n);
        expect_share(&s, 0, 2 / (n + 2), 1e-10);
        for (int i = 0; i < ANGLES; i++) {
            const double facing = cos(degrees(angles[i]));
            expect_share(&s, angles[i], shd_phong_energy(facing, n) / (SHD_PI * facing), 1e-10);
        }
    }
}

static void normalized_lobe_sends_on_its_color(void **state) {
    (void)state;
    for (int e = 0; e < EXPONENTS; e++) {
        subject s;
        make(&s, SHD_MODEL_PHONG_NORMALIZED, false, true, exponents[e]);
        for (int i = 0; i < ANGLES; i++) expect_share(&s, angles[i], 1, 1e-10);
    }
}

/* With u = N.H from 1 to the root of 1/2: 8 times the integral of u^n (2 u^2 - 1) u. */
static void blinn_lobe_is_its_closed_form_from_above(void **state) {
    (void)state;
    for (int e = 0; e < EXPONENTS; e++) {
        subject s;
        const double n = exponents[e], u = sqrt(0.5);
        make(&s, SHD_MODEL_BLINN_PHONG, false, true, n);
        expect_share(&s, 0, 8 * (2 * (1 - pow(u, n + 4)) / (n + 4) - (1 - pow(u, n + 2)) / (n + 2)),
                     1e-10);
    }
}

/* A + B (2 / pi) sin (  (t - sin cos) / 2 + (1 - sin^3) / (3 cos)  ) of the light's angle t: s is
 * sin sin cos(azimuth) over the larger cosine, for half of the azimuths. */
static void oren_nayar_is_its_closed_form(void **state) {
    (void)state;
    for (double sigma = 0; sigma < 1.6; sigma += 0.3) {
        subject s;
        make(&s, SHD_MODEL_OREN_NAYAR, true, false, sigma);
        const double q = sigma * sigma, a = 1 - q / (2 * (q + 0.33)), b = 0.45 * q / (q + 0.09);
        for (int i = 0; i < ANGLES; i++) {
            const double t = degrees(angles[i]), x = sin(t), y = cos(t);
            const double part = (t - x * y) / 2 + (1 - x * x * x) / (3 * y);
            expect_share(&s, angles[i], a + b * (2 / SHD_PI) * x * part, 1e-10);
        }
    }
}

/* 2 D G sin cos of a facet's angle t under light from above, where G = min(1, 2 cos 2t). */
static long double facet_share(long double t, long double m) {
    const long double tangent = tanl(t) / m, c = cosl(t);
    const long double d = expl(-tangent * tangent) / (m * m * c * c * c * c);
    return 2 * d * fminl(1, 2 * cosl(2 * t)) * sinl(t) * c;
}

static long double simpson(long double from, long double to, long double m) {
    enum { STEPS = 40000 };
    const long double step = (to - from) / STEPS;
    long double sum = 0;
    for (int i = 0; i <= STEPS; i++)
        sum += (i == 0 || i == STEPS ? 1 : i % 2 ? 4 : 2) * facet_share(from + i * step, m);
    return sum * step / 3;
}

static void facets_under_light_from_above_are_simpsons_rule(void **state) {
    (void)state;
    const double slopes[] = {1e-2, 0.1, 0.3, 1};
    for (size_t i = 0; i < sizeof slopes / sizeof slopes[0]; i++) {
        subject s;
        make(&s, SHD_MODEL_COOK_TORRANCE, false, true, slopes[i]);
        const long double bend = M_PIl / 6, m = slopes[i];
        /* The lobe's peak lies within a few of its widths. */
        const long double near = fminl(bend, 12 * m);
        const double wanted =
            (double)(simpson(0, near, m) + simpson(near, bend, m) + simpson(bend, M_PIl / 4, m));
        expect_share(&s, 0, wanted, 1e-10);
    }
}

/* Two of a lobe and a diffuse term add up, each channel by its color. */
static void terms_add_up_by_channel(void **state) {
    (void)state;
    subject s;
    make(&s, SHD_MODEL_PHONG_NORMALIZED, true, true, 20);
    s.lobes[0] = (shd_plan_lobe){{0.1, 0.2, 0.3}, 20};
    s.lobes[1] = (shd_plan_lobe){{0.4, 0.1, 0}, 3};
    s.material.lobe_count = 2;
    s.material.diffuse[2] = 0.5;
    shares out;
    assert_true(shd_albedo_find(&s.of, 1, 1e-11, out.share, &out.error));
    assert_float_equal(out.share[0], 1.5, 1e-10);
    assert_float_equal(out.share[1], 1.3, 1e-10);
    assert_float_equal(out.share[2], 0.8, 1e-10);
}

/* The albedo by the midpoint rule over V's own angles, which knows nothing of lobes. */
static double midpoint_share(const subject *s, double angle) {
    enum { NODES = 1500 };
    const shd_vec3 toward = shd_polar(degrees(angle), SHD_PI);
    double sum = 0;
    for (int i = 0; i < NODES; i++) {
        const double polar = SHD_PI / 2 * (i + 0.5) / NODES;
        for (int j = 0; j < NODES; j++) {
            double f[3];
            shd_reflectance_at(&s->of, toward, shd_polar(polar, 2 * SHD_PI * (j + 0.5) / NODES), f);
            sum += f[0] * cos(polar) * sin(polar);
        }
    }
    return sum * (SHD_PI / 2 / NODES) * (2 * SHD_PI / NODES);
}

static void wide_lobes_are_the_midpoint_rule(void **state) {
    (void)state;
    static const struct {
        shd_model model;
        double sharpness;
    } cases[] = {{SHD_MODEL_PHONG, 8}, {SHD_MODEL_BLINN_PHONG, 8}, {SHD_MODEL_COOK_TORRANCE, 0.5}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++)
        for (double angle = 30; angle < 80; angle += 40) {
            subject s;
            make(&s, cases[i].model, false, true, cases[i].sharpness);
            /* The rule errs by some 1e-7, the square of its step. */
            const shares is = albedo_at(&s, angle);
            assert_float_equal(is.share[0], midpoint_share(&s, angle), 1e-6);
            assert_true(is.error < 1e-9);
        }
}

static void cancelled_albedo_says_so(void **state) {
    (void)state;
    const atomic_bool cancelled = true;
    subject s;
    shares out;
    make(&s, SHD_MODEL_PHONG, true, true, 10);
    s.plan.cancelled = &cancelled;
    assert_false(shd_albedo_find(&s.of, 0.5, 1e-11, out.share, &out.error));
}

/* ---- Limits and reciprocity ---- */

static shd_reflectance figures_of(subject *s) {
    shd_reflectance out;
    assert_true(shd_reflectance_find(&s->plan, 0, &out));
    return out;
}

/* Oren-Nayar's f_r is kd / pi (A + B sin^2 / cos) where V is L, and Cook-Torrance's has
 * 1 / (N.L)^2 where V is R. E of the normalized lobe is above 0 at the horizon. */
static void limits_are_those_of_the_equations(void **state) {
    (void)state;
    static const struct {
        shd_model model;
        bool diffuse, lobe;
        double sharpness;
        bool unbounded, reciprocal;
    } cases[] = {{SHD_MODEL_PHONG, true, false, 0, false, true},
                 {SHD_MODEL_PHONG, true, true, 10, true, false},
                 {SHD_MODEL_PHONG, true, true, 1e6, true, false},
                 {SHD_MODEL_BLINN_PHONG, true, true, 10, true, false},
                 {SHD_MODEL_PHONG_NORMALIZED, true, true, 10, false, false},
                 {SHD_MODEL_PHONG_NORMALIZED, false, true, 1e6, false, false},
                 {SHD_MODEL_OREN_NAYAR, true, false, 0.5, true, true},
                 {SHD_MODEL_OREN_NAYAR, true, false, 0, false, true},
                 {SHD_MODEL_COOK_TORRANCE, true, true, 0.3, true, true}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        subject s;
        make(&s, cases[i].model, cases[i].diffuse, cases[i].lobe, cases[i].sharpness);
        const shd_reflectance r = figures_of(&s);
        if (r.unbounded != cases[i].unbounded || (r.residual < 1e-9) != cases[i].reciprocal)
            fail_msg("case %zu: %d, residual %g", i, r.unbounded, r.residual);
    }
}

/* A lobe that takes light away has no limit, either. */
static void limits_are_those_of_negative_lobes(void **state) {
    (void)state;
    subject s;
    make(&s, SHD_MODEL_PHONG, true, true, 10);
    for (int c = 0; c < 3; c++) s.lobes[0].specular[c] = -1;
    assert_true(figures_of(&s).unbounded);
    for (int c = 0; c < 3; c++) s.lobes[0].specular[c] = 0;
    assert_false(figures_of(&s).unbounded);
}

/* 1 = kd + ks E / (pi cos) at the angle that is found. */
static void energy_is_gained_from_where_the_closed_form_is_1(void **state) {
    (void)state;
    subject s;
    make(&s, SHD_MODEL_PHONG, true, true, 5);
    s.material.diffuse[0] = s.material.diffuse[1] = s.material.diffuse[2] = 0.5;
    const shd_reflectance r = figures_of(&s);
    const double facing = cos(degrees(r.gains));
    assert_float_equal(0.5 + shd_phong_energy(facing, 5) / (SHD_PI * facing), 1, 1e-4);
    /* At the horizon E / (pi cos) is above all. */
    assert_float_equal(r.most_angle, 89.99, 0);
}

/* However narrow a lobe is, and however little light it sends on from above. */
static void narrow_lobes_gain_energy_at_last(void **state) {
    (void)state;
    static const double list[] = {3e3, 1e6, 1e7};
    for (size_t k = 0; k < sizeof list / sizeof *list; k++)
        for (int dark = 0; dark < 2; dark++) {
            subject s;
            make(&s, SHD_MODEL_PHONG, false, true, list[k]);
            const double ks = dark ? 0.05 : 1;
            for (int c = 0; c < 3; c++) s.lobes[0].specular[c] = ks;
            const shd_reflectance r = figures_of(&s);
            assert_true(r.unbounded && r.gains > 89 && r.gains < 90);
            const double facing = sin(degrees(90 - r.gains));
            assert_float_equal(ks * shd_phong_energy(facing, list[k]) / (SHD_PI * facing), 1, 5e-3);
        }
    subject s;
    make(&s, SHD_MODEL_BLINN_PHONG, false, true, 1e6);
    assert_true(figures_of(&s).gains > 89.99);
    make(&s, SHD_MODEL_PHONG, false, true, 1e300);
    assert_true(figures_of(&s).gains == 90);
    /* Lobes that take light away never do, nor do those whose energy is bounded. */
    for (int c = 0; c < 3; c++) s.lobes[0].specular[c] = -1;
    assert_true(isnan(figures_of(&s).gains));
    make(&s, SHD_MODEL_COOK_TORRANCE, false, true, 0.01);
    assert_true(isnan(figures_of(&s).gains));
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(quadrature_finds_bends_and_peaks),
        cmocka_unit_test(quadrature_keeps_to_its_points),
        cmocka_unit_test(lambert_sends_on_its_color),
        cmocka_unit_test(phong_lobe_is_its_closed_form),
        cmocka_unit_test(normalized_lobe_sends_on_its_color),
        cmocka_unit_test(blinn_lobe_is_its_closed_form_from_above),
        cmocka_unit_test(oren_nayar_is_its_closed_form),
        cmocka_unit_test(facets_under_light_from_above_are_simpsons_rule),
        cmocka_unit_test(terms_add_up_by_channel),
        cmocka_unit_test(wide_lobes_are_the_midpoint_rule),
        cmocka_unit_test(cancelled_albedo_says_so),
        cmocka_unit_test(limits_are_those_of_the_equations),
        cmocka_unit_test(limits_are_those_of_negative_lobes),
        cmocka_unit_test(energy_is_gained_from_where_the_closed_form_is_1),
        cmocka_unit_test(narrow_lobes_gain_energy_at_last),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
