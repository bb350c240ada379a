#include "render/assets.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "assets/decoder.h"
#include "scene/json.h"

/* What stands before the samples of a thing of the store. */
typedef struct kept_asset {
    shd_decoded picture;
    shd_format format;
} kept_asset;

enum { HEAD = 64 };
_Static_assert(sizeof(kept_asset) <= HEAD, "samples stay aligned");

static const char prefix[] = "sha256-";

static void take_thing(shd_stored *thing, const shd_digest *digest, shd_asset *out) {
    const kept_asset *kept = shd_stored_bytes(thing);
    *out = (shd_asset){.thing = thing,
                       .digest = *digest,
                       .picture = &kept->picture,
                       .samples = (const char *)kept + HEAD};
}

/* ---- Decoding ---- */

typedef struct decoding {
    shd_request *request;
    const shd_digest *digest;
    bool must_fit; /* into the store; else it may be the request's alone */
    shd_stored *thing;
} decoding;

static void *make_room(void *context, const shd_decoded *picture, size_t bytes, shd_error *error) {
    decoding *d = context;
    shd_store *store = d->request->rendering.engine->store;
    (void)picture;
    shd_status status = d->must_fit ? shd_store_admit(store, HEAD + bytes, error)
                                    : shd_request_room_for(d->request, "picture", bytes, error);
    if (status == SHD_OK)
        status = shd_stored_new(store, SHD_THING_ASSET, d->digest, HEAD + bytes, &d->thing, error);
    return status == SHD_OK ? (char *)shd_stored_bytes(d->thing) + HEAD : NULL;
}

/* Makes a thing of a file's bytes, which the caller drops. */
static shd_status decode_asset(shd_request *request, const void *data, size_t size,
                               const shd_digest *digest, bool must_fit, shd_stored **out,
                               shd_error *error) {
    decoding d = {.request = request, .digest = digest, .must_fit = must_fit};
    const shd_decode_job job = {.data = data,
                                .size = size,
                                .most = request->limits.pixels,
                                .budget = request->rendering.engine->budget,
                                .cancelled = request->rendering.cancelled,
                                .room = make_room,
                                .context = &d,
                                .loose = &request->loose_decoder};
    shd_decoded picture;
    const shd_status status = shd_decode_file(&job, &picture, error);
    if (status != SHD_OK) {
        shd_stored_drop(d.thing);
        return status;
    }
    *(kept_asset *)shd_stored_bytes(d.thing) =
        (kept_asset){.picture = picture, .format = shd_format_sniff(data, size)};
    *out = d.thing;
    return SHD_OK;
}

shd_status shd_asset_decode(shd_request *request, const void *data, size_t size, shd_asset *out,
                            shd_error *error) {
    static const shd_digest none;
    shd_stored *thing;
    const shd_status status = decode_asset(request, data, size, &none, false, &thing, error);
    if (status == SHD_OK) take_thing(thing, &none, out);
    return status;
}

/* ---- What clients put ---- */

bool shd_engine_has_asset(shd_engine *engine, const shd_digest *digest) {
    shd_stored *thing = shd_store_find(engine->store, SHD_THING_ASSET, digest);
    shd_stored_drop(thing);
    return thing;
}

shd_status shd_request_keep_asset(shd_request *request, const void *data, size_t length,
                                  const shd_digest *digest, const char *client, bool *known) {
    shd_stored *thing = NULL;
    shd_error error;
    shd_stage_begin(&request->rendering);
    shd_status status = decode_asset(request, data, length, digest, true, &thing, &error);
    if (status == SHD_OK)
        status = shd_store_put(request->rendering.engine->store, thing, client, known, &error);
    shd_stored_drop(thing);
    if (status != SHD_OK) {
        shd_report_error(&request->report, status, error.path, "%s", error.text);
        shd_report_limit(&request->report, error.limit);
    }
    shd_stage_end(&request->rendering, &request->rendering.times.parse);
    return status;
}

/* ---- What the operator has ---- */

/* Of a file's bytes, which are counted meanwhile. */
static shd_status open_bytes(shd_request *request, const void *data, size_t size,
                             const shd_digest *digest, shd_asset *out, shd_error *error) {
    const shd_engine *engine = request->rendering.engine;
    shd_stored *thing = shd_store_find(engine->store, SHD_THING_ASSET, digest);
    shd_status status = SHD_OK;
    bool known;
    if (!thing) {
        shd_budget_count(engine->budget, size);
        status = decode_asset(request, data, size, digest, false, &thing, error);
        shd_budget_give(engine->budget, size);
        /* For any client: what the operator has belongs to nobody. */
        if (status == SHD_OK) shd_store_put(engine->store, thing, "", &known, NULL);
    }
    if (status == SHD_OK) take_thing(thing, digest, out);
    return status;
}

/* `called`: the digest that the file is called as, which is looked at before anything is decoded.
 * NULL: it has a name. */
