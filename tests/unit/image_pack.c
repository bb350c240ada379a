/* Samples: rounding, saturation, the choice of channels. */
#include "unit/image/fixture.h"

#include "image/pack.h"

static uint8_t code8(int channel, float v) {
    float rgba[4] = {v, v, v, 1};
    uint8_t out[3];
    shd_image image = picture(rgba, 1, 1);
    shd_pack pack = shd_pack_plan(&image, false, true);
    shd_pack_row(&pack, rgba, 1, out);
    return out[channel];
}

static uint16_t code16(int channel, float v) {
    float rgba[4] = {v, v, v, 1};
    uint16_t out[3];
    shd_image image = picture(rgba, 1, 1);
    image.depth = SHD_U16;
    shd_pack pack = shd_pack_plan(&image, false, true);
    shd_pack_row(&pack, rgba, 1, out);
    return out[channel];
}

static void every_code_survives_its_own_value(void **state) {
    (void)state;
    for (int i = 0; i < 256; i++) assert_int_equal(code8(1, (float)i / 255.0f), i);
    for (int i = 0; i < 65536; i++) assert_int_equal(code16(1, (float)i / 65535.0f), i);
}

/* Half a code is exact in f32 where 255 does not divide it away: 127.5/255 = 0.5. The neighbors
 * of 0.5 in f32 are 3e-6 codes away, which f32 arithmetic would not see. */
static void ties_round_up_and_their_neighbors_do_not(void **state) {
    (void)state;
    assert_int_equal(code8(0, 0.5f), 128);
    assert_int_equal(code8(0, nextafterf(0.5f, 0)), 127);
    assert_int_equal(code8(0, nextafterf(0.5f, 1)), 128);
    assert_int_equal(code16(0, 0.5f), 32768);
    assert_int_equal(code16(0, nextafterf(0.5f, 0)), 32767);
}

/* Against long double, over all magnitudes. */
static void rounding_is_to_nearest_everywhere(void **state) {
    (void)state;
    uint32_t seed = 1;
    for (int i = 0; i < 200000; i++) {
        seed = seed * 1664525u + 1013904223u;
        float v = (float)(seed >> 8) / (float)(1 << 24);
        assert_int_equal(code8(2, v), (int)floorl((long double)v * 255 + 0.5L));
        assert_int_equal(code16(2, v), (int)floorl((long double)v * 65535 + 0.5L));
    }
}

static void values_beyond_the_range_saturate(void **state) {
    (void)state;
    const float beyond[] = {1.001f, 2, 1e30f, INFINITY};
    for (size_t i = 0; i < 4; i++) {
        assert_int_equal(code8(0, beyond[i]), 255);
        assert_int_equal(code8(0, -beyond[i]), 0);
        assert_int_equal(code16(0, beyond[i]), 65535);
        assert_int_equal(code16(0, -beyond[i]), 0);
    }
    assert_int_equal(code8(0, NAN), 0);
    assert_int_equal(code16(1, NAN), 0);
}

static void rows_of_any_width_keep_within_their_bytes(void **state) {
    (void)state;
    enum { MAX = 200 };
    float *rgba = gradient(MAX, 1);
    for (int channel = -1; channel < 4; channel++)
        for (int alpha = 0; alpha < 2; alpha++)
            for (int width = 1; width <= MAX; width++) {
                shd_image image = picture(rgba, width, 1);
                image.channel = channel;
                image.alpha = alpha;
                shd_pack pack = shd_pack_plan(&image, false, true);
                int samples = width * pack.count;
                uint8_t narrow[4 * MAX + 1];
                uint16_t wide[4 * MAX + 1];
                narrow[samples] = 77;
                wide[samples] = 7777;
                shd_pack_row(&pack, rgba, width, narrow);
                image.depth = SHD_U16;
                pack = shd_pack_plan(&image, false, true);
                shd_pack_row(&pack, rgba, width, wide);
                assert_int_equal(narrow[samples], 77);
                assert_int_equal(wide[samples], 7777);
                for (int i = 0; i < samples; i++) {
                    float v = rgba[4 * (i / pack.count) + pack.source[i % pack.count]];
                    assert_int_equal(narrow[i], (int)floor(v * 255.0 + 0.5));
                    assert_int_equal(wide[i], (int)floor(v * 65535.0 + 0.5));
                }
            }
    free(rgba);
}

static void channels_are_picked_with_and_without_alpha(void **state) {
    (void)state;
    const float rgba[4] = {0.2f, 0.4f, 0.6f, 0.8f};
    shd_image image = picture(rgba, 1, 1);
    uint8_t out[4];

    image.alpha = true;
    image.channel = 1;
    shd_pack pack = shd_pack_plan(&image, false, true);
    assert_int_equal(pack.count, 2);
    shd_pack_row(&pack, rgba, 1, out);
    assert_int_equal(out[0], 102);
    assert_int_equal(out[1], 204);

    pack = shd_pack_plan(&image, false, false);
    assert_int_equal(pack.count, 4);
    shd_pack_row(&pack, rgba, 1, out);
    assert_memory_equal(out, ((uint8_t[]){102, 102, 102, 204}), 4);

    image.channel = 3;
    pack = shd_pack_plan(&image, true, true);
    assert_int_equal(pack.count, 1);
    shd_pack_row(&pack, rgba, 1, out);
    assert_int_equal(out[0], 204);
}

static void premultiplied_samples_are_encoded_values_times_alpha(void **state) {
    (void)state;
    const float rgba[4] = {1, 0.5f, -0.52f, 0.25f};
    shd_image image = picture(rgba, 1, 1);
    image.alpha = true;
    image.depth = SHD_U16;
    shd_pack pack = shd_pack_plan(&image, true, true);
    uint16_t wide[4];
    shd_pack_row(&pack, rgba, 1, wide);
    /* 65535/4, 32767.5/4, 0, 65535/4: to nearest */
    assert_memory_equal(wide, ((uint16_t[]){16384, 8192, 0, 16384}), sizeof wide);

    image.depth = SHD_FLOAT;
    pack = shd_pack_plan(&image, true, true);
    float out[4];
    shd_pack_row(&pack, rgba, 1, out);
    assert_true(out[0] == 0.25f && out[1] == 0.125f && out[2] == -0.52f * 0.25f && out[3] == 0.25f);
}

static void floats_keep_what_they_hold_and_half_saturates(void **state) {
    (void)state;
    const float rgba[4] = {-3.5f, 1e9f, -1e9f, 1};
    shd_image image = picture(rgba, 1, 1);
    image.depth = SHD_FLOAT;
    shd_pack pack = shd_pack_plan(&image, false, true);
    float out[3];
    shd_pack_row(&pack, rgba, 1, out);
    assert_memory_equal(out, rgba, sizeof out);
    image.depth = SHD_HALF;
    pack = shd_pack_plan(&image, false, true);
    shd_pack_row(&pack, rgba, 1, out);
    assert_memory_equal(out, ((float[]){-3.5f, 65504, -65504}), sizeof out);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_code_survives_its_own_value),
        cmocka_unit_test(ties_round_up_and_their_neighbors_do_not),
        cmocka_unit_test(rounding_is_to_nearest_everywhere),
        cmocka_unit_test(values_beyond_the_range_saturate),
        cmocka_unit_test(rows_of_any_width_keep_within_their_bytes),
        cmocka_unit_test(channels_are_picked_with_and_without_alpha),
        cmocka_unit_test(premultiplied_samples_are_encoded_values_times_alpha),
        cmocka_unit_test(floats_keep_what_they_hold_and_half_saturates),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
