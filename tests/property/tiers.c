/* The standard tier is the exact one to 1e-5 of the picture's maximum, for exponents up to 1000,
 * in scenes with every kind of light. */
#include "property/pieces.h"
#include "shade/packed.h"

typedef struct bounds {
    double least_shininess, most_shininess;
    double attenuation; /* share of attenuated lights */
    double hard_edges;  /* share of spots without penumbra */
} bounds;

static void write_light(FILE *out, const bounds *b, uint64_t *random) {
    static const char *const types[] = {"point", "spot", "directional"};
    int type = below(random, 3);
    bool camera = below(random, 4) == 0;
    shd_vec3 from = shd_scale(random_direction(random), uniform(random, 1.2, 8));
    fprintf(out, "{\"type\": \"%s\", \"color\": [%.17g, %.17g, %.17g], ", types[type],
            uniform(random, 0, 1), uniform(random, 0, 1), uniform(random, 0, 1));
    if (type != 2) {
        shd_vec3 at = from;
        if (camera) at.z += 4;
        write_vector(out, "position", at);
        if (uniform(random, 0, 1) < b->attenuation)
            fprintf(out, ", \"attenuation\": [%.17g, %.17g, %.17g], \"minDistance\": %.17g",
                    uniform(random, 0, 1), uniform(random, 0, 1), uniform(random, 0.01, 1),
                    uniform(random, 0, 0.5));
        fputs(", ", out);
    }
    if (type != 0) {
        shd_vec3 aim = shd_add(shd_scale(from, -1), shd_scale(random_direction(random), 0.5));
        write_vector(out, "direction", aim);
        fputs(", ", out);
    }
    if (type == 1)
        fprintf(out, "\"angle\": %.17g, \"penumbra\": %.17g, \"exponent\": %.17g, ",
                uniform(random, 5, 100),
                uniform(random, 0, 1) < b->hard_edges ? 0 : uniform(random, 0, 1),
                below(random, 2) ? uniform(random, 0, 50) : 0);
    fprintf(out, "\"frame\": \"%s\"}", camera ? "camera" : "world");
}

static void write_objects(FILE *out, const bounds *b, uint64_t *random) {
    static const char *const shapes[] = {"sphere", "box",  "cylinder", "cone",
                                         "torus",  "disc", "plane"};
    for (int i = 0; i < 8; i++) {
        shd_affine turn = random_rotation(random);
        shd_affine size = scaling(uniform(random, 0.2, 1.2), uniform(random, 0.2, 1.2),
                                  uniform(random, 0.2, 1.2));
        shd_affine map = shd_compose(&turn, &size);
        map.origin = shd_scale(random_direction(random), uniform(random, 0, 1.5));
        double ratio = b->most_shininess / b->least_shininess;
        fprintf(out, "%s{", i ? ", " : "");
        if (i < 7) {
            fprintf(out, "\"type\": \"%s\", ", shapes[i]);
        } else {
            fputs("\"type\": \"mesh\", ", out);
            write_ball(out, 16, 8, true);
            fputs(", ", out);
        }
        if (i == 6) {
            map = scaling(1, 1, 1);
            map.origin.y = -1.5;
        }
        write_transform(out, &map);
        fprintf(out,
                ", \"material\": {\"diffuse\": [%.17g, %.17g, %.17g], \"specular\": %.17g, "
                "\"shininess\": %.17g, \"lobes\": [{\"specular\": %.17g, \"shininess\": %.17g}]}}",
                uniform(random, 0, 0.8), uniform(random, 0, 0.8), uniform(random, 0, 0.8),
                uniform(random, 0, 1), b->least_shininess * pow(ratio, uniform(random, 0, 1)),
                uniform(random, 0, 1), b->least_shininess * pow(ratio, uniform(random, 0, 1)));
    }
}

static char *scene(const char *tier, uint64_t seed, const bounds *b) {
    uint64_t random = seed * 977;
    writing w;
    start(&w);
    fprintf(w.out,
            "{\"image\": {\"width\": 48, \"height\": 36, \"samples\": 1}, \"accuracy\": {\"tier\": "
            "\"%s\"}, \"ambient\": 0.1, \"lights\": [",
            tier);
    int lights = 1 + below(&random, 8);
    for (int i = 0; i < lights; i++) {
        fputs(i ? ", " : "", w.out);
        write_light(w.out, b, &random);
    }
    fputs("], \"objects\": [", w.out);
    write_objects(w.out, b, &random);
    fputs("]}", w.out);
    return finish(&w);
}

