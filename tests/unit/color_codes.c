/* Baked codes against the transform's own floats, packed: the same for every input.
 *
 * All thresholds with their neighbors and inputs of every size are tried each time. With
 * SHADED_EXHAUSTIVE set, every finite float is: some minutes. */
#include <float.h>
#include <limits.h>
#include <math.h>
#include <pthread.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "base/sample.h"
#include "color/codes.h"
#include "image/pack.h"
#include "sanitized.h"

extern const unsigned char shd_embedded_ocio[];
extern const unsigned long shd_embedded_ocio_size;

enum { PIXELS = 1000 };

static shd_color_config *config;
static shd_color_lease *lease; /* of all transforms */

static int load(void **state) {
    (void)state;
    return shd_color_config_load(NULL, &config, NULL) != SHD_OK;
}

static int drop(void **state) {
    (void)state;
    shd_color_lease_drop(lease);
    shd_color_config_drop(config);
    return 0;
}

static const shd_color_transform *to_space(shd_color_config *from, const char *name) {
    const shd_color_transform *made;
    assert_int_equal(shd_color_to_space(from, "lin_rec709", name, &lease, &made, NULL), SHD_OK);
    return made;
}

/* The way through floats: converted, held finite, packed, counted. */
static shd_encoded pack_floats(const shd_color_transform *transform, const shd_pack *pack,
                               const float *rgba, size_t count, void *out) {
    static float converted[4 * PIXELS];
    memcpy(converted, rgba, 4 * count * sizeof *converted);
    shd_color_apply(transform, converted, count);
    shd_encoded counts = {0, 0};
    for (size_t i = 0; i < 4 * count; i++) {
        float v = converted[i];
        if (v >= -FLT_MAX && v <= FLT_MAX) continue;
        converted[i] = v > FLT_MAX ? FLT_MAX : v < -FLT_MAX ? -FLT_MAX : 0;
        counts.beyond++;
    }
    for (int s = 0; s < pack->count; s++)
        for (size_t i = 0; pack->source[s] < 3 && i < count; i++)
            counts.clipped += shd_is_clipped(
                (double)converted[4 * i + (size_t)pack->source[s]] * pack->max, pack->max);
    shd_pack_row(pack, converted, (int)count, out);
    return counts;
}

static shd_pack pack_for(unsigned max, int channel, bool alpha) {
    const shd_image image = {
        .channel = channel, .alpha = alpha, .depth = max == 255 ? SHD_U8 : SHD_U16};
    return shd_pack_plan(&image, false, true);
}

/* By every variant. */
static void same_codes(const shd_color_transform *transform, const shd_color_codes *codes,
                       const float *rgba, size_t count) {
    static uint16_t want[4 * PIXELS], got[4 * PIXELS]; /* bytes where there are 8 bits */
    shd_pack pack = pack_for(codes->max, -1, false);
    const shd_encoded wanted = pack_floats(transform, &pack, rgba, count, want);
    for (shd_isa isa = SHD_PORTABLE; isa < SHD_ISA_COUNT; isa++) {
        if (!shd_cpu_has(isa)) continue;
        const shd_encoded counted =
            shd_color_encode(codes, isa, rgba, count, pack.source, pack.count, got);
        assert_memory_equal(&counted, &wanted, sizeof counted);
        if (!memcmp(want, got, 3 * count * pack.bytes)) continue;
        for (size_t i = 0; i < count; i++) {
            shd_color_encode(codes, isa, rgba + 4 * i, 1, pack.source, 3, got);
            pack_floats(transform, &pack, rgba + 4 * i, 1, want);
            if (memcmp(want, got, 3 * pack.bytes))
                fail_msg("%u: %a %a %a with %s", codes->max, (double)rgba[4 * i],
                         (double)rgba[4 * i + 1], (double)rgba[4 * i + 2], shd_isa_name(isa));
        }
        fail_msg("pixels together differ from one by one");
    }
}

/* Pixels of inputs by their bits, three a pixel, that are compared when there are PIXELS. */
typedef struct trial {
    const shd_color_transform *transform;
    const shd_color_codes *codes;
    float rgba[4 * PIXELS];
    size_t count; /* inputs */
} trial;

static void flush(trial *t) {
    size_t pixels = t->count / 3;
    if (pixels) same_codes(t->transform, t->codes, t->rgba, pixels);
    t->count = 0;
}

static void try(trial *t, uint32_t bits) {
    t->rgba[t->count / 3 * 4 + t->count % 3] = shd_float_of(bits);
    if (++t->count == 3 * PIXELS) flush(t);
}

/* In all three channels: their tables may differ. */
static void try_grey(trial *t, uint32_t bits) {
    if ((bits & 0x7fffffff) > 0x7f7fffff) return;
    for (int c = 0; c < 3; c++) try(t, bits);
}