static shd_status read_file(shd_request *request, size_t index, const shd_digest *called,
                            shd_asset *out, shd_error *error) {
    const shd_engine *engine = request->rendering.engine;
    size_t size, count;
    const char *file = shd_asset_names(engine->assets, &count)[index];
    void *data;
    shd_digest digest;
    shd_status status =
        shd_asset_read(engine->assets, index, request->limits.memory, &data, &size, &digest, error);
    if (status != SHD_OK) return status;
    if (called && !shd_digest_same(&digest, called))
        status =
            shd_fail(error, SHD_MISSING, "", "the file %s does not hold what it is called", file);
    else
        status = open_bytes(request, data, size, &digest, out, error);
    free(data);
    if (status == SHD_OK) snprintf(out->name, sizeof out->name, "%s", file);
    return status;
}

static shd_status open_kept(shd_request *request, const char *name, shd_asset *out,
                            shd_error *error) {
    shd_store *store = request->rendering.engine->store;
    shd_digest digest;
    if (!shd_digest_read(name + strlen(prefix), &digest))
        return shd_fail(error, SHD_SCENE, "",
                        "expected \"sha256-\" and 64 hexadecimal digits, in lower case, got \"%s\"",
                        shd_quote(name).text);
    const shd_asset_folder *folder = request->rendering.engine->assets;
    shd_stored *thing = shd_store_find(store, SHD_THING_ASSET, &digest);
    size_t index;
    if (!thing && folder && shd_asset_find_digits(folder, name + strlen(prefix), &index))
        return read_file(request, index, &digest, out, error);
    if (!shd_store_load_of(store).cap)
        return shd_fail(error, SHD_SCENE, "", "no assets are kept here by their digest");
    if (!thing) return shd_fail(error, SHD_MISSING, "", "no asset %s is kept here", name);
    take_thing(thing, &digest, out);
    const kept_asset *kept = shd_stored_bytes(thing);
    snprintf(out->name, sizeof out->name, "asset.%s", shd_format_get(kept->format)->name);
    return SHD_OK;
}

static shd_status open_named(shd_request *request, const char *name, shd_asset *out,
                             shd_error *error) {
    const shd_engine *engine = request->rendering.engine;
    size_t index = 0, count = 0;
    shd_digest digest;
    const char *const *names = engine->assets ? shd_asset_names(engine->assets, &count) : NULL;
    if (!count)
        return shd_fail(error, SHD_SCENE, "",
                        "no assets have names here: \"%s\" is none; what was put is named by "
                        "\"sha256-\" and its digits",
                        shd_quote(name).text);
    if (!shd_asset_find(engine->assets, name, &index))
        return shd_fail(error, SHD_SCENE, "", "unknown asset \"%s\"%s", shd_quote(name).text,
                        shd_suggest(&request->report, name, names, count).text);
    shd_stored *thing = shd_asset_known(engine->assets, index, &digest)
                            ? shd_store_find(engine->store, SHD_THING_ASSET, &digest)
                            : NULL;
    if (!thing) return read_file(request, index, NULL, out, error);
    take_thing(thing, &digest, out);
    snprintf(out->name, sizeof out->name, "%s", names[index]);
    return SHD_OK;
}

bool shd_asset_digest(const shd_request *request, const char *name, shd_digest *out) {
    const shd_engine *engine = request->rendering.engine;
    size_t index;
    if (!strncmp(name, prefix, strlen(prefix))) return shd_digest_read(name + strlen(prefix), out);
    return engine->assets && shd_asset_find(engine->assets, name, &index) &&
           shd_asset_known(engine->assets, index, out);
}

shd_status shd_asset_open(shd_request *request, const char *name, shd_asset *out,
                          shd_error *error) {
    const bool is_digest = !strncmp(name, prefix, strlen(prefix));
    return (is_digest ? open_kept : open_named)(request, name, out, error);
}

/* ---- Its samples ---- */

size_t shd_asset_count(const shd_asset *asset) {
    const shd_decoded *p = asset->picture;
    return (size_t)p->width * (size_t)p->height * (size_t)p->count;
}

shd_samples shd_asset_samples(const shd_asset *asset, float *values, const atomic_bool *cancelled) {
    const shd_decoded *p = asset->picture;
    const size_t count = shd_asset_count(asset);
    for (size_t i = 0; i < count && !shd_is_cancelled_at(cancelled, i); i++)
        values[i] = p->depth == SHD_U8    ? ((const uint8_t *)asset->samples)[i]
                    : p->depth == SHD_U16 ? ((const uint16_t *)asset->samples)[i]
                                          : ((const float *)asset->samples)[i];
    return (shd_samples){.width = p->width,
                         .height = p->height,
                         .count = p->count,
                         .alpha = p->alpha,
                         .associated = p->associated,
                         .depth = (shd_depth)p->depth,
                         .values = values};
}
