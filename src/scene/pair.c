#include "scene/pair.h"

#include "scene/read.h"

/* A scene, or a string that names a picture. */
static void read_side(shd_reader *r, const shd_node *node, void *out) {
    const char **name = out;
    if (json_is_string(node->value))
        *name = shd_take_text(r, json_string_value(node->value));
    else if (!json_is_object(node->value))
        shd_node_expect(r->report, node, "a scene, or a string that names a picture");
}

static void read_scene(shd_reader *r, const shd_node *node, void *out) {
    (void)out;
    shd_is_object(r, node);
}

static void read_text(shd_reader *r, const shd_node *node, void *out) {
    const char *text = shd_get_text(r, node, "a string");
    if (text) *(const char **)out = shd_take_text(r, text);
}

/* What a document is called, and its members. */
typedef struct form {
    const char *what;
    const shd_field *fields;
    size_t count;
} form;

static const shd_range density = {10, 400, .text = "from 10 to 400"};

static const shd_field pair_fields[] = {
    {"$schema", .read = shd_read_label},
    {"name", .read = shd_read_label},
    {"a", read_side, .offset = offsetof(shd_pair_texts, names[0]), .required = true},
    {"b", read_side, .offset = offsetof(shd_pair_texts, names[1]), .required = true},
    {"pixelsPerDegree", shd_read_number, .offset = offsetof(shd_pair_texts, density),
     .range = &density},
};

static const shd_field fit_fields[] = {
    {"$schema", .read = shd_read_label},
    {"name", .read = shd_read_label},
    {"scene", read_scene, .required = true},
    {"photo", read_text, .offset = offsetof(shd_fit_texts, photo), .required = true},
    {"object", read_text, .offset = offsetof(shd_fit_texts, object)},
};

static shd_status read_form(const form *f, const char *text, size_t length,
                            const shd_limits *limits, const atomic_bool *cancelled,
                            shd_arena *arena, void *out, shd_report *report) {
    shd_json json;
    if (!shd_json_parse(text, length, limits->memory, false, cancelled, arena, &json, report))
        return report->status;
    shd_reader r = {
        .limits = limits, .cancelled = cancelled, .arena = arena, .json = &json, .report = report};
    const shd_node root = {.value = json.tree};
    if (json.tree && shd_is_object(&r, &root))
        shd_read_fields(&r, &root, f->fields, f->count, 0, f->what, out);
    shd_json_drop(&json, arena);
    return report->status;
}

/* The text of a member of a document that is sound. */
static shd_span member_of(const char *text, size_t length, const char *name) {
    const shd_span whole = shd_span_of(text, text + length);
    const char *at = NULL;
    shd_span key, value, found = {text, text};
    while (shd_span_next(whole, &at, &key, &value))
        if (shd_span_is(key, name)) found = value;
    return found;
}

shd_status shd_pair_read(const char *text, size_t length, const shd_limits *limits,
                         const atomic_bool *cancelled, shd_arena *arena, shd_pair_texts *out,
                         shd_report *report) {
    static const form pair = {"the comparison", pair_fields, SHD_LENGTH(pair_fields)};
    *out = (shd_pair_texts){0};
    if (read_form(&pair, text, length, limits, cancelled, arena, out, report) != SHD_OK)
        return report->status;
    out->sides[0] = member_of(text, length, "a");
    out->sides[1] = member_of(text, length, "b");
    return SHD_OK;
}

shd_status shd_fit_read(const char *text, size_t length, const shd_limits *limits,
                        const atomic_bool *cancelled, shd_arena *arena, shd_fit_texts *out,
                        shd_report *report) {
    static const form fit = {"the fit", fit_fields, SHD_LENGTH(fit_fields)};
    *out = (shd_fit_texts){0};
    if (read_form(&fit, text, length, limits, cancelled, arena, out, report) != SHD_OK)
        return report->status;
    out->scene = member_of(text, length, "scene");
    return SHD_OK;
}
