/* What maps of normals are made of: the frames of charts, and Toksvig's exponents, held to closed
 * forms and to rays as fine as texels. */
#include "property/pieces.h"
#include "property/put_normals.h"
#include "scene/read.h"
#include "shade/bump.h"

/* ---- Frames of charts. ---- */

typedef struct framed {
    const char *shape;
    shd_vec3 at, normal, across, up; /* in the object's frame */
} framed;

static void frames_are_as_charts_are_told(void **state) {
    const double r = sqrt(0.5);
    const framed list[] = {
        {"\"type\": \"sphere\"", {0, 0, 1}, {0, 0, 1}, {1, 0, 0}, {0, 1, 0}},
        {"\"type\": \"sphere\"", {r, r, 0}, {r, r, 0}, {0, 0, -1}, {-r, r, 0}},
        {"\"type\": \"plane\"", {3, 0, 2}, {0, 1, 0}, {1, 0, 0}, {0, 0, -1}},
        {"\"type\": \"disc\"", {0.3, 0, 0.2}, {0, 1, 0}, {1, 0, 0}, {0, 0, -1}},
        {"\"type\": \"box\"", {0.5, 0.1, 0.2}, {1, 0, 0}, {0, 0, -1}, {0, 1, 0}},
        {"\"type\": \"box\"", {0.1, 0.2, -0.5}, {0, 0, -1}, {-1, 0, 0}, {0, 1, 0}},
        {"\"type\": \"box\"", {0.1, 0.5, 0.2}, {0, 1, 0}, {1, 0, 0}, {0, 0, -1}},
        {"\"type\": \"box\"", {0.1, -0.5, 0.2}, {0, -1, 0}, {1, 0, 0}, {0, 0, 1}},
        {"\"type\": \"cylinder\"", {0, 0.3, -1}, {0, 0, -1}, {-1, 0, 0}, {0, 1, 0}},
        {"\"type\": \"cylinder\"", {0.2, 1, 0.1}, {0, 1, 0}, {1, 0, 0}, {0, 0, -1}},
        {"\"type\": \"torus\"", {0, 0, 1.25}, {0, 0, 1}, {1, 0, 0}, {0, 1, 0}},
        {"\"type\": \"torus\"", {0, 0, 0.75}, {0, 0, -1}, {1, 0, 0}, {0, -1, 0}},
    };
    static const double plain[2][3] = {{1, 0, 0}, {0, 1, 0}},
                        turned[2][3] = {{0, -3, 0}, {3, 0, 0}};
    for (size_t k = 0; k < SHD_LENGTH(list); k++)
        for (int hand = -1; hand < 2; hand += 2)
            for (int side = -1; side < 2; side += 2) {
                char *text =
                    text_of("{\"objects\": [{%s, \"transform\": {\"scale\": [%d, 1, 1]}}]}",
                            list[k].shape, hand);
                shd_request *request = read_scene(*state, text);
                const shd_chart chart = shd_chart_of(&request->scene->objects[0]);
                framed f = list[k];
                shd_vec3 *const all[] = {&f.at, &f.normal, &f.across, &f.up};
                for (size_t i = 0; i < 4; i++) all[i]->x *= hand;
                const shd_charted_point point = {.position = f.at,
                                                 .normal = shd_scale(f.normal, side)};
                shd_tangent_frame frame;
                assert_true(shd_chart_frame(&chart, &point, plain, &frame));
                assert_int_equal(frame.back, side < 0);
                assert_below(shd_length(shd_sub(frame.across, f.across)), 1e-12);
                assert_below(shd_length(shd_sub(frame.up, f.up)), 1e-12);
                /* The picture turned by a quarter from u to v: s = -v. */
                assert_true(shd_chart_frame(&chart, &point, turned, &frame));
                assert_below(shd_length(shd_add(frame.across, f.up)), 1e-12);
                assert_below(shd_length(shd_sub(frame.up, f.across)), 1e-12);
                shd_request_drop(request);
                free(text);
            }
    /* A pole has no direction. */
    shd_request *request = read_scene(*state, "{\"objects\": [{\"type\": \"sphere\"}]}");
    const shd_chart chart = shd_chart_of(&request->scene->objects[0]);
    const shd_charted_point pole = {.position = {0, 1, 0}, .normal = {0, 1, 0}};
    shd_tangent_frame frame;
    if (shd_chart_frame(&chart, &pole, plain, &frame))
        assert_true(fabs(shd_length(frame.across) - 1) < 1e-12);
    shd_request_drop(request);
}

