/* The decoder, in this process: samples of each kind that files have, and hostile files. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>
#include <dlfcn.h>
#include <math.h>
#include <spng.h>

#include "decode/decode.h"
#include "image/image.h"

enum { WIDTH = 16, HEIGHT = 9, PIXELS = WIDTH * HEIGHT, MOST = 1 << 16 };

static shd_oiio_decode_fn *oiio; /* NULL: what needs it is left out */

typedef struct decoded {
    shd_status status;
    shd_decoded picture;
    void *samples;
    shd_error error;
    unsigned admitted;
} decoded;

static bool admit(void *context, const shd_decoded *picture) {
    decoded *d = context;
    assert_in_range(picture->count, 1, 4);
    return ++d->admitted;
}

/* The caller frees the samples. Bytes are of the exact size, so that AddressSanitizer sees every
 * one that is read past the end. */
static decoded decode(const void *data, size_t size) {
    decoded d = {0};
    const shd_decoder decoder = {.most = MOST, .oiio = oiio, .admit = admit, .context = &d};
    unsigned char *copy = malloc(size ? size : 1);
    memcpy(copy, data, size);
    d.status = shd_decode(&decoder, copy, size, &d.picture, &d.samples, &d.error);
    assert_int_equal(d.status == SHD_OK, d.samples != NULL);
    if (d.status == SHD_OK) assert_int_equal(d.admitted, 1);
    free(copy);
    return d;
}

static void refuses(const void *data, size_t size, shd_status status, const char *words) {
    decoded d = decode(data, size);
    if (d.status != status || !strstr(d.error.text, words))
        fail_msg("%s: %d %s", words, d.status, d.status ? d.error.text : "");
    assert_null(d.samples);
}

/* ---- PNG ---- */

static uint8_t next_byte(void) {
    static uint32_t state = 1;
    state = state * 1664525 + 1013904223;
    return (uint8_t)(state >> 24);
}

typedef struct png_kind {
    uint8_t color, bits;
    bool keyed;
    int count; /* of what it becomes */
    int alpha;
} png_kind;

static const unsigned channels_of[] = {
    [SPNG_COLOR_TYPE_GRAYSCALE] = 1,       [SPNG_COLOR_TYPE_TRUECOLOR] = 3,
    [SPNG_COLOR_TYPE_INDEXED] = 1,         [SPNG_COLOR_TYPE_GRAYSCALE_ALPHA] = 2,
    [SPNG_COLOR_TYPE_TRUECOLOR_ALPHA] = 4,
};

/* Encodes random samples, each in a 16-bit word of `values`: [HEIGHT][WIDTH][channels]. */
static uint8_t *encode_png(const png_kind *kind, uint16_t *values, size_t *size) {
    const unsigned channels = channels_of[kind->color];
    const size_t row = (WIDTH * channels * kind->bits + 7) / 8;
    uint8_t *packed = calloc(HEIGHT, row);
    for (size_t y = 0; y < HEIGHT; y++) {
        for (size_t i = 0; i < WIDTH * channels; i++) {
            const unsigned v = (unsigned)(next_byte() << 8 | next_byte()) >> (16 - kind->bits);
            values[y * WIDTH * channels + i] = (uint16_t)v;
            const size_t bit = i * kind->bits;
            uint8_t *at = packed + y * row + bit / 8;
            if (kind->bits == 16)
                memcpy(at, &values[y * WIDTH * channels + i], 2);
            else
                *at |= (uint8_t)(v << (8 - kind->bits - bit % 8));
        }
    }
    struct spng_ihdr head = {
        .width = WIDTH, .height = HEIGHT, .bit_depth = kind->bits, .color_type = kind->color};
    struct spng_plte palette = {.n_entries = 1u << (kind->bits > 8 ? 8 : kind->bits)};
    struct spng_trns key = {.n_type3_entries = 2, .type3_alpha = {7, 130}};
    key.gray = values[3];
    key.red = values[3 * channels];
    key.green = values[3 * channels + channels / 2];
    key.blue = values[3 * channels + channels - 1];
    for (unsigned i = 0; i < palette.n_entries; i++) {
        palette.entries[i].red = (uint8_t)(3 * i);
        palette.entries[i].green = (uint8_t)(255 - i);
        palette.entries[i].blue = (uint8_t)(7 * i);
    }
    spng_ctx *writer = spng_ctx_new(SPNG_CTX_ENCODER);
    spng_set_option(writer, SPNG_ENCODE_TO_BUFFER, 1);
    assert_int_equal(spng_set_ihdr(writer, &head), 0);
    if (kind->color == SPNG_COLOR_TYPE_INDEXED) spng_set_plte(writer, &palette);
    if (kind->keyed) assert_int_equal(spng_set_trns(writer, &key), 0);
    assert_int_equal(
        spng_encode_image(writer, packed, HEIGHT * row, SPNG_FMT_PNG, SPNG_ENCODE_FINALIZE), 0);
    int failed;
    uint8_t *file = spng_get_png_buffer(writer, size, &failed);
    assert_non_null(file);
    spng_ctx_free(writer);
    free(packed);
    return file;
}

