/* What is kept between requests changes no byte, and is used where it can be. */
#include <pthread.h>

#include "property/pieces.h"
#include "property/reused.h"

typedef struct change {
    const char *red, *light, *shininess, *radius;
} change;

static char *scene(change c, int samples, const char *tier) {
    return text_of(
        "{\"image\": {\"width\": 150, \"height\": 130, \"samples\": %d}, \"accuracy\": {\"tier\": "
        "\"%s\"}, \"background\": [0.1, 0, 0], \"ambient\": 0.1, \"lights\": [{\"type\": "
        "\"point\", "
        "\"position\": [%s, 2, 3], \"attenuation\": [1, 0.1, 0]}, {\"type\": \"directional\", "
        "\"direction\": [0, -1, -1], \"color\": [0.2, 0.3, 0.4]}], \"objects\": [{\"type\": "
        "\"sphere\", \"radius\": %s, \"material\": {\"diffuse\": [%s, 0.4, 0.2], \"specular\": "
        "0.3, "
        "\"shininess\": %s}}, {\"type\": \"torus\", \"material\": {\"diffuse\": [0.2, %s, 0.2]}}]}",
        samples, tier, c.light, c.radius, c.red, c.shininess, c.red);
}

static const change first = {"0.6", "1", "50", "1"};
static const struct {
    change to;
    shd_reused reused;
} steps[] = {{{"0.6", "1", "50", "1"}, SHD_REUSED_NOTHING},
             {{"0.6", "1", "50", "1"}, SHD_REUSED_LIGHT},        /* the same again */
             {{"0.7", "1", "50", "1"}, SHD_REUSED_LIGHT},        /* a color */
             {{"0.7", "1.5", "50", "1"}, SHD_REUSED_GEOMETRY},   /* a light */
             {{"0.7", "1", "80", "1"}, SHD_REUSED_GEOMETRY},     /* a shininess */
             {{"0.8", "1.5", "50", "1"}, SHD_REUSED_LIGHT},      /* a color under that light */
             {{"0.8", "1.5", "50", "0.9"}, SHD_REUSED_NOTHING}}; /* a shape */

static void pictures_are_the_same_and_work_is_saved(void **state) {
    (void)state;
    static const char *const tiers[] = {"standard", "exact", "standard",
                                        "exact",    "draft", "standard"};
    static const int samples[] = {4, 4, 1, 1, 4, 16};
    for (int k = 0; k < 6; k++) {
        const char *tier = tiers[k];
        shd_engine *keeps = new_engine_that_keeps((size_t)64 << 20, 2, NULL),
                   *forgets = new_engine_that_keeps(0, 2, NULL);
        for (size_t i = 0; i < sizeof steps / sizeof steps[0]; i++) {
            char *json = scene(steps[i].to, samples[k], tier);
            const shd_reused reused = reused_for(keeps, forgets, json);
            /* Which blocks of a draft are smooth depends on colors. */
            const bool colored = k == 4 && i != 1 && steps[i].reused == SHD_REUSED_LIGHT;
            assert_int_equal(reused, k == 1 || k == 3 ? SHD_REUSED_NOTHING
                                     : colored        ? SHD_REUSED_GEOMETRY
                                                      : steps[i].reused);
        }
        shd_engine_drop(keeps);
        shd_engine_drop(forgets);
    }
}

/* Drafts of these variants of a scene share what is seen, but no light. */
static void check_drafts(const char *written, const char *const variants[], int count) {
    shd_engine *keeps = new_engine_that_keeps((size_t)64 << 20, 2, NULL),
               *forgets = new_engine_that_keeps(0, 2, NULL);
    for (int i = 0; i < count; i++)
        assert_int_equal(reused_for(keeps, forgets, text_of(written, variants[i])),
                         i ? SHD_REUSED_GEOMETRY : SHD_REUSED_NOTHING);
    shd_engine_drop(keeps);
    shd_engine_drop(forgets);
}

/* Ambient light, like all colors, may hide what one sample of a draft is off. Under a spot, drafts
 * are not sketched. */
static void drafts_know_ambient_light(void **state) {
    (void)state;
    static const char *const ambients[] = {"2", "0"};
    check_drafts(
        "{\"image\": {\"width\": 64, \"height\": 48}, \"accuracy\": {\"tier\": \"draft\"}, "
        "\"output\": {\"format\": \"png\", \"bitDepth\": 16}, \"ambient\": %s, \"lights\": "
        "[{\"type\": \"spot\", \"position\": [3, 2, 3], \"direction\": [-3, -2, -3], "
        "\"angle\": 60, \"penumbra\": 0, \"intensity\": 0.5}], \"objects\": "
        "[{\"type\": \"sphere\", \"radius\": 1.4, \"material\": {\"specular\": 0.1}}]}",
        ambients, 2);
}