/* ---- Toksvig's exponents. ---- */

static char *far_away(const char *material) {
    return text_of("{\"image\": {\"width\": 32, \"height\": 24, \"samples\": 1}, \"accuracy\": "
                   "{\"tier\": \"exact\"}, \"camera\": {\"position\": [0, 2, 3], \"fov\": 30}, "
                   "\"lights\": [{\"type\": \"point\", \"position\": [0.5, 2, -3]}], "
                   "\"objects\": [{\"type\": \"disc\", \"radius\": 4, \"material\": {\"diffuse\": "
                   "0.2, %s}}]}",
                   material);
}

/* Two normals that alternate, far finer than pixels: their mean is along N, and sqrt(x x + y y)
 * shorter than 1. */
static void fine_normals_are_toksvigs(void **state) {
    static const code both[] = {{190, 140, 230}, {65, 115, 230}};
    static const char *const names[] = {"phong", "blinn-phong", "phong-normalized"};
    const put_name map = put_normals(*state, 2, 2, both, 2);
    const double length = vector_of(both[0], 1).z, variance = (1 - length) / length;
    assert_true(length > 0.8 && length < 0.95);
    for (size_t m = 0; m < SHD_LENGTH(names); m++)
        for (int k = 0; k < 2; k++) {
            const double n = k ? 400 : 7, by = m == 1 ? 1 : 4,
                         less = fmax(n / (1 + n * by * variance), 1),
                         share = m == 2 ? 1 : (less + 1) / (n + 1);
            char *mapped = text_of("\"model\": \"%s\", \"specular\": 0.5, \"shininess\": %.17g, "
                                   "\"normal\": {\"texture\": \"%s\", \"uv\": {\"scale\": 9e5}}",
                                   names[m], n, map.text),
                 *plain = text_of("\"model\": \"%s\", \"specular\": %.17g, \"shininess\": %.17g",
                                  names[m], 0.5 * share, less);
            char *one = far_away(mapped), *other = far_away(plain);
            drawn a = film_of(*state, one), b = film_of(*state, other);
            assert_below(film_difference(&b, &a), 2e-6);
            drop_drawn(&a);
            drop_drawn(&b);
            free(mapped);
            free(plain);
            free(one);
            free(other);
        }
    const shd_sharpness facets = shd_toksvig(SHD_MODEL_COOK_TORRANCE, 0.1, length);
    assert_below(fabs(facets.shininess - sqrt(0.01 + 2 * variance)), 1e-15);
    assert_true(facets.share == 1);
    for (int m = 0; m < SHD_MODEL_WESTIN; m++) {
        const double own = m == SHD_MODEL_COOK_TORRANCE ? 0.3 : 77;
        assert_true(shd_toksvig((shd_model)m, own, 1).shininess == own);
        assert_true(shd_toksvig((shd_model)m, own, 1 - 0x1p-23).share == 1);
        assert_true(shd_toksvig((shd_model)m, own, 0).shininess == 1);
        assert_true(shd_toksvig((shd_model)m, 0, 0).shininess >= 0);
    }
}

/* ---- Fine bumps against rays as fine as their texels. ---- */

enum { WIDE = 16, HIGH = 12, FINE = 16 };

