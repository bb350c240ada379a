/* Patterns, and a picture of one: closed forms, what is reused, and that tiers differ by no more
 * than is said. */
#include "property/pieces.h"
#include "property/put_picture.h"
#include "property/reused.h"

static const char all[] =
    "{\"image\": {\"width\": 64, \"height\": 48, \"samples\": %d}, \"accuracy\": {\"tier\": "
    "\"%s\"}, "
    "\"camera\": {\"position\": [0, 1.9, 6.2], \"target\": [0, 0.62, 0], \"fov\": 34}, "
    "\"ambient\": 0.2, "
    "\"background\": [0.1, 0.2, 0.3], %s"
    "\"lights\": [{\"type\": \"point\", \"position\": [%s, 6, 5], \"attenuation\": [0.5, 0.05, "
    "0]}, "
    "{\"type\": \"directional\", \"direction\": [1, -0.6, -0.5], \"color\": %s}], \"objects\": ["
    "{\"type\": \"plane\", \"material\": {\"diffuse\": {\"pattern\": \"checker\", \"colors\": "
    "[0.1, %s], "
    "\"uv\": {\"scale\": 1.6, \"rotate\": 24}}}}, {\"type\": \"sphere\", \"radius\": 0.62, "
    "\"material\": "
    "{%s\"diffuse\": 0.3, \"specular\": {\"pattern\": \"checker\", \"colors\": [[0.9, 0.2, 0.1], "
    "0.4], "
    "\"uv\": {\"scale\": [16, 8]}}, \"lobes\": [{\"specular\": 0.1, \"shininess\": 5}], "
    "\"emissive\": "
    "{\"pattern\": \"noise\", \"colors\": [0, 0.2], \"uv\": {\"scale\": 9}}}, \"transform\": "
    "{\"translate\": [0, 0.62, 0.6]}}, {\"type\": \"mesh\", \"positions\": [-2.4, 0, -2.2, -1.4, "
    "0, -2.5, "
    "-1.4, 1.5, -2.5, -2.4, 1.5, -2.2], \"indices\": [0, 1, 2, 0, 2, 3], \"uvs\": [0, 0, 1, 0, 1, "
    "1, 0, 1], "
    "\"material\": {\"diffuse\": {\"pattern\": \"gradient\", \"colors\": [0, [0.9, 0.8, 0.1]], "
    "\"uv\": "
    "{\"scale\": 6, \"wrap\": \"mirror\"}}}}, {\"type\": \"torus\", \"radius\": 0.5, \"tube\": "
    "0.21, "
    "\"material\": {\"diffuse\": {\"pattern\": \"grid\", \"colors\": [0.7, 0.1], \"uv\": "
    "{\"scale\": [20, "
    "8]}}}, \"transform\": {\"rotate\": [68, 0, -14], \"translate\": [1.35, 0.72, 0.35]}}]}";

#define GREY "[0.4, 0.4, 0.4]"
#define BLUE "[0.2, 0.3, 0.5]"

static void tiers_differ_by_no_more_than_is_said(void **state) {
    for (int k = 0; k < 4; k++) {
        char *fast =
                 text_of(all, k < 2 ? 1 : 4, "standard", "", "4", k % 2 ? GREY : BLUE, "0.8", ""),
             *full = text_of(all, k < 2 ? 1 : 4, "exact", "", "4", k % 2 ? GREY : BLUE, "0.8", "");
        drawn a = film_of(*state, fast), b = film_of(*state, full);
        const double bound = a.request->rendering.plan->bound.linear;
        double most = 0;
        assert_true(isfinite(bound) && bound < 1e-4);
        assert_true(!isfinite(a.request->rendering.plan->bound.code));
        assert_true(b.request->rendering.plan->bound.code == 0);
        for (size_t i = 0; i < 4 * pixels_of(&a); i++)
            most = fmax(most, fabs((double)a.film.rgba[i] - (double)b.film.rgba[i]));
        assert_true(most > 0);
        assert_below(most, bound);
        drop_drawn(&a);
        drop_drawn(&b);
        free(fast);
        free(full);
    }
}

