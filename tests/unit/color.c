/* Transforms and their cache: identity, alpha, splits, threads, metadata. */
#include <math.h>
#include <pthread.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "color/color.h"

enum { SPACES = 39, DISPLAYS = 8, VIEWS = 34, MOST = 80 };
enum { PIXELS = 2500 }; /* over two blocks, with a tail that no vector width divides */

static shd_color_config *config;
static _Thread_local shd_color_lease *lease; /* of all transforms */

static int load(void **state) {
    (void)state;
    /* A user's variables must not reach the colors; the first load removes them. */
    setenv("OCIO_ACTIVE_VIEWS", "Raw", 1);
    setenv("OCIO_INACTIVE_COLORSPACES", "sRGB", 1);
    setenv("OCIO_OPTIMIZATION_FLAGS", "0xffffffff", 1);
    return shd_color_config_load(NULL, &config, NULL) != SHD_OK;
}

static int drop(void **state) {
    (void)state;
    shd_color_lease_drop(lease);
    shd_color_config_drop(config);
    return 0;
}

/* Every transform from lin_rec709, spaces first; the count is returned. */
static size_t all_transforms(shd_color_config *from, const shd_color_transform *out[MOST]) {
    const shd_catalog *catalog = shd_color_catalog(from);
    size_t count = 0;
    shd_status bad = SHD_OK;
    for (size_t i = 0; i < catalog->space_count; i++)
        bad |= shd_color_to_space(from, "lin_rec709", catalog->spaces[i].name, &lease,
                                  &out[count++], NULL);
    for (size_t i = 0; i < catalog->display_count; i++)
        for (size_t j = 0; j < catalog->displays[i].view_count; j++)
            bad |= shd_color_to_view(from, "lin_rec709", catalog->displays[i].name,
                                     catalog->displays[i].views[j], &lease, &out[count++], NULL);
    return bad ? 0 : count;
}

/* Dark, bright, grey, negative and saturated pixels with odd alphas. */
static void fill(float *rgba) {
    uint32_t seed = 12345;
    for (int i = 0; i < 4 * PIXELS; i++) {
        seed = seed * 1664525 + 1013904223;
        float unit = (float)(seed >> 8) / 16777216;
        rgba[i] = i % 4 == 3 ? unit : unit * unit * 4 - (i % 28 < 4 ? 0.5f : 0);
        if (i / 4 % 5 == 0 && i % 4 && i % 4 != 3) rgba[i] = rgba[i - 1];
    }
}

static void catalog_lists_the_spaces_and_displays_in_order(void **state) {
    (void)state;
    static const char *const spaces[] = {"CIE-XYZ-D65",
                                         "lin_rec709",
                                         "ACEScg",
                                         "ACES2065-1",
                                         "Linear P3-D65",
                                         "Linear Rec.2020",
                                         "ACEScct",
                                         "sRGB",
                                         "Rec.1886",
                                         "Display P3",
                                         "Gamma 2.2",
                                         "Rec.2020",
                                         "P3-D65",
                                         "Rec.2100-PQ",
                                         "Rec.2100-HLG",
                                         "ST2084-P3-D65",
                                         "raw",
                                         "YIQ",
                                         "YIQ file",
                                         "YIQ linear",
                                         "YIQ linear file",
                                         "YIQ FCC 1953",
                                         "YIQ FCC 1953 file",
                                         "YIQ SMPTE 170M",
                                         "YIQ SMPTE 170M file",
                                         "HSV",
                                         "HSV linear",
                                         "CIELAB D50",
                                         "CIELAB D50 file",
                                         "CIELAB D65",
                                         "CIELAB D65 file",
                                         "OKLab",
                                         "OKLab file",
                                         "LCh D50",
                                         "LCh D50 file",
                                         "LCh D65",
                                         "LCh D65 file",
                                         "OKLCh",
                                         "OKLCh file"};
    static const char *const displays[] = {"sRGB",         "Rec.1886",     "Display P3",
                                           "Rec.2020",     "P3-D65",       "Rec.2100-PQ",
                                           "Rec.2100-HLG", "ST2084-P3-D65"};
    const shd_catalog *catalog = shd_color_catalog(config);
    assert_int_equal(catalog->space_count, SPACES);
    for (int i = 0; i < SPACES; i++) assert_string_equal(catalog->spaces[i].name, spaces[i]);
    assert_int_equal(catalog->display_count, DISPLAYS);
    size_t views = 0;
    for (int i = 0; i < DISPLAYS; i++) {
        const shd_display_info *display = &catalog->displays[i];
        assert_string_equal(display->name, displays[i]);
        assert_string_equal(display->views[0], "Standard");
        assert_string_equal(display->views[display->view_count - 1], "Raw");
        for (size_t j = 1; j + 1 < display->view_count; j++)
            assert_memory_equal(display->views[j], "ACES 1.", 7);
        views += display->view_count;
    }
    assert_int_equal(views, VIEWS);
    assert_ptr_equal(catalog->scene_linear, &catalog->spaces[1]);
    assert_ptr_equal(catalog->colors, &catalog->spaces[1]);
    assert_ptr_equal(catalog->css, shd_catalog_space(catalog, "sRGB"));
    assert_ptr_equal(catalog->rec709, shd_catalog_space(catalog, "lin_rec709"));
    for (size_t i = 0; i < catalog->space_count; i++) {
        const shd_space_info *space = &catalog->spaces[i];
        assert_int_equal(space->scene_linear, i > 0 && i < 6);
        const shd_channels channels = i == 0                            ? SHD_XYZ
                                      : !strncmp(space->name, "YIQ", 3) ? SHD_YIQ
                                      : !strncmp(space->name, "HSV", 3) ? SHD_HSV
                                      : strstr(space->name, "LCh")      ? SHD_LCH
                                      : strstr(space->name, "Lab") || strstr(space->name, "LAB")
                                          ? SHD_LAB
                                          : SHD_RGB;
        assert_int_equal(space->channels, channels);
        assert_true(*space->description && !strchr(space->description, '\n'));
    }
    assert_int_equal(strlen(shd_color_config_digest(config)), 32);
}

