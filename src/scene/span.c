#include "scene/span.h"

#include <jansson.h>
#include <stdlib.h>
#include <string.h>

static bool is_blank(char c) {
    return c == ' ' || c == '\t' || c == '\r' || c == '\n';
}

static const char *skip_blanks(const char *at, const char *end) {
    while (at < end && is_blank(*at)) at++;
    return at;
}

static const char *skip_string(const char *at, const char *end) {
    for (at++; at < end && *at != '"'; at++)
        if (*at == '\\') at++;
    return at < end ? at + 1 : end;
}

static const char *skip_value(const char *at, const char *end) {
    size_t depth = 0;
    if (at < end && *at != '"' && *at != '{' && *at != '[') {
        while (at < end && !is_blank(*at) && *at != ',' && *at != '}' && *at != ']') at++;
        return at;
    }
    while (at < end) {
        if (*at == '"') {
            at = skip_string(at, end);
        } else {
            depth += *at == '{' || *at == '[';
            depth -= *at == '}' || *at == ']';
            at++;
        }
        if (!depth) break;
    }
    return at;
}

shd_span shd_span_of(const char *at, const char *end) {
    at = skip_blanks(at, end);
    return (shd_span){at, skip_value(at, end)};
}

bool shd_span_next(shd_span whole, const char **at, shd_span *key, shd_span *value) {
    const char *end = whole.end;
    const char *c = skip_blanks(*at ? *at : whole.at + 1, end);
    if (c < end && *c == ',') c = skip_blanks(c + 1, end);
    if (c >= end || *c == '}' || *c == ']') return false;
    *key = (shd_span){c, c};
    if (*whole.at == '{') {
        *key = shd_span_of(c, end);
        c = skip_blanks(key->end, end);
        if (c < end) c++; /* the colon */
    }
    *value = shd_span_of(c, end);
    *at = value->end;
    return true;
}

static size_t size_of(shd_span span) {
    return (size_t)(span.end - span.at);
}

static bool has_escapes(shd_span span) {
    return memchr(span.at, '\\', size_of(span));
}

char *shd_span_text(shd_span string) {
    json_t *value = json_loadb(string.at, size_of(string), JSON_DECODE_ANY, NULL);
    char *text = json_is_string(value) ? strdup(json_string_value(value)) : NULL;
    json_decref(value);
    return text;
}

bool shd_span_is(shd_span key, const char *text) {
    const size_t length = strlen(text);
    if (!has_escapes(key)) return size_of(key) == length + 2 && !memcmp(key.at + 1, text, length);
    char *own = shd_span_text(key);
    const bool same = own && !strcmp(own, text);
    free(own);
    return same;
}

bool shd_span_same(shd_span a, shd_span b) {
    if (!has_escapes(a) && !has_escapes(b))
        return size_of(a) == size_of(b) && !memcmp(a.at, b.at, size_of(a));
    char *text = shd_span_text(a);
    const bool same = text && shd_span_is(b, text);
    free(text);
    return same;
}
