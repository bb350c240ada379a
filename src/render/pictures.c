#include "render/pictures.h"

#include <float.h>
#include <math.h>
#include <nettle/sha2.h>
#include <stdio.h>
#include <string.h>

#include "render/assets.h"

enum { BLOCK = 1024 };

/* Values beyond the largest half float, and those that are not finite, are held there: files of
 * light have them in the sun, and no bound could be given with them. */
static const float value_most = 65504;

/* What stands before the texels of a thing of the store: the picture, which points behind itself.
 */
enum { HEAD = (sizeof(shd_texels) + 63) / 64 * 64 };

struct shd_held_picture {
    shd_held_picture *next;
    shd_stored *thing;
    shd_stored *levels;         /* NULL: nobody has asked for its pyramid */
    const shd_pyramid *pyramid; /* of both */
};

static const shd_texels *picture_of(const shd_stored *thing) {
    return shd_stored_bytes(thing);
}

/* ---- Which texels ---- */

static void put_word(struct sha256_ctx *hash, const char *word) {
    sha256_update(hash, strlen(word) + 1, (const uint8_t *)word);
}

static shd_digest find_key(const shd_request *request, const shd_asset *asset,
                           const shd_space_info *space, const shd_picture_wish *wish) {
    const shd_space_info *working = wish->working;
    struct sha256_ctx hash;
    shd_digest out;
    sha256_init(&hash);
    sha256_update(&hash, sizeof asset->digest.bytes, asset->digest.bytes);
    if (working) {
        put_word(&hash, space->name);
        put_word(&hash, working->name);
        put_word(&hash, shd_color_config_digest(request->rendering.engine->color));
    }
    if (wish->normals) {
        char scale[32];
        snprintf(scale, sizeof scale, "normals %a", wish->scale + 0.0); /* -0 is 0 */
        put_word(&hash, scale);
    }
    sha256_digest(&hash, sizeof out.bytes, out.bytes);
    return out;
}

/* The space of values that nobody has told. */
static const shd_space_info *find_space(const shd_request *request, const shd_asset *asset) {
    const shd_color_config *config = request->rendering.engine->color;
    const shd_catalog *catalog = shd_color_catalog(config);
    bool is_default;
    const shd_space_info *space = shd_color_rule(config, asset->name, &is_default);
    if (space && !is_default) return space;
    const bool is_light = asset->picture->depth == SHD_FLOAT || !catalog->css;
    return is_light ? catalog->scene_linear : catalog->css;
}

/* ---- Texels ---- */

/* As they are in the file, but straight, and grey three times. */
static void take_pixel(const shd_asset *asset, size_t index, float out[4]) {
    const shd_decoded *p = asset->picture;
    const size_t count = (size_t)p->count, at = index * count, colors = count - (size_t)p->alpha;
    float value[4];
    for (size_t c = 0; c < count; c++)
        value[c] = p->depth == SHD_U8    ? (float)((const uint8_t *)asset->samples)[at + c] / 255
                   : p->depth == SHD_U16 ? (float)((const uint16_t *)asset->samples)[at + c] / 65535
                                         : ((const float *)asset->samples)[at + c];
    const float alpha = p->alpha ? value[count - 1] : 1;
    const float by = p->associated && alpha > 0 ? 1 / alpha : 1;
    for (size_t c = 0; c < 3; c++) out[c] = value[colors < 3 ? 0 : c] * by;
    out[3] = alpha;
}

static float hold_value(float value, float least, float most, size_t *held) {
    if (value >= least && value <= most) return value;
    ++*held;
    return value > most ? most : value < least ? least : 0;
}

/* Makes a normal of what the file has. Lengths are 1 to f32's rounding. */
static void make_normal(float *rgba, double scale) {
    const double x = scale * (2 * (double)rgba[0] - 1), y = scale * (2 * (double)rgba[1] - 1),
                 z = 2 * (double)rgba[2] - 1, length = sqrt(x * x + y * y + z * z);
    const bool any = length > 0;
    rgba[0] = any ? (float)(x / length) : 0;
    rgba[1] = any ? (float)(y / length) : 0;
    rgba[2] = any ? (float)(z / length) : 1;
}

/* What is done to texels as the file has them. */
typedef struct taking {
    const shd_color_transform *transform; /* NULL: they are in their space */
    const shd_picture_wish *wish;
} taking;

