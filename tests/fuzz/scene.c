/* Scene documents, from any bytes to an accepted or refused scene. */
#include <jansson.h>
#include <string.h>

#include "fuzz.h"
#include "shaded.h"

static shd_engine *engine_once(void) {
    static shd_engine *engine;
    if (engine) return engine;
    shd_engine_options options = shd_engine_defaults();
    options.threads = 1;
    options.limits.lights = options.limits.objects = 100;
    options.limits.triangles = 10000;
    options.limits.memory = 64 << 20;
    CHECK(shd_engine_new(&options, &engine, NULL) == SHD_OK);
    return engine;
}

static shd_request *read_scene(const char *text, size_t size) {
    shd_request *request;
    CHECK(shd_request_new(engine_once(), &request, NULL) == SHD_OK);
    shd_status status = shd_request_read(request, text, size, SHD_PNG);
    const shd_report *report = shd_request_report(request);
    CHECK(status == report->status);
    CHECK(status == SHD_OK || status == SHD_SYNTAX || status == SHD_SCENE || status == SHD_LIMIT ||
          status == SHD_MEMORY);
    CHECK((status == SHD_OK) == !shd_report_errors_kept(report));
    CHECK((status == SHD_SYNTAX) == (report->line > 0));
    return request;
}

/* White space, the order of members and the spelling of numbers do not make another scene. */
static void check_digest(const shd_request *request, const char *text, size_t size) {
    json_t *tree = json_loadb(text, size, JSON_DECODE_INT_AS_REAL, NULL);
    char *other = json_dumps(tree, JSON_SORT_KEYS | JSON_INDENT(1));
    CHECK(tree && other);
    shd_request *again = read_scene(other, strlen(other));
    CHECK(shd_request_report(again)->status == SHD_OK);
    CHECK(!strcmp(shd_request_etag(request), shd_request_etag(again)));
    shd_request_drop(again);
    free(other);
    json_decref(tree);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    const char *text = (const char *)data;
    shd_request *request = read_scene(text, size);
    if (shd_request_report(request)->status == SHD_OK) {
        CHECK(strlen(shd_request_etag(request)) == 32);
        check_digest(request, text, size);
    }
    shd_request_drop(request);
    return 0;
}
