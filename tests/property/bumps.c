/* Maps of normals as the scene has them. A map of one normal is a mesh with that normal at its
 * vertices, in all that light, shadows and mirrors do. */
#include "property/pieces.h"
#include "property/put_normals.h"
#include "scene/read.h"

/* ---- One normal everywhere is a mesh with it at its vertices. ---- */

/* A square, whose uvs are turned by `turn` quarters and mirrored or not. */
static void square(FILE *out, int turn, bool mirrored) {
    static const double at[4][2] = {{-2, -2}, {2, -2}, {2, 2}, {-2, 2}};
    fputs("{\"type\": \"mesh\", \"positions\": [-2, -2, 0, 2, -2, 0, 2, 2, 0, -2, 2, 0], "
          "\"indices\": [0, 1, 2, 0, 2, 3], \"uvs\": [",
          out);
    for (int i = 0; i < 4; i++) {
        double u = at[i][0], v = at[i][1];
        for (int k = 0; k < turn; k++) {
            const double was = u;
            u = v;
            v = -was;
        }
        fprintf(out, "%s%g, %g", i ? ", " : "", mirrored ? -u : u, v);
    }
    fputs("], ", out);
}

/* What the square's x, y, z are of the picture's. (u, v) = quarter turns of (x, y): u = y, v = -x
 * after one, so that T = (0, 1), and B = (-1, 0). Mirrored u has T the other way. */
static shd_vec3 carried(shd_vec3 m, int turn, bool mirrored) {
    double x = mirrored ? -m.x : m.x, y = m.y;
    for (int k = 0; k < turn; k++) {
        const double was = x;
        x = -y;
        y = was;
    }
    return (shd_vec3){x, y, m.z};
}

static const char *const models[] = {
    "\"specular\": 0.6, \"shininess\": 20, \"lobes\": [{\"specular\": 0.1, \"shininess\": 300}]",
    "\"model\": \"blinn-phong\", \"specular\": 0.6, \"shininess\": 50",
    "\"model\": \"phong-normalized\", \"specular\": 0.4, \"shininess\": 40",
    "\"model\": \"oren-nayar\", \"sigma\": 25",
    "\"model\": \"cook-torrance\", \"lobes\": [{\"roughness\": 0.3}]",
    "\"model\": \"westin\", \"microgeometry\": {\"type\": \"weave\"}",
    "\"specular\": 0.6, \"shininess\": 9, \"specularAntialiasing\": true",
};

typedef struct setting {
    size_t model;
    int turn;
    bool mirrored, behind, seen_in_mirror, shadows, other_hand, areas;
} setting;

static char *tilted(const setting *s, const char *map, shd_vec3 normal) {
    writing w;
    start(&w);
    fprintf(w.out,
            "{\"image\": {\"width\": 20, \"height\": 15, \"samples\": 1}, \"accuracy\": {\"tier\": "
            "\"exact\"}, \"background\": [0.2, 0.1, 0.3], \"camera\": {\"position\": [0.6, 0.4, "
            "%s3.5], \"target\": [0, 0, %d], \"fov\": 40}, \"trace\": {\"shadows\": %s, \"depth\": "
            "%d, \"shadowSamples\": "
            "4}, \"lights\": [{\"type\": \"point\", \"position\": [3, 2, 2.5]}, {\"type\": "
            "\"directional\", \"direction\": [-1, 0.3, 0.05], \"color\": [0.3, 0.4, 0.9]}, "
            "{\"type\": \"spot\", \"position\": [-2, 1, -2], \"direction\": [1, -0.3, 1], "
            "\"angle\": 50}%s], \"objects\": [",
            s->behind ? "-" : "", s->seen_in_mirror ? 9 : 0, s->shadows ? "true" : "false",
            s->seen_in_mirror ? 3 : 0,
            s->areas
                ? ", {\"type\": \"rect\", \"position\": [-3, 0, 1], \"direction\": [1, 0, -0.2], "
                  "\"up\": [0, 1, 0], \"size\": [1, 2], \"intensity\": 3}, {\"type\": "
                  "\"sphere\", \"position\": [1, 4, -1], \"radius\": 0.5, \"intensity\": 2}"
                : "");
    if (s->seen_in_mirror)
        fprintf(w.out, "{\"type\": \"plane\", \"material\": {\"diffuse\": 0.1, \"reflection\": "
                       "0.8}, \"transform\": {\"rotate\": [90, 0, 0], \"translate\": [0, 0, 9]}}, "
                       "{\"type\": \"sphere\", \"radius\": 0.3, \"transform\": {\"translate\": "
                       "[0.2, 0, 1]}}, ");
    square(w.out, s->turn, s->mirrored);
    if (!map)
        for (int i = 0; i < 4; i++)
            fprintf(w.out, "%s%.17g, %.17g, %.17g%s", i ? ", " : "\"normals\": [", normal.x,
                    normal.y, normal.z, i == 3 ? "], " : "");
    fprintf(w.out, "\"transform\": {\"scale\": [1, 1, %d], \"rotate\": [20, %d, 5]}, ",
            s->other_hand ? -1 : 1, s->seen_in_mirror ? 10 : 0);
    fprintf(w.out, "\"material\": {\"diffuse\": [0.5, 0.6, 0.4], %s%s", models[s->model],
            s->seen_in_mirror ? ", \"reflection\": 0.4" : "");
    if (map) fprintf(w.out, ", \"normal\": {\"texture\": \"%s\", \"scale\": 0.5}", map);
    fputs("}}]}", w.out);
    return finish(&w);
}