/* Slopes in both directions that are of a normal distribution, by sums of uniform numbers. */
static put_name put_slopes(shd_engine *engine, double deviation) {
    enum { SIDE = 64 };
    static code list[SIDE * SIDE];
    uint64_t random = 5;
    for (size_t i = 0; i < SHD_LENGTH(list); i++) {
        double slope[2] = {0, 0};
        for (int k = 0; k < 24; k++) slope[k % 2] += deviation * uniform(&random, -0.5, 0.5);
        const double length = sqrt(1 + slope[0] * slope[0] + slope[1] * slope[1]);
        list[i] = (code){(uint8_t)lround(127.5 * (slope[0] / length + 1)),
                         (uint8_t)lround(127.5 * (slope[1] / length + 1)),
                         (uint8_t)lround(127.5 * (1 / length + 1))};
    }
    return put_normals(engine, SIDE, SIDE, list, SHD_LENGTH(list));
}

/* The picture's first channel, in means of times x times pixels. */
static void draw_plane(shd_engine *engine, const char *lobe, const char *map, int times,
                       double out[HIGH * WIDE]) {
    char
        *normal = map ? text_of(", \"normal\": {\"texture\": \"%s\"}", map) : text_of("%s", ""),
        *text = text_of(
            "{\"image\": {\"width\": %d, \"height\": %d, \"samples\": 1}, \"accuracy\": {\"tier\": "
            "\"exact\"}, \"camera\": {\"type\": \"orthographic\", \"height\": 3, \"position\": [0, "
            "4, "
            "4]}, \"lights\": [{\"type\": \"point\", \"position\": [0, 4, -4]}], \"objects\": "
            "[{\"type\": \"plane\", \"material\": {\"diffuse\": 0, \"ambient\": 0, %s%s}}]}",
            WIDE * times, HIGH * times, lobe, normal);
    drawn d = film_of(engine, text);
    memset(out, 0, HIGH * WIDE * sizeof *out);
    for (int y = 0; y < HIGH * times; y++)
        for (int x = 0; x < WIDE * times; x++)
            out[y / times * WIDE + x / times] +=
                (double)d.film.rgba[4 * (y * WIDE * times + x)] / (times * times);
    drop_drawn(&d);
    free(normal);
    free(text);
}

typedef struct against {
    double off, sum; /* the RMS over the largest value; the sum over theirs */
} against;

static against hold(const double seen[HIGH * WIDE], const double wanted[HIGH * WIDE]) {
    double square = 0, most = 0, sum = 0, all = 0;
    for (int i = 0; i < HIGH * WIDE; i++) {
        square += (seen[i] - wanted[i]) * (seen[i] - wanted[i]);
        most = fmax(most, wanted[i]);
        sum += seen[i];
        all += wanted[i];
    }
    return (against){sqrt(square / (HIGH * WIDE)) / most, sum / all};
}

static void fine_bumps_are_what_many_rays_see(void **state) {
    static const char *const lobes[] = {
        "\"specular\": 0.5, \"shininess\": 20",
        "\"specular\": 0.5, \"shininess\": 200",
        "\"model\": \"blinn-phong\", \"specular\": 0.5, \"shininess\": 80",
        "\"model\": \"blinn-phong\", \"specular\": 0.5, \"shininess\": 800",
        "\"model\": \"cook-torrance\", \"lobes\": [{\"roughness\": 0.1}]",
        "\"model\": \"phong-normalized\", \"specular\": 0.5, \"shininess\": 20"};
    static const double deviations[] = {0.15, 0.05, 0.3};
    const bool all = getenv("SHADED_MEASURE");
    for (size_t s = 0; s < (all ? SHD_LENGTH(deviations) : 1); s++) {
        const put_name map = put_slopes(*state, deviations[s]);
        for (size_t k = all ? 0 : 1; k < SHD_LENGTH(lobes); k += all ? 1 : 2) {
            double many[HIGH * WIDE], seen[HIGH * WIDE], flat[HIGH * WIDE];
            draw_plane(*state, lobes[k], map.text, FINE, many);
            draw_plane(*state, lobes[k], map.text, 1, seen);
            draw_plane(*state, lobes[k], NULL, 1, flat);
            const against ours = hold(seen, many), without = hold(flat, many);
            if (all)
                printf("slopes %.2f, %s: error %.3f was %.3f, light %.2f was %.2f\n", deviations[s],
                       lobes[k], ours.off, without.off, ours.sum, without.sum);
            assert_below(ours.off, 0.15 * without.off);
            assert_below(fabs(ours.sum - 1), 0.15);
        }
    }
}

