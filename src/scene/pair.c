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

static void check_tree(shd_reader *r, json_t *tree, shd_pair_texts *out) {
    static const shd_range density = {10, 400, .text = "from 10 to 400"};
    static const shd_field fields[] = {
        {"$schema", .read = shd_read_label},
        {"name", .read = shd_read_label},
        {"a", read_side, .offset = offsetof(shd_pair_texts, names[0]), .required = true},
        {"b", read_side, .offset = offsetof(shd_pair_texts, names[1]), .required = true},
        {"pixelsPerDegree", shd_read_number, .offset = offsetof(shd_pair_texts, density),
         .range = &density},
    };
    const shd_node root = {.value = tree};
    if (tree && shd_is_object(r, &root))
        shd_read_fields(r, &root, fields, SHD_LENGTH(fields), 0, "the comparison", out);
}

shd_status shd_pair_read(const char *text, size_t length, const shd_limits *limits,
                         const atomic_bool *cancelled, shd_arena *arena, shd_pair_texts *out,
                         shd_report *report) {
    shd_json json;
    *out = (shd_pair_texts){0};
    if (!shd_json_parse(text, length, limits->memory, cancelled, arena, &json, report))
        return report->status;
    shd_reader r = {
        .limits = limits, .cancelled = cancelled, .arena = arena, .json = &json, .report = report};
    check_tree(&r, json.tree, out);
    shd_json_drop(&json, arena);
    if (report->status != SHD_OK) return report->status;
    const shd_span whole = shd_span_of(text, text + length);
    const char *at = NULL;
    shd_span key, value;
    while (shd_span_next(whole, &at, &key, &value)) {
        if (shd_span_is(key, "a")) out->sides[0] = value;
        if (shd_span_is(key, "b")) out->sides[1] = value;
    }
    return SHD_OK;
}