static void one_normal_is_that_of_vertices(void **state) {
    static const code tilt = {200, 90, 210};
    const put_name map = put_normals(*state, 2, 2, &tilt, 1);
    int seen = 0;
    for (size_t model = 0; model < SHD_LENGTH(models); model++)
        for (int k = 0; k < 6; k++) {
            const setting s = {.model = model,
                               .turn = k % 4,
                               .mirrored = k == 2 || k == 5,
                               .behind = k == 3,
                               .seen_in_mirror = k == 4,
                               .shadows = k % 2,
                               .other_hand = k == 1 || k == 5,
                               .areas = k < 2};
            const shd_vec3 normal = carried(vector_of(tilt, 0.5), s.turn, s.mirrored);
            char *with = tilted(&s, map.text, normal), *plain = tilted(&s, NULL, normal);
            drawn a = shown_film_of(*state, with), b = shown_film_of(*state, plain);
            assert_true(a.request->rendering.plan->bumped);
            if (strstr(with, "westin")) assert_non_null(a.request->rendering.plan->westin);
            assert_false(b.request->rendering.plan->bumped);
            if (!(film_difference(&a, &b) < 2e-6))
                fail_msg("model %zu, setting %d: %g", model, k, film_difference(&a, &b));
            seen++;
            drop_drawn(&a);
            drop_drawn(&b);
            free(with);
            free(plain);
        }
    assert_int_equal(seen, 42);
}

/* ---- The same of shapes: light from behind them, and their shadows on themselves. ---- */

/* A wide surface that faces z at 0: a shape with a map, or a square with normals. Two of the lights
 * are behind it, before its normals. */
static char *wide(const char *shape, const char *material, shd_vec3 normal, bool shadows,
                  bool behind, bool mirrors) {
    writing w;
    start(&w);
    fprintf(w.out,
            "{\"image\": {\"width\": 20, \"height\": 15, \"samples\": 1}, \"accuracy\": {\"tier\": "
            "\"exact\"}, \"camera\": {\"position\": [0.6, 0.4, %g], \"fov\": 40}, \"trace\": "
            "{\"shadows\": %s, \"depth\": %d}, \"background\": [0.2, 0.1, 0.3], \"lights\": "
            "[{\"type\": \"directional\", \"direction\": [-1, 0.1, 0.1]}, {\"type\": \"point\", "
            "\"position\": [9, -3, -0.9]}, {\"type\": \"point\", \"position\": [2, 1, 3]}, "
            "{\"type\": \"directional\", \"direction\": [0.5, 0.2, 1], \"color\": [1, 0, 0]}], "
            "\"objects\": [{\"type\": \"sphere\", \"radius\": 0.2, \"transform\": {\"translate\": "
            "[0.5, 0.1, %d]}}, {%s",
            behind ? -3.5 : 3.5, shadows ? "true" : "false", mirrors ? 2 : 0, mirrors ? 1 : 60,
            shape ? shape
                  : "\"type\": \"mesh\", \"positions\": [-90, -90, 0, 90, -90, 0, 90, 90, 0, -90, "
                    "90, 0], \"indices\": [0, 1, 2, 0, 2, 3], \"normals\": [");
    for (int i = 0; i < 4 && !shape; i++)
        fprintf(w.out, "%s%.17g, %.17g, %.17g", i ? ", " : "", normal.x, normal.y, normal.z);
    fprintf(w.out,
            "%s, \"material\": {\"diffuse\": [0.5, 0.6, 0.4], \"specular\": 0.5, "
            "\"shininess\": 12%s%s}}]}",
            shape ? "" : "]", mirrors ? ", \"reflection\": 0.5" : "", material);
    return finish(&w);
}

