/* An engine of one thread for a program's tests, as their state, and what it reads. cmocka.h comes
 * before. */
#pragma once

#include "render/request.h"

static inline int start_engine(void **state) {
    shd_engine_options options = shd_engine_defaults();
    shd_engine *engine = NULL;
    options.threads = 1;
    assert_int_equal(shd_engine_new(&options, &engine, NULL), SHD_OK);
    *state = engine;
    return 0;
}

static inline int stop_engine(void **state) {
    shd_engine_drop(*state);
    return 0;
}

/* Fails the test if the document is refused. */
static inline shd_request *read_document(shd_engine *engine, const char *json, size_t size) {
    shd_request *request;
    assert_int_equal(shd_request_new(engine, &request, NULL), SHD_OK);
    if (shd_request_read(request, json, size, SHD_PNG))
        fail_msg("%s: %s", shd_request_report(request)->errors[0].detail, json);
    return request;
}
