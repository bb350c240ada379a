/* A fresh engine's pictures meet no fresh memory, and what small ones leave is small: counted in
 * page faults and bytes, not in time. Pages are small here, as where the system gives no huge
 * ones. */
#include <sys/prctl.h>
#include <sys/resource.h>

#include "property/pieces.h"
#include "render/engine.h"
#include "render/tiles/reuse.h"

static shd_engine *fresh_engine(void) {
    shd_engine_options options = shd_engine_defaults();
    options.threads = 1;
    shd_engine *engine = NULL;
    shd_error error;
    assert_int_equal(shd_engine_new(&options, &engine, &error), SHD_OK);
    return engine;
}

static void render(shd_engine *engine, int side, int samples, double radius) {
    char *json = text_of("{\"image\": {\"width\": %d, \"height\": %d, \"samples\": %d}, "
                         "\"objects\": [{\"type\": \"sphere\", \"radius\": %.9g, \"material\": "
                         "{\"specular\": 0.5}}]}",
                         side, side, samples, radius);
    shd_request *request = read_scene(engine, json);
    shd_error error;
    assert_int_equal(shd_request_render(request, NULL, &error), SHD_OK);
    assert_int_equal(shd_request_reused(request), SHD_REUSED_NOTHING);
    shd_request_drop(request);
    free(json);
}

static long faults(void) {
    struct rusage usage;
    assert_int_equal(getrusage(RUSAGE_THREAD, &usage), 0);
    return usage.ru_minflt;
}

/* A picture keeps 9 MB of hits and sums of light, which are 2,300 pages. */
static void the_first_pictures_meet_no_fresh_pages(void **state) {
    (void)state;
    enum { FIRST = 3, PICTURES = 43 };
    shd_engine *engine = fresh_engine();
    long worst = 0;
    for (int i = 0; i < PICTURES; i++) {
        while (shd_reuse_touch(engine->reuse)) continue; /* as idle workers do */
        const long before = faults();
        render(engine, 512, 4, 1 + 1e-4 * i);
        const long met = faults() - before;
        /* The first pictures bring code and the memory that requests hand on. */
        if (i >= FIRST && met > worst) worst = met;
    }
    print_message("page faults of a picture after the first %d: %ld at most\n", FIRST, worst);
    assert_true(worst < 250);
    assert_true(shd_engine_reuse(engine).bytes > (size_t)200 << 20);
    shd_engine_drop(engine);
}

static void small_pictures_keep_little(void **state) {
    (void)state;
    enum { PICTURES = 100, SIDE = 32 };
    shd_engine *engine = fresh_engine();
    for (int i = 0; i < PICTURES; i++) render(engine, SIDE, 1, 1 + 1e-4 * i);
    const size_t each = shd_engine_reuse(engine).bytes / PICTURES;
    print_message("%d x %d: %zu bytes are kept\n", SIDE, SIDE, each);
    assert_in_range(each, 1, 80 * SIDE * SIDE);
    shd_engine_drop(engine);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_first_pictures_meet_no_fresh_pages),
        cmocka_unit_test(small_pictures_keep_little),
    };
    prctl(PR_SET_THP_DISABLE, 1, 0, 0, 0);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