static void shapes_are_lit_as_meshes_are(void **state) {
    static const char *const shapes[] = {
        "\"type\": \"plane\", \"transform\": {\"rotate\": [90, 0, 0]}",
        "\"type\": \"disc\", \"radius\": 70, \"transform\": {\"rotate\": [90, 0, 0]}",
        "\"type\": \"box\", \"size\": [99, 99, 2], \"transform\": {\"translate\": [0, 0, -1]}"};
    static const code tilt = {215, 100, 210};
    const put_name map = put_normals(*state, 1, 1, &tilt, 1);
    const shd_vec3 normal = vector_of(tilt, 1);
    for (size_t k = 0; k < SHD_LENGTH(shapes); k++)
        for (int m = 0; m < 8; m++) {
            const bool shadows = m & 1, behind = m & 2 && k < 2, mirrors = m & 4;
            char *mapped = text_of(", \"normal\": {\"texture\": \"%s\"}", map.text),
                 *one = wide(shapes[k], mapped, normal, shadows, behind, mirrors),
                 *other = wide(NULL, "", normal, shadows, behind, mirrors);
            drawn a = film_of(*state, one), b = film_of(*state, other);
            if (!(film_difference(&a, &b) < 2e-6))
                fail_msg("shape %zu, setting %d: %g", k, m, film_difference(&a, &b));
            drop_drawn(&a);
            drop_drawn(&b);
            free(mapped);
            free(one);
            free(other);
        }
}

/* In spectra, too: of a color, of patterns, which are lit part by part, and along rays that carry
 * wavelengths. */
static void spectra_see_the_same(void **state) {
    static const char plane[] = "\"type\": \"plane\", \"transform\": {\"rotate\": [90, 0, 0]}",
                      glossy[] = "\"lobes\": [{\"shininess\": 5, \"specular\": ",
                      even[] = "{\"pattern\": \"checker\", \"colors\": [[0.3, 0.2, 0.4], "
                               "[0.3, 0.2, 0.4]]}",
                      tinted[] = ", \"transmission\": [0.1, 0.2, 0.05]";
    static const code tilt = {215, 100, 210};
    const put_name map = put_normals(*state, 1, 1, &tilt, 1);
    for (int m = 0; m < 8; m++) {
        const bool shadows = m & 1, mirrors = m & 2, pattern = m & 4;
        char *mapped = text_of(", %s%s}], \"normal\": {\"texture\": \"%s\"}%s", glossy,
                               pattern ? even : "[0.3, 0.2, 0.4]", map.text, mirrors ? tinted : ""),
             *plain = text_of(", %s[0.3, 0.2, 0.4]}]%s", glossy, mirrors ? tinted : ""),
             *a_text = wide(plane, mapped, vector_of(tilt, 1), shadows, false, mirrors),
             *b_text = wide(NULL, plain, vector_of(tilt, 1), shadows, false, mirrors),
             *one = text_of("{\"spectral\": true, %s", a_text + 1),
             *other = text_of("{\"spectral\": true, %s", b_text + 1);
        drawn a = film_of(*state, one), b = film_of(*state, other);
        assert_true(a.request->rendering.plan->bins);
        assert_int_equal(a.request->rendering.plan->part_count > 0, pattern);
        if (!(film_difference(&a, &b) < 2e-6))
            fail_msg("setting %d: %g", m, film_difference(&a, &b));
        drop_drawn(&a);
        drop_drawn(&b);
        free(mapped);
        free(plain);
        free(a_text);
        free(b_text);
        free(one);
        free(other);
    }
}

/* ---- What stays, and what is told. ---- */

static const char bodies[] =
    "{\"image\": {\"width\": 48, \"height\": 36, \"samples\": 4%s}, \"accuracy\": {\"tier\": "
    "\"%s\"}, \"camera\": {\"position\": [1, 2, 5]}, \"trace\": {\"shadows\": %s}, \"lights\": "
    "[%s{\"type\": \"directional\", \"direction\": [-1, -1, -0.4]}], \"materials\": {\"a\": "
    "{\"diffuse\": 0.5, \"specular\": 0.4, \"shininess\": 60%s}}, \"objects\": [{\"type\": "
    "\"disc\", \"radius\": 3, \"material\": \"a\", \"transform\": {\"translate\": [0, -1, 0]}}, "
    "{\"type\": \"%s\", \"material\": \"a\", \"transform\": {\"rotate\": [20, 30, 0], "
    "\"scale\": 0.7}}, {\"type\": \"sphere\", \"material\": \"a\", \"radius\": 0.5, "
    "\"transform\": {\"translate\": [1.4, 0.1, 0]}}]}";

