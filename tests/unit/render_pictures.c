/* Pictures that documents name: texels in the space they are wanted in, what tells them apart, and
 * what of them is kept. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>
#include <math.h>

#include "assets/store.h"
#include "image/image.h"
#include "png_file.h"
#include "render/engine.h"
#include "render/pictures.h"

enum { WIDTH = 4, HEIGHT = 3, PIXELS = WIDTH * HEIGHT };

static shd_engine *engine_of(size_t store, const char *folder) {
    shd_engine_options options = shd_engine_defaults();
    shd_engine *engine;
    shd_error error;
    options.threads = 1;
    options.queue = 0;
    options.mesh_store = store;
    options.assets = folder;
    assert_int_equal(shd_engine_new(&options, &engine, &error), SHD_OK);
    return engine;
}

static shd_request *request_of(shd_engine *engine) {
    shd_request *request;
    shd_error error;
    assert_int_equal(shd_request_new(engine, &request, &error), SHD_OK);
    return request;
}

static void make_samples(uint8_t samples[4 * PIXELS]) {
    for (int i = 0; i < 4 * PIXELS; i++) samples[i] = (uint8_t)(5 * i);
}

/* Puts a file and gives its name. */
static void put(shd_engine *engine, shd_bytes file, char name[80]) {
    shd_request *request = request_of(engine);
    const shd_digest digest = shd_digest_of(file.data, file.size);
    bool known = true;
    assert_int_equal(
        shd_request_keep_asset(request, file.data, file.size, &digest, "somebody", &known), SHD_OK);
    assert_false(known);
    strcpy(name, "sha256-");
    shd_digest_write(&digest, name + 7);
    shd_request_drop(request);
}

static shd_picture_wish wish_of(const shd_engine *engine, const char *name, const char *space,
                                const char *working) {
    return (shd_picture_wish){.name = name,
                              .space = space ? shd_catalog_space(&engine->catalog, space) : NULL,
                              .working =
                                  working ? shd_catalog_space(&engine->catalog, working) : NULL};
}

static const shd_texels *take(shd_request *request, const char *name, const char *space,
                              const char *working) {
    const shd_picture_wish wish = wish_of(request->rendering.engine, name, space, working);
    const shd_texels *texels = NULL;
    shd_error error = {.text = ""};
    const shd_status status = shd_request_texels(request, &wish, &texels, &error);
    if (status != SHD_OK) print_message("%s\n", error.text);
    assert_int_equal(status, SHD_OK);
    return texels;
}

static double decode_srgb(double v) {
    return v <= 0.04045 ? v / 12.92 : pow((v + 0.055) / 1.055, 2.4);
}

static void texels_are_converted_and_straight(void **state) {
    (void)state;
    uint8_t samples[4 * PIXELS];
    char name[80];
    make_samples(samples);
    shd_bytes file = png_file_of(WIDTH, HEIGHT, samples);
    shd_engine *engine = engine_of(1 << 20, NULL);
    put(engine, file, name);
    shd_request *request = request_of(engine);
    const shd_texels *color = take(request, name, NULL, "lin_rec709"),
                     *data = take(request, name, NULL, NULL),
                     *linear = take(request, name, "lin_rec709", "lin_rec709");
    assert_int_equal(color->width, WIDTH);
    assert_int_equal(color->height, HEIGHT);
    assert_int_equal(color->colors, 3);
    assert_true(color->alpha && color->integers && !color->held);
    for (int i = 0; i < 4 * PIXELS; i++) {
        const double code = samples[i] / 255.0;
        /* OpenColorIO's curve and matrix in f32. */
        assert_float_equal(color->rgba[i], (i % 4 < 3 ? decode_srgb(code) : code), 1e-6);
        assert_float_equal(data->rgba[i], code, 1e-7);
        assert_float_equal(linear->rgba[i], code, 1e-7);
        assert_true(data->rgba[i] >= data->low[i % 4] && data->rgba[i] <= data->high[i % 4]);
    }
    assert_float_equal(data->low[0], 0, 0);
    assert_float_equal(data->high[3], 235 / 255.0, 1e-7);
    /* Found again, by any name of the space; and told apart from what has other texels. */
    assert_ptr_equal(take(request, name, "sRGB", "lin_rec709"), color);
    assert_ptr_equal(take(request, name, "srgb", "scene_linear"), color);
    assert_false(shd_digest_same(&color->key, &data->key));
    assert_false(shd_digest_same(&color->key, &linear->key));
    assert_false(shd_digest_same(&data->key, &linear->key));
    assert_true(shd_digest_same(&color->file, &data->file));
    shd_request_drop(request);
    /* By another request, too: nothing is decoded or converted again. */
    shd_request *later = request_of(engine);
    const shd_store_load before = shd_store_load_of(engine->store);
    const shd_texels *again = take(later, name, NULL, "lin_rec709");
    const shd_store_load after = shd_store_load_of(engine->store);
    assert_ptr_equal(again, color);
    assert_int_equal(after.hits - before.hits, 2);
    assert_int_equal(after.misses, before.misses);
    shd_request_drop(later);
    shd_engine_drop(engine);
    free(file.data);
}

