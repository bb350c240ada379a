/* The models of reflection: closed forms, energy, reciprocity, and the cases that break naive
 * formulas. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>

#include <cmocka.h>

#include "shade/brdf.h"

#if __LDBL_MANT_DIG__ == 113
typedef long double wide;
#else
typedef __float128 wide;
#endif

static const shd_vec3 UP = {0, 0, 1};

typedef struct subject {
    shd_material scene;
    shd_plan_lobe lobe;
    shd_plan_material plan;
} subject;

/* A material of one lobe of 1 and a diffuse term of 1. */
static void make(subject *s, shd_model model, double sharpness) {
    *s = (subject){.scene = {.model = model, .fresnel = {.n = {1.5, 1.5, 1.5}}},
                   .lobe = {{1, 1, 1}, sharpness}};
    s->plan = (shd_plan_material){.model = model,
                                  .diffuse = {1, 1, 1},
                                  .has_diffuse = true,
                                  .lobes = &s->lobe,
                                  .lobe_count = 1,
                                  .from = &s->scene};
}

static shd_vec3 at_angles(double polar, double azimuth) {
    return (shd_vec3){sin(polar) * cos(azimuth), sin(polar) * sin(azimuth), cos(polar)};
}

/* pi f_r N.L: of the diffuse term and the lobe. */
static void weigh(const subject *s, shd_vec3 light, shd_vec3 view, double *diffuse, double *lobe) {
    double row[SHD_BRDF_ROWS];
    shd_surface at = {.normal = UP, .view = view, .material = &s->plan};
    at.mirror = shd_sub(shd_scale(UP, 2 * shd_dot(UP, view)), view);
    *diffuse = *lobe = 0;
    if (!shd_brdf_weigh(&at, light, row)) return;
    *diffuse = row[0];
    *lobe = row[3];
}

/* What albedo_of errs by, where its grid is cut by the horizon. */
static const double HORIZON = 5e-3;

/* The share of light from `polar` that the lobe sends on: the integral of f_r N.V over V, by the
 * midpoint rule around the mirrored direction, whose square root spreads nodes as the lobe does. */
static double albedo_of(const subject *s, double polar, bool diffuse, int nodes) {
    const shd_vec3 light = at_angles(polar, 0), mirror = at_angles(-polar, 0);
    const shd_vec3 across = {cos(polar), 0, sin(polar)}, side = {0, 1, 0};
    double sum = 0;
    for (int i = 0; i < nodes; i++) {
        const double share = (i + 0.5) / nodes, t = share * share * SHD_PI;
        const double width = 2 * share * SHD_PI / nodes;
        for (int j = 0; j < nodes; j++) {
            const double turn = 2 * SHD_PI * (j + 0.5) / nodes;
            const shd_vec3 v =
                shd_madd(shd_madd(shd_scale(mirror, cos(t)), across, sin(t) * cos(turn)), side,
                         sin(t) * sin(turn));
            if (!(v.z > 0)) continue;
            double d, l;
            weigh(s, light, v, &d, &l);
            sum +=
                (diffuse ? d : l) / SHD_PI / cos(polar) * v.z * sin(t) * width * 2 * SHD_PI / nodes;
        }
    }
    return sum;
}

/* What of the circle around R at the angle t is above the horizon, times the lobe there. */
static long double circle_of(long double angle, long double t, double n) {
    const long double p = cosl(angle) * cosl(t), q = sinl(angle) * sinl(t),
                      half = p >= q    ? M_PIl
                             : p <= -q ? 0
                                       : acosl(-p / q);
    return powl(fmaxl(cosl(t), 0), (long double)n) * sinl(t) * 2 * (p * half + q * sinl(half));
}

/* The integral over [low, high] by the tanh-sinh rule, to which roots at the ends do no harm. */
static long double integrate(long double angle, double n, long double low, long double high) {
    const long double step = 1.0L / 128, middle = (low + high) / 2, reach = (high - low) / 2;
    long double sum = 0;
    for (int k = -560; k <= 560; k++) {
        const long double u = M_PI_2l * sinhl(k * step), c = coshl(u);
        const long double weight = M_PI_2l * coshl(k * step) / (c * c);
        if (weight > 0) sum += weight * circle_of(angle, middle + reach * tanhl(u), n);
    }
    return sum * step * reach;
}

