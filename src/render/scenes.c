/* Links to scenes: documents that are kept for them, and those that are in them. */
#include <libdeflate.h>
#include <nettle/base64.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "render/request.h"

enum { LEVEL = 12 }; /* libdeflate's densest */

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

shd_status shd_request_suffix(const shd_request *request, const char **suffix, shd_error *error) {
    if (shd_request_multipart(request))
        return shd_fail(error, SHD_SCENE, "/outputs",
                        "a link shows one picture: give one `output` instead");
    const shd_format format = shd_request_format(request, 0);
    if (format != SHD_PNG && format != SHD_JPEG && format != SHD_WEBP)
        return shd_fail(error, SHD_SCENE, "/output/format",
                        "a link shows png, jpeg or webp, not %s", shd_format_get(format)->name);
    *suffix = format == SHD_JPEG ? "jpg" : shd_format_get(format)->name;
    return SHD_OK;
}

/* In deflate and base64url without padding. NULL: out of memory. */
static char *pack_text(const char *text, size_t length) {
    struct libdeflate_compressor *compressor = libdeflate_alloc_compressor(LEVEL);
    const size_t most = compressor ? libdeflate_deflate_compress_bound(compressor, length) : 0;
    unsigned char *packed = compressor ? malloc(most) : NULL;
    char *out = packed ? malloc(BASE64_ENCODE_RAW_LENGTH(most) + 1) : NULL;
    if (out) {
        struct base64_encode_ctx encoder;
        const size_t size = libdeflate_deflate_compress(compressor, text, length, packed, most);
        base64url_encode_init(&encoder);
        size_t end = base64_encode_update(&encoder, out, size, packed);
        end += base64_encode_final(&encoder, out + end);
        while (end && out[end - 1] == '=') end--;
        out[end] = 0;
    }
    free(packed);
    libdeflate_free_compressor(compressor);
    return out;
}

shd_status shd_request_link(const shd_request *request, const char *json, size_t length,
                            char **path, shd_error *error) {
    const char *suffix;
    const shd_status status = shd_request_suffix(request, &suffix, error);
    if (status != SHD_OK) return status;
    char *text = malloc(length + 1), *packed = NULL;
    if (text) packed = pack_text(text, condense(json, length, text));
    const bool is_made = packed && asprintf(path, "/v1/scene/%s.%s", packed, suffix) >= 0;
    free(packed);
    free(text);
    return is_made ? SHD_OK : shd_fail(error, SHD_EXHAUSTED, "", "out of memory");
}

shd_status shd_request_condense(shd_request *request, const char *json, size_t length,
                                const char **text, size_t *size, shd_digest *digest,
                                shd_error *error) {
    char *out = shd_arena_alloc(request->rendering.arena, length, 1);
    if (!out) {
        shd_fail(error, SHD_MEMORY, "", "the limit `memory` is reached");
        return shd_request_blame(request, SHD_MEMORY, error);
    }
    *text = out;
    *size = condense(json, length, out);
    *digest = shd_digest_of(out, *size);
    return SHD_OK;
}

shd_status shd_engine_new_scene(shd_engine *engine, const shd_digest *digest, size_t length,
                                shd_kept_scene **out, char **text, shd_error *error) {
    const shd_status status = shd_stored_new(engine->store, SHD_THING_SCENE, digest,
                                             sizeof(kept_text) + length, out, error);
    if (status != SHD_OK) return status;
    kept_text *kept = shd_stored_bytes(*out);
    kept->length = length;
    *text = kept->text;
    return SHD_OK;
}

shd_status shd_engine_keep_scene(shd_engine *engine, shd_kept_scene *scene, const char *client,
                                 bool *known, shd_error *error) {
    return shd_store_put(engine->store, scene, client, known, error);
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