#define LAMP "{\"type\": \"point\", \"position\": [2, 3, 4]}, "

static char *bodies_text(const char *region, const char *tier, bool shadows, const char *lamp,
                         const char *scale, const char *map, const char *shape) {
    char *member = map ? text_of(", \"normal\": {\"texture\": \"%s\", \"scale\": %s, \"uv\": "
                                 "{\"scale\": [6, 3]}}",
                                 map, scale)
                       : text_of("%s", "");
    char *out = text_of(bodies, region, tier, shadows ? "true" : "false", lamp, member, shape);
    free(member);
    return out;
}

/* Bumps of a scale of 0 are the surface itself, in light and shadow, to what rounds. */
static void no_bumps_change_nothing(void **state) {
    static const char *const shapes[] = {"box", "torus", "cylinder", "cone"};
    static const code list[] = {{10, 200, 200}, {250, 30, 255}, {128, 128, 150}};
    const put_name noise = put_normals(*state, 16, 16, list, SHD_LENGTH(list));
    for (size_t k = 0; k < SHD_LENGTH(shapes); k++) {
        char *with = bodies_text("", "exact", k % 2, LAMP, "0", noise.text, shapes[k]),
             *bumpy = bodies_text("", "exact", k % 2, LAMP, "0.3", noise.text, shapes[k]),
             *without = bodies_text("", "exact", k % 2, LAMP, "", NULL, shapes[k]);
        drawn a = film_of(*state, with), b = film_of(*state, without), c = film_of(*state, bumpy);
        assert_below(film_difference(&b, &a), 2e-7);
        const double both =
            a.request->rendering.plan->bound.linear + b.request->rendering.plan->bound.linear;
        for (size_t i = 0; i < 4 * pixels_of(&a); i++)
            assert_true(fabs((double)a.film.rgba[i] - (double)b.film.rgba[i]) <= both);
        assert_true(film_difference(&b, &c) > 0.01);
        assert_true(a.request->rendering.plan->tier == SHD_EXACT);
        drop_drawn(&a);
        drop_drawn(&b);
        drop_drawn(&c);
        free(with);
        free(bumpy);
        free(without);
    }
}

static void parts_are_those_of_the_whole(void **state) {
    const put_name noise = put_noise(*state, 16, 16, 4);
    char *whole = bodies_text("", "exact", true, LAMP, "0.2", noise.text, "torus"),
         *part = bodies_text(", \"region\": [7, 5, 21, 17]", "standard", true, LAMP, "0.2",
                             noise.text, "torus");
    drawn a = film_of(*state, whole), b = film_of(*state, part);
    for (int y = 0; y < 17; y++)
        for (int x = 0; x < 21; x++)
            assert_memory_equal(b.film.rgba + 4 * (y * 21 + x),
                                a.film.rgba + 4 * ((y + 5) * 48 + x + 7), 4 * sizeof(float));
    drop_drawn(&a);
    drop_drawn(&b);
    free(whole);
    free(part);
}

static void bounds_are_told_where_they_are_known(void **state) {
    const put_name noise = put_noise(*state, 8, 8, 5);
    for (int k = 0; k < 4; k++) {
        char *text = bodies_text("", "standard", k % 2, k < 2 ? "" : LAMP, "0.2", noise.text,
                                 k == 3 ? "plane" : "box");
        drawn d = film_of(*state, text);
        const shd_bound *bound = &d.request->rendering.plan->bound;
        assert_int_equal(isfinite(bound->linear) != 0, k < 3);
        if (k < 3) assert_below(bound->linear, 1e-5);
        assert_true(bound->code == 0);
        drop_drawn(&d);
        free(text);
    }
}