/* Every model lights the same coefficients: the exact tier's sums times them. */
static void layers_add_up(void **state) {
    static const char *const models[] = {"", "\"model\": \"blinn-phong\", ",
                                         "\"model\": \"phong-normalized\", "};
    for (int k = 0; k < 4; k++) {
        char *text = text_of(
            all, 4, k ? "exact" : "standard",
            "\"output\": {\"format\": \"exr\", \"layers\": [\"emissive\", \"ambient\", "
            "\"diffuse\", \"specular\", \"light.0\", \"light.1\", \"lobe.0\", \"lobe.1\"]}, ",
            "4", BLUE, "0.8", models[k ? k - 1 : 0]);
        drawn d = film_of(*state, text);
        const shd_layer_kind kinds[] = {SHD_LAYER_EMISSIVE, SHD_LAYER_AMBIENT, SHD_LAYER_DIFFUSE,
                                        SHD_LAYER_SPECULAR};
        const float *part[4], *light[2], *lobe[2];
        for (int p = 0; p < 4; p++) part[p] = plane_of(&d, kinds[p], 0);
        for (size_t p = 0; p < 2; p++) {
            light[p] = plane_of(&d, SHD_LAYER_LIGHT, p);
            lobe[p] = plane_of(&d, SHD_LAYER_LOBE, p);
        }
        for (size_t i = 0; i < 3 * pixels_of(&d); i++) {
            const double terms = (double)part[2][i] + (double)part[3][i];
            assert_true(fabs((double)light[0][i] + (double)light[1][i] - terms) < 1e-5);
            assert_true(fabs((double)lobe[0][i] + (double)lobe[1][i] - (double)part[3][i]) < 1e-5);
        }
        drop_drawn(&d);
        free(text);
    }
}

/* A pattern of one color is that color, whatever it multiplies. */
static void equal_colors_are_one_color(void **state) {
    static const char with[] =
        "{\"image\": {\"width\": 64, \"height\": 48, \"samples\": 4}, \"ambient\": 0.1, "
        "\"lights\": "
        "[{\"type\": \"point\", \"position\": [2, 3, 4], \"color\": [1, 0.8, 0.6]}], \"accuracy\": "
        "{\"tier\": \"%s\"}, \"objects\": [{\"type\": \"torus\", \"material\": {\"emissive\": %s, "
        "\"diffuse\": %s, \"specular\": %s}, \"transform\": {\"rotate\": [60, 0, 0]}}]}";
#define SAME(color)                                                                                \
    "{\"pattern\": \"noise\", \"colors\": [" color ", " color "], \"uv\": {\"scale\": 9}}"
    for (int exact = 0; exact < 2; exact++) {
        const char *tier = exact ? "exact" : "standard";
        char *one = text_of(with, tier, "[0.1, 0, 0.2]", "[0.3, 0.5, 0.7]", "0.4"),
             *other =
                 text_of(with, tier, SAME("[0.1, 0, 0.2]"), SAME("[0.3, 0.5, 0.7]"), SAME("0.4"));
        drawn a = film_of(*state, one), b = film_of(*state, other);
        assert_below(film_difference(&a, &b), exact ? 1e-7 : 1e-6);
        drop_drawn(&a);
        drop_drawn(&b);
        free(one);
        free(other);
    }
}

