/* Pictures on surfaces: what they look like, what is reused, and that tiers differ by no more than
 * is said. */
#include "property/pieces.h"
#include "property/put_picture.h"

/* A floor, a ball and a square; `diffuse` is the ball's. */
static const char all[] =
    "{\"image\": {\"width\": 64, \"height\": 48, \"samples\": %d}, \"accuracy\": {\"tier\": "
    "\"%s\"}, \"camera\": {\"position\": [0, 1.9, 6.2], \"target\": [0, 0.62, 0], \"fov\": 34}, "
    "\"ambient\": 0.2, \"background\": [0.1, 0.2, 0.3], %s\"lights\": [{\"type\": \"point\", "
    "\"position\": [4, 6, 5], \"attenuation\": [0.5, 0.05, 0]}, {\"type\": \"directional\", "
    "\"direction\": [1, -0.6, -0.5], \"color\": %s}], \"objects\": [{\"type\": \"plane\", "
    "\"material\": {\"diffuse\": {\"texture\": \"%s\", \"uv\": {\"scale\": 0.8, \"rotate\": "
    "24}}}}, "
    "{\"type\": \"sphere\", \"radius\": 0.62, \"material\": {\"diffuse\": %s, \"specular\": "
    "{\"texture\": \"%s\", \"channel\": \"A\", \"tint\": [0.9, 0.2, 0.1], \"uv\": {\"wrap\": "
    "\"mirror\"}}}, \"transform\": {\"translate\": [0, 0.62, 0.6]}}, {\"type\": \"mesh\", "
    "\"positions\": [-2.4, 0, -2.2, -1.4, 0, -2.5, -1.4, 1.5, -2.5, -2.4, 1.5, -2.2], "
    "\"indices\": [0, 1, 2, 0, 2, 3], \"uvs\": [0, 0, 1, 0, 1, 1, 0, 1], \"material\": "
    "{\"emissive\": {\"texture\": \"%s\", \"uv\": {\"scale\": 2, \"wrap\": \"clamp\"}}}}]}";

#define GREY "[0.4, 0.4, 0.4]"
#define BLUE "[0.2, 0.3, 0.5]"

typedef struct view {
    int samples;
    const char *tier, *more, *light, *floor, *tint;
} view;

/* The ball and the square have a picture of noise. */
static char *write_view(shd_engine *engine, view v) {
    const put_name noise = put_noise(engine, 33, 20, 3);
    char *diffuse = text_of("{\"texture\": \"%s\", \"tint\": %s}", noise.text, v.tint),
         *text = text_of(all, v.samples, v.tier, v.more, v.light, v.floor, diffuse, noise.text,
                         noise.text);
    free(diffuse);
    return text;
}

static void tiers_differ_by_no_more_than_is_said(void **state) {
    const put_name checks = put_checks(*state, 32);
    for (int k = 0; k < 4; k++) {
        view v = {k < 2 ? 1 : 4, "standard", "", k % 2 ? GREY : BLUE, checks.text, "0.8"};
        char *fast = write_view(*state, v);
        v.tier = "exact";
        char *full = write_view(*state, v);
        drawn a = film_of(*state, fast), b = film_of(*state, full);
        check_bound(&a, &b, 1e-4);
        drop_drawn(&a);
        drop_drawn(&b);
        free(fast);
        free(full);
    }
}