static void environment_does_not_reach_the_colors(void **state) {
    (void)state;
    assert_null(getenv("OCIO_ACTIVE_VIEWS"));
    assert_null(getenv("OCIO_INACTIVE_COLORSPACES"));
    assert_null(getenv("OCIO_OPTIMIZATION_FLAGS"));
}

static void same_space_is_the_identity(void **state) {
    (void)state;
    static float pixels[4 * PIXELS], before[4 * PIXELS];
    const shd_catalog *catalog = shd_color_catalog(config);
    fill(pixels);
    memcpy(before, pixels, sizeof pixels);
    for (size_t i = 0; i < catalog->space_count; i++) {
        const char *name = catalog->spaces[i].name;
        const shd_color_transform *transform;
        assert_int_equal(shd_color_to_space(config, name, name, &lease, &transform, NULL), SHD_OK);
        shd_color_apply(transform, pixels, PIXELS);
        assert_memory_equal(pixels, before, sizeof pixels);
        double rgb[3] = {0.1, -1e-300, 1e300};
        assert_int_equal(catalog->convert(catalog->self, name, name, rgb, NULL), SHD_OK);
        assert_true(rgb[0] == 0.1 && rgb[1] == -1e-300 && rgb[2] == 1e300);
    }
    for (int i = 0; i < 3; i++) {
        const shd_color_transform *raw;
        assert_int_equal(shd_color_to_view(config, "ACEScg", catalog->displays[i].name, "Raw",
                                           &lease, &raw, NULL),
                         0);
        shd_color_apply(raw, pixels, PIXELS);
        assert_memory_equal(pixels, before, sizeof pixels);
    }
}

static void alpha_is_untouched(void **state) {
    (void)state;
    static float pixels[4 * PIXELS], before[4 * PIXELS];
    const shd_color_transform *transforms[MOST];
    size_t count = all_transforms(config, transforms);
    assert_int_equal(count, SPACES + VIEWS);
    for (size_t t = 0; t < count; t++) {
        fill(pixels);
        pixels[0] = pixels[5] = -3e38f; /* overflows in the matrices */
        pixels[1] = pixels[4] = 3e38f;
        memcpy(before, pixels, sizeof pixels);
        shd_color_apply(transforms[t], pixels, PIXELS);
        for (int i = 3; i < 4 * PIXELS; i += 4)
            assert_memory_equal(&pixels[i], &before[i], sizeof(float));
        for (int i = 8; i < 4 * PIXELS; i++) assert_true(isfinite(pixels[i]));
    }
}