static void fill_block(const shd_asset *asset, const taking *by, size_t first, size_t count,
                       float *rgba, shd_texels *out) {
    const shd_color_transform *transform = by->transform;
    for (size_t i = 0; i < count; i++) {
        float *pixel = rgba + 4 * i;
        take_pixel(asset, first + i, pixel);
        for (int c = 0; c < 3; c++)
            pixel[c] = hold_value(pixel[c], -value_most, value_most, &out->held);
        pixel[3] = hold_value(pixel[3], 0, 1, &out->held);
    }
    if (transform) shd_color_apply(transform, rgba, count);
    for (size_t i = 0; by->wish->normals && i < count; i++)
        make_normal(rgba + 4 * i, by->wish->scale);
    for (size_t i = 0; i < 4 * count; i++) {
        const int c = i % 4;
        if (transform && c < 3) rgba[i] = hold_value(rgba[i], -FLT_MAX, FLT_MAX, &out->held);
        out->low[c] = fminf(out->low[c], rgba[i]);
        out->high[c] = fmaxf(out->high[c], rgba[i]);
    }
}

static shd_status fill_picture(const shd_request *request, const shd_asset *asset, const taking *by,
                               float *rgba, shd_texels *out, shd_error *error) {
    const shd_decoded *p = asset->picture;
    const size_t pixels = (size_t)p->width * (size_t)p->height;
    for (int c = 0; c < 4; c++) {
        out->low[c] = INFINITY;
        out->high[c] = -INFINITY;
    }
    for (size_t first = 0; first < pixels; first += BLOCK) {
        const size_t left = pixels - first;
        if (shd_is_cancelled(request->rendering.cancelled)) return shd_rendering_cancelled(error);
        fill_block(asset, by, first, left < BLOCK ? left : BLOCK, rgba + 4 * first, out);
    }
    return SHD_OK;
}

/* ---- Pictures ---- */

static shd_held_picture *find_held(const shd_request *request, const shd_digest *key) {
    shd_held_picture *held = request->held_pictures;
    while (held && !shd_digest_same(&picture_of(held->thing)->key, key)) held = held->next;
    return held;
}

static void drop_held(shd_request *request, shd_stored *thing) {
    if (!thing) return;
    request->held_bytes -= shd_stored_size(thing);
    shd_stored_drop(thing);
}

void shd_request_drop_pictures(shd_request *request) {
    for (shd_held_picture *h = request->held_pictures; h; h = h->next) {
        drop_held(request, h->thing);
        drop_held(request, h->levels);
    }
    request->held_pictures = NULL;
}

void shd_request_forget_texels(shd_request *request) {
    shd_held_picture *last = request->held_pictures;
    request->held_pictures = last->next;
    drop_held(request, last->thing);
    drop_held(request, last->levels);
}

/* Makes the picture, which the caller drops; it is kept if it fits. */
static shd_status make_picture(const shd_request *request, const shd_asset *asset,
                               const shd_digest *key, const taking *by, shd_stored **out,
                               shd_error *error) {
    shd_store *store = request->rendering.engine->store;
    const shd_decoded *p = asset->picture;
    const size_t bytes = HEAD + (size_t)p->width * (size_t)p->height * 4 * sizeof(float);
    shd_stored *thing;
    shd_status status = shd_request_room_for(request, "picture", bytes, error);
    if (status == SHD_OK)
        status = shd_stored_new(store, SHD_THING_TEXELS, key, bytes, &thing, error);
    if (status != SHD_OK) return status;
    shd_texels *picture = shd_stored_bytes(thing);
    float *rgba = (float *)(void *)((char *)(void *)picture + HEAD);
    *picture = (shd_texels){.width = p->width,
                            .height = p->height,
                            .colors = p->count - p->alpha,
                            .alpha = p->alpha,
                            .integers = p->depth != SHD_FLOAT,
                            .rgba = rgba,
                            .file = asset->digest,
                            .key = *key};
    status = fill_picture(request, asset, by, rgba, picture, error);
    bool known;
    if (status != SHD_OK) {
        shd_stored_drop(thing);
        return status;
    }
    /* For any client: it can be made again of what one has put. */
    shd_store_put(store, thing, "", &known, NULL);
    *out = thing;
    return SHD_OK;
}