/* Budgets leave drafts different rooms, and what is left out in a larger one is not within a
 * smaller one. One light leaves nothing else out, so that its sums are kept. */
static void drafts_know_their_room(void **state) {
    (void)state;
    static const char *const most[] = {"0.05", "0.001", "0.0003"};
    check_drafts("{\"image\": {\"width\": 64, \"height\": 48}, \"accuracy\": {\"maxError\": %s, "
                 "\"metric\": \"linear\"}, \"output\": {\"format\": \"png\", \"bitDepth\": 16}, "
                 "\"lights\": [{\"type\": \"spot\", \"position\": [3, 2, 3], \"direction\": "
                 "[-3, -2, -3], \"angle\": 60, \"penumbra\": 0.2}], \"objects\": "
                 "[{\"type\": \"sphere\", \"radius\": 1.4}]}",
                 most, 3);
}

/* Sums of light do not know colors, however large these are. */
static void colors_of_any_size_keep_the_light(void **state) {
    (void)state;
    shd_engine *keeps = new_engine_that_keeps((size_t)64 << 20, 2, NULL),
               *forgets = new_engine_that_keeps(0, 2, NULL);
    static const char *const reds[] = {"0.9", "1.1", "3", "0.01", "40"};
    for (int i = 0; i < 5; i++) {
        change c = first;
        c.red = reds[i];
        char *json = scene(c, 4, "standard");
        assert_int_equal(reused_for(keeps, forgets, json),
                         i ? SHD_REUSED_LIGHT : SHD_REUSED_NOTHING);
    }
    shd_engine_drop(keeps);
    shd_engine_drop(forgets);
}

/* Sums hold the lights whose color a material has something of, and depend on the places of lights
 * in the list and on how many there are: none of it is taken for something else. */
static void lists_of_lights_are_told_apart(void **state) {
    (void)state;
    static const char *const scenes[] = {
        "{\"lights\": [{\"type\": \"point\", \"color\": [1, 0, 0]}, {\"type\": "
        "\"directional\", \"direction\": [1, -1, -1], \"color\": [0, 1, 1]}], \"objects\": "
        "[{\"type\": \"sphere\", \"material\": {\"diffuse\": [%s, 0.5, 0.5]}}, {\"type\": "
        "\"torus\", \"material\": {\"diffuse\": 0.4}}]}",
        "{\"output\": {\"format\": \"png\", \"bitDepth\": 16}, \"image\": {\"samples\": 1}, "
        "\"lights\": [%s{\"type\": \"point\"}, {\"type\": \"directional\", \"direction\": "
        "[1, -1, -1]}, {\"type\": \"point\", \"position\": [-3, 1, 2]}, {\"type\": \"point\", "
        "\"position\": [3, 1, 2]}, {\"type\": \"point\", \"position\": [1, 4, 2]}], \"objects\": "
        "[{\"type\": \"sphere\", \"material\": {\"specular\": 0.5}}]}"};
    static const char *const parts[][3] = {
        {"0", "0.5", "0"},
        {"", "{\"type\": \"ambient\"}, ",
         "{\"type\": \"ambient\", \"color\": 0}, {\"type\": \"ambient\", \"color\": 0}, "}};
    for (int k = 0; k < 2; k++) {
        shd_engine *keeps = new_engine_that_keeps((size_t)64 << 20, 2, NULL),
                   *forgets = new_engine_that_keeps(0, 2, NULL);
        for (int i = 0; i < 3; i++) {
            char *json = text_of(scenes[k], parts[k][i]);
            reused_for(keeps, forgets, json);
        }
        shd_engine_drop(keeps);
        shd_engine_drop(forgets);
    }
}

/* More pictures than fit: the cap holds, the latest stay. */
/* What is kept are sums of all lights together. */
static void planes_of_single_lights_are_not_kept(void **state) {
    (void)state;
    static const char *const layers[] = {"diffuse", "light.0", "light.1"};
    shd_engine *keeps = new_engine_that_keeps((size_t)64 << 20, 2, NULL),
               *forgets = new_engine_that_keeps(0, 2, NULL);
    for (int i = 0; i < 6; i++) {
        char *json = text_of("{\"image\": {\"width\": 64, \"height\": 48}, \"lights\": [{\"type\": "
                             "\"point\"}, {\"type\": \"directional\", \"color\": [1, 0.5, 0]}], "
                             "\"objects\": [{\"type\": \"sphere\"}], \"output\": {\"format\": "
                             "\"exr\", \"layers\": [\"beauty\", \"%s\"]}}",
                             layers[i % 3]);
        assert_int_equal(reused_for(keeps, forgets, json), SHD_REUSED_NOTHING);
    }
    shd_engine_drop(keeps);
    shd_engine_drop(forgets);
}

