/* JPEG in strips: the same picture as in one piece, and the same bytes whoever encodes them. */
#include "unit/image/fixture.h"

#include <turbojpeg.h>

#include "base/pool.h"

/* Not a multiple of an MCU, and of many strips. */
enum { WIDE = 1003, HIGH = 1501 };

static unsigned char *decoded(shd_bytes jpeg, int channels) {
    tjhandle handle = tjInitDecompress();
    int width, height, sampling, space;
    assert_int_equal(
        tjDecompressHeader3(handle, jpeg.data, jpeg.size, &width, &height, &sampling, &space), 0);
    assert_true(width == WIDE && height == HIGH);
    unsigned char *pixels = malloc((size_t)WIDE * HIGH * (size_t)channels);
    assert_non_null(pixels);
    assert_int_equal(tjDecompress2(handle, jpeg.data, jpeg.size, pixels, WIDE, 0, HIGH,
                                   channels == 1 ? TJPF_GRAY : TJPF_RGB, TJFLAG_ACCURATEDCT),
                     0);
    tjDestroy(handle);
    return pixels;
}

static void strips_are_the_picture(void **state) {
    (void)state;
    unsigned char *samples = malloc((size_t)WIDE * HIGH * 3);
    assert_non_null(samples);
    for (int i = 0; i < WIDE * HIGH * 3; i++)
        samples[i] = (unsigned char)(i / 3 % WIDE / 4 * (1 + i % 3) + i / 3 / WIDE / 3);
    for (int round = 0; round < 3; round++) {
        const int quality = round == 0 ? 90 : 60, channels = round == 2 ? 1 : 3;
        shd_image image = picture(NULL, WIDE, HIGH);
        image.samples = samples;
        image.quality = quality;
        image.channel = channels == 1 ? 0 : -1;
        image.transfer = SHD_TRANSFER_UNKNOWN; /* no profile */
        shd_bytes got = encoded(&image, SHD_JPEG);

        tjhandle handle = tjInitCompress();
        shd_bytes whole = {NULL, 0};
        unsigned long size = 0;
        const int sampling = channels == 1 ? TJSAMP_GRAY : quality < 90 ? TJSAMP_420 : TJSAMP_444;
        assert_int_equal(tjCompress2(handle, samples, WIDE, 0, HIGH,
                                     channels == 1 ? TJPF_GRAY : TJPF_RGB, &whole.data, &size,
                                     sampling, quality, TJFLAG_ACCURATEDCT),
                         0);
        whole.size = size;
        tjDestroy(handle);
        /* Markers, and that strips begin without the average of what is before them. */
        assert_true(got.size != whole.size && labs((long)got.size - (long)whole.size) < 500);

        unsigned char *a = decoded(got, channels), *b = decoded(whole, channels);
        assert_memory_equal(a, b, (size_t)WIDE * HIGH * (size_t)channels);
        free(a);
        free(b);
        free(got.data);
        tjFree(whole.data);
    }
    free(samples);
}

static void spread(void *context, size_t count,
                   void (*run)(void *work, size_t index, unsigned slot), void *work) {
    shd_pool_for(context, count, run, work);
}

static void threads_make_the_same_bytes(void **state) {
    (void)state;
    float *rgba = gradient(WIDE, HIGH);
    shd_image image = picture(rgba, WIDE, HIGH);
    const shd_bytes wanted = encoded(&image, SHD_JPEG);
    shd_pool *pool;
    shd_error error;
    assert_int_equal(shd_pool_new(4, 4, &pool, &error), SHD_OK);
    image.spread = spread;
    image.slots = shd_pool_slots(pool);
    image.context = pool;
    for (int i = 0; i < 5; i++) {
        shd_bytes got = encoded(&image, SHD_JPEG);
        assert_int_equal(got.size, wanted.size);
        assert_memory_equal(got.data, wanted.data, got.size);
        free(got.data);
    }
    shd_pool_drop(pool);
    free(wanted.data);
    free(rgba);
}

static bool twice(void *context) {
    int *calls = context;
    return (*calls)++ < 2;
}

static void it_is_left_where_it_is_told_to(void **state) {
    (void)state;
    float *rgba = gradient(WIDE, HIGH);
    shd_image image = picture(rgba, WIDE, HIGH);
    int calls = 0;
    image.go_on = twice;
    image.context = &calls;
    shd_arena *scratch = shd_arena_new(1 << 26);
    shd_bytes out = {0};
    shd_error error = {0};
    assert_int_equal(shd_image_encode(&image, SHD_JPEG, scratch, &out, &error), SHD_CANCELLED);
    assert_null(out.data);
    assert_int_equal(calls, 3);
    shd_arena_drop(scratch);
    free(rgba);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(strips_are_the_picture),
        cmocka_unit_test(threads_make_the_same_bytes),
        cmocka_unit_test(it_is_left_where_it_is_told_to),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