static void what_is_too_large_to_be_kept_is_the_requests(void **state) {
    (void)state;
    enum { SIDE = 64 };
    uint8_t *samples = calloc(SIDE * SIDE, 4);
    char name[80];
    shd_bytes file = png_file_of(SIDE, SIDE, samples);
    /* Texels take 64 KB, of which half of the cap has 50. */
    shd_engine *engine = engine_of(100 << 10, NULL);
    put(engine, file, name);
    for (int i = 0; i < 2; i++) {
        shd_request *request = request_of(engine);
        const shd_texels *texels = take(request, name, NULL, "lin_rec709");
        assert_int_equal(texels->width, SIDE);
        assert_true(request->held_bytes > 64 << 10);
        assert_true(shd_store_load_of(engine->store).bytes < 20 << 10);
        shd_request_drop(request);
    }
    shd_request *request = request_of(engine);
    shd_request_hold(request, 60 << 10);
    const shd_picture_wish wish = wish_of(engine, name, NULL, "lin_rec709");
    const shd_texels *texels;
    shd_error error;
    assert_int_equal(shd_request_texels(request, &wish, &texels, &error), SHD_LIMIT);
    assert_int_equal(error.limit, SHD_LIMIT_MEMORY);
    shd_request_drop(request);
    shd_engine_drop(engine);
    free(file.data);
    free(samples);
}

static void fails(shd_request *request, const char *name, shd_status status, const char *words) {
    const shd_picture_wish wish = wish_of(request->rendering.engine, name, NULL, "lin_rec709");
    const shd_texels *texels;
    shd_error error;
    assert_int_equal(shd_request_texels(request, &wish, &texels, &error), status);
    if (!strstr(error.text, words)) fail_msg("%s: %s", words, error.text);
}

static void operators_pictures_have_names(void **state) {
    (void)state;
    char folder[] = "/tmp/shaded-assets-XXXXXX", path[128], unknown[80] = "sha256-";
    uint8_t samples[4 * PIXELS];
    make_samples(samples);
    shd_bytes file = png_file_of(WIDTH, HEIGHT, samples);
    assert_non_null(mkdtemp(folder));
    static const char *const names[] = {"brick.png", "broken.png", ".hidden.png", "notes.txt",
                                        "with blank.png"};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        snprintf(path, sizeof path, "%s/%s", folder, names[i]);
        FILE *out = fopen(path, "wb");
        fwrite(file.data, 1, i == 1 ? file.size - 20 : file.size, out);
        fclose(out);
    }
    shd_engine *engine = engine_of(1 << 20, folder);
    shd_request *request = request_of(engine);
    const shd_texels *texels = take(request, "brick.png", NULL, "lin_rec709");
    assert_int_equal(texels->height, HEIGHT);
    assert_ptr_equal(take(request, "brick.png", NULL, "lin_rec709"), texels);
    fails(request, "brik.png", SHD_SCENE, "did you mean \"brick.png\"");
    fails(request, "broken.png", SHD_SCENE, "PNG");
    fails(request, ".hidden.png", SHD_SCENE, "unknown asset");
    fails(request, "notes.txt", SHD_SCENE, "unknown asset");
    fails(request, "with blank.png", SHD_SCENE, "unknown asset");
    fails(request, "../brick.png", SHD_SCENE, "unknown asset");
    fails(request, "", SHD_SCENE, "unknown asset");
    fails(request, "sha256-12", SHD_SCENE, "64 hexadecimal digits");
    memset(unknown + 7, 'a', 64);
    fails(request, unknown, SHD_MISSING, unknown);
    shd_request_drop(request);
    shd_engine_drop(engine);
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        snprintf(path, sizeof path, "%s/%s", folder, names[i]);
        unlink(path);
    }
    rmdir(folder);
    free(file.data);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(texels_are_converted_and_straight),
        cmocka_unit_test(what_is_too_large_to_be_kept_is_the_requests),
        cmocka_unit_test(operators_pictures_have_names),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