static shd_status find_picture(shd_request *request, const shd_asset *asset,
                               const shd_picture_wish *wish, shd_stored **out, shd_error *error) {
    shd_store *store = request->rendering.engine->store;
    const shd_space_info *space = wish->space ? wish->space : find_space(request, asset);
    const shd_color_transform *transform = NULL;
    const shd_digest key = find_key(request, asset, space, wish);
    shd_held_picture *held = find_held(request, &key);
    *out = held ? held->thing : NULL;
    if (held) return SHD_OK;
    shd_status status = SHD_OK;
    if (wish->working && strcmp(space->name, wish->working->name) != 0)
        status =
            shd_color_to_space(request->rendering.engine->color, space->name, wish->working->name,
                               request->rendering.lease, &transform, error);
    if (status != SHD_OK) return status;
    shd_stored *thing = shd_store_find(store, SHD_THING_TEXELS, &key);
    if (thing) {
        status = shd_request_room_for(request, "picture", shd_stored_size(thing), error);
        if (status != SHD_OK) shd_stored_drop(thing);
    } else {
        status = make_picture(request, asset, &key, &(taking){transform, wish}, &thing, error);
    }
    if (status != SHD_OK) return status;
    held = shd_arena_alloc(request->rendering.arena, 1, sizeof *held);
    if (!held) {
        shd_stored_drop(thing);
        return shd_rendering_full(&request->rendering, "picture", error);
    }
    *held = (shd_held_picture){.next = request->held_pictures, .thing = thing};
    request->held_pictures = held;
    request->held_bytes += shd_stored_size(thing);
    *out = thing;
    return SHD_OK;
}

shd_status shd_request_texels_of(shd_request *request, const shd_asset *asset,
                                 const shd_picture_wish *wish, const shd_texels **out,
                                 shd_error *error) {
    shd_stored *thing;
    const shd_status status = find_picture(request, asset, wish, &thing, error);
    if (status == SHD_OK) *out = picture_of(thing);
    return status;
}

shd_status shd_request_texels(shd_request *request, const shd_picture_wish *wish,
                              const shd_texels **out, shd_error *error) {
    shd_asset asset;
    shd_status status = shd_asset_open(request, wish->name, &asset, error);
    if (status != SHD_OK) return status;
    status = shd_request_texels_of(request, &asset, wish, out, error);
    shd_stored_drop(asset.thing);
    return status;
}

/* ---- Pyramids ---- */

/* The levels, which the caller drops; they are kept if they fit. */
static shd_status make_levels(const shd_request *request, const shd_texels *texels,
                              shd_stored **out, shd_error *error) {
    shd_store *store = request->rendering.engine->store;
    const size_t bytes = shd_pyramid_size(texels);
    shd_stored *thing;
    bool known;
    const shd_status status =
        shd_stored_new(store, SHD_THING_LEVELS, &texels->key, bytes, &thing, error);
    if (status != SHD_OK) return status;
    if (!shd_pyramid_fill(texels, request->rendering.cancelled, shd_stored_bytes(thing))) {
        shd_stored_drop(thing);
        return shd_rendering_cancelled(error);
    }
    shd_store_put(store, thing, "", &known, NULL);
    *out = thing;
    return SHD_OK;
}

shd_status shd_request_pyramid(shd_request *request, const shd_texels *texels,
                               const shd_pyramid **out, shd_error *error) {
    shd_store *store = request->rendering.engine->store;
    shd_held_picture *held = find_held(request, &texels->key);
    shd_status status = SHD_OK;
    if (!held->pyramid) {
        status = shd_request_room_for(request, "picture", shd_pyramid_size(texels), error);
        if (status != SHD_OK) return status;
        shd_pyramid *pyramid = shd_arena_alloc(request->rendering.arena, 1, sizeof *pyramid);
        if (!pyramid) return shd_rendering_full(&request->rendering, "picture", error);
        held->levels = shd_store_find(store, SHD_THING_LEVELS, &texels->key);
        if (!held->levels) status = make_levels(request, texels, &held->levels, error);
        if (status != SHD_OK) return status;
        request->held_bytes += shd_stored_size(held->levels);
        shd_pyramid_open(texels, shd_stored_bytes(held->levels), pyramid);
        held->pyramid = pyramid;
    }
    *out = held->pyramid;
    return status;
}
