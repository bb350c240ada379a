/* What scenes may name: the store's meshes, as reading a scene finds and keeps them, and pictures.
 */
#include "render/pictures.h"
#include "render/request.h"
#include "sight/ready.h"

shd_status shd_request_keep_made(shd_request *request, const shd_mesh *mesh,
                                 const shd_digest *digest, const char *client, bool *known,
                                 shd_error *error) {
    shd_store *store = request->rendering.engine->store;
    shd_ready_mesh ready;
    shd_status status = shd_ready_mesh_make(mesh, digest, request->rendering.cancelled,
                                            request->rendering.arena, &ready, error);
    shd_stored *thing;
    if (status == SHD_OK)
        status = shd_stored_new(store, SHD_THING_MESH, digest, shd_ready_mesh_copy(&ready, NULL),
                                &thing, error);
    if (status != SHD_OK) return status;
    shd_ready_mesh_copy(&ready, shd_stored_bytes(thing));
    status = shd_store_put(store, thing, client, known, error);
    shd_stored_drop(thing);
    return status;
}

/* A kept mesh, which the request holds from then on. */
static const shd_mesh *find_mesh(void *context, const shd_digest *digest) {
    shd_request *request = context;
    for (const shd_held_mesh *m = request->held; m; m = m->next)
        if (shd_digest_same(&m->digest, digest)) return shd_stored_bytes(m->stored);
    shd_held_mesh *added = shd_arena_alloc(request->rendering.arena, 1, sizeof *added);
    if (!added) request->held_full = true;
    shd_store *store = request->rendering.engine->store;
    shd_stored *stored = added ? shd_store_find(store, SHD_THING_MESH, digest) : NULL;
    if (!stored) return NULL;
    *added = (shd_held_mesh){request->held, *digest, stored};
    request->held = added;
    return shd_stored_bytes(stored);
}

/* For any client: what is built in belongs to nobody. Where there is no room it is not kept. */
static const shd_mesh *keep_builtin(void *context, const shd_mesh *mesh, const shd_digest *digest) {
    shd_error error;
    bool known;
    if (shd_request_keep_made(context, mesh, digest, "", &known, &error) != SHD_OK) return NULL;
    return find_mesh(context, digest);
}

shd_shelf shd_shelf_of(shd_request *request) {
    shd_shelf shelf = {
        .context = request, .texels = shd_wished_texels, .pyramid = shd_wished_pyramid};
    if (shd_store_load_of(request->rendering.engine->store).cap > 0) {
        shelf.find = find_mesh;
        shelf.keep = keep_builtin;
    }
    return shelf;
}
