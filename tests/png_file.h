/* Pictures as files, for tests that put them. */
#ifndef SHD_TEST_PNG_FILE_H
#define SHD_TEST_PNG_FILE_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "image/image.h"

/* A PNG with these samples of 8 bits, [height][width][4], straight. Its data is for free(). */
static inline shd_bytes png_file_of(int width, int height, const uint8_t *samples) {
    shd_arena *arena = shd_arena_new(64 << 20);
    shd_bytes png;
    shd_error error;
    const shd_image image = {.width = width,
                             .height = height,
                             .channel = -1,
                             .alpha = true,
                             .depth = SHD_U8,
                             .samples = samples,
                             .slots = 1};
    assert_int_equal(shd_image_encode(&image, SHD_PNG, arena, &png, &error), SHD_OK);
    shd_arena_drop(arena);
    return png;
}

#endif