/* Light that is beside what facets send on. */
static void microgeometry_glows_in_patterns(void **state) {
    static const char format[] =
        "{\"image\": {\"width\": 16, \"height\": 12, \"samples\": 2}, \"ambient\": 0.4, \"trace\": "
        "{\"shadows\": %s}, \"objects\": [{\"type\": \"sphere\", \"material\": {%s\"emissive\": "
        "%s, "
        "\"ambient\": {\"pattern\": \"noise\", \"colors\": [[0.1, 0.5, 0.2], [0.6, 0, 0.1]]}}}]}";
    static const char westin[] =
        "\"model\": \"westin\", \"microgeometry\": {\"type\": \"grooves\"}, ",
                      checks[] = "{\"pattern\": \"checker\", \"colors\": [0.1, [0.5, 0.2, 0]], "
                                 "\"uv\": {\"scale\": 8}}",
                      black[] = "\"diffuse\": 0, ";
    for (int s = 0; s < 2; s++) {
        const char *shadows = s ? "true" : "false";
        char *texts[] = {
            text_of(format, shadows, westin, checks), text_of(format, shadows, black, checks),
            text_of(format, shadows, westin, "0"), text_of(format, shadows, black, "0")};
        drawn d[4];
        for (int k = 0; k < 4; k++) d[k] = shown_film_of(*state, texts[k]);
        for (size_t i = 0; i < (size_t)16 * 12 * 4; i++) {
            const double with = (double)d[0].film.rgba[i] - (double)d[2].film.rgba[i],
                         alone = (double)d[1].film.rgba[i] - (double)d[3].film.rgba[i];
            assert_true(fabs(with - alone) < 2e-6);
        }
        assert_true(film_difference(&d[0], &d[1]) > 0.01 && film_difference(&d[0], &d[2]) > 0.01);
        for (int k = 0; k < 4; k++) drop_drawn(&d[k]), free(texts[k]);
    }
}

/* Facets of another color at each point send on what facets of that color everywhere do there: with
 * shadows, in a mirror, by lamps and by a light with a shape, on a surface whose normals are
 * turned. A third material is seen for the field itself. */
static void microgeometry_has_patterns(void **state) {
    static const char format[] =
        "{\"image\": {\"width\": 24, \"height\": 12, \"samples\": 1}, \"ambient\": 0.1, \"trace\": "
        "{\"shadows\": true, \"shadowSamples\": 4, \"depth\": 2}, \"camera\": {\"position\": [0, "
        "1, 5]}, "
        "\"lights\": [{\"type\": \"point\", \"position\": [3, 4, 2], \"intensity\": 2}, {\"type\": "
        "\"rect\", \"position\": [-3, 2, 2], \"direction\": [3, -2, -2], \"up\": [0, 1, 0], "
        "\"size\": [1, 1], \"intensity\": 20}], \"objects\": [{\"type\": \"sphere\", \"material\": "
        "{%s}, \"transform\": {\"translate\": [0.9, 0, 0]}}, {\"type\": \"disc\", \"radius\": 2, "
        "\"material\": {\"diffuse\": 0, "
        "\"reflection\": 1}, \"transform\": {\"rotate\": [90, 30, 0], \"translate\": [-1.5, 0, "
        "0]}}]}";
#define FADES(of)                                                                                  \
    "\"" of "\": {\"pattern\": \"gradient\", \"colors\": [%s, %s], \"uv\": {\"rotate\": 60, "      \
    "\"scale\": [3, 2], \"wrap\": \"mirror\"}}"
    static const char facets[] =
        "\"model\": \"westin\", \"microgeometry\": {\"type\": \"grooves\"}, ";
    char *glow = text_of("\"diffuse\": 0, " FADES("emissive"), "0", "1"),
         *fades = text_of("%s" FADES("diffuse"), facets, "0.1", "0.9"),
         *text[2] = {text_of(format, glow), text_of(format, fades)};
    drawn field = shown_film_of(*state, text[0]), d = shown_film_of(*state, text[1]);
    size_t seen = 0;
    for (size_t i = 3; i < pixels_of(&d); i += 7) {
        const double w = (double)field.film.rgba[4 * i];
        if (!(w > 0.02)) continue;
        char *plain = text_of("%s\"diffuse\": %.17g", facets, 0.1 + 0.8 * w),
             *one = text_of(format, plain);
        drawn p = shown_film_of(*state, one);
        assert_below(fabs((double)d.film.rgba[4 * i] - (double)p.film.rgba[4 * i]), 1e-6);
        seen += (double)p.film.rgba[4 * i] > 0.05;
        drop_drawn(&p);
        free(plain);
        free(one);
    }
    assert_true(seen >= 5);
    drop_drawn(&field);
    drop_drawn(&d);
    free(glow);
    free(fades);
    free(text[0]);
    free(text[1]);
}

