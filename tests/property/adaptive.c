/* Fewer samples than the pattern has, within the plan's tolerance of it: over scenes with all that
 * could be missed between pixel centres, and a pixel's verdict does not know the region. */
#include "property/pieces.h"
#include "render/shown.h"
#include "sanitized.h"

enum { SIDE = 96 };

static const char *const lights[] = {
    "{\"type\": \"directional\", \"direction\": [%g, -1, -0.5], \"color\": [1, 0.9, 0.8]}",
    "{\"type\": \"point\", \"position\": [%g, 2, 3]}",
    "{\"type\": \"point\", \"position\": [%g, 1.1, 0.6], \"attenuation\": [0, 0, 1]}",
    "{\"type\": \"spot\", \"position\": [%g, 0, 4], \"direction\": [0, 0, -1], \"angle\": 9, "
    "\"penumbra\": 0}",
    "{\"type\": \"spot\", \"position\": [%g, 0.1, 4], \"direction\": [0, 0, -1], \"angle\": 0.3}",
    "{\"type\": \"spot\", \"position\": [%g, 3, 2], \"direction\": [0, -1, -0.7], \"angle\": 40, "
    "\"penumbra\": 1, \"exponent\": 400}"};
enum { LIGHTS = sizeof lights / sizeof lights[0] };

static const char *const shapes[] = {"sphere", "box", "cylinder", "cone", "torus", "disc"};
static const double exponents[] = {0.3, 1, 10, 50, 300, 3000, 1e5, 1e6};

static char *random_scene(uint64_t *random, int samples, const char *region) {
    writing w;
    start(&w);
    fprintf(w.out,
            "{\"image\": {\"width\": %d, \"height\": %d, \"samples\": %d%s}, \"ambient\": 0.05, "
            "\"background\": [0.1, 0.2, 0.3], \"camera\": {\"position\": [0, 0, 4], \"fov\": %g}, "
            "\"lights\": [",
            SIDE, SIDE, samples, region, uniform(random, 15, 60));
    const int count = 1 + below(random, 4);
    for (int i = 0; i < count; i++) {
        if (i) fputs(", ", w.out);
        fprintf(w.out, lights[below(random, LIGHTS)], uniform(random, -1, 1));
    }
    fputs("], \"objects\": [", w.out);
    const int objects = 1 + below(random, 3);
    for (int i = 0; i < objects; i++)
        fprintf(w.out,
                "%s{\"type\": \"%s\", \"material\": {\"diffuse\": [%g, %g, %g], \"specular\": %g, "
                "\"shininess\": %g}, \"transform\": {\"scale\": %g, \"rotate\": [%g, %g, %g], "
                "\"translate\": [%g, %g, 0]}}",
                i ? ", " : "", shapes[below(random, 6)], uniform(random, 0, 1),
                uniform(random, 0, 1), uniform(random, 0, 1), uniform(random, 0, 1),
                exponents[below(random, 8)], uniform(random, 0.3, 1.2), uniform(random, 0, 360),
                uniform(random, 0, 360), uniform(random, 0, 360), uniform(random, -0.7, 0.7),
                uniform(random, -0.7, 0.7));
    fputs("]}", w.out);
    return finish(&w);
}

/* As film_of, with every sample where `full`. */
static drawn draw(shd_engine *engine, const char *json, bool full) {
    drawn d = {.request = read_scene(engine, json)};
    shd_sight *sight = NULL;
    shd_error error = {SHD_OK, "", ""};
    if (shd_request_plan_make(d.request, d.request->scene, &error) ||
        shd_sight_new(d.request->plan, NULL, d.request->arena, &sight, &error))
        fail_msg("%s: %s", error.path, error.text);
    shd_plan plan = *d.request->plan;
    if (full) plan.sampling_absolute = plan.sampling_relative = 0;
    const shd_plan *own = d.request->plan;
    d.request->plan = &plan;
    shd_status status = shd_film_render(d.request, sight, NULL, NULL, &d.film, &error);
    d.request->plan = own;
    if (status != SHD_OK) fail_msg("%s: %s", error.path, error.text);
    return d;
}

/* The largest error as a share of the tolerance, and how many pixels differ at all. */
static double share_of_tolerance(const drawn *full, const drawn *some, size_t *different) {
    const shd_plan *plan = some->request->plan;
    if (!(plan->sampling_absolute > 0)) { /* only shapes that are not convex */
        assert_true(same_film(full, some));
        return 0;
    }
    double worst = 0;
    for (size_t i = 0; i < 4 * pixels_of(full); i++) {
        const double a = (double)full->film.rgba[i], b = (double)some->film.rgba[i];
        worst = fmax(worst, fabs(a - b) / (plan->sampling_absolute + plan->sampling_relative * a +
                                           1e-6 * fabs(a)));
        if (a != b) ++*different;
    }
    return worst;
}