/* What pixel `at`'s sample c is to become. */
static unsigned wanted(const png_kind *kind, const uint16_t *values, size_t at, int c) {
    const unsigned channels = channels_of[kind->color];
    const uint16_t *pixel = values + at * channels, *keyed = values + 3 * channels;
    const unsigned full = kind->bits == 16 ? 65535 : 255;
    if (kind->color == SPNG_COLOR_TYPE_INDEXED) {
        const unsigned i = pixel[0];
        if (c == 3) return i == 0 ? 7 : i == 1 ? 130 : 255;
        return c == 0 ? (3 * i) & 255 : c == 1 ? 255 - i : (7 * i) & 255;
    }
    if (kind->keyed && c == kind->count - 1)
        return memcmp(pixel, keyed, channels * sizeof *pixel) ? full : 0;
    return kind->bits < 8 ? pixel[c] * 255u / ((1u << kind->bits) - 1) : pixel[c];
}

static void every_kind_of_png_is_read(void **state) {
    (void)state;
    static const png_kind kinds[] = {
        {0, 1, false, 1, 0},  {0, 2, false, 1, 0},  {0, 4, false, 1, 0}, {0, 8, false, 1, 0},
        {0, 16, false, 1, 0}, {0, 2, true, 2, 1},   {0, 8, true, 2, 1},  {0, 16, true, 2, 1},
        {2, 8, false, 3, 0},  {2, 16, false, 3, 0}, {2, 8, true, 4, 1},  {2, 16, true, 4, 1},
        {3, 1, false, 3, 0},  {3, 4, false, 3, 0},  {3, 8, false, 3, 0}, {3, 4, true, 4, 1},
        {4, 8, false, 2, 1},  {4, 16, false, 2, 1}, {6, 8, false, 4, 1}, {6, 16, false, 4, 1},
    };
    uint16_t values[4 * PIXELS];
    for (size_t k = 0; k < sizeof kinds / sizeof *kinds; k++) {
        const png_kind *kind = &kinds[k];
        size_t size;
        uint8_t *file = encode_png(kind, values, &size);
        decoded d = decode(file, size);
        if (d.status != SHD_OK) fail_msg("%d %d: %s", kind->color, kind->bits, d.error.text);
        assert_int_equal(d.picture.width, WIDTH);
        assert_int_equal(d.picture.height, HEIGHT);
        assert_int_equal(d.picture.count, kind->count);
        assert_int_equal(d.picture.alpha, kind->alpha);
        assert_int_equal(d.picture.associated, 0);
        assert_int_equal(d.picture.depth, kind->bits == 16 ? SHD_U16 : SHD_U8);
        for (size_t i = 0; i < (size_t)(PIXELS * kind->count); i++) {
            const unsigned found = kind->bits == 16 ? ((const uint16_t *)d.samples)[i]
                                                    : ((const uint8_t *)d.samples)[i];
            const size_t at = i / (size_t)kind->count;
            if (found != wanted(kind, values, at, (int)(i % (size_t)kind->count)))
                fail_msg("color %d of %d bits%s: sample %zu is %u", kind->color, kind->bits,
                         kind->keyed ? ", keyed" : "", i, found);
        }
        free(d.samples);
        /* None that ends early is one, but where only its end mark is missing. */
        for (size_t less = 13; less < size; less += 1 + size / 40)
            refuses(file, size - less, SHD_SCENE, "");
        free(file);
    }
}

static uint32_t crc_of(const uint8_t *data, size_t size) {
    uint32_t crc = 0xffffffff;
    for (size_t i = 0; i < size; i++) {
        crc ^= data[i];
        for (int bit = 0; bit < 8; bit++) crc = crc >> 1 ^ (crc & 1 ? 0xedb88320 : 0);
    }
    return ~crc;
}

