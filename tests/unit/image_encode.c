/* All formats through shd_image_encode: what is refused, what is mapped, equal bytes. Values are
 * read back by other programs in image_roundtrip_test.py. */
#include "unit/image/fixture.h"

#include <stdio.h>
#include <time.h>

enum { W = 40, H = 24 };

static bool oiio_is_mapped(void) {
    FILE *maps = fopen("/proc/self/maps", "r");
    assert_non_null(maps);
    char line[512];
    bool found = false;
    while (fgets(line, sizeof line, maps))
        found = found || strstr(line, "OpenImageIO") || strstr(line, "shaded_oiio");
    fclose(maps);
    return found;
}

/* First: the module stays once it is in. */
static void png_jpeg_and_webp_never_map_openimageio(void **state) {
    (void)state;
    float *rgba = gradient(W, H);
    shd_image image = picture(rgba, W, H);
    static const shd_format formats[] = {SHD_PNG, SHD_JPEG, SHD_WEBP};
    for (int i = 0; i < 3; i++) {
        shd_bytes out = encoded(&image, formats[i]);
        free(out.data);
    }
    assert_false(oiio_is_mapped());
    free(rgba);
}

/* Second: what one of them began goes on for the next one, and is counted once. */
static void who_waits_for_openimageio_leaves_when_cancelled(void **state) {
    (void)state;
    shd_budget *budget = shd_budget_new(1 << 30);
    shd_error error = {.status = SHD_OK};
    atomic_bool cancelled = true;
    assert_int_equal(shd_image_prepare(SHD_EXR, budget, &cancelled, &error), SHD_CANCELLED);
    assert_true(shd_budget_load_of(budget).used == 0);
    for (int i = 0; i < 2; i++) {
        assert_int_equal(shd_image_prepare(SHD_EXR, budget, NULL, &error), SHD_OK);
        assert_true(oiio_is_mapped());
        assert_true(shd_budget_load_of(budget).fixed == 64 << 20);
        assert_true(shd_budget_load_of(budget).used == 64 << 20);
    }
    assert_int_equal(shd_image_prepare(SHD_EXR, budget, &cancelled, &error), SHD_OK);
    shd_budget_drop(budget);
}

static void files_begin_with_their_signature(void **state) {
    (void)state;
    static const struct {
        const char *bytes;
        size_t size;
    } signatures[SHD_FORMAT_COUNT] = {[SHD_PNG] = {"\x89PNG\r\n\x1a\n", 8},
                                      [SHD_JPEG] = {"\xff\xd8\xff\xe0", 4},
                                      [SHD_WEBP] = {"RIFF", 4},
                                      [SHD_TIFF] = {"II*\0", 4},
                                      [SHD_EXR] = {"v/1\x01", 4},
                                      [SHD_HDR] = {"#?RADIANCE\n", 11}};
    float *rgba = gradient(W, H);
    for (int f = 0; f < SHD_FORMAT_COUNT; f++) {
        shd_image image = picture(rgba, W, H);
        image.depth = shd_format_get((shd_format)f)->depth;
        shd_bytes out = encoded(&image, (shd_format)f);
        assert_true(out.size > 64);
        assert_memory_equal(out.data, signatures[f].bytes, signatures[f].size);
        free(out.data);
    }
    free(rgba);
}

/* The service's ETag promises it: no date, no pointer, no uninitialized byte may show. */
static void equal_pictures_are_equal_bytes_at_another_second(void **state) {
    (void)state;
    float *rgba = gradient(W, H);
    shd_bytes first[SHD_FORMAT_COUNT][2];
    for (int round = 0; round < 2; round++) {
        for (int f = 0; f < SHD_FORMAT_COUNT; f++)
            for (int p3 = 0; p3 < 2; p3++) {
                shd_image image = picture(rgba, W, H);
                const shd_format_info *info = shd_format_get((shd_format)f);
                image.depth = info->depth;
                image.alpha = info->alpha;
                if (p3) memcpy(image.primaries, display_p3, sizeof display_p3);
                shd_bytes out = encoded(&image, (shd_format)f);
                if (!round) {
                    first[f][p3] = out;
                    continue;
                }
                assert_int_equal(out.size, first[f][p3].size);
                assert_memory_equal(out.data, first[f][p3].data, out.size);
                free(out.data);
                free(first[f][p3].data);
            }
        struct timespec wait = {1, 100000000};
        if (!round) nanosleep(&wait, NULL);
    }
    free(rgba);
}