/* The layer of normals has what is lit, also where materials are sorted apart. */
static void layers_have_the_normals_that_are_lit(void **state) {
    static const code tilt = {215, 100, 210};
    const put_name map = put_normals(*state, 1, 1, &tilt, 1);
    const shd_vec3 n = vector_of(tilt, 1);
    char *text = text_of(
        "{\"image\": {\"width\": 24, \"height\": 16, \"samples\": 4}, \"camera\": {\"position\": "
        "[0, 0, 4]}, \"objects\": [{\"type\": \"sphere\", \"radius\": 0.4, \"transform\": "
        "{\"translate\": [0, 0, 1]}}, {\"type\": \"box\", \"size\": [9, 9, 1], \"transform\": "
        "{\"translate\": [0, 0, -0.5]}, \"material\": {\"normal\": {\"texture\": \"%s\"}}}], "
        "\"output\": {\"format\": \"exr\", \"bitDepth\": \"float\", \"colorSpace\": "
        "\"lin_rec709\", \"layers\": [\"normal\", \"object\", \"depth\"]}}",
        map.text);
    drawn d = shown_film_of(*state, text);
    size_t seen[2] = {0, 0};
    for (size_t i = 0; i < pixels_of(&d); i++) {
        const float *at = d.film.normal + 3 * i;
        const shd_vec3 normal = {(double)at[0], (double)at[1], (double)at[2]};
        const size_t object = (size_t)d.film.object[i];
        seen[object]++;
        assert_below(fabs(shd_length(normal) - 1), 1e-6);
        if (object) assert_below(shd_length(shd_sub(normal, n)), 1e-6);
        if (object) assert_true(fabsf(d.film.depth[i] - 4) < 1e-5f);
        if (!object) assert_true(d.film.depth[i] < 3.5f);
    }
    assert_true(seen[0] > 10 && seen[1] > 10);
    drop_drawn(&d);
    free(text);
}

/* ---- What is refused. ---- */

static void refuse(void **state, const char *material, const char *object, const char *top,
                   const char *pointer) {
    refuse_text(*state,
                text_of("{%s\"objects\": [{%s, \"material\": {%s}}]}", top, object, material),
                pointer);
}

static void what_has_no_frame_is_refused(void **state) {
    const put_name noise = put_noise(*state, 2, 2, 6);
    char *map = text_of("\"normal\": {\"texture\": \"%s\"}", noise.text),
         *space =
             text_of("\"normal\": {\"texture\": \"%s\", \"space\": \"lin_rec709\"}", noise.text),
         *channel = text_of("\"normal\": {\"texture\": \"%s\", \"channel\": \"R\"}", noise.text),
         *large = text_of("\"normal\": {\"texture\": \"%s\", \"scale\": 1e9}", noise.text);
    char *colored =
        text_of("%s, \"opacity\": {\"pattern\": \"noise\", \"colors\": [\"red\", 1]}", map);
    static const char ball[] = "\"type\": \"sphere\"", at[] = "/objects/0/material/normal";
    refuse(state, space, ball, "", "/objects/0/material/normal/space");
    refuse(state, channel, ball, "", "/objects/0/material/normal/channel");
    refuse(state, large, ball, "", "/objects/0/material/normal/scale");
    refuse(state, "\"normal\": [0, 0, 1]", ball, "", at);
    refuse(state, colored, ball, "\"spectral\": true, \"trace\": {\"depth\": 1}, ", "/objects/0");
    refuse(state, map, "\"type\": \"mesh\", \"positions\": [0, 0, 0, 1, 0, 0, 0, 1, 0]", "",
           "/objects/0");
    free(map);
    free(colored);
    free(space);
    free(channel);
    free(large);
}

/* Tags tell maps and scales apart, and keep what they were. */
static void tags_tell_maps_apart(void **state) {
    const put_name one = put_noise(*state, 2, 2, 7), other = put_noise(*state, 2, 2, 8);
    const char *const maps[] = {one.text, one.text, other.text, NULL, one.text}, *const scales[] = {
                                                                                     "1", "0.5",
                                                                                     "1", "",
                                                                                     "1.0"};
    char digests[5][33];
    for (size_t k = 0; k < 5; k++) {
        char *text = bodies_text("", "exact", false, "", scales[k], maps[k], "box");
        shd_request *request = read_scene(*state, text);
        memcpy(digests[k], request->scene->digest, sizeof digests[k]);
        shd_request_drop(request);
        free(text);
    }
    for (size_t a = 0; a < 4; a++)
        for (size_t b = 0; b < a; b++) assert_string_not_equal(digests[a], digests[b]);
    assert_string_equal(digests[4], digests[0]);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(one_normal_is_that_of_vertices),
        cmocka_unit_test(shapes_are_lit_as_meshes_are),
        cmocka_unit_test(spectra_see_the_same),
        cmocka_unit_test(no_bumps_change_nothing),
        cmocka_unit_test(parts_are_those_of_the_whole),
        cmocka_unit_test(bounds_are_told_where_they_are_known),
        cmocka_unit_test(layers_have_the_normals_that_are_lit),
        cmocka_unit_test(what_has_no_frame_is_refused),
        cmocka_unit_test(tags_tell_maps_apart),
    };
    return cmocka_run_group_tests(tests, make_engine, drop_engine);
}
