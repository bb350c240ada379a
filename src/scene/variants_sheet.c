/* What a sheet of variants says of them. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "scene/variants_parts.h"

/* ---- Reading ---- */

static void read_labels(shd_reader *r, const shd_node *node, void *out) {
    static const char expected[] = "true, false or 1 to 1000 texts";
    if (json_is_boolean(node->value)) {
        *(bool *)out = json_is_true(node->value);
        return;
    }
    if (!shd_is_array(r, node, 1, SHD_CELLS_MOST, expected)) return;
    for (size_t i = 0; i < json_array_size(node->value); i++) {
        const shd_node item = shd_node_item(node, i);
        const char *text = shd_get_text(r, &item, "a text");
        if (text && *text && !shd_is_plain_name(text))
            shd_wrong(r, &item, "a label has at most 64 characters, and no control characters");
    }
}

void shd_read_sheet_wish(shd_reader *r, const shd_node *node, void *out) {
    static const shd_range columns = {1, SHD_CELLS_MOST, .text = "1 to 1000"};
    static const shd_field fields[] = {
        {"columns", shd_read_integer, offsetof(shd_sheet_wish, columns), .range = &columns},
        {"labels", read_labels, .offset = offsetof(shd_sheet_wish, labels)},
    };
    shd_sheet_wish *wish = out;
    *wish = (shd_sheet_wish){.wanted = true, .labels = true};
    if (!shd_is_object(r, node)) return;
    shd_read_fields(r, node, fields, SHD_LENGTH(fields), 0, "a sheet", wish);
}

/* ---- Labels ---- */

enum { SHORT_NUMBER = 8, SHORT_VALUE = 24, LINES_MOST = 4 };

/* The last name of a pointer, with what it is the item of: "intensity", "objects 0". */
static void put_name(FILE *out, const char *pointer) {
    const char *last = strrchr(pointer, '/');
    if (last > pointer && last[1] && strspn(last + 1, "0123456789") == strlen(last + 1)) {
        const char *before = last;
        while (before > pointer && before[-1] != '/') before--;
        fprintf(out, "%.*s %s", (int)(last - before), before, last + 1);
        return;
    }
    for (const char *c = last + 1; *c; c++) {
        const bool escaped = *c == '~' && c[1];
        if (escaped) c++;
        fputc(!escaped ? *c : *c == '1' ? '/' : '~', out);
    }
}

/* The text that tells most of an object: which preset it is, or what it is called. */
static char *find_word(shd_span object) {
    static const char *const telling[] = {"preset", "name", "type"};
    for (size_t i = 0; i < SHD_LENGTH(telling); i++) {
        const char *at = NULL;
        shd_span key, value;
        while (shd_span_next(object, &at, &key, &value))
            if (shd_span_is(key, telling[i]) && *value.at == '"') return shd_span_text(value);
    }
    return NULL;
}

/* Numbers with few digits, and the rest as it is written, as far as it is short. */
static void put_value(FILE *out, shd_span value) {
    const size_t size = (size_t)(value.end - value.at);
    char *word;
    if (*value.at == '[' && size <= 4 * SHORT_VALUE) {
        const char *at = NULL;
        shd_span key, item;
        for (bool next = false; shd_span_next(value, &at, &key, &item); next = true) {
            if (next) fputc(' ', out);
            put_value(out, item);
        }
    } else if ((*value.at == '"' && (word = shd_span_text(value))) ||
               (*value.at == '{' && (word = find_word(value)))) {
        for (const char *c = word; *c; c++) fputc((unsigned char)*c < ' ' ? ' ' : *c, out);
        free(word);
    } else if (size > SHORT_NUMBER && strchr("-0123456789", *value.at)) {
        fprintf(out, "%.4g", strtod(value.at, NULL));
    } else {
        const size_t some = size > SHORT_VALUE ? SHORT_VALUE : size;
        for (size_t i = 0; i < some; i++)
            fputc((unsigned char)value.at[i] < ' ' ? ' ' : value.at[i], out);
        if (some < size) fputs("...", out);
    }
}

/* A text speaks for itself. */
static void put_change(FILE *out, const char *pointer, shd_span value, size_t *lines) {
    if ((*lines)++) fputc('\n', out);
    if (*value.at != '"' && *value.at != '{') {
        put_name(out, pointer);
        fputc(' ', out);
    }
    put_value(out, value);
}

static void put_patch(FILE *out, const char *name, shd_span patch, size_t *lines) {
    const char *at = NULL;
    shd_span key, value;
    if (*patch.at != '{') {
        if (*lines < LINES_MOST) put_change(out, name, patch, lines);
        return;
    }
    while (*lines < LINES_MOST && shd_span_next(patch, &at, &key, &value)) {
        char *text = shd_span_text(key), *pointer = NULL;
        if (text && asprintf(&pointer, "/%s", text) >= 0) put_patch(out, pointer, value, lines);
        free(pointer);
        free(text);
    }
}

char *shd_variants_label(const shd_variants *v, size_t index) {
    if (v->labels) return shd_span_text(v->labels[index]);
    char *label = NULL;
    size_t length, lines = 0, stride = v->count;
    FILE *out = open_memstream(&label, &length);
    if (!out) return NULL;
    if (v->patches) put_patch(out, "/", v->patches[index], &lines);
    for (size_t i = 0; i < v->axis_count && lines < LINES_MOST; i++) {
        const shd_axis *a = &v->axes[i];
        stride /= a->count;
        put_change(out, a->pointer, a->values[index / stride % a->count], &lines);
    }
    if (!v->patches && !v->axis_count && v->name) fputs(v->name, out);
    if (!fclose(out)) return label;
    free(label);
    return NULL;
}

/* ---- Places ---- */

char *shd_variants_place(const shd_variants *v, size_t index, const char *pointer) {
    char *place = NULL;
    size_t length, stride = v->count;
    FILE *out = open_memstream(&place, &length);
    if (!out) return NULL;
    bool is_found = v->patches;
    if (is_found) fprintf(out, "/variants/%zu", index);
    for (size_t i = 0; i < v->axis_count && !is_found; i++) {
        const shd_axis *a = &v->axes[i];
        const size_t size = strlen(a->pointer);
        stride /= a->count;
        is_found = !strncmp(pointer, a->pointer, size) && (!pointer[size] || pointer[size] == '/');
        if (!is_found) continue;
        fputs("/sweep/", out);
        for (const char *c = a->pointer; *c; c++)
            fputs(*c == '/' ? "~1" : *c == '~' ? "~0" : (char[]){*c, 0}, out);
        fprintf(out, "/%zu%s", index / stride % a->count, pointer + size);
    }
    if (!is_found) fprintf(out, "/scene%s", pointer);
    if (!fclose(out)) return place;
    free(place);
    return NULL;
}
