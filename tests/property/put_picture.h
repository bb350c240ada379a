/* Pictures that tests make and put, to be named in scenes. */
#ifndef SHD_TEST_PUT_PICTURE_H
#define SHD_TEST_PUT_PICTURE_H

#include "png_file.h"
#include "property/film_of.h"

/* Its name: "sha256-" and digits. */
typedef struct put_name {
    char text[80];
} put_name;

/* Puts a PNG with these samples of 8 bits, [height][width][4], straight. */
static inline put_name put_picture(shd_engine *engine, int width, int height,
                                   const uint8_t *samples) {
    shd_request *request;
    shd_error error;
    put_name out = {"sha256-"};
    bool known;
    const shd_bytes png = png_file_of(width, height, samples);
    assert_int_equal(shd_request_new(engine, &request, &error), SHD_OK);
    const shd_digest digest = shd_digest_of(png.data, png.size);
    assert_int_equal(
        shd_request_keep_asset(request, png.data, png.size, &digest, "somebody", &known), SHD_OK);
    shd_digest_write(&digest, out.text + 7);
    shd_request_drop(request);
    free(png.data);
    return out;
}

/* 2 x 2 checks of this many texels a side, the lower left one black. */
static inline put_name put_checks(shd_engine *engine, int side) {
    uint8_t *samples = malloc((size_t)(16 * side * side));
    for (int i = 0; i < 4 * side * side; i++) {
        const bool light = ((i % (2 * side)) / side + i / (2 * side) / side) % 2 == 0;
        memset(samples + 4 * i, light ? 255 : 0, 3);
        samples[4 * i + 3] = 255;
    }
    const put_name name = put_picture(engine, 2 * side, 2 * side, samples);
    free(samples);
    return name;
}

/* Random colors and alphas. */
static inline put_name put_noise(shd_engine *engine, int width, int height, uint64_t random) {
    const size_t count = 4 * (size_t)width * (size_t)height;
    uint8_t *samples = malloc(count);
    for (size_t i = 0; i < count; i++) samples[i] = (uint8_t)below(&random, 256);
    const put_name name = put_picture(engine, width, height, samples);
    free(samples);
    return name;
}

#endif
