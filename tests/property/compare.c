/* Measuring films: any number of threads gives the same figures, the memory's cap holds for the
 * comparison as a whole, and cancelling ends it. */
#include "property/pieces.h"
#include "render/tell/measure.h"

static char *scene(int width, int height, const char *more) {
    return text_of("{\"image\": {\"width\": %d, \"height\": %d, \"samples\": 1}, \"objects\": "
                   "[{\"type\": \"torus\", \"material\": {\"specular\": 0.5}}], \"lights\": "
                   "[{\"type\": \"point\", \"position\": [3, 3, 3]}]%s}",
                   width, height, more);
}

/* Both films of a scene, the second one moved by up to `most` where `share` of the values are. */
static shd_difference measure_moved(shd_engine *engine, char *json, double most, double share,
                                    double wanted[3]) {
    drawn exact = film_of(engine, json), other = film_of(engine, json);
    free(json);
    size_t pixels = pixels_of(&exact);
    double *errors = calloc(3 * pixels, sizeof *errors), sum = 0, largest = 0;
    uint64_t random = 7;
    for (size_t i = 0; i < pixels; i++)
        for (size_t c = 0; c < 3; c++) {
            float *value = &other.film.rgba[4 * i + c];
            if (uniform(&random, 0, 1) < share) *value += (float)uniform(&random, -most, most);
            double error = fabs((double)*value - (double)exact.film.rgba[4 * i + c]);
            sum += error;
            largest = fmax(largest, error);
            errors[3 * i + c] = error;
        }
    size_t rank = 3 * pixels - 3 * pixels / 100, below_p99 = 0, upto_p99 = 0;

    const shd_difference got = measured(&exact, &other);
    for (size_t i = 0; i < 3 * pixels; i++) {
        below_p99 += (double)(float)errors[i] < got.linear.p99;
        upto_p99 += (double)(float)errors[i] <= got.linear.p99;
    }
    assert_true(below_p99 < rank && rank <= upto_p99);
    wanted[0] = largest;
    wanted[1] = sum / (3 * (double)pixels);
    wanted[2] = got.linear.p99;
    free(errors);
    drop_drawn(&exact);
    drop_drawn(&other);
    return got;
}

static void figures_are_those_of_the_errors_put_in(void **state) {
    static const struct {
        int width, height;
        double most, share;
    } cases[] = {{1, 1, 0.1, 1},     {33, 31, 0.1, 0.5}, {32, 32, 1e-6, 1},
                 {100, 83, 10, 0.3}, {64, 64, 0.2, 0},   {199, 50, 1e-30, 0.005}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        double wanted[3];
        shd_difference got = measure_moved(*state, scene(cases[i].width, cases[i].height, ""),
                                           cases[i].most, cases[i].share, wanted);
        assert_true(got.linear.max == wanted[0]);
        assert_true(fabs(got.linear.mean - wanted[1]) <= 1e-12 * wanted[1]);
        assert_true(got.linear.mean <= got.linear.max && got.linear.p99 <= got.linear.max);
        assert_true(got.delta_e.mean <= got.delta_e.max && got.delta_e.p99 <= got.delta_e.max);
        assert_true((got.equal == 1) == isinf(got.psnr));
        assert_true((got.equal == 1) == (got.code.max == 0));
        if (cases[i].share == 0) assert_true(got.delta_e.max == 0 && got.linear.max == 0);
    }
}

static void any_number_of_threads_gives_the_same_figures(void **state) {
    (void)state;
    shd_difference got[3];
    for (unsigned i = 0; i < 3; i++) {
        shd_engine *engine = new_engine(1 + 2 * i);
        double wanted[3];
        memset(&got[i], 0, sizeof got[i]);
        got[i] = measure_moved(engine, scene(120, 90, ""), 0.05, 0.7, wanted);
        shd_engine_drop(engine);
        assert_memory_equal(&got[i], &got[0], sizeof got[0]);
    }
}

/* A comparison of a scene with layers and two outputs, which count for nothing. */
static shd_status try_compare(shd_engine *engine, const char *json, bool cancel, size_t *used) {
    shd_request *request = NULL;
    shd_error error = {.status = SHD_OK};
    char *answer = NULL;
    assert_int_equal(shd_request_new(engine, &request, &error), SHD_OK);
    shd_status status = shd_request_read(request, json, strlen(json), SHD_PNG);
    if (status == SHD_OK) {
        if (cancel) shd_request_cancel(request);
        status = shd_request_compare(request, NULL, &answer, &error);
        assert_int_equal(status, error.status);
        assert_true((status == SHD_OK) == (answer != NULL));
        *used = shd_arena_used(request->rendering.arena);
    }
    free(answer);
    shd_request_drop(request);
    return status;
}

static const char *const outputs =
    ", \"outputs\": [{\"name\": \"a\", \"format\": \"exr\", \"layers\": [\"diffuse\", "
    "\"normal\"]}, {\"name\": \"b\"}]";

static void every_cap_gives_an_answer_or_says_memory(void **state) {
    (void)state;
    /* One worker: whether a second one has work, and needs memory, is chance. */
    shd_engine *engine = new_engine(1);
    char *json = scene(200, 100, outputs);
    int good = 0, refused = 0;
    for (double cap = 64 * 1024; cap < 64e6; cap *= 1.15) {
        engine->limits.memory = (uint64_t)cap;
        size_t used = 0;
        shd_status status = try_compare(engine, json, false, &used);
        assert_true(status == SHD_OK || status == SHD_MEMORY || status == SHD_LIMIT);
        assert_true((double)used <= cap);
        assert_true(status == SHD_OK || good == 0); /* more memory never fails where less did */
        good += status == SHD_OK;
        refused += status != SHD_OK;
    }
    assert_true(good > 5 && refused > 5);
    free(json);
    shd_engine_drop(engine);
}

static void a_cancelled_comparison_says_so(void **state) {
    char *json = scene(200, 100, outputs);
    size_t used;
    assert_int_equal(try_compare(*state, json, true, &used), SHD_CANCELLED);
    free(json);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(figures_are_those_of_the_errors_put_in),
        cmocka_unit_test(any_number_of_threads_gives_the_same_figures),
        cmocka_unit_test(every_cap_gives_an_answer_or_says_memory),
        cmocka_unit_test(a_cancelled_comparison_says_so),
    };
    return cmocka_run_group_tests(tests, make_engine, drop_engine);
}
