/* A hash of what a document says, whatever way it is written: SHA-256, as nobody may find another
 * document that is answered by this one's picture.
 *
 * Every value is fed to it as a tag and its bits: numbers as their double (-0 as 0), strings
 * behind their length, containers behind their count, members in the order of their keys. */
#include <nettle/base16.h>
#include <nettle/sha2.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "scene/json.h"

/* Hashing works best on long pieces; a mesh has a million short ones. */
typedef struct sink {
    struct sha256_ctx hash;
    const shd_json *json;
    shd_arena *arena;
    size_t used;
    unsigned char bytes[4096];
} sink;

static void flush(sink *s) {
    sha256_update(&s->hash, s->used, s->bytes);
    s->used = 0;
}

static void put(sink *s, const void *data, size_t size) {
    if (size > sizeof s->bytes - s->used) flush(s);
    if (size > sizeof s->bytes) {
        sha256_update(&s->hash, size, data);
        return;
    }
    memcpy(s->bytes + s->used, data, size);
    s->used += size;
}

static void put_tagged(sink *s, char tag, uint64_t bits) {
    unsigned char piece[9] = {(unsigned char)tag};
    memcpy(piece + 1, &bits, sizeof bits);
    put(s, piece, sizeof piece);
}

static void put_number(sink *s, double value) {
    uint64_t bits;
    value += 0.0; /* -0 + 0 is 0 */
    memcpy(&bits, &value, sizeof bits);
    put_tagged(s, 'n', bits);
}

static void put_string(sink *s, const char *text, size_t length) {
    put_tagged(s, 's', length);
    put(s, text, length);
}

static int compare_keys(const void *a, const void *b) {
    return strcmp(*(const char *const *)a, *(const char *const *)b);
}

static bool put_value(sink *s, const json_t *value);

static bool put_object(sink *s, const json_t *object) {
    enum { FEW = 32 };
    const char *few[FEW], **keys = few;
    size_t count = json_object_size(object), i = 0;
    if (count > FEW) keys = shd_arena_alloc(s->arena, count, sizeof *keys);
    if (!keys) return false;
    /* Iteration does not change the object, but jansson's iterators are not const. */
    json_t *mutable_object = (json_t *)(uintptr_t)object;
    for (void *at = json_object_iter(mutable_object); at;
         at = json_object_iter_next(mutable_object, at))
        keys[i++] = json_object_iter_key(at);
    qsort(keys, count, sizeof *keys, compare_keys);
    put_tagged(s, 'o', count);
    for (i = 0; i < count; i++) {
        put_string(s, keys[i], strlen(keys[i]));
        if (!put_value(s, json_object_get(object, keys[i]))) return false;
    }
    return true;
}

static bool put_value(sink *s, const json_t *value) {
    switch (json_typeof(value)) {
    case JSON_OBJECT:
        return put_object(s, value);
    case JSON_ARRAY: {
        size_t count = json_array_size(value);
        put_tagged(s, 'a', count);
        for (size_t i = 0; i < count; i++)
            if (!put_value(s, json_array_get(value, i))) return false;
        return true;
    }
    case JSON_STRING:
        put_string(s, json_string_value(value), json_string_length(value));
        return true;
    case JSON_INTEGER: {
        const shd_numbers numbers = shd_json_numbers(s->json, value);
        put_tagged(s, 'a', numbers.count);
        for (size_t i = 0; i < numbers.count; i++) put_number(s, numbers.values[i]);
        return true;
    }
    case JSON_REAL:
        put_number(s, json_number_value(value));
        return true;
    case JSON_TRUE:
        put(s, "t", 1);
        return true;
    case JSON_FALSE:
        put(s, "f", 1);
        return true;
    case JSON_NULL:
        put(s, "0", 1);
        return true;
    }
    return true;
}

bool shd_json_digest(const shd_json *json, shd_arena *arena, char digest[33]) {
    enum { BYTES = 16 };
    sink s = {.json = json, .arena = arena};
    unsigned char bytes[BYTES];
    sha256_init(&s.hash);
    if (!put_value(&s, json->tree)) return false;
    flush(&s);
    sha256_digest(&s.hash, BYTES, bytes);
    base16_encode_update(digest, BYTES, bytes);
    digest[2 * BYTES] = 0;
    return true;
}