static void the_cap_holds(void **state) {
    (void)state;
    const size_t cap = (size_t)6 << 20;
    shd_engine *engine = new_engine_that_keeps(cap, 2, NULL);
    for (int i = 0; i < 20; i++) {
        change c = first;
        char *radius = text_of("%g", 0.5 + 0.02 * i);
        c.radius = radius;
        char *json = scene(c, 1, "standard");
        shd_reused reused;
        free(file_of(engine, json, &reused).data);
        assert_int_equal(reused, SHD_REUSED_NOTHING);
        free(file_of(engine, json, &reused).data);
        assert_int_equal(reused, SHD_REUSED_LIGHT);
        const shd_reuse_load load = shd_engine_reuse(engine);
        assert_true(load.bytes <= cap && load.bytes > 0);
        assert_int_equal(load.cap, cap);
        assert_int_equal(load.light_hits, i + 1);
        assert_int_equal(load.light_misses, i + 1);
        free(radius);
        free(json);
    }
    shd_engine_drop(engine);
}

/* A picture that would fill the cap is rendered and not kept. */
static void what_is_too_large_is_not_kept(void **state) {
    (void)state;
    shd_engine *engine = new_engine_that_keeps((size_t)1 << 17, 2, NULL);
    char *json = scene(first, 4, "standard");
    for (int i = 0; i < 2; i++) {
        shd_reused reused;
        free(file_of(engine, json, &reused).data);
        assert_int_equal(reused, SHD_REUSED_NOTHING);
    }
    assert_int_equal(shd_engine_reuse(engine).bytes, 0);
    free(json);
    shd_engine_drop(engine);
}

/* ---- Threads. ---- */

typedef struct worker {
    shd_engine *engine;
    file expected[4];
    bool same;
} worker;

static const char *const reds[] = {"0.5", "0.55", "0.6", "0.65"};

static void *work(void *context) {
    worker *w = context;
    w->same = true;
    for (int i = 0; i < 24; i++) {
        change c = first;
        c.red = reds[i % 4];
        c.light = i % 3 ? "1" : "2";
        char *json = scene(c, 1, "standard");
        file a = {NULL, 0};
        if (try_png_of(w->engine, json, &a) != SHD_OK) w->same = false;
        if (i % 3) w->same &= same_file(a, w->expected[i % 4]);
        free(a.data);
        free(json);
    }
    return NULL;
}

static void threads_share_records(void **state) {
    (void)state;
    /* Small, so that records go while others are in use. */
    shd_engine *engine = new_engine_that_keeps((size_t)5 << 20, 2, NULL),
               *forgets = new_engine_that_keeps(0, 2, NULL);
    worker workers[4];
    file expected[4];
    for (int i = 0; i < 4; i++) {
        change c = first;
        c.red = reds[i];
        char *json = scene(c, 1, "standard");
        expected[i] = file_of(forgets, json, &(shd_reused){0});
        free(json);
    }
    pthread_t threads[4];
    for (int i = 0; i < 4; i++) {
        workers[i] = (worker){.engine = engine};
        memcpy(workers[i].expected, expected, sizeof expected);
        assert_int_equal(pthread_create(&threads[i], NULL, work, &workers[i]), 0);
    }
    for (int i = 0; i < 4; i++) {
        pthread_join(threads[i], NULL);
        assert_true(workers[i].same);
    }
    for (int i = 0; i < 4; i++) free(expected[i].data);
    shd_engine_drop(engine);
    shd_engine_drop(forgets);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(pictures_are_the_same_and_work_is_saved),
        cmocka_unit_test(drafts_know_ambient_light),
        cmocka_unit_test(drafts_know_their_room),
        cmocka_unit_test(colors_of_any_size_keep_the_light),
        cmocka_unit_test(lists_of_lights_are_told_apart),
        cmocka_unit_test(planes_of_single_lights_are_not_kept),
        cmocka_unit_test(the_cap_holds),
        cmocka_unit_test(what_is_too_large_is_not_kept),
        cmocka_unit_test(threads_share_records),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