static void fewer_samples_stay_within_the_tolerance(void **state) {
    static const int patterns[] = {2, 3, 4, 7, 16, 64};
    uint64_t random = 11;
    double worst = 0;
    size_t different = 0;
    const int scenes = SHD_SANITIZED ? 60 : 300;
    for (int i = 0; i < scenes; i++) {
        char *json = random_scene(&random, patterns[i % 6], "");
        drawn full = draw(*state, json, true), some = draw(*state, json, false);
        const double share = share_of_tolerance(&full, &some, &different);
        if (share > 1) fail_msg("scene %d: %g of the tolerance: %s", i, share, json);
        worst = fmax(worst, share);
        drop_drawn(&full);
        drop_drawn(&some);
        free(json);
    }
    if (getenv("SHADED_MEASURE"))
        printf("worst %.3g of the tolerance, %zu values differ\n", worst, different);
    assert_true(different >
                50000u * (unsigned)scenes / 300); /* it is not the full pattern everywhere */
}

static void regions_are_crops(void **state) {
    static const int regions[][4] = {
        {0, 0, SIDE, SIDE}, {31, 31, 2, 2}, {32, 32, 32, 32}, {5, 40, 60, 1}, {33, 7, 20, 57}};
    for (int k = 0; k < (SHD_SANITIZED ? 5 : 20); k++) {
        drawn whole = {0};
        for (int r = 0; r < 5; r++) {
            const int *at = regions[r];
            char *region = text_of(", \"region\": [%d, %d, %d, %d]", at[0], at[1], at[2], at[3]);
            uint64_t random = 100 + (uint64_t)k;
            char *json = random_scene(&random, 4, region);
            drawn part = draw(*state, json, false);
            if (r == 0) {
                whole = part;
            } else {
                for (int y = 0; y < at[3]; y++)
                    assert_memory_equal(part.film.rgba + 4 * y * at[2],
                                        whole.film.rgba + 4 * ((at[1] + y) * SIDE + at[0]),
                                        16 * (size_t)at[2]);
                drop_drawn(&part);
            }
            free(json);
            free(region);
        }
        drop_drawn(&whole);
    }
}

/* Adaptive sampling is for pictures whose codes hide it. */
static void floats_and_the_exact_tier_take_every_sample(void **state) {
    static const char *const rests[] = {"\"output\": {\"format\": \"exr\"}",
                                        "\"output\": {\"format\": \"png\", \"bitDepth\": 16}",
                                        "\"accuracy\": {\"tier\": \"exact\"}"};
    for (int i = 0; i < 3; i++) {
        char *json = text_of("{\"image\": {\"width\": 64, \"height\": 64, \"samples\": 4}, "
                             "\"objects\": [{\"type\": \"sphere\"}], %s}",
                             rests[i]);
        drawn full = draw(*state, json, true), some = draw(*state, json, false);
        assert_true(same_film(&full, &some));
        drop_drawn(&full);
        drop_drawn(&some);
        free(json);
    }
}

/* Whole pixels of 48 samples leave gaps in chunks, and every chunk of this tile sees smooth and
 * flat objects after pixels that one sample settled. */
static void tiles_of_many_runs_are_whole(void **state) {
    static const double boxes[][5] = {
        {3.8, 3.8, -12.5, 12.5, 0}, {1, 32, 4.5, 0, 0},  {1, 1, 14.5, -15.5, 0}, {1, 32, 9.5, 0, 1},
        {1, 1, 15.5, -15.5, 1},     {15, 23, -8, -4, 1}, {7, 7, -4, 12, 1}};
    for (int samples = 2; samples <= 64; samples++) {
        writing w;
        start(&w);
        fprintf(w.out,
                "{\"camera\": {\"type\": \"orthographic\", \"position\": [0, 0, 50], \"height\": "
                "32}, \"image\": {\"width\": 32, \"height\": 32, \"samples\": %d}, \"objects\": [",
                samples);
        for (int i = 0; i < 7; i++)
            fprintf(w.out,
                    "%s{\"type\": \"box\", \"size\": [%g, %g, 1], \"transform\": {\"translate\": "
                    "[%g, %g, 0]}, \"interpolation\": \"%s\"}",
                    i ? ", " : "", boxes[i][0], boxes[i][1], boxes[i][2], boxes[i][3],
                    boxes[i][4] > 0 ? "flat" : "phong");
        fputs("]}", w.out);
        char *json = finish(&w);
        drawn full = draw(*state, json, true), some = draw(*state, json, false);
        size_t different = 0;
        assert_true(share_of_tolerance(&full, &some, &different) <= 1);
        drop_drawn(&full);
        drop_drawn(&some);
        free(json);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(fewer_samples_stay_within_the_tolerance),
        cmocka_unit_test(regions_are_crops),
        cmocka_unit_test(tiles_of_many_runs_are_whole),
        cmocka_unit_test(floats_and_the_exact_tier_take_every_sample),
    };
    return cmocka_run_group_tests(tests, make_engine, drop_engine);
}