static void splits_do_not_change_a_bit(void **state) {
    (void)state;
    static float whole[4 * PIXELS], parts[4 * PIXELS];
    static const size_t steps[] = {1, 2, 3, 5, 16, 17, 1023, 1025};
    const shd_color_transform *transforms[MOST];
    size_t count = all_transforms(config, transforms);
    for (size_t t = 0; t < count; t++) {
        fill(whole);
        shd_color_apply(transforms[t], whole, PIXELS);
        for (size_t s = 0; s < sizeof steps / sizeof *steps; s++) {
            fill(parts);
            for (size_t i = 0; i < PIXELS; i += steps[s]) {
                size_t left = PIXELS - i;
                shd_color_apply(transforms[t], parts + 4 * i, left < steps[s] ? left : steps[s]);
            }
            assert_memory_equal(parts, whole, sizeof whole);
        }
        shd_color_apply(transforms[t], parts, 0);
        assert_memory_equal(parts, whole, sizeof whole);
    }
}

static void every_space_comes_back(void **state) {
    (void)state;
    const shd_catalog *catalog = shd_color_catalog(config);
    for (size_t i = 0; i < catalog->space_count; i++) {
        const shd_space_info *space = &catalog->spaces[i];
        static const double colors[][3] = {{.5, .25, .125}, {1, 0, 0}, {0, 1, 1},
                                           {.18, .18, .18}, {0, 0, 0}, {4, 2, 9},
                                           {-.1, .2, -.3}};
        for (size_t c = 0; c < sizeof colors / sizeof *colors; c++) {
            double rgb[3], size = 0;
            memcpy(rgb, colors[c], sizeof rgb);
            const bool bounded = space->channels == SHD_HSV || strstr(space->name, "2100") ||
                                 strstr(space->name, "2084");
            if (bounded && rgb[0] < 0) continue; /* cannot come back */
            for (int k = 0; k < 3; k++) size = fmax(size, fabs(rgb[k]));
            if (strstr(space->name, "HLG")) size = fmax(size, 0.01); /* its root of black */
            if (strstr(space->name, " file")) size = fmax(size, 1);  /* zero is 128/255 there */
            assert_int_equal(catalog->convert(catalog->self, "lin_rec709", space->name, rgb, NULL),
                             SHD_OK);
            assert_int_equal(catalog->convert(catalog->self, space->name, "lin_rec709", rgb, NULL),
                             SHD_OK);
            /* Two curves and two matrices in float; YIQ's inverse has entries up to 1.9. */
            for (int k = 0; k < 3; k++)
                if (!(fabs(rgb[k] - colors[c][k]) <= 3e-6 * size))
                    fail_msg("%s: color %zu comes back as %g", space->name, c, rgb[k]);
        }
    }
}

static void written_srgb_is_decoded_by_the_standard(void **state) {
    (void)state;
    const shd_catalog *catalog = shd_color_catalog(config);
    for (int code = 0; code < 256; code++) {
        double v = code / 255.0, rgb[3] = {v, v, v};
        double wanted = v <= 0.04045 ? v / 12.92 : pow((v + 0.055) / 1.055, 2.4);
        assert_int_equal(catalog->convert(catalog->self, "sRGB", "lin_rec709", rgb, NULL), SHD_OK);
        assert_true(fabs(rgb[1] - wanted) < 1e-15);
        assert_int_equal(catalog->convert(catalog->self, "lin_rec709", "ACEScg", rgb, NULL),
                         SHD_OK);
        assert_true(fabs(rgb[1] - wanted) <= 3e-6 * wanted); /* white stays white */
    }
}

static void written_srgb_comes_back_to_its_codes(void **state) {
    (void)state;
    const shd_catalog *catalog = shd_color_catalog(config);
    for (int top = 255; top <= 65535; top += 65280)
        for (int code = 0; code <= top; code++) {
            double v = (double)code / top, rgb[3] = {v, v, v};
            assert_int_equal(catalog->convert(catalog->self, "sRGB", "lin_rec709", rgb, NULL),
                             SHD_OK);
            assert_int_equal(catalog->convert(catalog->self, "lin_rec709", "sRGB", rgb, NULL),
                             SHD_OK);
            assert_int_equal((int)(rgb[1] * top + 0.5), code);
        }
}

