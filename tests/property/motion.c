/* The picture does not know where the scene is: moved, turned, scaled or mirrored together with
 * its camera and lights, it stays the same. */
#include "property/pieces.h"

/* What is applied to a whole scene. */
typedef struct move {
    shd_affine map;
    double size; /* its scale: attenuation and distances follow */
} move;

typedef enum attenuation { CONSTANT, SQUARE, MIXED } attenuation;

typedef struct stage {
    const char *tier;
    uint64_t seed;
    bool orthographic, mesh;
    attenuation attenuation;
} stage;

static shd_affine moved(const move *m, const shd_affine *base) {
    return shd_compose(&m->map, base);
}

static void write_camera(FILE *out, const stage *s, const move *m) {
    shd_vec3 direction = {0, 0, 0};
    shd_normalize(shd_linear(&m->map, (shd_vec3){0, 1, 0}), &direction);
    fprintf(out, "\"camera\": {\"type\": \"%s\", ",
            s->orthographic ? "orthographic" : "perspective");
    write_vector(out, "position", shd_transform(&m->map, (shd_vec3){0, 0.5, 5}));
    fputs(", ", out);
    write_vector(out, "target", shd_transform(&m->map, (shd_vec3){0, 0, 0}));
    fputs(", ", out);
    write_vector(out, "up", direction);
    if (s->orthographic)
        fprintf(out, ", \"height\": %.17g}", 4 * m->size);
    else
        fputs(", \"fov\": 45}", out);
}

static void write_lights(FILE *out, const stage *s, const move *m, uint64_t *random) {
    fputs("\"lights\": [", out);
    for (int i = 0; i < 6; i++) {
        shd_vec3 from = shd_scale(random_direction(random), uniform(random, 2, 5));
        shd_vec3 toward = {0, 0, 0};
        shd_normalize(shd_linear(&m->map, shd_scale(from, -1)), &toward);
        fprintf(out, "%s{\"intensity\": %.17g, ", i ? ", " : "", uniform(random, 0.2, 1));
        if (i % 3 == 0) {
            fputs("\"type\": \"directional\", ", out);
            write_vector(out, "direction", toward);
            fputs("}", out);
            continue;
        }
        fprintf(out, "\"type\": \"%s\", ", i % 3 == 1 ? "point" : "spot");
        write_vector(out, "position", shd_transform(&m->map, from));
        double b = s->attenuation == MIXED ? 0.2 : 0, c = s->attenuation != CONSTANT ? 0.1 : 0;
        double a = s->attenuation == SQUARE ? 0 : 0.5;
        fprintf(out, ", \"attenuation\": [%.17g, %.17g, %.17g], \"minDistance\": %.17g", a,
                b / m->size, c / m->size / m->size, 0.125 * m->size);
        if (i % 3 == 2) {
            fputs(", ", out);
            write_vector(out, "direction", toward);
            fputs(", \"angle\": 40, \"penumbra\": 0.5, \"exponent\": 3", out);
        }
        fputs("}", out);
    }
    fputs("]", out);
}

static const char *const shapes[] = {"sphere", "box", "cylinder", "cone", "torus", "disc"};

static void write_objects(FILE *out, const stage *s, const move *m, uint64_t *random) {
    fputs("\"objects\": [", out);
    for (int i = 0; i < 6; i++) {
        shd_affine turn = random_rotation(random);
        shd_affine size =
            scaling(uniform(random, 0.3, 1), uniform(random, 0.3, 1) * (i % 2 ? -1 : 1),
                    uniform(random, 0.3, 1));
        shd_affine base = shd_compose(&turn, &size);
        base.origin = (shd_vec3){uniform(random, -1.5, 1.5), uniform(random, -0.8, 1.2),
                                 uniform(random, -1, 1)};
        shd_affine map = moved(m, &base);
        fprintf(out, "%s{\"type\": \"%s\", ", i ? ", " : "", s->mesh ? "mesh" : shapes[i]);
        if (s->mesh) write_ball(out, 12, 6, true), fputs(", ", out);
        write_transform(out, &map);
        fprintf(out,
                ", \"material\": {\"ambient\": 0.1, \"diffuse\": [%.17g, 0.5, 0.3], \"specular\": "
                "0.4, \"shininess\": %d}}",
                uniform(random, 0.1, 0.9), 10 << (i % 3 * 2));
    }
    if (!s->mesh) {
        shd_affine base = scaling(1, 1, 1);
        base.origin.y = -1.25;
        shd_affine map = moved(m, &base);
        fputs(", {\"type\": \"plane\", ", out);
        write_transform(out, &map);
        fputs("}", out);
    }
    fputs("]", out);
}

