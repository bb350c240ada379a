/* PNG files as the standard wants them: chunks, checksums, samples, color metadata. */
#include "unit/image/fixture.h"

#include "base/primaries.h"

#include <libdeflate.h>

typedef struct chunk {
    const unsigned char *data; /* NULL: there is none */
    uint32_t length;
} chunk;

/* Walks the file, checks every checksum, and finds a chunk; `order` gets all types in a row. */
static chunk find(shd_bytes png, const char *type, char order[512]) {
    static const unsigned char signature[] = {137, 80, 78, 71, 13, 10, 26, 10};
    chunk found = {NULL, 0};
    size_t at = 8;
    assert_memory_equal(png.data, signature, 8);
    order[0] = 0;
    while (at < png.size) {
        assert_true(at + 12 <= png.size);
        uint32_t length = read32(png.data + at);
        assert_true(length <= png.size - at - 12);
        const unsigned char *name = png.data + at + 4;
        assert_int_equal(read32(name + 4 + length), libdeflate_crc32(0, name, length + 4));
        strncat(order, (const char *)name, 4);
        strcat(order, " ");
        if (!memcmp(name, type, 4)) found = (chunk){name + 4, length};
        at += 12 + length;
    }
    return found;
}

static void check_order(const shd_image *image, const char *wanted) {
    char order[512];
    shd_bytes png = encoded(image, SHD_PNG);
    find(png, "IHDR", order);
    assert_string_equal(order, wanted);
    free(png.data);
}

/* The data of all IDAT chunks; the caller frees it. */
static chunk join_data(shd_bytes png) {
    unsigned char *all = malloc(png.size);
    uint32_t size = 0;
    for (size_t at = 8; at < png.size; at += 12 + read32(png.data + at)) {
        if (memcmp(png.data + at + 4, "IDAT", 4)) continue;
        memcpy(all + size, png.data + at + 8, read32(png.data + at));
        size += read32(png.data + at);
    }
    return (chunk){all, size};
}

/* What a filter expects of a byte from those to the left and above. */
static unsigned expected(unsigned filter, unsigned left, unsigned above) {
    switch (filter) {
    case 1:
        return left;
    case 2:
        return above;
    case 3:
        return (left + above) / 2;
    default:
        assert_int_equal(filter, 0);
        return 0;
    }
}

/* Undoes deflate and the filters; rows of samples as stored. `used` counts the filters. */
static unsigned char *decode_counting(shd_bytes png, size_t row, size_t pixel, size_t height,
                                      int used[5]) {
    chunk idat = join_data(png);
    unsigned char *raw = malloc((row + 1) * height), *out = malloc(row * height);
    struct libdeflate_decompressor *d = libdeflate_alloc_decompressor();
    size_t size;
    assert_int_equal(
        libdeflate_zlib_decompress(d, idat.data, idat.length, raw, (row + 1) * height, &size), 0);
    assert_int_equal(size, (row + 1) * height);
    libdeflate_free_decompressor(d);
    for (size_t y = 0; y < height; y++) {
        const unsigned char *from = raw + y * (row + 1);
        unsigned char *to = out + y * row;
        assert_true(from[0] < 5);
        used[from[0]]++;
        for (size_t x = 0; x < row; x++)
            to[x] = (unsigned char)(from[1 + x] + expected(from[0], x < pixel ? 0 : to[x - pixel],
                                                           y ? *(to + x - row) : 0));
    }
    free((void *)(size_t)idat.data);
    free(raw);
    return out;
}

static unsigned char *decode(shd_bytes png, size_t row, size_t pixel, size_t height) {
    int used[5] = {0};
    return decode_counting(png, row, pixel, height, used);
}