/* The worst of many scenes; geometry is the same f64 in both tiers, so nothing is left out. */
static double worst_difference(void **state, const bounds *b, int scenes) {
    double worst = 0;
    for (int seed = 1; seed <= scenes; seed++) {
        char *one = scene("exact", (uint64_t)seed, b),
             *other = scene("standard", (uint64_t)seed, b);
        sampled exact = samples_of(*state, one), standard = samples_of(*state, other);
        worst = fmax(worst, sample_difference(&exact, &standard, -1, NULL));
        drop_sampled(&exact);
        drop_sampled(&standard);
        free(one);
        free(other);
    }
    return worst;
}

/* The figure: 1e-5 of the maximum for ns <= 1000, of which the table in model.md gives
 * 2.4e-6 to the highlight of one light alone. */
static void tiers_agree_up_to_shininess_1000(void **state) {
    assert_below(worst_difference(state, &(bounds){1, 1000, 0.5, 0.2}, 60), 1e-5);
}

static void tiers_agree_on_broad_highlights(void **state) {
    assert_below(worst_difference(state, &(bounds){0.01, 10, 0.5, 0.2}, 60), 4e-6);
}

/* model.md: 3e-5 at 1e5 for one light; sums of up to eight may add up. */
static void tiers_agree_on_sharp_highlights_as_well(void **state) {
    assert_below(worst_difference(state, &(bounds){1e4, 1e5, 0.5, 0}, 30), 1e-4);
}

/* Lights are placed to twice f32's digits: beside a surface, the difference counts. */
static void light_positions_keep_48_bits(void **state) {
    (void)state;
    uint64_t random = 4;
    for (int i = 0; i < 1000; i++) {
        const shd_plan plan = {.origin = shd_scale(random_direction(&random), 3),
                               .scale = ldexp(1, below(&random, 9) - 4)};
        shd_plan_light light = {.a = 1, .gain = 1};
        light.position = shd_scale(random_direction(&random), uniform(&random, 0.1, 10));
        const shd_packed_light packed = shd_pack_light(&plan, &light);
        const double wanted[3] = {(light.position.x - plan.origin.x) * plan.scale,
                                  (light.position.y - plan.origin.y) * plan.scale,
                                  (light.position.z - plan.origin.z) * plan.scale};
        for (int c = 0; c < 3; c++) {
            double sum = (double)packed.at[c] + (double)packed.low[c];
            /* 24 bits, and 24 of what is left of at most half a step */
            assert_true(fabs(sum - wanted[c]) <= 0x1p-48 * fabs(wanted[c]));
        }
    }
}

/* A light that almost touches a surface, or is far away: 1/d^2 spans 1e56. */
static double difference_at(void **state, double distance, const char *turn, shd_vec3 place) {
    sampled got[2];
    for (int t = 0; t < 2; t++) {
        /* The light stands over the middle of the picture: where the plane, turned about x by 60
         * degrees or not, meets the axis of the camera. */
        char *json = text_of(
            "{\"image\": {\"width\": 33, \"height\": 25, \"samples\": 1}, \"accuracy\": "
            "{\"tier\": \"%s\"}, \"camera\": {\"position\": [%.17g, %.17g, %.17g], \"target\": "
            "[%.17g, %.17g, %.17g]}, \"objects\": [{\"type\": \"disc\", \"radius\": 2, "
            "\"transform\": {\"rotate\": [%s, 0, 0], \"translate\": [%.17g, %.17g, %.17g]}, "
            "\"material\": {\"specular\": 0.5}}], \"lights\": [{\"type\": \"point\", "
            "\"position\": [%.17g, %.17g, %.17g], \"attenuation\": [0, 0, 1], \"intensity\": "
            "%.17g}]}",
            t ? "standard" : "exact", place.x, place.y, place.z + 4, place.x, place.y, place.z,
            turn, place.x, place.y, place.z, place.x, place.y, place.z + distance,
            distance * distance);
        got[t] = samples_of(*state, json);
        free(json);
    }
    for (size_t k = 0; k < got[1].count; k++)
        for (int c = 0; c < 3; c++) assert_true(isfinite(got[1].radiance[k][c]));
    double difference = sample_difference(&got[0], &got[1], -1, NULL);
    drop_sampled(&got[0]);
    drop_sampled(&got[1]);
    return difference;
}

