#include "scene/pair.h"

#include "scene/read.h"

static void check_side(shd_reader *r, const shd_node *node, void *out) {
    (void)out;
    shd_is_object(r, node);
}

static void check_tree(shd_reader *r, json_t *tree, shd_pair_texts *out) {
    static const shd_range density = {10, 400, .text = "from 10 to 400"};
    static const shd_field fields[] = {
        {"$schema", .read = shd_read_label},
        {"name", .read = shd_read_label},
        {"a", check_side, .required = true},
        {"b", check_side, .required = true},
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