static void header_names_size_depth_and_channels(void **state) {
    (void)state;
    enum { W = 7, H = 5 };
    float *rgba = gradient(W, H);
    static const struct {
        int channel;
        bool alpha;
        shd_depth depth;
        unsigned char bits, type;
    } cases[] = {
        {-1, false, SHD_U8, 8, 2},  {-1, true, SHD_U8, 8, 6},   {0, false, SHD_U8, 8, 0},
        {2, true, SHD_U8, 8, 4},    {3, true, SHD_U8, 8, 0},    {-1, false, SHD_U16, 16, 2},
        {-1, true, SHD_U16, 16, 6}, {1, false, SHD_U16, 16, 0}, {1, true, SHD_U16, 16, 4}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        shd_image image = picture(rgba, W, H);
        image.channel = cases[i].channel;
        image.alpha = cases[i].alpha;
        image.depth = cases[i].depth;
        shd_bytes png = encoded(&image, SHD_PNG);
        char order[512];
        chunk ihdr = find(png, "IHDR", order);
        assert_int_equal(ihdr.length, 13);
        assert_int_equal(read32(ihdr.data), W);
        assert_int_equal(read32(ihdr.data + 4), H);
        assert_int_equal(ihdr.data[8], cases[i].bits);
        assert_int_equal(ihdr.data[9], cases[i].type);
        assert_memory_equal(ihdr.data + 10, "\0\0\0", 3);
        free(png.data);
    }
    free(rgba);
}

static void samples_come_back_straight_and_big_endian(void **state) {
    (void)state;
    enum { W = 33, H = 9 };
    float *rgba = gradient(W, H);
    shd_image image = picture(rgba, W, H);
    image.alpha = true;
    shd_bytes png = encoded(&image, SHD_PNG);
    unsigned char *samples = decode(png, 4 * W, 4, H);
    for (int i = 0; i < 4 * W * H; i++)
        assert_int_equal(samples[i], (int)floor(rgba[i] * 255.0 + 0.5));
    free(samples);
    free(png.data);

    image.depth = SHD_U16;
    png = encoded(&image, SHD_PNG);
    samples = decode(png, 8 * W, 8, H);
    for (int i = 0; i < 4 * W * H; i++)
        assert_int_equal(samples[2 * i] << 8 | samples[2 * i + 1],
                         (int)floor(rgba[i] * 65535.0 + 0.5));
    free(samples);
    free(png.data);
    free(rgba);
}

static void color_is_said_once_and_truly(void **state) {
    (void)state;
    const float rgba[4] = {0.5f, 0.5f, 0.5f, 1};
    shd_image image = picture(rgba, 1, 1);
    check_order(&image, "IHDR cICP gAMA cHRM sRGB IDAT IEND ");

    image.transfer = SHD_TRANSFER_REC1886;
    check_order(&image, "IHDR gAMA cHRM IDAT IEND ");
    image.transfer = SHD_TRANSFER_LINEAR;
    check_order(&image, "IHDR cICP gAMA cHRM IDAT IEND ");

    shd_image p3 = image;
    p3.transfer = SHD_TRANSFER_SRGB;
    memcpy(p3.primaries, display_p3, sizeof display_p3);
    check_order(&p3, "IHDR cICP gAMA cHRM iCCP IDAT IEND ");
    p3.channel = 0; /* an RGB profile in a grey picture is an error to libpng */
    check_order(&p3, "IHDR gAMA IDAT IEND ");
    p3.channel = 3;
    check_order(&p3, "IHDR IDAT IEND ");

    /* ACES2065-1's blue lies below the axis: no cHRM can say that. */
    const double aces[8] = {0.7347, 0.2653, 0.0, 1.0, 0.0001, -0.0770, 0.32168, 0.33767};
    memcpy(image.primaries, aces, sizeof aces);
    check_order(&image, "IHDR gAMA iCCP IDAT IEND ");

    image.transfer = SHD_TRANSFER_UNKNOWN;
    check_order(&image, "IHDR IDAT IEND ");
    image.transfer = SHD_TRANSFER_LINEAR;
    image.has_primaries = false;
    check_order(&image, "IHDR gAMA IDAT IEND ");
}