static void codes_are_those_of_floats(const shd_color_transform *transform, unsigned max,
                                      bool all) {
    static trial t;
    t = (trial){.transform = transform, .codes = shd_color_codes_bake(transform, max, NULL, NULL)};
    for (int i = 0; i < PIXELS; i++) t.rgba[4 * i + 3] = 1;
    assert_non_null(t.codes);

    /* Every threshold's neighbors: 64 on each side, or a few. */
    const uint32_t side = SHD_SANITIZED ? 4 : 64;
    for (int c = 0; c < 3; c++) {
        if (c && t.codes->threshold[c] == t.codes->threshold[0]) continue;
        for (int k = t.codes->least[c] + 1; k <= t.codes->most[c]; k++) {
            uint32_t at = shd_bits_of(t.codes->threshold[c][k]);
            for (uint32_t near = at - side; near < at + side; near++) try_grey(&t, near);
        }
    }
    /* All sizes and signs; the strides are prime. */
    for (uint32_t bits = 0; bits < 0xffff0000; bits += SHD_SANITIZED ? 65537 : 4099)
        try_grey(&t, bits);
    for (uint32_t sign = 0; sign < 2; sign++)
        for (uint32_t i = 0; i < 300; i++) {
            try_grey(&t, sign << 31 | i);
            try_grey(&t, sign << 31 | (0x7f7fffff - i));
            try_grey(&t, sign << 31 | (shd_bits_of(1) - 150 + i));
            try_grey(&t, shd_bits_of(t.codes->finite_least[0]) - 150 + i);
            try_grey(&t, shd_bits_of(t.codes->finite_most[0]) - 150 + i);
        }
    if (all)
        for (uint32_t sign = 0; sign < 2; sign++)
            for (uint32_t bits = 0; bits < 0x7f800000; bits++) try(&t, sign << 31 | bits);
    while (t.count % 3) try(&t, 0);
    flush(&t);
    shd_color_codes_drop((shd_color_codes *)t.codes);
}

static const char *const separable[] = {"lin_rec709", "sRGB", "Rec.1886", "raw"};
static const char *const mixing[] = {"ACEScg",     "ACES2065-1", "Display P3", "YIQ",
                                     "YIQ linear", "HSV",        "HSV linear"};

static void codes_of_8_bits_are_those_of_floats(void **state) {
    (void)state;
    for (size_t i = 0; i < 3; i++)
        codes_are_those_of_floats(to_space(config, separable[i]), 255, getenv("SHADED_EXHAUSTIVE"));
}

static void codes_of_16_bits_are_those_of_floats(void **state) {
    (void)state;
    for (size_t i = 0; i < 3; i++)
        codes_are_those_of_floats(to_space(config, separable[i]), 65535,
                                  getenv("SHADED_EXHAUSTIVE"));
}

static void transforms_that_qualify_are_found_by_what_they_do(void **state) {
    (void)state;
    for (unsigned max = 255; max <= 65535; max += 65280) {
        for (size_t i = 0; i < sizeof separable / sizeof *separable; i++)
            assert_non_null(
                shd_color_codes_of(to_space(config, separable[i]), max, SIZE_MAX, NULL, NULL));
        for (size_t i = 0; i < sizeof mixing / sizeof *mixing; i++)
            assert_null(shd_color_codes_of(to_space(config, mixing[i]), max, SIZE_MAX, NULL, NULL));
    }
    static const char *const displays[] = {"sRGB", "Rec.1886", "Display P3"};
    static const char *const views[] = {"Standard", "Raw", "ACES 1.0 - SDR Video"};
    for (int i = 0; i < 9; i++) {
        const shd_color_transform *made;
        assert_int_equal(shd_color_to_view(config, "lin_rec709", displays[i % 3], views[i / 3],
                                           &lease, &made, NULL),
                         SHD_OK);
        bool yes = i < 2 || i / 3 == 1;
        assert_int_equal(shd_color_codes_of(made, 255, SIZE_MAX, NULL, NULL) != NULL, yes);
    }
}

static void tables_are_made_once_they_pay(void **state) {
    (void)state;
    shd_color_config *fresh;
    assert_int_equal(shd_color_config_load(NULL, &fresh, NULL), SHD_OK);
    const shd_color_transform *srgb = to_space(fresh, "sRGB");
    for (int i = 0; i < 16; i++) assert_null(shd_color_codes_of(srgb, 255, 1000, NULL, NULL));
    const shd_color_codes *codes = shd_color_codes_of(srgb, 255, 1000, NULL, NULL);
    assert_non_null(codes);
    assert_ptr_equal(shd_color_codes_of(srgb, 255, 1, NULL, NULL), codes);
    assert_null(shd_color_codes_of(srgb, 65535, 262144, NULL, NULL));
    assert_non_null(shd_color_codes_of(srgb, 65535, SIZE_MAX, NULL, NULL));
    shd_color_config_drop(fresh);
}

