#include "scene/json.h"

#include <assert.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

enum { POINTER_BYTES = 1024, TEXT_BYTES = sizeof((shd_error *)0)->text };
enum { QUOTE_BYTES = 60, NAME_CHARACTERS = 64, NAMES_COMPARED = 1024 };

shd_node shd_node_member(const shd_node *parent, const char *key) {
    return (shd_node){parent, key, 0, json_object_get(parent->value, key)};
}

shd_node shd_node_item(const shd_node *parent, size_t index) {
    return (shd_node){parent, NULL, index, json_array_get(parent->value, index)};
}

/* A key that is too long or too strange to show is reported at its object. */
static const shd_node *shown_node(const shd_node *node) {
    const shd_node *place = node;
    for (const shd_node *n = node; n->parent; n = n->parent)
        if (n->key && !shd_is_plain_name(n->key)) place = n->parent;
    return place;
}

/* Writes the pointer and returns its length. Keys on the way are plain names, so the buffer is long
 * enough for any place in a scene. */
static size_t write_pointer(const shd_node *node, char *out, size_t size) {
    if (!node->parent) return 0;
    size_t used = write_pointer(node->parent, out, size);
    if (!node->key) {
        int wrote = snprintf(out + used, size - used, "/%zu", node->index);
        return used + (size_t)wrote < size ? used + (size_t)wrote : size - 1;
    }
    if (used + 1 < size) out[used++] = '/';
    for (const char *c = node->key; *c && used + 2 < size; c++) {
        if (*c == '~' || *c == '/') {
            out[used++] = '~';
            out[used++] = *c == '~' ? '0' : '1';
        } else {
            out[used++] = *c;
        }
    }
    return used;
}

const char *shd_node_pointer(const shd_node *node, shd_arena *arena) {
    char pointer[POINTER_BYTES];
    pointer[write_pointer(shown_node(node), pointer, sizeof pointer)] = '\0';
    return shd_arena_strdup(arena, pointer);
}

void shd_node_report(shd_report *report, const shd_node *node, shd_status status,
                     const char *format, ...) {
    char pointer[POINTER_BYTES], text[TEXT_BYTES];
    pointer[write_pointer(shown_node(node), pointer, sizeof pointer)] = '\0';
    va_list args;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    if (status == SHD_OK)
        shd_report_warning(report, pointer, "%s", text);
    else
        shd_report_error(report, status, pointer, "%s", text);
}

void shd_node_expect(shd_report *report, const shd_node *node, const char *expected) {
    static const char *const kinds[] = {
        [JSON_OBJECT] = "an object", [JSON_ARRAY] = "an array", [JSON_STRING] = "a string",
        [JSON_INTEGER] = "an array", [JSON_REAL] = "a number",  [JSON_TRUE] = "true",
        [JSON_FALSE] = "false",      [JSON_NULL] = "null"};
    shd_node_report(report, node, SHD_SCENE, "expected %s, got %s", expected,
                    kinds[json_typeof(node->value)]);
}

shd_numbers shd_json_numbers(const shd_json *json, const json_t *value) {
    assert(!json_is_integer(value) || (size_t)json_integer_value(value) < json->packs.count);
    if (json_is_integer(value)) return json->packs.arrays[json_integer_value(value)];
    return (shd_numbers){NULL, json_array_size(value), 0, 0};
}

/* The bytes of the control character at `c`; 0 if it is none. U+0080 to U+009F steer terminals just
 * as the first 32 do. */
static size_t control_bytes(const char *c) {
    unsigned char first = (unsigned char)c[0], second = first ? (unsigned char)c[1] : 0;
    if (first < 0x20 || first == 0x7f) return 1;
    return first == 0xc2 && second >= 0x80 && second <= 0x9f ? 2 : 0;
}

shd_quoted shd_quote(const char *text) {
    shd_quoted out;
    size_t used = 0;
    const char *c = text;
    while (*c && used < QUOTE_BYTES) {
        size_t control = control_bytes(c);
        out.text[used++] = control ? '?' : *c;
        c += control ? control : 1;
    }
    if (*c) {
        /* Do not leave half of a character behind. */
        while (used && ((unsigned char)*c & 0xc0) == 0x80) used--, c--;
        memcpy(out.text + used, "...", 3);
        used += 3;
    }
    out.text[used] = '\0';
    return out;
}

bool shd_is_plain_name(const char *name) {
    size_t characters = 0;
    for (const char *c = name; *c; c++) {
        if (control_bytes(c)) return false;
        if (((unsigned char)*c & 0xc0) != 0x80 && ++characters > NAME_CHARACTERS) return false;
    }
    return true;
}

/* The number of edits (insert, delete, replace, swap neighbors) that make one name of the other,
 * case aside. Names longer than the table are never close. */
static size_t edit_distance(const char *a, const char *b) {
    enum { LONGEST = 40 };
    unsigned char row[3][LONGEST + 1];
    size_t a_length = strlen(a), b_length = strlen(b);
    if (a_length > LONGEST || b_length > LONGEST) return SIZE_MAX;
    unsigned char *before = row[0], *last = row[1], *next = row[2];
    for (size_t j = 0; j <= b_length; j++) last[j] = (unsigned char)j;
    for (size_t i = 1; i <= a_length; i++) {
        next[0] = (unsigned char)i;
        for (size_t j = 1; j <= b_length; j++) {
            bool same = !strncasecmp(a + i - 1, b + j - 1, 1);
            unsigned best = last[j - 1] + !same;
            if (last[j] + 1u < best) best = last[j] + 1u;
            if (next[j - 1] + 1u < best) best = next[j - 1] + 1u;
            bool swapped = i > 1 && j > 1 && !strncasecmp(a + i - 1, b + j - 2, 1) &&
                           !strncasecmp(a + i - 2, b + j - 1, 1);
            if (swapped && before[j - 2] + 1u < best) best = before[j - 2] + 1u;
            next[j] = (unsigned char)best;
        }
        unsigned char *spare = before;
        before = last, last = next, next = spare;
    }
    return last[b_length];
}

static void list_names(shd_hint *hint, const char *const *names, size_t count) {
    size_t used = 0;
    for (size_t i = 0; i < count; i++) {
        const char *joint = i ? ", " : ": there is ";
        shd_quoted name = shd_quote(names[i]);
        size_t need = strlen(joint) + strlen(name.text);
        if (used + need + sizeof ", ..." > sizeof hint->text) {
            snprintf(hint->text + used, sizeof hint->text - used, ", ...");
            return;
        }
        used +=
            (size_t)snprintf(hint->text + used, sizeof hint->text - used, "%s%s", joint, name.text);
    }
}

shd_hint shd_suggest(const shd_report *report, const char *name, const char *const *names,
                     size_t count) {
    shd_hint hint = {""};
    if (report->error_count >= SHD_REPORT_KEEP) return hint;
    size_t best = SIZE_MAX, near = 0;
    for (size_t i = 0; i < count && i < NAMES_COMPARED; i++) {
        size_t distance = edit_distance(name, names[i]);
        if (distance < best) best = distance, near = i;
    }
    if (best != SIZE_MAX && best <= 1 + strlen(name) / 6 && best < strlen(names[near]))
        snprintf(hint.text, sizeof hint.text, ": did you mean \"%s\"?",
                 shd_quote(names[near]).text);
    else
        list_names(&hint, names, count);
    return hint;
}