static void reflectances_of_patterns_are_not_told(void **state) {
    static const char *const members[] = {"diffuse", "emissive"};
    for (int k = 0; k < 2; k++) {
        char *json =
            text_of("{\"objects\": [{\"type\": \"box\"}, {\"type\": \"sphere\", \"material\": "
                    "{\"%s\": {\"pattern\": \"checker\", \"colors\": [0, 0.9]}, \"ambient\": "
                    "0}}]}",
                    members[k]);
        shd_request *request = read_scene(*state, json);
        shd_error error;
        unsigned char *data = NULL;
        size_t size;
        const shd_status status = shd_request_brdf(request, SHD_BRDF_JSON, &data, &size, &error);
        assert_int_equal(status, k ? SHD_OK : SHD_SCENE);
        if (!k) assert_string_equal(error.path, "/objects/1/material");
        free(data);
        shd_request_drop(request);
        free(json);
    }
}

/* Another tint casts and lights nothing, another light casts nothing, and bytes are the same. */
static void tints_keep_light(void **state) {
    (void)state;
    static const struct {
        const char *x, *light, *tint;
        shd_reused reused;
    } steps[] = {
        {"4", BLUE, "0.8", SHD_REUSED_NOTHING},  {"4", BLUE, "[0.9, 0.2, 0.1]", SHD_REUSED_LIGHT},
        {"4", BLUE, "0.1", SHD_REUSED_LIGHT},    {"3", BLUE, "0.8", SHD_REUSED_GEOMETRY},
        {"3", GREY, "0.8", SHD_REUSED_GEOMETRY}, {"3", GREY, "0.7", SHD_REUSED_LIGHT}};
    for (int samples = 1; samples <= 4; samples += 3) {
        shd_engine *keeps = new_engine_that_keeps((size_t)64 << 20, 2, NULL),
                   *forgets = new_engine_that_keeps(0, 1, NULL);
        for (size_t i = 0; i < sizeof steps / sizeof steps[0]; i++) {
            char *json = text_of(all, samples, "standard", "", steps[i].x, steps[i].light,
                                 steps[i].tint, "");
            assert_int_equal(reused_for(keeps, forgets, json), steps[i].reused);
        }
        shd_engine_drop(keeps);
        shd_engine_drop(forgets);
    }
}

static void regions_and_kernels_see_the_same(void **state) {
    char *whole = text_of(all, 4, "exact", "", "4", BLUE, "0.8", "");
    shd_engine *other = new_engine_of(1, "portable");
    check_region(*state, other, whole);
    shd_engine_drop(other);
    free(whole);
}

/* ---- A checkered plane to the horizon. ---- */

enum { WIDE = 32, HIGH = 48, RAYS = 64 /* a side of a pixel */ };

typedef struct floor_view {
    double turn;  /* of the camera, in pixels */
    double angle; /* of the checks */
} floor_view;

static const double HALF = 0.46630765815499860; /* tan of half the field of view, 50 degrees */

/* `texture`: a picture of four checks; NULL: they are a pattern. */
static drawn see_floor(shd_engine *engine, floor_view view, int samples, const char *texture) {
    const double turn = view.turn * 2 * HALF / HIGH;
    char *color = texture
                      ? text_of("{\"texture\": \"%s\", \"uv\": {\"scale\": 0.5, \"rotate\": %g}}",
                                texture, view.angle)
                      : text_of("{\"pattern\": \"checker\", \"colors\": [0, 1], \"uv\": "
                                "{\"rotate\": %g}}",
                                view.angle);
    char *text = text_of(
        "{\"image\": {\"width\": %d, \"height\": %d, \"samples\": %d}, \"lights\": [], \"camera\": "
        "{\"position\": [0, 1, 0], \"target\": [%.17g, 0.4, %.17g], \"fov\": 50}, \"objects\": "
        "[{\"type\": \"plane\", \"material\": {\"diffuse\": 0, \"emissive\": %s}}]}",
        WIDE, HIGH, samples, 4 * sin(turn), -4 * cos(turn), color);
    free(color);
    drawn d = film_of(engine, text);
    free(text);
    return d;
}

