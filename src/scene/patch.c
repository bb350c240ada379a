#include "scene/patch.h"

#include <jansson.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

static void put_bytes(shd_draft *d, const char *data, size_t size) {
    if (d->status != SHD_OK) return;
    if (size > d->capacity - d->size) {
        size_t capacity = d->capacity ? d->capacity : 1024;
        while (capacity - d->size < size) capacity *= 2;
        char *grown = realloc(d->data, capacity);
        if (!grown) {
            d->status = SHD_EXHAUSTED;
            return;
        }
        d->data = grown;
        d->capacity = capacity;
    }
    memcpy(d->data + d->size, data, size);
    d->size += size;
}

static void put_span(shd_draft *d, shd_span span) {
    put_bytes(d, span.at, (size_t)(span.end - span.at));
}

/* Before each member and item. */
static void put_comma(shd_draft *d, bool *is_first) {
    if (!*is_first) put_bytes(d, ",", 1);
    *is_first = false;
}

static bool goes_on(shd_draft *d) {
    if (d->status == SHD_OK && shd_is_cancelled_at(d->cancelled, d->steps++))
        d->status = SHD_CANCELLED;
    return d->status == SHD_OK;
}

/* ---- Merging ---- */

static bool is_object(shd_span span) {
    return span.at < span.end && *span.at == '{';
}

static bool is_null(shd_span span) {
    return span.at < span.end && *span.at == 'n';
}

/* The member of that key, or an empty span. */
static shd_span find_member(shd_draft *d, shd_span object, shd_span key) {
    const char *at = NULL;
    shd_span name, value;
    while (goes_on(d) && shd_span_next(object, &at, &name, &value))
        if (shd_span_same(name, key)) return value;
    return (shd_span){NULL, NULL};
}

void shd_patch_merge(shd_draft *d, shd_span document, shd_span patch) {
    const char *at = NULL;
    shd_span key, value;
    bool is_first = true;
    const bool had_members = is_object(document);
    if (!is_object(patch)) {
        put_span(d, patch);
        return;
    }
    put_bytes(d, "{", 1);
    while (had_members && goes_on(d) && shd_span_next(document, &at, &key, &value)) {
        const shd_span other = find_member(d, patch, key);
        if (is_null(other)) continue;
        put_comma(d, &is_first);
        put_span(d, key);
        put_bytes(d, ":", 1);
        if (other.at)
            shd_patch_merge(d, value, other);
        else
            put_span(d, value);
    }
    at = NULL;
    while (goes_on(d) && shd_span_next(patch, &at, &key, &value)) {
        if (is_null(value) || (had_members && find_member(d, document, key).at)) continue;
        put_comma(d, &is_first);
        put_span(d, key);
        put_bytes(d, ":", 1);
        shd_patch_merge(d, (shd_span){NULL, NULL}, value);
    }
    put_bytes(d, "}", 1);
}

/* ---- Replacing ---- */

typedef struct replacement {
    shd_draft *draft;
    const char *pointer; /* the whole one, for messages */
    shd_span value;
    shd_error *error;
} replacement;

static shd_status replace_at(const replacement *r, shd_span place, const char *rest);

/* The text of the pointer's first token, which the caller frees; *rest is what follows. */
static char *next_token(const char *pointer, const char **rest) {
    const size_t length = strcspn(pointer + 1, "/");
    char *token = malloc(length + 1), *end = token;
    *rest = pointer + 1 + length;
    for (const char *c = pointer + 1; token && c < *rest; c++) {
        const bool escaped = *c == '~';
        if (escaped) c++;
        *end++ = !escaped ? *c : *c == '1' ? '/' : '~';
    }
    if (token) *end = 0;
    return token;
}

static shd_status put_member(const replacement *r, const char *token, const char *rest) {
    json_t *name = json_string(token);
    char *text = json_dumps(name, JSON_ENCODE_ANY);
    json_decref(name);
    if (text) {
        put_bytes(r->draft, text, strlen(text));
        put_bytes(r->draft, ":", 1);
    } else {
        r->draft->status = SHD_EXHAUSTED;
    }
    free(text);
    return replace_at(r, (shd_span){NULL, NULL}, rest);
}

static shd_status replace_member(const replacement *r, shd_span object, const char *token,
                                 const char *rest) {
    const char *at = NULL;
    shd_span key, value;
    shd_status status = SHD_OK;
    bool is_first = true, is_found = false;
    put_bytes(r->draft, "{", 1);
    while (object.at && status == SHD_OK && goes_on(r->draft) &&
           shd_span_next(object, &at, &key, &value)) {
        put_comma(r->draft, &is_first);
        put_span(r->draft, key);
        put_bytes(r->draft, ":", 1);
        if (!is_found && shd_span_is(key, token)) {
            status = replace_at(r, value, rest);
            is_found = true;
        } else {
            put_span(r->draft, value);
        }
    }
    if (status == SHD_OK && !is_found) {
        put_comma(r->draft, &is_first);
        status = put_member(r, token, rest);
    }
    put_bytes(r->draft, "}", 1);
    return status;
}

static shd_status replace_item(const replacement *r, shd_span array, const char *token,
                               const char *rest) {
    enum { DIGITS_MOST = 9 };
    const size_t digits = strspn(token, "0123456789");
    const bool is_index =
        digits && digits <= DIGITS_MOST && !token[digits] && (digits == 1 || *token != '0');
    const size_t wanted = is_index ? strtoul(token, NULL, 10) : SIZE_MAX;
    const char *at = NULL;
    shd_span key, value;
    shd_status status = SHD_OK;
    size_t count = 0;
    bool is_first = true;
    put_bytes(r->draft, "[", 1);
    for (; status == SHD_OK && goes_on(r->draft) && shd_span_next(array, &at, &key, &value);
         count++) {
        put_comma(r->draft, &is_first);
        if (count == wanted)
            status = replace_at(r, value, rest);
        else
            put_span(r->draft, value);
    }
    put_bytes(r->draft, "]", 1);
    if (status != SHD_OK || r->draft->status != SHD_OK || wanted < count) return status;
    return shd_fail(r->error, SHD_SCENE, "", "the scene has nothing at %s: a list of %zu is there",
                    r->pointer, count);
}

/* `place` is empty where the document has nothing. */
static shd_status replace_at(const replacement *r, shd_span place, const char *pointer) {
    if (!*pointer) {
        put_span(r->draft, r->value);
        return SHD_OK;
    }
    const bool is_array = place.at && *place.at == '[';
    if (place.at && !is_array && !is_object(place))
        return shd_fail(r->error, SHD_SCENE, "",
                        "the scene has nothing at %s: what is above it is neither object nor list",
                        r->pointer);
    const char *rest;
    char *token = next_token(pointer, &rest);
    if (!token) r->draft->status = SHD_EXHAUSTED;
    const shd_status status = !token     ? SHD_OK
                              : is_array ? replace_item(r, place, token, rest)
                                         : replace_member(r, place, token, rest);
    free(token);
    return status;
}

shd_status shd_patch_replace(shd_draft *draft, shd_span document, const char *pointer,
                             shd_span value, shd_error *error) {
    const replacement r = {draft, pointer, value, error};
    const shd_status status = replace_at(&r, document, pointer);
    return status == SHD_OK ? draft->status : status;
}