/* Whoever makes tables, and goes on for as many questions. */
typedef struct baker {
    const shd_color_transform *transform;
    int questions, most;
    const shd_color_codes *beside; /* what another thread was given meanwhile */
} baker;

static void *ask_beside(void *context) {
    baker *b = context;
    b->beside = shd_color_codes_of(b->transform, 65535, SIZE_MAX, NULL, NULL);
    return NULL;
}

static bool go_on_some(const void *context) {
    baker *b = (baker *)(uintptr_t)context;
    pthread_t other;
    if (b->questions == 10) {
        assert_int_equal(pthread_create(&other, NULL, ask_beside, b), 0);
        pthread_join(other, NULL);
    }
    return b->questions++ < b->most;
}

static void baking_is_left_and_nobody_waits_for_it(void **state) {
    (void)state;
    shd_color_config *fresh;
    assert_int_equal(shd_color_config_load(NULL, &fresh, NULL), SHD_OK);
    baker b = {to_space(fresh, "sRGB"), 0, INT_MAX, (const void *)config};
    const shd_color_codes *codes = NULL;
    for (int most = 0; !codes; most = 3 * most + 20) {
        b.questions = 0;
        b.most = most;
        codes = shd_color_codes_of(b.transform, 65535, SIZE_MAX, go_on_some, &b);
        if (!codes) assert_in_range(b.questions, most + 1, most + 2);
    }
    assert_true(b.questions > 1000);
    assert_null(b.beside);
    ask_beside(&b);
    assert_ptr_equal(b.beside, codes);
    shd_color_config_drop(fresh);
}

static void samples_are_the_channels_that_are_asked_for(void **state) {
    (void)state;
    static float rgba[4 * PIXELS];
    static uint16_t want[4 * PIXELS + 1], got[4 * PIXELS + 1];
    for (int i = 0; i < 4 * PIXELS; i++)
        rgba[i] = (float)((uint32_t)i * 2654435761u >> 8) / 16777216 * (i % 4 == 3 ? 1 : 1.1f);
    rgba[3] = 0;
    const shd_color_transform *srgb = to_space(config, "sRGB");
    for (unsigned max = 255; max <= 65535; max += 65280) {
        const shd_color_codes *codes = shd_color_codes_of(srgb, max, SIZE_MAX, NULL, NULL);
        for (int channel = -1; channel < 4; channel++)
            for (int alpha = 0; alpha < 2; alpha++)
                for (size_t count = 1; count <= PIXELS; count = count * 3 + 1) {
                    shd_pack pack = pack_for(max, channel, alpha);
                    memset(want, 7, sizeof want);
                    memset(got, 7, sizeof got);
                    pack_floats(srgb, &pack, rgba, count, want);
                    shd_color_encode(codes, shd_cpu_best(), rgba, count, pack.source, pack.count,
                                     got);
                    assert_memory_equal(got, want, sizeof got);
                }
    }
}

/* Rows: one behind the other, a tile's, short ones, one in all. */
static const struct {
    size_t width, pitch;
} ways[] = {{32, 32}, {32, 77}, {7, 20}, {1, 3}, {PIXELS, PIXELS}};