static void code_points_are_those_of_h_273(void **state) {
    (void)state;
    const float rgba[4] = {0.5f, 0.5f, 0.5f, 1};
    static const struct {
        const double *xy;
        shd_transfer transfer;
        unsigned char codes[2]; /* 0: there are none */
    } cases[] = {{rec709, SHD_TRANSFER_SRGB, {1, 13}},      {rec709, SHD_TRANSFER_LINEAR, {1, 8}},
                 {rec709, SHD_TRANSFER_GAMMA22, {1, 4}},    {rec709, SHD_TRANSFER_REC1886, {0}},
                 {display_p3, SHD_TRANSFER_SRGB, {12, 13}}, {shd_rec2020, SHD_TRANSFER_PQ, {9, 16}},
                 {shd_rec2020, SHD_TRANSFER_HLG, {9, 18}},  {shd_p3_dci, SHD_TRANSFER_GAMMA26, {0}},
                 {shd_acescg, SHD_TRANSFER_LINEAR, {0}}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        shd_image image = picture(rgba, 1, 1);
        image.transfer = cases[i].transfer;
        memcpy(image.primaries, cases[i].xy, sizeof image.primaries);
        shd_bytes png = encoded(&image, SHD_PNG);
        char order[512];
        const chunk told = find(png, "cICP", order);
        const unsigned char wanted[4] = {cases[i].codes[0], cases[i].codes[1], 0, 1};
        if (cases[i].codes[0])
            assert_memory_equal(told.data, wanted, sizeof wanted);
        else
            assert_null(strstr(order, "cICP"));
        free(png.data);
    }
}

static void gamma_and_chromaticities_have_the_standards_values(void **state) {
    (void)state;
    const float rgba[4] = {0.5f, 0.5f, 0.5f, 1};
    static const uint32_t srgb[8] = {31270, 32900, 64000, 33000, 30000, 60000, 15000, 6000};
    static const struct {
        shd_transfer transfer;
        uint32_t gamma;
    } cases[] = {
        {SHD_TRANSFER_SRGB, 45455}, {SHD_TRANSFER_LINEAR, 100000}, {SHD_TRANSFER_REC1886, 41667}};
    for (size_t i = 0; i < 3; i++) {
        shd_image image = picture(rgba, 1, 1);
        image.transfer = cases[i].transfer;
        shd_bytes png = encoded(&image, SHD_PNG);
        char order[512];
        chunk gamma = find(png, "gAMA", order), chrm = find(png, "cHRM", order);
        assert_int_equal(read32(gamma.data), cases[i].gamma);
        for (int k = 0; k < 8; k++) assert_int_equal(read32(chrm.data + 4 * k), srgb[k]);
        free(png.data);
    }
}

static void noise_and_single_pixels_fit_their_bounds(void **state) {
    (void)state;
    enum { W = 61, H = 47 };
    float *rgba = gradient(W, H);
    uint32_t seed = 7;
    for (int i = 0; i < 4 * W * H; i++) {
        seed = seed * 1664525u + 1013904223u;
        rgba[i] = (float)(seed >> 8) / (float)(1 << 24);
    }
    for (int w = 1; w <= W; w += 12)
        for (int h = 1; h <= H; h += 23) {
            shd_image image = picture(rgba, w, h);
            image.alpha = true;
            image.depth = SHD_U16;
            shd_bytes png = encoded(&image, SHD_PNG);
            unsigned char *samples = decode(png, 8 * (size_t)w, 8, (size_t)h);
            for (int i = 0; i < 4 * w * h; i++)
                assert_int_equal(samples[2 * i] << 8 | samples[2 * i + 1],
                                 (int)floor(rgba[i] * 65535.0 + 0.5));
            free(samples);
            free(png.data);
        }
    free(rgba);
}

