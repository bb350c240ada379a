/* A WebP picture is left although libwebp does not ask: the linker sends calls of it here, where
 * they wait as long as the test wants. */
#include "unit/image/fixture.h"

#include <pthread.h>
#include <stdatomic.h>
#include <unistd.h>
#include <webp/encode.h>

static atomic_bool holding;
static atomic_int begun, finished; /* calls, and pictures that came of them */

int __wrap_WebPEncode(const WebPConfig *config, WebPPicture *picture);
int __real_WebPEncode(const WebPConfig *config, WebPPicture *picture);

int __wrap_WebPEncode(const WebPConfig *config, WebPPicture *picture) {
    atomic_fetch_add(&begun, 1);
    while (atomic_load(&holding)) usleep(1000);
    const int whole = __real_WebPEncode(config, picture);
    atomic_fetch_add(&finished, whole);
    return whole;
}

enum { W = 300, H = 200 };

/* Goes on until libwebp has begun and some more questions were asked. */
static bool go_on_a_little(void *context) {
    int *left = context;
    return !atomic_load(&begun) || (*left)-- > 0;
}

static shd_status encode_webp(const shd_image *image, shd_budget *budget, shd_bytes *out) {
    shd_spares *spares = shd_spares_new(0, budget);
    shd_arena *scratch = shd_arena_new_from(spares, 1 << 26);
    shd_error error;
    const shd_status status = shd_image_encode(image, SHD_WEBP, scratch, out, &error);
    shd_arena_drop(scratch);
    shd_spares_drop(spares);
    return status;
}

static void expect_abandoned(unsigned count) {
    while (shd_image_abandoned() != count) usleep(1000);
}

/* What it was given is freed at once, which AddressSanitizer watches. */
static void leave_one(shd_budget *budget, int quality) {
    float *rgba = gradient(W, H);
    int left = 3;
    shd_image image = picture(rgba, W, H);
    image.quality = quality;
    image.go_on = go_on_a_little;
    image.context = &left;
    shd_bytes out = {NULL, 0};
    atomic_store(&begun, 0);
    assert_int_equal(encode_webp(&image, budget, &out), SHD_CANCELLED);
    assert_int_equal(left, -1);
    assert_null(out.data);
    free(rgba);
}

static void who_encodes_leaves_before_libwebp_asks(void **state) {
    (void)state;
    for (int quality = 80; quality <= 100; quality += 20) {
        shd_budget *budget = shd_budget_new(1 << 30);
        atomic_store(&holding, true);
        leave_one(budget, quality);
        expect_abandoned(1);
        assert_true(shd_budget_load_of(budget).used >= W * H * 24);
        shd_budget *owner = shd_budget_keep(budget);
        shd_budget_drop(budget); /* the thread has it, too */
        atomic_store(&holding, false);
        expect_abandoned(0);
        assert_int_equal(atomic_load(&finished), 0);
        assert_true(shd_budget_load_of(owner).used == 0);
        shd_budget_drop(owner);
    }
}

static bool count_questions(void *context) {
    return --*(int *)context > 0;
}

static void as_many_as_work_are_abandoned_at_most(void **state) {
    (void)state;
    atomic_store(&holding, true);
    leave_one(NULL, 90);
    expect_abandoned(1);
    float *rgba = gradient(W, H);
    int left = 5;
    shd_image image = picture(rgba, W, H);
    image.go_on = count_questions;
    image.context = &left;
    shd_bytes out;
    atomic_store(&begun, 0);
    assert_int_equal(encode_webp(&image, NULL, &out), SHD_CANCELLED);
    assert_int_equal(left, 0);
    assert_int_equal(atomic_load(&begun), 0);
    expect_abandoned(1);
    atomic_store(&holding, false);
    image.go_on = NULL;
    double elsewhere = 0;
    image.elsewhere = &elsewhere;
    assert_int_equal(encode_webp(&image, NULL, &out), SHD_OK);
    assert_true(elsewhere > 0);
    assert_int_equal(atomic_load(&finished), 1);
    free(out.data);
    free(rgba);
    expect_abandoned(0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(who_encodes_leaves_before_libwebp_asks),
        cmocka_unit_test(as_many_as_work_are_abandoned_at_most),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