static void unknown_names_are_refused(void **state) {
    (void)state;
    const shd_color_transform *transform = NULL;
    shd_error error;
    /* The last one is inactive, and no role names it. */
    static const char *const names[] = {"nowhere", "s RGB", "", "sRGB - Display"};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        assert_int_equal(
            shd_color_to_space(config, "lin_rec709", names[i], &lease, &transform, &error),
            SHD_SCENE);
        assert_non_null(strstr(error.text, "unknown color space"));
        assert_int_equal(shd_color_to_space(config, names[i], "sRGB", &lease, &transform, &error),
                         SHD_SCENE);
    }
    assert_int_equal(
        shd_color_to_view(config, "lin_rec709", "srgb", "Standard", &lease, &transform, &error),
        SHD_SCENE);
    assert_int_equal(
        shd_color_to_view(config, "lin_rec709", "sRGB", "Film", &lease, &transform, &error),
        SHD_SCENE);
    assert_string_equal(error.text, "unknown view 'Film'");
    assert_null(transform);
    const shd_catalog *catalog = shd_color_catalog(config);
    double huge[3] = {1e300, 0, 0};
    assert_int_equal(catalog->convert(catalog->self, "lin_rec709", "sRGB", huge, &error),
                     SHD_SCENE);
    assert_true(huge[0] == 1e300);
}

static void outputs_are_described(void **state) {
    (void)state;
    static const struct {
        const char *from, *to, *view;
        shd_channels channels;
        shd_transfer transfer;
        double red_x; /* 0: no primaries */
    } cases[] = {
        {"lin_rec709", "lin_rec709", NULL, SHD_RGB, SHD_TRANSFER_LINEAR, .64},
        {"lin_rec709", "ACEScg", NULL, SHD_RGB, SHD_TRANSFER_LINEAR, .713},
        {"lin_rec709", "ACES2065-1", NULL, SHD_RGB, SHD_TRANSFER_LINEAR, .7347},
        {"ACEScg", "sRGB", NULL, SHD_RGB, SHD_TRANSFER_SRGB, .64},
        {"lin_rec709", "Rec.1886", NULL, SHD_RGB, SHD_TRANSFER_REC1886, .64},
        {"lin_rec709", "Display P3", NULL, SHD_RGB, SHD_TRANSFER_SRGB, .68},
        {"ACEScg", "raw", NULL, SHD_RGB, SHD_TRANSFER_LINEAR, .713},
        {"lin_rec709", "ACEScct", NULL, SHD_RGB, SHD_TRANSFER_UNKNOWN, 0},
        {"lin_rec709", "CIE-XYZ-D65", NULL, SHD_XYZ, SHD_TRANSFER_LINEAR, 1},
        {"lin_rec709", "Linear P3-D65", NULL, SHD_RGB, SHD_TRANSFER_LINEAR, .68},
        {"lin_rec709", "Linear Rec.2020", NULL, SHD_RGB, SHD_TRANSFER_LINEAR, .708},
        {"lin_rec709", "Gamma 2.2", NULL, SHD_RGB, SHD_TRANSFER_GAMMA22, .64},
        {"lin_rec709", "Rec.2020", "Standard", SHD_RGB, SHD_TRANSFER_REC1886, .708},
        {"lin_rec709", "Rec.2020", "ACES 1.0 - SDR Video", SHD_RGB, SHD_TRANSFER_REC1886, .708},
        {"lin_rec709", "P3-D65", "Standard", SHD_RGB, SHD_TRANSFER_GAMMA26, .68},
        {"lin_rec709", "P3-D65", "ACES 1.0 - SDR Cinema", SHD_RGB, SHD_TRANSFER_GAMMA26, .68},
        {"lin_rec709", "Rec.2100-PQ", "Standard", SHD_RGB, SHD_TRANSFER_PQ, .708},
        {"lin_rec709", "Rec.2100-PQ", "ACES 1.1 - HDR Video (1000 nits & P3 lim)", SHD_RGB,
         SHD_TRANSFER_PQ, .708},
        {"lin_rec709", "Rec.2100-HLG", "Standard", SHD_RGB, SHD_TRANSFER_HLG, .708},
        {"ACEScg", "Rec.2100-HLG", "ACES 1.1 - HDR Video (1000 nits & Rec.2020 lim)", SHD_RGB,
         SHD_TRANSFER_HLG, .708},
        {"lin_rec709", "ST2084-P3-D65", "Standard", SHD_RGB, SHD_TRANSFER_PQ, .68},
        {"lin_rec709", "ST2084-P3-D65", "ACES 1.1 - HDR Cinema (108 nits & P3 lim)", SHD_RGB,
         SHD_TRANSFER_PQ, .68},
        {"lin_rec709", "CIELAB", NULL, SHD_LAB, SHD_TRANSFER_UNKNOWN, 0},
        {"lin_rec709", "OKLab", NULL, SHD_LAB, SHD_TRANSFER_UNKNOWN, 0},
        {"lin_rec709", "LCh", NULL, SHD_LCH, SHD_TRANSFER_UNKNOWN, 0},
        {"lin_rec709", "YIQ", NULL, SHD_YIQ, SHD_TRANSFER_UNKNOWN, 0},
        {"lin_rec709", "HSV linear", NULL, SHD_HSV, SHD_TRANSFER_UNKNOWN, 0},
        {"lin_rec709", "sRGB", "Standard", SHD_RGB, SHD_TRANSFER_SRGB, .64},
        {"lin_rec709", "sRGB", "ACES 1.0 - SDR Video", SHD_RGB, SHD_TRANSFER_SRGB, .64},
        {"lin_rec709", "Rec.1886", "ACES 1.0 - SDR Video", SHD_RGB, SHD_TRANSFER_REC1886, .64},
        {"lin_rec709", "Display P3", "Standard", SHD_RGB, SHD_TRANSFER_SRGB, .68},
        {"ACEScg", "sRGB", "Raw", SHD_RGB, SHD_TRANSFER_LINEAR, .713},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        const shd_color_transform *made;
        shd_status status = cases[i].view ? shd_color_to_view(config, cases[i].from, cases[i].to,
                                                              cases[i].view, &lease, &made, NULL)
                                          : shd_color_to_space(config, cases[i].from, cases[i].to,
                                                               &lease, &made, NULL);
        assert_int_equal(status, SHD_OK);
        const shd_color_info *info = shd_color_describe(made);
        assert_int_equal(info->channels, cases[i].channels);
        assert_int_equal(info->transfer, cases[i].transfer);
        assert_int_equal(info->has_primaries, cases[i].red_x > 0);
        if (info->has_primaries) assert_true(info->primaries[0] == cases[i].red_x);
        const bool raw = !strcmp(cases[i].view ? cases[i].view : cases[i].to, "raw") ||
                         (cases[i].view && !strcmp(cases[i].view, "Raw"));
        assert_int_equal(info->data, raw);
    }
}