/* The lobe's energy by circles around R. Those beyond the kink go below the horizon. */
static double energy_by_quadrature(double facing, double n) {
    const long double angle = acosl((long double)facing), kink = M_PI_2l - angle,
                      narrow = fminl(M_PI_2l, 12 / sqrtl(n + 1));
    if (narrow >= kink) {
        const long double after = fminl(M_PI_2l, kink + narrow);
        return (double)(integrate(angle, n, 0, kink) + integrate(angle, n, kink, after) +
                        integrate(angle, n, after, M_PI_2l));
    }
    return (double)(integrate(angle, n, 0, narrow) + integrate(angle, n, narrow, kink) +
                    integrate(angle, n, kink, M_PI_2l));
}

static void energy_of_phong_is_its_integral(void **state) {
    (void)state;
    static const double facings[] = {1, 0.999, 0.7, 0.3, 0.02, 1e-4, 0},
                        powers[] = {0, 0.3, 1, 7.7, 32, 1000};
    for (size_t i = 0; i < sizeof facings / sizeof facings[0]; i++)
        for (size_t j = 0; j < sizeof powers / sizeof powers[0]; j++) {
            const double expected = energy_by_quadrature(facings[i], powers[j]),
                         actual = shd_phong_energy(facings[i], powers[j]);
            if (!(fabs(actual - expected) <= 1e-11 * expected))
                fail_msg("E(%g, %g) is %.15g, not %.15g", facings[i], powers[j], actual, expected);
        }
}

static void energy_of_phong_has_closed_forms(void **state) {
    (void)state;
    static const double powers[] = {0, 0.5, 1, 10, 63, 64, 1e3, 1e6};
    for (size_t j = 0; j < sizeof powers / sizeof powers[0]; j++) {
        const double n = powers[j];
        const double upright = 2 * SHD_PI / (n + 2);
        assert_true(fabs(shd_phong_energy(1, n) - upright) <= 1e-14 * upright);
        /* At the horizon half of the lobe is left: 2 W(n) / (n + 2), W(n) Wallis's integral. */
        const double wallis = sqrt(SHD_PI) / 2 * exp(lgamma((n + 1) / 2) - lgamma(n / 2 + 1));
        const double level = 2 * wallis / (n + 2);
        assert_true(fabs(shd_phong_energy(0, n) - level) <= 1e-9 * level); /* lgamma's digits */
    }
    /* A lobe of exponent 0 is the half of the sphere around R: pi (1 + N.L) / 2 of N.V is in it. */
    for (double c = 0; c <= 1; c += 0.125)
        assert_true(fabs(shd_phong_energy(c, 0) - SHD_PI * (1 + c) / 2) < 1e-13);
}

static void normalized_phong_sends_on_all_light(void **state) {
    (void)state;
    static const double powers[] = {0, 1, 12.5, 200}, angles[] = {0, 0.6, 1.2, 1.5};
    for (size_t j = 0; j < 4; j++)
        for (size_t i = 0; i < 4; i++) {
            subject s;
            make(&s, SHD_MODEL_PHONG_NORMALIZED, powers[j]);
            const double albedo = albedo_of(&s, angles[i], false, 1200);
            if (!(fabs(albedo - 1) < HORIZON))
                fail_msg("n %g, %g rad: %g", powers[j], angles[i], albedo);
        }
}

static void no_model_of_facets_gains_energy(void **state) {
    (void)state;
    static const double slopes[] = {0.05, 0.2, 0.5, 1, 3}, angles[] = {0, 0.6, 1.2, 1.5, 1.56};
    for (size_t j = 0; j < 5; j++)
        for (size_t i = 0; i < 5; i++) {
            subject s;
            make(&s, SHD_MODEL_COOK_TORRANCE, slopes[j]);
            for (int c = 0; c < 3; c++) s.scene.fresnel.n[c] = INFINITY; /* a mirror */
            const double albedo = albedo_of(&s, angles[i], false, 600);
            if (!(albedo <= 1 + HORIZON))
                fail_msg("slope %g, %g rad: %g", slopes[j], angles[i], albedo);
            make(&s, SHD_MODEL_OREN_NAYAR, 0);
            s.scene.sigma = slopes[j] < 1.5 ? slopes[j] : SHD_PI / 2;
            const double dull = albedo_of(&s, angles[i], true, 300);
            /* A + B / 2 at grazing light is largest at sigma = 0.2: shade/brdf.h tells. */
            if (!(dull <= 1.0155 + HORIZON))
                fail_msg("sigma %g, %g rad: %g", s.scene.sigma, angles[i], dull);
        }
}