/* The mean over 4,096 rays through each pixel; `span`: how many checks it is wide. */
static void trace_floor(floor_view view, float *mean, float *span) {
    const double turn = view.turn * 2 * HALF / HIGH, step = 2 * HALF / HIGH;
    const shd_vec3 eye = {0, 1, 0}, target = {4 * sin(turn), 0.4, -4 * cos(turn)};
    shd_vec3 back = shd_sub(eye, target), right;
    shd_normalize(back, &back);
    shd_normalize(shd_cross((shd_vec3){0, 1, 0}, back), &right);
    const shd_vec3 up = shd_cross(back, right);
    const double c = cos(view.angle * SHD_PI / 180), s = sin(view.angle * SHD_PI / 180);
    for (int i = 0; i < WIDE * HIGH; i++) {
        int odd = 0;
        double width = 0;
        for (int k = 0; k < RAYS * RAYS; k++) {
            const double p = (i % WIDE + (k % RAYS + 0.5) / RAYS - WIDE / 2) * step,
                         q = (HIGH / 2 - i / WIDE - (k / RAYS + 0.5) / RAYS) * step;
            const shd_vec3 d = shd_sub(shd_madd(shd_scale(right, p), up, q), back);
            if (!(d.y < 0)) continue;
            const double t = -1 / d.y, u = t * d.x, v = -t * d.z;
            odd += ((long)floor(c * u - s * v) + (long)floor(s * u + c * v)) & 1;
            width += t * step;
        }
        mean[i] = (float)odd / (RAYS * RAYS);
        span[i] = (float)width / (RAYS * RAYS);
    }
}

/* The row of the horizon is left out: what it shows is how much of a pixel is floor. */
static void floors_neither_shimmer_nor_grey(void **state) {
    static float mean[WIDE * HIGH], span[WIDE * HIGH];
    static const double angles[] = {20, 45};
    const put_name checks = put_checks(*state, 64);
    for (int k = 0; k < 2; k++) {
        trace_floor((floor_view){0, angles[k]}, mean, span);
        for (int way = 0; way < 3; way++) {
            const int samples = way == 1 ? 4 : 1;
            const char *texture = way == 2 ? checks.text : NULL;
            drawn a = see_floor(*state, (floor_view){0, angles[k]}, samples, texture),
                  b = see_floor(*state, (floor_view){0.1, angles[k]}, samples, texture);
            double sum = 0, moved = 0, fine = 0;
            int count = 0, horizon = 0;
            while (!(span[horizon * WIDE] > 0)) horizon++;
            for (int i = (horizon + 1) * WIDE; i < WIDE * HIGH; i++) {
                const double value = (double)a.film.rgba[4 * i], off = value - (double)mean[i],
                             step = fabs(value - (double)b.film.rgba[4 * i]);
                sum += off * off;
                count++;
                moved = fmax(moved, step);
                if (span[i] > 1) fine = fmax(fine, step);
            }
            assert_below(sqrt(sum / count), 0.02);
            assert_below(moved, 0.15);
            assert_below(fine, 0.02);
            drop_drawn(&a);
            drop_drawn(&b);
        }
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(tiers_differ_by_no_more_than_is_said),
        cmocka_unit_test(layers_add_up),
        cmocka_unit_test(equal_colors_are_one_color),
        cmocka_unit_test(microgeometry_glows_in_patterns),
        cmocka_unit_test(microgeometry_has_patterns),
        cmocka_unit_test(reflectances_of_patterns_are_not_told),
        cmocka_unit_test(tints_keep_light),
        cmocka_unit_test(regions_and_kernels_see_the_same),
        cmocka_unit_test(floors_neither_shimmer_nor_grey),
    };
    return cmocka_run_group_tests(tests, make_engine, drop_engine);
}