static void tiers_agree_next_to_lights_and_far_from_them(void **state) {
    /* Below 1e-7 of the scene's size f64 takes over; above it, positions of 2^-48 = 4e-15 make
     * 4e-8 of a direction and of a distance at least. The factor 1/d^2 doubles that. */
    static const double distances[] = {1e-12, 1e-9, 1e-7, 1e-6, 1e-5, 1e-4,
                                       1e-3,  0.01, 0.1,  1e4,  1e8,  1e16};
    for (size_t i = 0; i < sizeof distances / sizeof distances[0]; i++) {
        assert_below(difference_at(state, distances[i], "90", (shd_vec3){0, 0, 0}), 1e-6);
        assert_below(difference_at(state, distances[i], "60", (shd_vec3){0, 0, 0}), 1e-6);
        assert_below(difference_at(state, distances[i], "60", (shd_vec3){0.1, -0.7, 0.3}), 1e-6);
    }
}

/* Where a spot's (cos t)^exponent or a highlight falls off vertically, at 90 degrees: the middle of
 * this picture, seen from so near that cos t and R.V are below 5e-3 in it, and 1.5e-4 at least. */
static void tiers_agree_where_powers_below_1_fall_off(void **state) {
    static const char *const lights[] = {
        "{\"type\": \"spot\", \"position\": [0, 0, 1], \"direction\": [1, 0, 0], \"angle\": 120,"
        " \"exponent\": 0.1}",
        "{\"type\": \"spot\", \"position\": [0, 0, 1], \"direction\": [1, 0, 0], \"angle\": 90,"
        " \"penumbra\": 0, \"exponent\": 0.5}",
        "{\"type\": \"point\", \"position\": [1, 0, 1e-3]}"};
    for (int i = 0; i < 3; i++) {
        sampled got[2];
        for (int t = 0; t < 2; t++) {
            char *json = text_of(
                "{\"image\": {\"width\": 32, \"height\": 24, \"samples\": 1}, \"accuracy\": "
                "{\"tier\": \"%s\"}, \"camera\": {\"type\": \"orthographic\", \"height\": 0.0072}, "
                "\"objects\": [{\"type\": \"disc\", \"radius\": 2, \"transform\": {\"rotate\": "
                "[90, "
                "0, 0]}, \"material\": {\"specular\": 0.5, \"shininess\": %s}}], \"lights\": "
                "[%s]}",
                t ? "standard" : "exact", i < 2 ? "5" : "0.1", lights[i]);
            got[t] = samples_of(*state, json);
            free(json);
        }
        assert_below(sample_difference(&got[0], &got[1], -1, NULL), 1e-6); /* f32's few ulps */
        drop_sampled(&got[0]);
        drop_sampled(&got[1]);
    }
}

static void attenuation_may_have_any_unit(void **state) {
    /* Terms from 1e-30 to 1e30, with the intensity that makes up for them. */
    for (int exponent = -30; exponent <= 30; exponent += 10)
        for (int term = 0; term < 3; term++) {
            sampled got[2];
            double terms[3] = {0, 0, 0};
            terms[term] = pow(10, exponent);
            for (int t = 0; t < 2; t++) {
                char *json = text_of(
                    "{\"image\": {\"width\": 16, \"height\": 12, \"samples\": 1}, \"accuracy\": "
                    "{\"tier\": \"%s\"}, \"objects\": [{\"type\": \"sphere\", \"material\": "
                    "{\"specular\": 0.5}}], \"lights\": [{\"type\": \"point\", \"attenuation\": "
                    "[%.17g, %.17g, %.17g], \"intensity\": %.17g}]}",
                    t ? "standard" : "exact", terms[0], terms[1], terms[2], terms[term]);
                got[t] = samples_of(*state, json);
                free(json);
            }
            assert_below(sample_difference(&got[0], &got[1], -1, NULL), 1e-6); /* as above */
            drop_sampled(&got[0]);
            drop_sampled(&got[1]);
        }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(tiers_agree_up_to_shininess_1000),
        cmocka_unit_test(tiers_agree_on_broad_highlights),
        cmocka_unit_test(tiers_agree_on_sharp_highlights_as_well),
        cmocka_unit_test(light_positions_keep_48_bits),
        cmocka_unit_test(tiers_agree_next_to_lights_and_far_from_them),
        cmocka_unit_test(tiers_agree_where_powers_below_1_fall_off),
        cmocka_unit_test(attenuation_may_have_any_unit),
    };
    return cmocka_run_group_tests(tests, make_engine, drop_engine);
}
