/* Layers of data say where and what the nearest sample of a pixel sees, from any camera, in every
 * tier; and highlights' bounds hold. */
#include "bound/light/pieces.h"
#include "property/pieces.h"

static char *scene(uint64_t seed, const char *tier, int samples, bool layers) {
    uint64_t random = seed * 131 + 7;
    writing w;
    start(&w);
    fprintf(w.out,
            "{\"accuracy\": {\"tier\": \"%s\"}, \"image\": {\"width\": 40, \"height\": 30, "
            "\"samples\": %d}, \"camera\": {\"type\": \"%s\", ",
            tier, samples, below(&random, 2) ? "perspective" : "orthographic");
    write_vector(w.out, "position", shd_scale(random_direction(&random), 4));
    fputs(", ", w.out);
    write_vector(w.out, "up", random_direction(&random));
    fprintf(w.out, "}, \"output\": {\"format\": \"exr\"%s}, \"objects\": [",
            layers ? ", \"layers\": [\"normal\", \"position\", \"depth\", \"object\"]" : "");
    static const char *const shapes[] = {"sphere", "torus", "box"};
    for (int i = 0; i < 3; i++) {
        shd_affine map = random_rotation(&random);
        map.origin = shd_scale(random_direction(&random), 0.5);
        fprintf(w.out, "%s{\"type\": \"%s\", ", i ? ", " : "", shapes[i]);
        write_transform(w.out, &map);
        fputs("}", w.out);
    }
    fputs("]}", w.out);
    return finish(&w);
}

/* Of one sample a pixel: the same that sampling alone sees. */
static void layers_are_what_samples_see(void **state) {
    static const char *const tiers[] = {"exact", "standard"};
    size_t seen = 0;
    for (uint64_t seed = 0; seed < 40; seed++) {
        char *plain = scene(seed, "exact", 1, false);
        sampled s = samples_of(*state, plain);
        const shd_camera camera = s.request->scene->camera;
        for (int t = 0; t < 2; t++) {
            char *json = scene(seed, tiers[t], 1, true);
            drawn d = film_of(*state, json);
            for (size_t i = 0; i < s.count; i++) {
                assert_true((double)d.film.object[i] == (double)s.seen.object[i]);
                if (s.seen.object[i] == SHD_NOTHING) {
                    assert_true(isinf(d.film.depth[i]));
                    continue;
                }
                double depth = 0;
                const double eye[3] = {camera.position.x, camera.position.y, camera.position.z},
                             back[3] = {camera.back.x, camera.back.y, camera.back.z};
                for (size_t c = 0; c < 3; c++) {
                    const double p = s.seen.position[c][i], n = s.seen.normal[c][i];
                    depth += (eye[c] - p) * back[c];
                    /* Of f32, of coordinates up to 2. */
                    assert_below(fabs((double)d.film.position[3 * i + c] - p), 1e-6);
                    assert_below(fabs((double)d.film.normal[3 * i + c] - n), 1e-6);
                }
                assert_below(fabs((double)d.film.depth[i] - depth), 2e-6);
                seen++;
            }
            drop_drawn(&d);
            free(json);
        }
        drop_sampled(&s);
        free(plain);
    }
    assert_true(seen > 10000);
}

/* Of several: the nearest of them. */
static void layers_take_the_nearest_sample(void **state) {
    enum { SAMPLES = 4 };
    for (uint64_t seed = 0; seed < 10; seed++) {
        char *plain = scene(seed, "exact", SAMPLES, false);
        char *json = scene(seed, "exact", SAMPLES, true);
        sampled s = samples_of(*state, plain);
        drawn d = film_of(*state, json);
        const shd_camera *camera = &s.request->scene->camera;
        for (size_t i = 0; i < s.count; i += SAMPLES) {
            double nearest = INFINITY, object = -1;
            for (size_t k = i; k < i + SAMPLES; k++) {
                if (s.seen.object[k] == SHD_NOTHING) continue;
                const shd_vec3 p = {s.seen.position[0][k], s.seen.position[1][k],
                                    s.seen.position[2][k]};
                const double depth = shd_dot(shd_sub(camera->position, p), camera->back);
                if (depth < nearest) nearest = depth, object = s.seen.object[k];
            }
            assert_true((double)d.film.object[i / SAMPLES] == object);
            if (isfinite(nearest))
                assert_below(fabs((double)d.film.depth[i / SAMPLES] - nearest), 2e-6);
        }
        drop_drawn(&d);
        drop_sampled(&s);
        free(plain);
        free(json);
    }
}

static void highlights_are_within_their_bounds(void **state) {
    (void)state;
    uint64_t random = 3;
    for (int i = 0; i < 200000; i++) {
        const double shininess = pow(10, uniform(&random, -2, 6)),
                     shine = 1 - pow(10, uniform(&random, -9, 0.3)),
                     is = shine > 0 ? pow(shine, shininess) : 0;
        assert_true(shd_shine_most(shine, shininess) >= is * (1 - 1e-12));
        assert_true(shd_shine_least(shine, shininess) <= is * (1 + 1e-12));
        assert_true(shd_shine_most(shine, shininess) <= is + 2e-10);
        assert_true(shd_shine_least(shine, shininess) >= is - 2e-10);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(layers_are_what_samples_see),
        cmocka_unit_test(layers_take_the_nearest_sample),
        cmocka_unit_test(highlights_are_within_their_bounds),
    };
    return cmocka_run_group_tests(tests, make_engine, drop_engine);
}