/* A picture of one color is that color, whatever it multiplies, and however small it is. */
static void one_color_is_that_color(void **state) {
    static const uint8_t white[] = {255, 255, 255, 255};
    const put_name name = put_picture(*state, 1, 1, white);
    static const char with[] =
        "{\"image\": {\"width\": 64, \"height\": 48}, \"ambient\": 0.1, \"lights\": [{\"type\": "
        "\"point\", \"position\": [2, 3, 4], \"color\": [1, 0.8, 0.6]}], \"accuracy\": {\"tier\": "
        "\"%s\"}, \"objects\": [{\"type\": \"torus\", \"material\": {\"emissive\": %s, "
        "\"diffuse\": %s, \"specular\": %s}, \"transform\": {\"rotate\": [60, 0, 0]}}]}";
    for (int exact = 0; exact < 2; exact++) {
        const char *tier = exact ? "exact" : "standard";
        static const char *const tints[] = {"[0.1, 0, 0.2]", "[0.3, 0.5, 0.7]", "0.4"};
        char *pictures[3];
        for (int i = 0; i < 3; i++)
            pictures[i] = text_of("{\"texture\": \"%s\", \"tint\": %s}", name.text, tints[i]);
        char *one = text_of(with, tier, tints[0], tints[1], tints[2]),
             *other = text_of(with, tier, pictures[0], pictures[1], pictures[2]);
        drawn a = film_of(*state, one), b = film_of(*state, other);
        assert_below(film_difference(&a, &b), exact ? 1e-7 : 1e-6);
        drop_drawn(&a);
        drop_drawn(&b);
        for (int i = 0; i < 3; i++) free(pictures[i]);
        free(one);
        free(other);
    }
}

static char *etag_and_bytes(shd_engine *engine, const char *json, shd_picture *out,
                            shd_reused *reused) {
    shd_request *request = read_scene(engine, json);
    shd_error error;
    char *etag = strdup(shd_request_etag(request));
    size_t count;
    assert_int_equal(shd_request_render(request, NULL, &error), SHD_OK);
    *out = shd_request_pictures(request, &count)[0];
    out->data = shd_request_take(request, 0);
    *reused = shd_request_reused(request);
    shd_request_drop(request);
    return etag;
}

/* Another tint casts and lights nothing, another picture casts nothing; each has its own tag. */
static void tints_keep_light(void **state) {
    (void)state;
    static const struct {
        int picture;
        const char *light, *tint;
        shd_reused reused;
    } steps[] = {{0, BLUE, "0.8", SHD_REUSED_NOTHING},
                 {0, BLUE, "[0.9, 0.2, 0.1]", SHD_REUSED_LIGHT},
                 {1, BLUE, "0.8", SHD_REUSED_GEOMETRY},
                 {1, GREY, "0.8", SHD_REUSED_GEOMETRY},
                 {0, BLUE, "0.1", SHD_REUSED_LIGHT}};
    enum { COUNT = sizeof steps / sizeof steps[0] };
    char *tags[COUNT];
    shd_engine *keeps = new_engine_that_keeps((size_t)64 << 20, 2, NULL),
               *forgets = new_engine_that_keeps(0, 1, NULL);
    shd_engine *const engines[] = {keeps, forgets};
    for (size_t i = 0; i < COUNT; i++) {
        shd_picture files[2];
        shd_reused reused[2];
        for (int e = 0; e < 2; e++) {
            const put_name floors[] = {put_checks(engines[e], 8), put_checks(engines[e], 7)};
            char *json =
                write_view(engines[e], (view){4, "standard", "", steps[i].light,
                                              floors[steps[i].picture].text, steps[i].tint});
            char *tag = etag_and_bytes(engines[e], json, &files[e], &reused[e]);
            if (e)
                assert_string_equal(tag, tags[i]), free(tag);
            else
                tags[i] = tag;
            free(json);
        }
        if (files[0].size != files[1].size || memcmp(files[0].data, files[1].data, files[0].size))
            fail_msg("step %zu", i);
        assert_int_equal(reused[0], steps[i].reused);
        for (size_t k = 0; k < i; k++) assert_string_not_equal(tags[k], tags[i]);
        for (int e = 0; e < 2; e++) free(files[e].data);
    }
    for (size_t i = 0; i < COUNT; i++) free(tags[i]);
    shd_engine_drop(keeps);
    shd_engine_drop(forgets);
}