static void oren_nayar_without_roughness_is_lambert(void **state) {
    (void)state;
    subject s;
    make(&s, SHD_MODEL_OREN_NAYAR, 0);
    for (double a = 0.1; a < 1.5; a += 0.2) {
        double diffuse, lobe;
        weigh(&s, at_angles(a, 1), at_angles(1.4 - a / 2, 2.5), &diffuse, &lobe);
        assert_true(diffuse == at_angles(a, 1).z);
    }
}

/* f_r(L, V) = f_r(V, L) of what its authors made reciprocal. */
static void reciprocity_holds_where_it_should(void **state) {
    (void)state;
    static const shd_model models[] = {SHD_MODEL_OREN_NAYAR, SHD_MODEL_COOK_TORRANCE};
    for (size_t m = 0; m < 2; m++)
        for (double a = 0.05; a < 1.55; a += 0.21)
            for (double b = 0.1; b < 1.55; b += 0.17) {
                subject s;
                make(&s, models[m], 0.3);
                s.scene.sigma = 0.5;
                const shd_vec3 x = at_angles(a, 0.3), y = at_angles(b, 2.2);
                double d1, d2, l1, l2;
                weigh(&s, x, y, &d1, &l1);
                weigh(&s, y, x, &d2, &l2);
                const double one = (m ? l1 : d1) / x.z, other = (m ? l2 : d2) / y.z;
                assert_true(fabs(one - other) <= 1e-12 * fmax(one, other));
            }
}

static void hard_cases_are_finite(void **state) {
    (void)state;
    static const double sharp[] = {0, 1e-4, 1, 10, 1e6};
    static const double angles[] = {0, 1e-9, 0.7, SHD_PI / 2 - 1e-9, SHD_PI / 2, 2, SHD_PI};
    for (shd_model model = SHD_MODEL_PHONG; model <= SHD_MODEL_COOK_TORRANCE; model++)
        for (size_t k = 0; k < 5; k++)
            for (size_t i = 0; i < 7; i++)
                for (size_t j = 0; j < 7; j++)
                    for (double turn = 0; turn < 4; turn += SHD_PI / 2) {
                        if (model == SHD_MODEL_COOK_TORRANCE && (k == 0 || k == 4)) continue;
                        subject s;
                        make(&s, model, sharp[k]);
                        s.scene.sigma = SHD_PI / 2;
                        const shd_vec3 light = at_angles(angles[i], 0);
                        double diffuse, lobe;
                        weigh(&s, light, at_angles(angles[j], turn), &diffuse, &lobe);
                        assert_true(isfinite(diffuse) && isfinite(lobe));
                        assert_true(diffuse >= 0 && lobe >= 0);
                        if (!(light.z > 0)) assert_true(diffuse == 0 && lobe == 0);
                    }
}

static void lobes_peak_where_they_should(void **state) {
    (void)state;
    /* L = V: Blinn's H is N only along N. A mirror direction is the top of all lobes. */
    for (double n = 0; n <= 1e6; n = 10 * n + 1) {
        subject s;
        double diffuse, lobe;
        make(&s, SHD_MODEL_BLINN_PHONG, n);
        weigh(&s, UP, UP, &diffuse, &lobe);
        assert_true(lobe == 1);
        weigh(&s, at_angles(0.8, 0), at_angles(0.8, SHD_PI), &diffuse, &lobe);
        assert_true(fabs(lobe - 1) < 1e-9);
        make(&s, SHD_MODEL_PHONG_NORMALIZED, n);
        weigh(&s, UP, UP, &diffuse, &lobe);
        assert_true(fabs(lobe - (n + 2) / 2) <= 1e-9 * (n + 2)); /* pi / E(1, n) */
    }
    subject s;
    double diffuse, lobe;
    make(&s, SHD_MODEL_COOK_TORRANCE, 0.1);
    weigh(&s, UP, UP, &diffuse, &lobe);
    assert_true(fabs(lobe - 0.04 * 100 / 4) < 1e-12); /* F D / 4 */
}

