/* Meshes that are kept for many scenes: read once, with the tree that rays walk. */
#include "render/request.h"

shd_status shd_request_keep_mesh(shd_request *request, const void *data, size_t length, bool binary,
                                 const shd_digest *digest, const char *client, bool *known) {
    shd_stage_begin(&request->rendering);
    const shd_mesh *mesh = NULL;
    shd_error error;
    shd_status status = shd_mesh_read(data, length, binary, &request->limits, &request->cancelled,
                                      request->rendering.arena, &mesh, &request->report);
    if (status == SHD_OK &&
        (status = shd_request_keep_made(request, mesh, digest, client, known, &error))) {
        shd_report_error(&request->report, status, error.path, "%s", error.text);
        shd_report_limit(&request->report, error.limit);
    }
    shd_stage_end(&request->rendering, &request->rendering.times.parse);
    return shd_request_blame_report(request, status);
}

bool shd_engine_has_mesh(shd_engine *engine, const shd_digest *digest) {
    shd_stored *thing = shd_store_find(engine->store, SHD_THING_MESH, digest);
    shd_stored_drop(thing);
    return thing;
}

shd_mesh_load shd_engine_meshes(shd_engine *engine) {
    const shd_store_load load = shd_store_load_of(engine->store);
    return (shd_mesh_load){load.cap,  load.bytes,  load.things,   load.held,
                           load.hits, load.misses, load.evictions};
}
