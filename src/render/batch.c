/* Scenes with variants, as the library's users see them. */
#include "render/request.h"
#include "scene/variants.h"

shd_status shd_request_read_batch(shd_request *request, const char *json, size_t length,
                                  shd_batch **out) {
    shd_stage_begin(&request->rendering);
    const shd_status status = shd_variants_read(json, length, &request->limits, &request->cancelled,
                                                request->rendering.arena, out, &request->report);
    shd_stage_end(&request->rendering, &request->rendering.times.parse);
    return shd_request_blame_report(request, status);
}

void shd_batch_drop(shd_batch *batch) {
    shd_variants_drop(batch);
}

size_t shd_batch_count(const shd_batch *batch) {
    return shd_variants_count(batch);
}

bool shd_batch_is(const char *json, size_t length) {
    return shd_variants_are(json, length);
}

bool shd_batch_is_one(const shd_batch *batch) {
    return shd_variants_sheet(batch).wanted || shd_variants_turn(batch).frames;
}

const char *shd_batch_name(const shd_batch *batch) {
    return shd_variants_name(batch);
}

size_t shd_batch_size(const shd_batch *batch) {
    return shd_variants_size(batch);
}

shd_status shd_batch_document(const shd_batch *batch, size_t index, const shd_request *request,
                              char **json, size_t *length, shd_error *error) {
    return shd_variants_document(batch, index, request ? &request->cancelled : NULL, json, length,
                                 error);
}
