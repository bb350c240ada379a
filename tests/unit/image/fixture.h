/* Pictures for the tests of src/image: a plain RGB one, and a byte reader. */
#ifndef TESTS_UNIT_IMAGE_FIXTURE_H
#define TESTS_UNIT_IMAGE_FIXTURE_H

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "image/image.h"

static const double rec709[8] = {0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290};
static const double display_p3[8] = {0.68, 0.32, 0.265, 0.69, 0.15, 0.06, 0.3127, 0.3290};

/* Opaque sRGB at 8 bits over `rgba`. */
static inline shd_image picture(const float *rgba, int width, int height) {
    shd_image image = {.width = width,
                       .height = height,
                       .rgba = rgba,
                       .channel = -1,
                       .depth = SHD_U8,
                       .quality = 90,
                       .transfer = SHD_TRANSFER_SRGB,
                       .has_primaries = true,
                       .channel_names = shd_channel_names(SHD_RGB)};
    memcpy(image.primaries, rec709, sizeof rec709);
    return image;
}

/* Smooth and different in every channel; freed by the caller. */
static inline float *gradient(int width, int height) {
    float *rgba = malloc((size_t)width * (size_t)height * 4 * sizeof *rgba);
    assert_non_null(rgba);
    for (int i = 0; i < width * height; i++) {
        float u = (float)(i % width) / (float)width, v = (float)(i / width) / (float)height;
        const float pixel[4] = {u, v, u * v, 1 - u * v};
        memcpy(rgba + 4 * i, pixel, sizeof pixel);
    }
    return rgba;
}

/* Encodes and asserts success. */
static inline shd_bytes encoded(const shd_image *image, shd_format format) {
    shd_arena *scratch = shd_arena_new(1 << 26);
    shd_bytes out = {0};
    shd_error error = {0};
    shd_status status = shd_image_encode(image, format, scratch, &out, &error);
    if (status) print_error("%s\n", error.text);
    assert_int_equal(status, SHD_OK);
    assert_non_null(out.data);
    shd_arena_drop(scratch);
    return out;
}

static inline uint32_t read32(const unsigned char *at) {
    return (uint32_t)at[0] << 24 | (uint32_t)at[1] << 16 | (uint32_t)at[2] << 8 | at[3];
}

#endif
