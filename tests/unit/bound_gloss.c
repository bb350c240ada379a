/* What bounds take a lobe for that may be any between two exponents, or roughnesses: no less than
 * they take any single one of these for. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

#include "bound/light/weights.h"
#include "plan/peaks.h"
#include "plan/spread.h"

typedef struct subject {
    shd_material scene;
    shd_plan_lobe lobe;
    shd_gloss gloss;
    shd_plan_material plan;
} subject;

static void make(subject *s, shd_model model, double least, double most) {
    static const shd_texture texture;
    const bool facets = model == SHD_MODEL_COOK_TORRANCE;
    *s = (subject){.scene = {.model = model, .fresnel = {.n = {1.5, 2, 3}}},
                   .lobe = {{1, 1, 1}, facets ? least : most},
                   .gloss = {&texture, least, most}};
    s->plan =
        (shd_plan_material){.model = model, .lobes = &s->lobe, .lobe_count = 1, .from = &s->scene};
    if (least == most) return;
    s->plan.gloss = &s->gloss;
    s->plan.pointwise = true;
}

static double uniform(double low, double high) {
    return low + (high - low) * rand() / RAND_MAX;
}

static shd_glance any_glance(void) {
    const double far = pow(10, uniform(-6, 0));
    return (shd_glance){.lit = {.nearest = 1,
                                .fall_high = 1,
                                .factor_high = 1,
                                .facing_high = uniform(0, 1),
                                .shine_high = rand() % 3 ? 1 - far : uniform(0, 1)},
                        .direction = pow(10, uniform(-16, -3)),
                        .view = uniform(0.001, 1),
                        .half = uniform(0.001, 1),
                        .drifts = rand() % 2};
}

static const shd_model models[] = {SHD_MODEL_PHONG, SHD_MODEL_BLINN_PHONG,
                                   SHD_MODEL_PHONG_NORMALIZED, SHD_MODEL_COOK_TORRANCE};

static void any_between_is_within_the_bound(void **state) {
    (void)state;
    static const double slack = 1e-12;
    srand(7);
    double loosest[SHD_MODEL_COUNT] = {0};
    for (int i = 0; i < 4000; i++) {
        const shd_model model = models[i % 4];
        const bool facets = model == SHD_MODEL_COOK_TORRANCE;
        const double low = facets ? -3 : 0, high = facets ? 1 : 6, a = uniform(low, high),
                     b = rand() % 4 ? uniform(a, high) : uniform(a, a + 0.1);
        subject all;
        make(&all, model, pow(10, a), pow(10, b));
        const shd_glance g = any_glance();
        const shd_weight told = shd_weight_of(&all.plan, 1, &g, 3);
        const shd_peak peak = shd_peak_of(&all.plan, 1);
        double most = 0, error = 0;
        for (int k = 0; k <= 40; k++) {
            subject one;
            const double n =
                fmin(fmax(pow(10, a + (b - a) * k / 40), all.gloss.least), all.gloss.most);
            make(&one, model, n, n);
            /* Where a power is next to nothing, it is taken for the same of any exponent. */
            if (k && !facets && n * (1 - g.lit.shine_high) > 23) continue;
            const shd_weight w = shd_weight_of(&one.plan, 1, &g, 3);
            const shd_peak own = shd_peak_of(&one.plan, 1);
            assert_true(own.most <= peak.most * (1 + slack) &&
                        own.whole <= peak.whole * (1 + slack));
            most = fmax(most, w.most);
            error = fmax(error, w.error);
        }
        if (!(most <= told.most * (1 + slack) && error <= told.error * (1 + slack)))
            fail_msg("model %d, %g to %g: %g of %g, %g of %g", (int)model, all.gloss.least,
                     all.gloss.most, most, told.most, error, told.error);
        loosest[model] = fmax(loosest[model], told.error / error);
    }
    if (getenv("SHADED_MEASURE"))
        for (size_t k = 0; k < 4; k++) printf("%zu: %g times\n", k, loosest[models[k]]);
}

/* The other end is that of the pattern, and then what maps and bends make of it. */
static void the_widest_is_the_widest_of_all(void **state) {
    (void)state;
    subject s;
    make(&s, SHD_MODEL_PHONG, 3, 200);
    assert_true(shd_dullest(&s.plan, 0) == 3 && shd_widest(&s.plan, 0) == 3);
    s.plan.antialiased = true;
    assert_true(shd_widest(&s.plan, 0) < 3 && shd_widest(&s.plan, 0) >= 1);
    make(&s, SHD_MODEL_COOK_TORRANCE, 0.1, 0.4);
    assert_true(shd_dullest(&s.plan, 0) == 0.4);
    make(&s, SHD_MODEL_PHONG, 9, 9);
    assert_true(shd_dullest(&s.plan, 0) == 9 && shd_widest(&s.plan, 0) == 9);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(any_between_is_within_the_bound),
        cmocka_unit_test(the_widest_is_the_widest_of_all),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