/* A disc of slopes on black, beside noise and stripes. */
static void paint(unsigned char *samples, size_t width, size_t height, size_t pixel) {
    uint32_t seed = 3;
    for (size_t y = 0; y < height; y++)
        for (size_t x = 0; x < width; x++)
            for (size_t c = 0; c < pixel; c++) {
                double dx = (double)x / (double)width - 0.4, dy = (double)y / (double)height - 0.5;
                unsigned v =
                    dx * dx + dy * dy < 0.1 ? (unsigned)(200 - 300 * (dx + dy * (double)c)) : 0;
                seed = seed * 1664525u + 1013904223u;
                if (x > width * 9 / 10) v = y > height / 2 ? seed >> 24 : (unsigned)x * 40;
                samples[(y * width + x) * pixel + c] = (unsigned char)v;
            }
}

static void rows_take_their_filters_with_the_same_bytes_from_any_variant(void **state) {
    (void)state;
    enum { W = 701, H = 530 };
    unsigned char *samples = malloc((size_t)8 * W * H);
    for (int deep = 0; deep < 2; deep++)
        for (int alpha = 0; alpha < 2; alpha++) {
            shd_image image = picture(NULL, W, H);
            image.samples = samples;
            image.alpha = alpha;
            image.depth = deep ? SHD_U16 : SHD_U8;
            const size_t pixel = (size_t)(alpha ? 4 : 3) * (deep ? 2 : 1);
            paint(samples, W, H, pixel);
            shd_bytes first = encoded(&image, SHD_PNG);
            int used[5] = {0};
            unsigned char *back = decode_counting(first, W * pixel, pixel, H, used);
            for (size_t i = 0; i < W * H * pixel; i += deep ? 2 : 1) {
                assert_int_equal(back[i], samples[i + (deep ? 1 : 0)]);
                if (deep) assert_int_equal(back[i + 1], samples[i]);
            }
            free(back);
            assert_true(used[1] && used[2] && used[3]);
            for (shd_isa isa = SHD_PORTABLE; isa < SHD_ISA_COUNT; isa++) {
                if (!shd_cpu_has(isa)) continue;
                image.isa = isa;
                shd_bytes other = encoded(&image, SHD_PNG);
                assert_int_equal(other.size, first.size);
                assert_memory_equal(other.data, first.data, first.size);
                free(other.data);
            }
            free(first.data);
        }
    free(samples);
}

/* What no compressor makes smaller, so that it takes more than one chunk. */
static void long_data_is_cut_into_chunks(void **state) {
    (void)state;
    enum { W = 701, H = 530, SIZE = 4 * W * H };
    unsigned char *samples = malloc(SIZE);
    uint32_t seed = 5;
    for (size_t i = 0; i < SIZE; i++) {
        seed = seed * 1664525u + 1013904223u;
        samples[i] = (unsigned char)(seed >> 24);
    }
    shd_image image = picture(NULL, W, H);
    image.samples = samples;
    image.alpha = true;
    shd_bytes png = encoded(&image, SHD_PNG);
    char order[512];
    find(png, "IHDR", order);
    assert_non_null(strstr(order, "sRGB IDAT IDAT IEND "));
    unsigned char *back = decode(png, (size_t)4 * W, 4, H);
    assert_memory_equal(back, samples, SIZE);
    free(back);
    free(png.data);
    free(samples);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(header_names_size_depth_and_channels),
        cmocka_unit_test(samples_come_back_straight_and_big_endian),
        cmocka_unit_test(color_is_said_once_and_truly),
        cmocka_unit_test(code_points_are_those_of_h_273),
        cmocka_unit_test(gamma_and_chromaticities_have_the_standards_values),
        cmocka_unit_test(noise_and_single_pixels_fit_their_bounds),
        cmocka_unit_test(rows_take_their_filters_with_the_same_bytes_from_any_variant),
        cmocka_unit_test(long_data_is_cut_into_chunks),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