static void put_word(uint8_t *at, uint32_t word) {
    for (int i = 0; i < 4; i++) at[i] = (uint8_t)(word >> (24 - 8 * i));
}

static void a_head_decides_before_anything_is_decoded(void **state) {
    (void)state;
    static const png_kind kind = {2, 8, false, 3, 0};
    static const uint32_t sizes[][2] = {{100000, 100000}, {257, 256}};
    uint16_t values[4 * PIXELS];
    size_t size;
    uint8_t *file = encode_png(&kind, values, &size);
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {
        put_word(file + 16, sizes[i][0]);
        put_word(file + 20, sizes[i][1]);
        put_word(file + 29, crc_of(file + 12, 17));
        refuses(file, size, SHD_LIMIT, "`pixels`");
        assert_int_equal(decode(file, size).admitted, 0);
    }
    put_word(file + 16, 0);
    put_word(file + 29, crc_of(file + 12, 17));
    refuses(file, size, SHD_SCENE, "PNG");
    free(file);
    refuses("", 0, SHD_SCENE, "begins as no PNG");
    refuses("GIF89a", 6, SHD_SCENE, "begins as no PNG");
    refuses("\xff\xd8\xff", 3, SHD_SCENE, "JPEG");
    refuses("RIFF\0\0\0\0WEBPVP8 ", 16, SHD_SCENE, "WebP");
}

/* ---- Other formats ---- */

static shd_bytes make_layered(shd_format format, shd_depth depth, bool alpha, const float *rgba,
                              const shd_image_layer *layer) {
    shd_arena *arena = shd_arena_new(64 << 20);
    const char *const names[] = {"R", "G", "B"};
    const shd_image image = {.width = WIDTH,
                             .height = HEIGHT,
                             .rgba = rgba,
                             .channel = -1,
                             .alpha = alpha,
                             .depth = depth,
                             .quality = 100,
                             .channel_names = names,
                             .layers = layer,
                             .layer_count = layer != NULL,
                             .slots = 1};
    shd_bytes file;
    shd_error error;
    if (shd_image_encode(&image, format, arena, &file, &error)) fail_msg("%s", error.text);
    shd_arena_drop(arena);
    return file;
}

static shd_bytes make_file(shd_format format, shd_depth depth, bool alpha, const float *rgba) {
    return make_layered(format, depth, alpha, rgba, NULL);
}

typedef struct other_kind {
    shd_format format;
    shd_depth given, taken;
    bool alpha, associated;
    double most; /* that a sample differs by, of [0,1] */
} other_kind;

static double sample_of(const decoded *d, size_t i) {
    return d->picture.depth == SHD_U8    ? ((const uint8_t *)d->samples)[i] / 255.0
           : d->picture.depth == SHD_U16 ? ((const uint16_t *)d->samples)[i] / 65535.0
                                         : (double)((const float *)d->samples)[i];
}

