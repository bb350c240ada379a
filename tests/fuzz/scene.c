/* Scene documents and meshes, from any bytes to an accepted or refused one. */
#include <jansson.h>
#include <string.h>

#include "../same_tree.h"
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
          status == SHD_MEMORY || status == SHD_MISSING);
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

static shd_status keep_mesh(const void *data, size_t size, bool binary, const shd_digest *digest) {
    shd_request *request;
    bool known;
    CHECK(shd_request_new(engine_once(), &request, NULL) == SHD_OK);
    const shd_status status =
        shd_request_keep_mesh(request, data, size, binary, digest, "a", &known);
    const shd_report *report = shd_request_report(request);
    CHECK(status == report->status);
    CHECK(status == SHD_OK || status == SHD_SYNTAX || status == SHD_SCENE || status == SHD_LIMIT ||
          status == SHD_MEMORY);
    CHECK((status == SHD_OK) == !shd_report_errors_kept(report));
    shd_request_drop(request);
    return status;
}

/* The bytes as they are, and behind a head that they fit. */
static void check_mesh(const uint8_t *data, size_t size) {
    const shd_digest digest = shd_digest_of(data, size);
    keep_mesh(data, size, false, &digest);
    keep_mesh(data, size, true, &digest);
    if (size < 13) return;
    const uint32_t vertices = data[0], flags = data[1] % 2;
    const size_t floats = (size_t)vertices * (flags ? 24 : 12), left = size - 12;
    if (floats > left) return;
    const uint32_t head[3] = {vertices, (uint32_t)((left - floats) / 4), flags};
    const size_t length = 12 + floats + 4 * (size_t)head[1];
    uint8_t *mesh = malloc(length);
    CHECK(mesh);
    memcpy(mesh, head, sizeof head);
    memcpy(mesh + 12, data + 12, length - 12);
    const shd_digest name = shd_digest_of(mesh, length);
    const bool kept = keep_mesh(mesh, length, true, &name) == SHD_OK;
    free(mesh);
    char text[256], digits[SHD_DIGEST_TEXT];
    shd_digest_write(&name, digits);
    snprintf(text, sizeof text, "{\"objects\":[{\"type\":\"mesh\",\"data\":\"sha256-%s\"}]}",
             digits);
    shd_request *request = read_scene(text, strlen(text));
    const shd_status status = shd_request_report(request)->status;
    CHECK(!kept || status == SHD_OK);
    shd_request_drop(request);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    const char *text = (const char *)data;
    shd_request *request = read_scene(text, size);
    if (shd_request_report(request)->status == SHD_OK) {
        CHECK(strlen(shd_request_etag(request)) == 32);
        check_digest(request, text, size);
    }
    shd_request_drop(request);
    CHECK(hold_quick_tree(text, size) >= 0);
    check_mesh(data, size);
    return 0;
}