static void regions_and_kernels_see_the_same(void **state) {
    const put_name checks = put_checks(*state, 32);
    const view v = {4, "exact", "", BLUE, checks.text, "0.8"};
    char *whole = write_view(*state, v);
    shd_engine *other = new_engine_of(1, "portable");
    put_checks(other, 32);
    free(write_view(other, v));
    check_region(*state, other, whole);
    shd_engine_drop(other);
    free(whole);
}

static void refuse(shd_engine *engine, const char *texture, uint64_t memory, shd_status status,
                   const char *pointer, const char *words) {
    char *json =
        text_of("{\"materials\": {\"m\": {\"diffuse\": {\"texture\": \"%s\"}}}, \"objects\": "
                "[{\"type\": \"sphere\", \"material\": \"m\"}]}",
                texture);
    shd_request *request;
    shd_error error;
    assert_int_equal(shd_request_new(engine, &request, &error), SHD_OK);
    if (memory) shd_request_hold(request, memory);
    assert_int_equal(shd_request_read(request, json, strlen(json), SHD_PNG), status);
    const shd_problem *problem = &shd_request_report(request)->errors[0];
    assert_string_equal(problem->pointer, pointer);
    if (!strstr(problem->detail, words)) fail_msg("%s: %s", words, problem->detail);
    shd_request_drop(request);
    free(json);
}

static void what_is_not_there_is_told(void **state) {
    static const char at[] = "/materials/m/diffuse/texture";
    const put_name noise = put_noise(*state, 400, 400, 9);
    char missing[80] = "sha256-";
    memset(missing + 7, 'b', 64);
    refuse(*state, missing, 0, SHD_MISSING, at, missing);
    refuse(*state, "sha256-12", 0, SHD_SCENE, at, "64 hexadecimal digits");
    refuse(*state, "brick.png", 0, SHD_SCENE, at, "no assets have names here");
    refuse(*state, "../../etc/passwd", 0, SHD_SCENE, at, "no assets have names here");
    /* Its texels alone, and its texels without the levels. */
    refuse(*state, noise.text, 2 << 20, SHD_LIMIT, at, "`memory`");
    refuse(*state, noise.text, 3 << 20, SHD_LIMIT, at, "`memory`");
}

/* Each wish of a scene is fulfilled once, and there are not too many. */
static void wishes_are_counted(void **state) {
    static const uint8_t white[] = {255, 255, 255, 255};
    const put_name name = put_picture(*state, 1, 1, white);
    for (int more = 0; more < 2; more++) {
        writing w;
        start(&w);
        fputs("{\"materials\": {", w.out);
        for (int i = 0; i < 300; i++)
            if (more)
                fprintf(w.out, "%s\"m%d\": {\"diffuse\": {\"texture\": \"t%d.png\"}}",
                        i ? ", " : "", i, i);
            else
                fprintf(w.out, "%s\"m%d\": {\"diffuse\": {\"texture\": \"%s\"}}", i ? ", " : "", i,
                        name.text);
        fputs("}, \"objects\": [{\"type\": \"sphere\", \"material\": \"m7\"}]}", w.out);
        char *json = finish(&w);
        shd_request *request;
        shd_error error;
        assert_int_equal(shd_request_new(*state, &request, &error), SHD_OK);
        assert_int_equal(shd_request_read(request, json, strlen(json), SHD_PNG),
                         more ? SHD_SCENE : SHD_OK);
        const shd_report *report = shd_request_report(request);
        assert_int_equal(report->error_count, more ? 300 : 0);
        shd_request_drop(request);
        free(json);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(tiers_differ_by_no_more_than_is_said),
        cmocka_unit_test(one_color_is_that_color),
        cmocka_unit_test(tints_keep_light),
        cmocka_unit_test(regions_and_kernels_see_the_same),
        cmocka_unit_test(what_is_not_there_is_told),
        cmocka_unit_test(wishes_are_counted),
    };
    return cmocka_run_group_tests(tests, make_engine, drop_engine);
}