static void check_refused(const shd_image *image, shd_format format, size_t cap, shd_status wanted,
                          const char *word) {
    shd_arena *scratch = shd_arena_new(cap);
    unsigned char mark;
    shd_bytes out = {&mark, 12345};
    shd_error error = {0};
    assert_int_equal(shd_image_encode(image, format, scratch, &out, &error), wanted);
    assert_int_equal(error.status, wanted);
    if (!strstr(error.text, word)) print_error("\"%s\" lacks \"%s\"\n", error.text, word);
    assert_non_null(strstr(error.text, word));
    assert_ptr_equal(out.data, &mark);
    assert_int_equal(out.size, 12345);
    assert_int_equal(shd_image_encode(image, format, scratch, &out, NULL), wanted);
    shd_arena_drop(scratch);
}

static void what_a_format_cannot_hold_is_refused(void **state) {
    (void)state;
    float *rgba = gradient(W, H);
    shd_image image = picture(rgba, W, H);
    const size_t cap = 1 << 24;
    image.depth = SHD_FLOAT;
    check_refused(&image, SHD_PNG, cap, SHD_INTERNAL, "png has no samples of depth float");
    image.depth = SHD_U16;
    check_refused(&image, SHD_JPEG, cap, SHD_INTERNAL, "depth 16");
    image.depth = SHD_U8;
    check_refused(&image, SHD_EXR, cap, SHD_INTERNAL, "depth 8");
    image.alpha = true;
    check_refused(&image, SHD_JPEG, cap, SHD_INTERNAL, "jpeg has no alpha");
    image.alpha = false;
    shd_image_layer layer = {"z", shd_channel_names(SHD_RGB), 1, false, rgba};
    image.layers = &layer;
    image.layer_count = 1;
    check_refused(&image, SHD_TIFF, cap, SHD_INTERNAL, "tiff has no layers");
    free(rgba);
}

static void sizes_beyond_a_format_are_refused(void **state) {
    (void)state;
    static const struct {
        int width, height;
        shd_format format;
        const char *words;
    } cases[] = {{16384, 1, SHD_WEBP, "1 to 16383"},
                 {1, 65501, SHD_JPEG, "1 to 65500"},
                 {0, 4, SHD_PNG, "not 0 x 4"},
                 {4, -1, SHD_EXR, "not 4 x -1"}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        shd_image image = picture(NULL, cases[i].width, cases[i].height);
        check_refused(&image, cases[i].format, 1 << 20, SHD_INTERNAL, cases[i].words);
    }
}

static void short_memory_is_an_error_in_every_format(void **state) {
    (void)state;
    enum { SIDE = 300 };
    float *rgba = gradient(SIDE, SIDE);
    for (int f = 0; f < SHD_FORMAT_COUNT; f++) {
        shd_image image = picture(rgba, SIDE, SIDE);
        image.depth = shd_format_get((shd_format)f)->depth;
        check_refused(&image, (shd_format)f, 100000, SHD_MEMORY, "memory");
    }
    /* a size whose bytes overflow */
    shd_image image = picture(rgba, 1 << 24, 1 << 24);
    check_refused(&image, SHD_PNG, 1 << 20, SHD_MEMORY, "memory");
    free(rgba);
}

static const unsigned char *find_bytes(shd_bytes where, const char *what, size_t size) {
    return memmem(where.data, where.size, what, size);
}

static void jpeg_carries_a_profile_of_color(void **state) {
    (void)state;
    float *rgba = gradient(W, H);
    shd_image image = picture(rgba, W, H);
    shd_bytes out = encoded(&image, SHD_JPEG);
    assert_non_null(find_bytes(out, "ICC_PROFILE", 12));
    free(out.data);

    memcpy(image.primaries, display_p3, sizeof display_p3);
    out = encoded(&image, SHD_JPEG);
    /* directly behind SOI and the 18 bytes of JFIF */
    assert_memory_equal(out.data + 20, "\xff\xe2", 2);
    assert_memory_equal(out.data + 24, "ICC_PROFILE\0\1\1", 14);
    size_t profile = (out.data[22] * 256u + out.data[23]) - 16u;
    assert_int_equal(read32(out.data + 38), profile);
    assert_memory_equal(out.data + 38 + profile, "\xff\xdb", 2);
    free(out.data);

    image.channel = 1; /* one channel is grey, not a color of that space */
    out = encoded(&image, SHD_JPEG);
    assert_null(find_bytes(out, "ICC_PROFILE", 12));
    free(out.data);
    free(rgba);
}