enum { THREADS = 8 };

typedef struct worker {
    shd_color_config *config;
    float *pixels;
    bool ok;
} worker;

/* Asks for every transform, in its own order of pixels' turns, and applies each. */
static void *work(void *context) {
    worker *self = context;
    const shd_color_transform *transforms[MOST];
    self->ok = true;
    for (int round = 0; round < 3; round++) {
        size_t count = all_transforms(self->config, transforms);
        self->ok = self->ok && count;
        for (size_t t = 0; t < count; t++) {
            fill(self->pixels);
            shd_color_apply(transforms[t], self->pixels, PIXELS);
        }
        double rgb[3] = {.1, .2, .3};
        const shd_catalog *catalog = shd_color_catalog(self->config);
        self->ok = self->ok && !catalog->convert(catalog->self, "sRGB", "ACEScg", rgb, NULL);
    }
    shd_color_lease_drop(lease);
    lease = NULL;
    return NULL;
}

static void threads_share_a_configuration(void **state) {
    (void)state;
    static float pixels[THREADS + 1][4 * PIXELS];
    shd_color_config *fresh;
    assert_int_equal(shd_color_config_load(NULL, &fresh, NULL), SHD_OK);
    pthread_t threads[THREADS];
    worker workers[THREADS + 1];
    for (int i = 0; i < THREADS; i++) {
        workers[i] = (worker){fresh, pixels[i], false};
        assert_int_equal(pthread_create(&threads[i], NULL, work, &workers[i]), 0);
    }
    for (int i = 0; i < THREADS; i++) pthread_join(threads[i], NULL);
    workers[THREADS] = (worker){config, pixels[THREADS], false};
    work(&workers[THREADS]);
    for (int i = 0; i < THREADS; i++) {
        assert_true(workers[i].ok);
        assert_memory_equal(pixels[i], pixels[THREADS], sizeof *pixels);
    }
    assert_string_equal(shd_color_config_digest(fresh), shd_color_config_digest(config));
    shd_color_config_drop(fresh);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(catalog_lists_the_spaces_and_displays_in_order),
        cmocka_unit_test(environment_does_not_reach_the_colors),
        cmocka_unit_test(same_space_is_the_identity),
        cmocka_unit_test(alpha_is_untouched),
        cmocka_unit_test(splits_do_not_change_a_bit),
        cmocka_unit_test(every_space_comes_back),
        cmocka_unit_test(written_srgb_is_decoded_by_the_standard),
        cmocka_unit_test(written_srgb_comes_back_to_its_codes),
        cmocka_unit_test(unknown_names_are_refused),
        cmocka_unit_test(outputs_are_described),
        cmocka_unit_test(threads_share_a_configuration),
    };
    return cmocka_run_group_tests(tests, load, drop);
}