static void fresnel_has_its_known_values(void **state) {
    (void)state;
    const shd_fresnel glass = {.n = {1.5, 1.5, 1.5}}, mirror = {.n = {INFINITY, 1, 1}};
    assert_true(fabs(shd_fresnel_reflectance(&glass, 0, 1) - 0.04) < 1e-15);
    assert_true(shd_fresnel_reflectance(&glass, 0, 0) == 1);
    /* At Brewster's angle, tan = n, only the part across is mirrored: ((n^2 - 1) / (n^2 + 1))^2. */
    const double brewster = 1 / sqrt(1 + 2.25), across = 1.25 / 3.25;
    assert_true(fabs(shd_fresnel_reflectance(&glass, 0, brewster) - across * across / 2) < 1e-15);
    assert_true(shd_fresnel_reflectance(&mirror, 0, 0.3) == 1);
    assert_true(shd_fresnel_reflectance(&mirror, 1, 0.3) < 1e-15); /* n = 1 mirrors nothing */
    const shd_fresnel *gold = shd_metal_find("gold");
    assert_true(shd_fresnel_reflectance(gold, 0, 1) > 0.9);
    assert_null(shd_metal_find("cheese"));
}

/* Fresnel's two amplitudes with a complex index, in 113 bits. */
static double fresnel_in_113_bits(double n, double k, double cosine) {
    const wide c = cosine, s2 = (1 - c) * (1 + c), real = (wide)n * n - (wide)k * k - s2,
               half = (wide)n * k;
    /* a + ib = sqrt(real + 2 i half), by Newton's steps from f64. */
    const double size = hypot((double)real, 2 * (double)half);
    wide a = sqrt(fmax((size + (double)real) / 2, 0)), b = sqrt(fmax((size - (double)real) / 2, 0));
    if (real < 0)
        a = b > 0 ? half / b : 0;
    else
        b = a > 0 ? half / a : 0;
    for (int i = 0; i < 4; i++) { /* z <- (z + w / z) / 2 */
        const wide below = a * a + b * b;
        if (!(below > 0)) break;
        const wide x = (real * a + 2 * half * b) / below, y = (2 * half * a - real * b) / below;
        a = (a + x) / 2;
        b = (b + y) / 2;
    }
    const wide across = ((a - c) * (a - c) + b * b) / ((a + c) * (a + c) + b * b),
               along = ((a * c - s2) * (a * c - s2) + b * b * c * c) /
                       ((a * c + s2) * (a * c + s2) + b * b * c * c);
    return (double)(across * (1 + along) / 2);
}

/* The largest error is where nearly all is mirrored: at n < 1, beyond the angle that lets no light
 * in, whose distance is rounded. */
static void fresnel_keeps_its_digits(void **state) {
    (void)state;
    static const double ks[] = {0, 1e-12, 1e-5, 2e-4, 0.1, 2, 9, 1e6};
    double most = 0;
    for (double n = 1e-3; n <= 1e6; n *= 1.37)
        for (size_t i = 0; i < sizeof ks / sizeof ks[0]; i++)
            for (double c = 1; c > 1e-9; c *= 0.83) {
                const shd_fresnel index = {.n = {n, n, n}, .k = {ks[i], ks[i], ks[i]}};
                const double expected = fresnel_in_113_bits(n, ks[i], c),
                             actual = shd_fresnel_reflectance(&index, 0, c);
                assert_true(actual >= 0 && actual <= 1 + 1e-15);
                most = fmax(most, fabs(actual - expected));
            }
    if (!(most < 1e-13)) fail_msg("off by %g", most);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(energy_of_phong_is_its_integral),
        cmocka_unit_test(energy_of_phong_has_closed_forms),
        cmocka_unit_test(normalized_phong_sends_on_all_light),
        cmocka_unit_test(no_model_of_facets_gains_energy),
        cmocka_unit_test(oren_nayar_without_roughness_is_lambert),
        cmocka_unit_test(reciprocity_holds_where_it_should),
        cmocka_unit_test(hard_cases_are_finite),
        cmocka_unit_test(lobes_peak_where_they_should),
        cmocka_unit_test(fresnel_has_its_known_values),
        cmocka_unit_test(fresnel_keeps_its_digits),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
