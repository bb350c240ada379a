/* Scene documents that are kept for links. */
#include <string.h>

#include "render/request.h"

/* A thing's bytes. */
typedef struct kept_text {
    size_t length;
    char text[];
} kept_text;

/* Past the string that begins at a quote. */
static size_t string_end(const char *json, size_t length, size_t at) {
    for (at++; at < length && json[at] != '"'; at++)
        if (json[at] == '\\') at++;
    return at < length ? at + 1 : length;
}

/* The document without the blanks between its tokens, which JSON.stringify leaves out, too. `json`
 * is sound JSON. Returns how long it is. */
static size_t condense(const char *json, size_t length, char *out) {
    char *end = out;
    for (size_t i = 0; i < length;) {
        size_t next = i + 1;
        if (json[i] == '"') next = string_end(json, length, i);
        if (!strchr(" \t\r\n", json[i])) end = mempcpy(end, json + i, next - i);
        i = next;
    }
    return (size_t)(end - out);
}

static shd_status keep_text(shd_store *store, const char *text, size_t length,
                            const shd_digest *digest, const char *client, bool *known,
                            shd_error *error) {
    shd_stored *thing;
    shd_status status =
        shd_stored_new(store, SHD_THING_SCENE, digest, sizeof(kept_text) + length, &thing, error);
    if (status != SHD_OK) return status;
    kept_text *kept = shd_stored_bytes(thing);
    kept->length = length;
    memcpy(kept->text, text, length);
    status = shd_store_put(store, thing, client, known, error);
    shd_stored_drop(thing);
    return status;
}

shd_status shd_request_keep_scene(shd_request *request, const char *json, size_t length,
                                  const char *client, shd_digest *digest, bool *known,
                                  shd_error *error) {
    shd_store *store = request->rendering.engine->store;
    char *text = shd_arena_alloc(request->rendering.arena, length, 1);
    if (!text) {
        shd_fail(error, SHD_MEMORY, "", "the limit `memory` is reached");
        return shd_request_blame(request, SHD_MEMORY, error);
    }
    const size_t condensed = condense(json, length, text);
    *digest = shd_digest_of(text, condensed);
    shd_stored *there = shd_store_find(store, SHD_THING_SCENE, digest);
    shd_stored_drop(there);
    *known = there;
    return there ? SHD_OK : keep_text(store, text, condensed, digest, client, known, error);
}

shd_kept_scene *shd_engine_find_scene(shd_engine *engine, const shd_digest *digest,
                                      const char **json, size_t *length) {
    shd_stored *thing = shd_store_find(engine->store, SHD_THING_SCENE, digest);
    if (!thing) return NULL;
    const kept_text *kept = shd_stored_bytes(thing);
    *json = kept->text;
    *length = kept->length;
    return thing;
}

void shd_kept_scene_drop(shd_kept_scene *scene) {
    shd_stored_drop(scene);
}