static void planes_give_the_same_samples_at_their_places(void **state) {
    (void)state;
    enum { PLACES = 4096 };
    static float rgba[4 * PIXELS], plane[4][PIXELS];
    static uint16_t together[4 * PIXELS];
    static unsigned char want[8 * PLACES], got[8 * PLACES];
    for (int i = 0; i < 4 * PIXELS; i++)
        plane[i % 4][i / 4] = rgba[i] =
            (float)((uint32_t)i * 2654435761u >> 8) / 16777216 * (i % 4 == 3 ? 1 : 1.1f);
    plane[1][70] = rgba[4 * 70 + 1] = -3e38f;
    plane[2][700] = rgba[4 * 700 + 2] = INFINITY;
    const float *const rgb[3] = {plane[0], plane[1], plane[2]};
    const shd_color_transform *srgb = to_space(config, "sRGB");
    for (unsigned max = 255; max <= 65535; max += 65280) {
        const shd_color_codes *codes = shd_color_codes_of(srgb, max, SIZE_MAX, NULL, NULL);
        for (int channel = -1; channel < 4; channel++)
            for (int alpha = 0; alpha < 3; alpha++) /* none, opaque, of pixels */
                for (size_t count = 1; count <= PIXELS; count = count * 3 + 1) {
                    shd_pack pack = pack_for(max, channel, alpha > 0);
                    const size_t bytes = (size_t)pack.count * pack.bytes;
                    for (size_t i = 0; i < count; i++)
                        rgba[4 * i + 3] = alpha == 1 ? 1 : plane[3][i];
                    const shd_encoded alone = shd_color_encode(codes, SHD_PORTABLE, rgba, count,
                                                               pack.source, pack.count, together);
                    for (size_t way = 0; way < sizeof ways / sizeof ways[0]; way++) {
                        const size_t width = ways[way].width, pitch = ways[way].pitch;
                        memset(want, 7, sizeof want);
                        for (size_t i = 0; i < count; i++)
                            memcpy(want + (i / width * pitch + i % width) * bytes,
                                   (const unsigned char *)together + i * bytes, bytes);
                        for (shd_isa isa = SHD_PORTABLE; isa < SHD_ISA_COUNT; isa++) {
                            if (!shd_cpu_has(isa)) continue;
                            memset(got, 7, sizeof got);
                            const shd_encoded counts = shd_color_encode_planes(
                                codes, isa, rgb, alpha == 1 ? NULL : plane[3], count, pack.source,
                                pack.count, width, pitch, got);
                            assert_memory_equal(got, want, sizeof got);
                            assert_memory_equal(&counts, &alone, sizeof counts);
                        }
                    }
                }
    }
}

/* A configuration with one more space, `X`. */
static shd_color_config *with_space(const char *transform) {
    char path[] = "/tmp/shaded_codes_XXXXXX";
    int file = mkstemp(path);
    assert_true(file >= 0);
    FILE *out = fdopen(file, "wb");
    assert_non_null(out);
    fwrite(shd_embedded_ocio, 1, shd_embedded_ocio_size, out);
    fprintf(out,
            "\n  - !<ColorSpace>\n    name: X\n    bitdepth: 32f\n    isdata: false\n"
            "    from_scene_reference: %s\n",
            transform);
    fclose(out);
    shd_color_config *made = NULL;
    shd_error error = {.status = SHD_OK};
    if (shd_color_config_load(path, &made, &error)) fail_msg("%s", error.text);
    remove(path);
    return made;
}

static void channels_may_have_curves_of_their_own(void **state) {
    (void)state;
    static const char *const transforms[] = {
        "!<ExponentTransform> {value: [2.4, 1.8, 1.1, 1], direction: inverse}",
        "!<ExponentTransform> {value: [2.2, 3, 1, 1], style: mirror}",
        "!<MatrixTransform> {matrix: [2, 0, 0, 0, 0, 0.5, 0, 0, 0, 0, 1.7, 0, 0, 0, 0, 1]}",
        ("!<RangeTransform> {min_in_value: 0.1, min_out_value: 0.2, max_in_value: 0.7,"
         " max_out_value: 0.9}"),
    };
    for (size_t i = 0; i < sizeof transforms / sizeof *transforms; i++) {
        shd_color_config *own = with_space(transforms[i]);
        codes_are_those_of_floats(to_space(own, "X"), 255, false);
        shd_color_config_drop(own);
    }
}

static void other_transforms_do_not_qualify(void **state) {
    (void)state;
    static const char *const transforms[] = {
        /* falling, with codes that change below 0, mixing a very little, or alpha in */
        ("!<MatrixTransform> {matrix: [-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1],"
         " offset: [1, 0, 0, 0]}"),
        "!<MatrixTransform> {offset: [0.1, 0, 0, 0]}",
        "!<MatrixTransform> {matrix: [1, 1e-9, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]}",
        "!<MatrixTransform> {matrix: [1, 0, 0, 0.1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]}",
    };
    for (size_t i = 0; i < sizeof transforms / sizeof *transforms; i++) {
        shd_color_config *own = with_space(transforms[i]);
        if (shd_color_codes_of(to_space(own, "X"), 255, SIZE_MAX, NULL, NULL))
            fail_msg("%s", transforms[i]);
        shd_color_config_drop(own);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(codes_of_8_bits_are_those_of_floats),
        cmocka_unit_test(codes_of_16_bits_are_those_of_floats),
        cmocka_unit_test(transforms_that_qualify_are_found_by_what_they_do),
        cmocka_unit_test(tables_are_made_once_they_pay),
        cmocka_unit_test(baking_is_left_and_nobody_waits_for_it),
        cmocka_unit_test(samples_are_the_channels_that_are_asked_for),
        cmocka_unit_test(planes_give_the_same_samples_at_their_places),
        cmocka_unit_test(channels_may_have_curves_of_their_own),
        cmocka_unit_test(other_transforms_do_not_qualify),
    };
    return cmocka_run_group_tests(tests, load, drop);
}