static void webp_quality_100_is_lossless(void **state) {
    (void)state;
    float *rgba = gradient(W, H);
    shd_image image = picture(rgba, W, H);
    shd_bytes out = encoded(&image, SHD_WEBP);
    assert_non_null(find_bytes(out, "VP8 ", 4));
    free(out.data);
    image.quality = 100;
    out = encoded(&image, SHD_WEBP);
    assert_memory_equal(out.data + 12, "VP8X", 4);
    assert_non_null(find_bytes(out, "ICCP", 4));
    assert_non_null(find_bytes(out, "VP8L", 4));
    free(out.data);
    image.transfer = SHD_TRANSFER_UNKNOWN;
    out = encoded(&image, SHD_WEBP);
    assert_memory_equal(out.data + 12, "VP8L", 4);
    free(out.data);
    free(rgba);
}

static bool count_down(void *context) {
    return --*(int *)context > 0;
}

static void check_left_where_told(shd_image image, shd_format format, int least) {
    int calls = 1000000;
    shd_bytes wanted = encoded(&image, format);
    image.go_on = count_down;
    image.context = &calls;
    shd_bytes out = encoded(&image, format);
    assert_int_equal(out.size, wanted.size);
    assert_memory_equal(out.data, wanted.data, wanted.size);
    free(wanted.data);
    free(out.data);
    int most = 1000000 - calls;
    assert_true(most >= least);
    for (int at = 1; at <= most; at += 1 + most / 50) {
        calls = at;
        check_refused(&image, format, 1 << 26, SHD_CANCELLED, "cancelled");
    }
}

static void encoding_is_left_where_it_is_told_to(void **state) {
    (void)state;
    enum { SIDE = 600, WIDE = 11250, WIDEST = 90000 };
    float *rgba = gradient(SIDE, SIDE);
    static const struct {
        shd_format format;
        shd_depth depth;
        int quality, width, height;
        int least; /* questions whether to go on */
    } cases[] = {{SHD_PNG, SHD_U8, 0, SIDE, SIDE, 3},
                 {SHD_PNG, SHD_U16, 0, SIDE, SIDE, 3},
                 {SHD_TIFF, SHD_U8, 0, SIDE, SIDE, 8},
                 {SHD_TIFF, SHD_U8, 0, WIDE, SIDE * SIDE / WIDE, 8},
                 {SHD_TIFF, SHD_U16, 0, WIDEST, SIDE * SIDE / WIDEST, 350},
                 {SHD_EXR, SHD_HALF, 0, WIDEST, SIDE * SIDE / WIDEST, 350},
                 {SHD_EXR, SHD_HALF, 0, SIDE, SIDE, 12},
                 {SHD_EXR, SHD_HALF, 0, WIDE, SIDE * SIDE / WIDE, 12},
                 {SHD_HDR, SHD_FLOAT, 0, SIDE, SIDE, 12},
                 {SHD_HDR, SHD_FLOAT, 0, WIDE, SIDE * SIDE / WIDE, 12}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        shd_image image = picture(rgba, cases[i].width, cases[i].height);
        image.depth = cases[i].depth;
        image.quality = cases[i].quality;
        check_left_where_told(image, cases[i].format, cases[i].least);
    }
    free(rgba);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(png_jpeg_and_webp_never_map_openimageio),
        cmocka_unit_test(who_waits_for_openimageio_leaves_when_cancelled),
        cmocka_unit_test(files_begin_with_their_signature),
        cmocka_unit_test(equal_pictures_are_equal_bytes_at_another_second),
        cmocka_unit_test(what_a_format_cannot_hold_is_refused),
        cmocka_unit_test(sizes_beyond_a_format_are_refused),
        cmocka_unit_test(short_memory_is_an_error_in_every_format),
        cmocka_unit_test(jpeg_carries_a_profile_of_color),
        cmocka_unit_test(webp_quality_100_is_lossless),
        cmocka_unit_test(encoding_is_left_where_it_is_told_to),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