static char *scene(const stage *s, const move *m) {
    uint64_t random = s->seed;
    writing w;
    start(&w);
    fprintf(w.out,
            "{\"image\": {\"width\": 48, \"height\": 36, \"samples\": 1}, \"ambient\": 0.2, "
            "\"accuracy\": {\"tier\": \"%s\"}, ",
            s->tier);
    write_camera(w.out, s, m);
    fputs(", ", w.out);
    write_lights(w.out, s, m, &random);
    fputs(", ", w.out);
    write_objects(w.out, s, m, &random);
    fputs("}", w.out);
    return finish(&w);
}

static sampled take(void **state, const stage *s, const move *m) {
    char *json = scene(s, m);
    sampled out = samples_of(*state, json);
    free(json);
    return out;
}

static const move still = {{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0, 0, 0}}, 1};

static void moving_and_turning_everything_changes_nothing(void **state) {
    uint64_t random = 11;
    for (uint64_t seed = 1; seed <= 10; seed++) {
        stage s = {.tier = "exact",
                   .seed = seed,
                   .orthographic = seed % 2,
                   .attenuation = (attenuation)(seed % 3)};
        move m = {random_rotation(&random), 1};
        m.map.origin = shd_scale(random_direction(&random), 10);
        sampled a = take(state, &s, &still), b = take(state, &s, &m);
        /* Coordinates near 10 have steps of 1.8e-15; a grazing ray (N.V = 0.05) carries 20 times
         * that along, thin shapes (0.3) turn normals by three times more, a highlight of 160
         * multiplies by its exponent: 1e-11, with room for sums. */
        size_t strays;
        assert_below(sample_difference(&a, &b, 0.05, &strays), 1e-9);
        assert_int_equal(strays, 0);
        drop_sampled(&a);
        drop_sampled(&b);
    }
}

static void moving_meshes_moves_the_picture_with_them(void **state) {
    uint64_t random = 12;
    for (uint64_t seed = 1; seed <= 4; seed++) {
        stage s = {.tier = "exact", .seed = seed, .mesh = true};
        move m = {random_rotation(&random), 1};
        m.map.origin = shd_scale(random_direction(&random), 10);
        sampled a = take(state, &s, &still), b = take(state, &s, &m);
        size_t strays;
        assert_below(sample_difference(&a, &b, 0.05, &strays), 1e-9); /* as for shapes */
        assert_int_equal(strays, 0);
        drop_sampled(&a);
        drop_sampled(&b);
    }
}

static void scaling_by_a_power_of_two_changes_no_bit(void **state) {
    static const int exponents[] = {-60, -20, -1, 1, 3, 30, 60};
    static const char *const tiers[] = {"exact", "standard"};
    for (size_t k = 0; k < sizeof exponents / sizeof exponents[0]; k++)
        for (int v = 0; v < 4; v++) {
            stage s = {.tier = tiers[v % 2],
                       .seed = 20 + k,
                       .orthographic = k % 2,
                       .attenuation = v / 2 ? SQUARE : CONSTANT};
            double size = ldexp(1, exponents[k]);
            move m = {scaling(size, size, size), size};
            sampled a = take(state, &s, &still), b = take(state, &s, &m);
            assert_true(largest_of(&a) > 0);
            for (size_t i = 0; i < a.count; i++) {
                assert_int_equal(a.seen.object[i], b.seen.object[i]);
                for (int c = 0; c < 3; c++) assert_true(a.radiance[i][c] == b.radiance[i][c]);
            }
            drop_sampled(&a);
            drop_sampled(&b);
        }
}

static void scaling_with_mixed_attenuation_rounds_last_digits_only(void **state) {
    for (int exponent = -20; exponent <= 20; exponent += 8) {
        stage s = {.tier = "exact", .seed = 31, .attenuation = MIXED};
        double size = ldexp(1, exponent);
        move m = {scaling(size, size, size), size};
        sampled a = take(state, &s, &still), b = take(state, &s, &m);
        /* The three terms are divided by another one of them: some rounding errors of 2^-53. */
        assert_below(sample_difference(&a, &b, -1, NULL), 1e-14);
        drop_sampled(&a);
        drop_sampled(&b);
    }
}

