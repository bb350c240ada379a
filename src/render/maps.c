#include "render/maps.h"

#include <nettle/sha2.h>
#include <string.h>

#include "render/assets.h"
#include "render/pictures.h"

/* What stands before the texels of a thing of the store: the map, which points into it. */
typedef struct kept_map {
    shd_surroundings map;
    char key[SHD_DIGEST_TEXT], name[80];
} kept_map;

enum { HEAD = (sizeof(kept_map) + 63) / 64 * 64 };

struct shd_held_map {
    shd_held_map *next;
    shd_digest name; /* of what was asked for */
    shd_stored *thing;
};

static const shd_surroundings *map_of(const shd_stored *thing) {
    return &((const kept_map *)shd_stored_bytes(thing))->map;
}

void shd_request_drop_maps(shd_request *request) {
    for (shd_held_map *h = request->held_maps; h; h = h->next) {
        request->held_bytes -= shd_stored_size(h->thing);
        shd_stored_drop(h->thing);
    }
    request->held_maps = NULL;
}

/* ---- Which one ---- */

static void put_word(struct sha256_ctx *hash, const char *word) {
    sha256_update(hash, strlen(word) + 1, (const uint8_t *)word);
}

/* What is asked for. It is found without the picture, which may be kept no longer. The name decides
 * on the picture's colors, too. */
static shd_digest name_of(const shd_request *request, const char *name, const shd_digest *file,
                          const shd_space_info *working, int rows) {
    struct sha256_ctx hash;
    shd_digest out;
    sha256_init(&hash);
    sha256_update(&hash, sizeof file->bytes, file->bytes);
    put_word(&hash, name);
    put_word(&hash, working->name);
    put_word(&hash, shd_color_config_digest(request->rendering.engine->color));
    sha256_update(&hash, sizeof rows, (const uint8_t *)&rows);
    sha256_digest(&hash, sizeof out.bytes, out.bytes);
    return out;
}

/* What is the same for maps of the same texels, by whatever name. */
static void write_key(const shd_texels *picture, int rows, char out[SHD_DIGEST_TEXT]) {
    struct sha256_ctx hash;
    shd_digest key;
    sha256_init(&hash);
    sha256_update(&hash, sizeof picture->key.bytes, picture->key.bytes);
    sha256_update(&hash, sizeof rows, (const uint8_t *)&rows);
    sha256_digest(&hash, sizeof key.bytes, key.bytes);
    shd_digest_write(&key, out);
}

/* ---- Making ---- */

static shd_status check_shape(const shd_decoded *picture, shd_error *error) {
    if (picture->width == 2 * picture->height) return SHD_OK;
    return shd_fail(error, SHD_SCENE, "",
                    "a map is twice as wide as it is high, all longitudes by all latitudes; this "
                    "picture has %d by %d pixels",
                    picture->width, picture->height);
}

static shd_status make_map(const shd_request *request, const shd_texels *picture, const char *name,
                           const shd_digest *digest, int wanted, shd_stored **out,
                           shd_error *error) {
    const shd_engine *engine = request->rendering.engine;
    const int rows = shd_surroundings_rows(picture->height, wanted);
    const size_t bytes = HEAD + 6 * (size_t)rows * (size_t)rows * sizeof(float);
    shd_stored *thing;
    shd_status status = shd_request_room_for(request, "map", bytes, error);
    if (status == SHD_OK)
        status = shd_stored_new(engine->glows, SHD_THING_MAP, digest, bytes, &thing, error);
    if (status != SHD_OK) return status;
    kept_map *kept = shd_stored_bytes(thing);
    float *texels = (float *)(void *)((char *)(void *)kept + HEAD);
    *kept = (kept_map){.map = {.name = kept->name,
                               .key = kept->key,
                               .width = 2 * rows,
                               .height = rows,
                               .working = true}};
    write_key(picture, rows, kept->key);
    strncpy(kept->name, name, sizeof kept->name - 1);
    const bool made =
        shd_surroundings_fill(picture, request->rendering.cancelled, &kept->map, texels) &&
        shd_surroundings_measure(&kept->map, rows <= SHD_SURROUNDINGS_MOST,
                                 request->rendering.cancelled);
    kept->map.held += picture->held;
    if (shd_is_cancelled(request->rendering.cancelled))
        status = shd_rendering_cancelled(error);
    else if (!made)
        status = shd_fail(error, SHD_EXHAUSTED, "", "out of memory");
    if (status != SHD_OK) {
        shd_stored_drop(thing);
        return status;
    }
    /* For any client: it can be made again. */
    bool known;
    shd_error unkept;
    shd_store_put(engine->glows, thing, "", &known, &unkept);
    *out = thing;
    return SHD_OK;
}

/* The picture is needed no longer than it takes to make a map of it. */
static shd_status make_of_name(shd_request *request, const char *name,
                               const shd_space_info *working, int rows, shd_digest *digest,
                               shd_stored **out, shd_error *error) {
    const shd_picture_wish wish = {.name = name, .working = working};
    const shd_held_picture *before = request->held_pictures;
    const shd_texels *picture;
    shd_asset asset;
    shd_status status = shd_asset_open(request, name, &asset, error);
    if (status != SHD_OK) return status;
    status = check_shape(asset.picture, error);
    if (status == SHD_OK) status = shd_request_texels_of(request, &asset, &wish, &picture, error);
    shd_stored_drop(asset.thing);
    if (status != SHD_OK) return status;
    *digest = name_of(request, name, &picture->file, working, rows);
    status = make_map(request, picture, name, digest, rows, out, error);
    if (request->held_pictures != before) shd_request_forget_texels(request);
    return status;
}

shd_status shd_request_map(shd_request *request, const char *name, const shd_space_info *working,
                           int rows, const shd_surroundings **out, shd_error *error) {
    const shd_engine *engine = request->rendering.engine;
    shd_digest file, digest;
    shd_stored *thing = NULL;
    if (shd_asset_digest(request, name, &file)) {
        digest = name_of(request, name, &file, working, rows);
        for (const shd_held_map *h = request->held_maps; h; h = h->next) {
            if (!shd_digest_same(&h->name, &digest)) continue;
            *out = map_of(h->thing);
            return SHD_OK;
        }
        thing = shd_store_find(engine->glows, SHD_THING_MAP, &digest);
    }
    if (!thing) {
        const shd_status status =
            make_of_name(request, name, working, rows, &digest, &thing, error);
        if (status != SHD_OK) return status;
    }
    shd_held_map *held = shd_arena_alloc(request->rendering.arena, 1, sizeof *held);
    if (!held) {
        shd_stored_drop(thing);
        return shd_rendering_full(&request->rendering, "map", error);
    }
    *held = (shd_held_map){request->held_maps, digest, thing};
    request->held_maps = held;
    request->held_bytes += shd_stored_size(thing);
    *out = map_of(thing);
    return SHD_OK;
}