static void other_formats_are_read(void **state) {
    (void)state;
    static const other_kind kinds[] = {
        {SHD_JPEG, SHD_U8, SHD_U8, false, false, 0.02},
        {SHD_WEBP, SHD_U8, SHD_U8, false, false, 0.002},
        {SHD_WEBP, SHD_U8, SHD_U8, true, false, 0.002},
        {SHD_TIFF, SHD_U8, SHD_U8, false, false, 0.002},
        {SHD_TIFF, SHD_U16, SHD_U16, true, true, 1e-5},
        {SHD_TIFF, SHD_FLOAT, SHD_FLOAT, false, false, 0},
        {SHD_EXR, SHD_HALF, SHD_FLOAT, true, true, 5e-4},
        {SHD_EXR, SHD_FLOAT, SHD_FLOAT, false, false, 0},
        {SHD_HDR, SHD_FLOAT, SHD_FLOAT, false, false, 0.005},
    };
    for (size_t k = 0; k < sizeof kinds / sizeof *kinds; k++) {
        const other_kind *kind = &kinds[k];
        float rgba[4 * PIXELS];
        for (int i = 0; i < 4 * PIXELS; i++)
            rgba[i] = i % 4 == 3 ? (kind->alpha ? 0.5f : 1)
                                 : 0.25f + (float)(i / 4 % WIDTH) / 32 + (float)(i % 4) / 16;
        if (shd_format_takes_oiio(kind->format) && !oiio) continue;
        shd_bytes file = make_file(kind->format, kind->given, kind->alpha, rgba);
        decoded d = decode(file.data, file.size);
        if (d.status != SHD_OK) fail_msg("%zu: %s", k, d.error.text);
        const int count = kind->alpha ? 4 : 3;
        assert_int_equal(d.picture.count, count);
        assert_int_equal(d.picture.alpha, kind->alpha);
        assert_int_equal(d.picture.associated, kind->associated);
        assert_int_equal(d.picture.depth, kind->taken);
        for (size_t i = 0; i < PIXELS; i++)
            for (int c = 0; c < count; c++) {
                const double by = kind->associated && c < 3 ? 0.5 : 1;
                const double found = sample_of(&d, i * (size_t)count + (size_t)c);
                if (fabs(found - by * (double)rgba[4 * i + (size_t)c]) > kind->most)
                    fail_msg("kind %zu: sample %d of pixel %zu is %g", k, c, i, found);
            }
        free(d.samples);
        /* A strip or a scan that is missing is told; WebP's and HDR's are all of the file. */
        refuses(file.data, file.size / 2, SHD_SCENE, "");
        refuses(file.data, 20, SHD_SCENE, "");
        if (kind->format == SHD_TIFF) { /* its rows are deflated, from the 8th byte on */
            memset((unsigned char *)file.data + 12, 0xff, 16);
            refuses(file.data, file.size, SHD_SCENE, "");
        }
        free(file.data);
    }
}

static void put_box(uint8_t *data, size_t size, const char *name, int width, int height) {
    const int32_t box[4] = {0, 0, width - 1, height - 1};
    uint8_t *at = memmem(data, size, name, strlen(name) + 1);
    assert_non_null(at);
    memcpy(at + strlen(name) + 1 + strlen("box2i") + 1 + 4, box, sizeof box);
}

/* A head that promises more than there is: more than is read here, or more than the file has. */
static void exr_promises_nothing(void **state) {
    (void)state;
    if (!oiio) skip();
    static const int sides[] = {100000, 250, 2000000000};
    float rgba[4 * PIXELS] = {0};
    shd_bytes file = make_file(SHD_EXR, SHD_FLOAT, false, rgba);
    for (size_t i = 0; i < sizeof sides / sizeof *sides; i++) {
        put_box(file.data, file.size, "dataWindow", sides[i], sides[i]);
        put_box(file.data, file.size, "displayWindow", sides[i], sides[i]);
        decoded d = decode(file.data, file.size);
        assert_true(d.status == SHD_SCENE || d.status == SHD_LIMIT);
        assert_null(d.samples);
    }
    free(file.data);
}

/* OpenEXR decodes all of them. */
static void channels_are_bounded(void **state) {
    (void)state;
    if (!oiio) skip();
#ifndef NDEBUG
    skip(); /* the encoder asserts that a layer has four channels at most */
#endif
    static const char *const names[] = {"a", "b", "c", "d", "e", "f", "g",
                                        "h", "i", "j", "k", "l", "m", "n"};
    static float rgba[4 * PIXELS], values[14 * PIXELS];
    for (int count = 13; count <= 14; count++) {
        const shd_image_layer layer = {
            .name = "x", .channels = names, .count = count, .values = values};
        shd_bytes file = make_layered(SHD_EXR, SHD_HALF, false, rgba, &layer);
        decoded d = decode(file.data, file.size);
        assert_int_equal(d.status, count == 13 ? SHD_OK : SHD_SCENE);
        assert_int_equal(d.admitted, count == 13);
        if (d.status) assert_non_null(strstr(d.error.text, "it has 17 channels; pictures of 16"));
        free(d.samples);
        free(file.data);
    }
}

int main(void) {
    void *module = dlopen("shaded_oiio.so", RTLD_NOW);
    shd_oiio_open_fn *open_it = NULL;
    if (module) *(void **)&open_it = dlsym(module, "shd_oiio_open");
    if (open_it && open_it()) *(void **)&oiio = dlsym(module, "shd_oiio_decode");
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_kind_of_png_is_read),
        cmocka_unit_test(a_head_decides_before_anything_is_decoded),
        cmocka_unit_test(other_formats_are_read),
        cmocka_unit_test(exr_promises_nothing),
        cmocka_unit_test(channels_are_bounded),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