/* ---- In the light of an environment. ---- */

/* A rough ball and a torus; `tier` NULL: their material without its map of normals. */
static drawn draw_around(shd_engine *engine, const char *lobe, const char *map, const char *tier) {
    char
        *normal = map ? text_of(", \"normal\": {\"texture\": \"%s\", \"uv\": {\"scale\": 3}}", map)
                      : text_of("%s", ""),
        *text = text_of(
            "{\"image\": {\"width\": 14, \"height\": 12, \"samples\": 1}, \"accuracy\": {\"tier\": "
            "\"%s\"}, \"camera\": {\"position\": [0.3, 0.4, 4]}, \"lights\": [{\"type\": "
            "\"environment\", \"map\": \"studio\", \"rotate\": 30}], \"materials\": {\"a\": "
            "{\"diffuse\": 0.1, %s, \"specularAntialiasing\": true%s}}, \"objects\": [{\"type\": "
            "\"sphere\", \"radius\": 0.7, \"material\": \"a\"}, {\"type\": \"torus\", \"tube\": "
            "0.2, "
            "\"radius\": 1.1, \"material\": \"a\", \"transform\": {\"rotate\": [60, 0, 20]}}]}",
            tier, lobe, normal);
    drawn d = shown_film_of(engine, text);
    free(text);
    free(normal);
    return d;
}

static const char *const around[] = {
    "\"specular\": 3, \"shininess\": 200", "\"specular\": 3, \"shininess\": 2.5",
    "\"model\": \"blinn-phong\", \"specular\": 3, \"shininess\": 300",
    "\"model\": \"phong-normalized\", \"specular\": 0.5, \"shininess\": 90",
    "\"model\": \"cook-torrance\", \"lobes\": [{\"roughness\": 0.08}]"};

/* By tables and quick walks, and by quadrature and long ones: within their bounds, and codes. */
static void tiers_agree_around(void **state) {
    const put_name map = put_slopes(*state, 0.2);
    for (size_t k = 0; k < SHD_LENGTH(around); k++)
        for (int mapped = 0; mapped < 2; mapped++) {
            const char *name = mapped ? map.text : NULL;
            drawn quick = draw_around(*state, around[k], name, "standard"),
                  exact = draw_around(*state, around[k], name, "exact");
            const shd_bound a = exact.request->rendering.plan->bound,
                            b = quick.request->rendering.plan->bound;
            double most = 0;
            for (size_t i = 0; i < 4 * pixels_of(&quick); i++)
                most = fmax(most, fabs((double)quick.film.rgba[i] - (double)exact.film.rgba[i]));
            assert_below(most, a.linear + b.linear);
            assert_true(most > 0 && isfinite(b.code));
            const shd_difference seen = measured(&exact, &quick);
            assert_below(seen.code.max, fmin(b.code, 1) + 0.5);
            drop_drawn(&quick);
            drop_drawn(&exact);
        }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(frames_are_as_charts_are_told),
        cmocka_unit_test(fine_normals_are_toksvigs),
        cmocka_unit_test(fine_bumps_are_what_many_rays_see),
        cmocka_unit_test(tiers_agree_around),
    };
    return cmocka_run_group_tests(tests, make_engine, drop_engine);
}