static void a_scene_of_any_size_looks_the_same(void **state) {
    static const double sizes[] = {1e-20, 1e-12, 1e-3, 7, 1e6, 1e20};
    static const char *const tiers[] = {"exact", "standard"};
    for (size_t k = 0; k < sizeof sizes / sizeof sizes[0]; k++)
        for (int v = 0; v < 6; v++) {
            stage s = {.tier = tiers[v % 2],
                       .seed = 40 + k,
                       .orthographic = k % 2,
                       .attenuation = (attenuation)(v / 2)};
            move m = {scaling(sizes[k], sizes[k], sizes[k]), sizes[k]};
            sampled a = take(state, &s, &still), b = take(state, &s, &m);
            /* Exact: rounding only, see above. Standard: f32 positions land on other steps of
             * 2^-24; the spot's fade and the highlight make 5e-7 of that, measured. */
            size_t strays;
            double difference = sample_difference(&a, &b, 0.05, &strays);
            assert_below(difference, v % 2 ? 1e-6 : 1e-9);
            assert_int_equal(strays, 0);
            drop_sampled(&a);
            drop_sampled(&b);
        }
}

static void meshes_of_any_size_look_the_same(void **state) {
    static const double sizes[] = {1e-20, 0x1p-40, 8, 1e20};
    for (size_t k = 0; k < sizeof sizes / sizeof sizes[0]; k++) {
        stage s = {.tier = "exact", .seed = 50 + k, .mesh = true, .attenuation = SQUARE};
        move m = {scaling(sizes[k], sizes[k], sizes[k]), sizes[k]};
        sampled a = take(state, &s, &still), b = take(state, &s, &m);
        size_t strays;
        assert_below(sample_difference(&a, &b, 0.05, &strays), 1e-9); /* as for motion */
        assert_int_equal(strays, 0);
        drop_sampled(&a);
        drop_sampled(&b);
    }
}

/* Sample i seen in a mirror, for pictures with one sample a pixel. */
static void flip(sampled *s) {
    int width = s->request->scene->raster.w;
    for (size_t i = 0; i < s->count; i++) {
        size_t x = i % (size_t)width, other = i - x + (size_t)width - 1 - x;
        if (other <= i) continue;
        for (int c = 0; c < 3; c++) {
            double radiance = s->radiance[i][c], n = s->seen.normal[c][i], v = s->seen.view[c][i];
            s->radiance[i][c] = s->radiance[other][c], s->radiance[other][c] = radiance;
            s->seen.normal[c][i] = s->seen.normal[c][other], s->seen.normal[c][other] = n;
            s->seen.view[c][i] = s->seen.view[c][other], s->seen.view[c][other] = v;
        }
        int32_t object = s->seen.object[i];
        s->seen.object[i] = s->seen.object[other], s->seen.object[other] = object;
    }
}

static void a_mirrored_scene_gives_the_mirrored_picture(void **state) {
    for (uint64_t seed = 60; seed < 66; seed++) {
        stage s = {.tier = "exact", .seed = seed, .orthographic = seed % 2, .attenuation = MIXED};
        move m = {scaling(-1, 1, 1), 1};
        sampled a = take(state, &s, &still), b = take(state, &s, &m);
        flip(&b);
        assert_below(sample_difference(&a, &b, 0.05, NULL), 1e-9); /* as for motion */
        drop_sampled(&a);
        drop_sampled(&b);

        s.mesh = true;
        a = take(state, &s, &still), b = take(state, &s, &m);
        flip(&b);
        size_t strays;
        assert_below(sample_difference(&a, &b, 0.05, &strays), 1e-9);
        assert_int_equal(strays, 0);
        drop_sampled(&a);
        drop_sampled(&b);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(moving_and_turning_everything_changes_nothing),
        cmocka_unit_test(moving_meshes_moves_the_picture_with_them),
        cmocka_unit_test(scaling_by_a_power_of_two_changes_no_bit),
        cmocka_unit_test(scaling_with_mixed_attenuation_rounds_last_digits_only),
        cmocka_unit_test(a_scene_of_any_size_looks_the_same),
        cmocka_unit_test(meshes_of_any_size_look_the_same),
        cmocka_unit_test(a_mirrored_scene_gives_the_mirrored_picture),
    };
    return cmocka_run_group_tests(tests, make_engine, drop_engine);
}
