#include "scene/variants.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

#include "scene/patch.h"
#include "scene/variants_parts.h"

/* ---- Documents ---- */

/* Without axes it is the scene. */
static shd_status sweep(const shd_variants *v, size_t index, shd_draft *draft, shd_error *error) {
    shd_span document = v->scene;
    size_t stride = v->count;
    static const char nothing[] = "{}";
    if (!v->axis_count)
        shd_patch_merge(draft, document, (shd_span){nothing, nothing + strlen(nothing)});
    for (size_t i = 0; i < v->axis_count; i++) {
        const shd_axis *a = &v->axes[i];
        shd_draft next = {.cancelled = draft->cancelled};
        stride /= a->count;
        const shd_status status = shd_patch_replace(&next, document, a->pointer,
                                                    a->values[index / stride % a->count], error);
        free(draft->data);
        *draft = next;
        if (status != SHD_OK) return status;
        document = (shd_span){next.data, next.data + next.size};
    }
    return SHD_OK;
}

shd_status shd_variants_document(const shd_variants *v, size_t index, const atomic_bool *cancelled,
                                 char **text, size_t *length, shd_error *error) {
    shd_draft draft = {.cancelled = cancelled};
    shd_status status = SHD_OK;
    assert(index < v->count);
    if (v->turn.frames)
        shd_put_frame(&v->turn, index, &draft, v->scene);
    else if (v->patches)
        shd_patch_merge(&draft, v->scene, v->patches[index]);
    else
        status = sweep(v, index, &draft, error);
    if (draft.status == SHD_EXHAUSTED) status = shd_fail(error, SHD_EXHAUSTED, "", "out of memory");
    if (draft.status == SHD_CANCELLED) status = shd_fail(error, SHD_CANCELLED, "", "cancelled");
    if (status != SHD_OK) {
        free(draft.data);
        return status;
    }
    *text = draft.data;
    *length = draft.size;
    return SHD_OK;
}

size_t shd_variants_count(const shd_variants *v) {
    return v->count;
}

size_t shd_variants_size(const shd_variants *v) {
    return (size_t)(v->scene.end - v->scene.at);
}

shd_sheet_wish shd_variants_sheet(const shd_variants *v) {
    return v->wish;
}

shd_turn shd_variants_turn(const shd_variants *v) {
    return v->turn;
}

const char *shd_variants_name(const shd_variants *v) {
    return v->name ? v->name : "";
}

void shd_variants_drop(shd_variants *v) {
    if (!v) return;
    for (size_t i = 0; i < v->axis_count; i++) {
        free(v->axes[i].pointer);
        free(v->axes[i].values);
    }
    free(v->patches);
    free(v->labels);
    free(v->name);
    free(v);
}

/* ---- Telling them from scenes ---- */

/* Behind a string whose opening quote is at `at`. */
static const char *pass_string(const char *at, const char *end) {
    for (at++; at < end && *at != '"'; at++)
        if (*at == '\\') at++;
    return at < end ? at + 1 : end;
}

bool shd_variants_are(const char *text, size_t length) {
    static const char name[] = "\"scene\"";
    const char *const end = text + length;
    int depth = 0;
    for (const char *at = text; at < end;) {
        if (*at != '"') {
            depth += (*at == '{' || *at == '[') - (*at == '}' || *at == ']');
            at++;
            continue;
        }
        const char *const from = at;
        at = pass_string(at, end);
        if (depth != 1 || (size_t)(at - from) != strlen(name) || memcmp(from, name, strlen(name)))
            continue;
        while (at < end && strchr(" \t\r\n", *at) && *at) at++;
        if (at < end && *at == ':') return true;
    }
    return false;
}

/* ---- Checking the tree ---- */

static void check_scene(shd_reader *r, const shd_node *node, void *out) {
    (void)out;
    shd_is_object(r, node);
}

static void check_variants(shd_reader *r, const shd_node *node, void *out) {
    (void)out;
    if (!shd_is_array(r, node, 1, SHD_VARIANTS_MOST, "1 to 10000 merge patches")) return;
    for (size_t i = 0; i < json_array_size(node->value); i++) {
        const shd_node patch = shd_node_item(node, i);
        shd_is_object(r, &patch);
    }
}

static bool is_pointer(const char *text) {
    if (*text != '/') return false;
    for (const char *c = text; *c; c++)
        if (*c == '~' && c[1] != '0' && c[1] != '1') return false;
    return true;
}

static void check_sweep(shd_reader *r, const shd_node *node, void *out) {
    (void)out;
    const char *key;
    json_t *values;
    size_t product = 1;
    if (!shd_is_object(r, node)) return;
    if (!json_object_size(node->value) || json_object_size(node->value) > SHD_AXES_MOST)
        shd_wrong(r, node, "expected 1 to %d places, got %zu", SHD_AXES_MOST,
                  json_object_size(node->value));
    json_object_foreach(node->value, key, values) {
        const shd_node list = shd_node_member(node, key);
        const size_t count = json_array_size(values);
        if (!is_pointer(key))
            shd_wrong(r, &list,
                      "expected a JSON Pointer to a part of the scene, such as "
                      "\"/camera/fov\"");
        if (!shd_is_array(r, &list, 1, SHD_VARIANTS_MOST, "1 to 10000 values")) continue;
        if (product <= SHD_VARIANTS_MOST && count) product *= count;
    }
    if (product > SHD_VARIANTS_MOST)
        shd_wrong(r, node, "the lists have more than %d combinations", SHD_VARIANTS_MOST);
}

/* How all variants become one answer. */
typedef struct joining {
    shd_sheet_wish sheet;
    shd_turn turn;
} joining;

static void check_tree(shd_reader *r, json_t *tree, joining *out) {
    enum { VARIANTS = 1, SWEEP = 2, SHEET = 4, TURN = 8 };
    static const shd_field fields[] = {
        {"$schema", .read = shd_read_label},
        {"name", .read = shd_read_label},
        {"scene", check_scene, .required = true},
        {"variants", check_variants, .mark = VARIANTS},
        {"sweep", check_sweep, .mark = SWEEP},
        {"sheet", shd_read_sheet_wish, .offset = offsetof(joining, sheet), .mark = SHEET},
        {"turntable", shd_read_turn, .offset = offsetof(joining, turn), .mark = TURN},
    };
    const shd_node root = {.value = tree};
    if (!tree || !shd_is_object(r, &root)) return;
    shd_read_fields(r, &root, fields, SHD_LENGTH(fields), 0, "the batch", out);
    if ((r->seen & (VARIANTS | SWEEP)) == (VARIANTS | SWEEP))
        shd_wrong(r, &root, "give either `variants` or `sweep`, not both");
    if (r->seen & TURN && r->seen & (VARIANTS | SWEEP | SHEET))
        shd_wrong(r, &root, "a turntable is of one scene: give no `variants`, `sweep` or `sheet`");
    shd_find_orbit(json_object_get(tree, "scene"), &out->turn);
}

/* ---- Finding the parts ---- */

/* The items of an array, which the caller frees. NULL: memory is short. */
static shd_span *list_items(shd_span array, size_t *count) {
    const char *at = NULL;
    shd_span key, value;
    size_t n = 0;
    while (shd_span_next(array, &at, &key, &value)) n++;
    shd_span *items = malloc((n ? n : 1) * sizeof *items);
    at = NULL;
    for (size_t i = 0; items && shd_span_next(array, &at, &key, &value); i++) items[i] = value;
    *count = n;
    return items;
}

static bool take_axes(shd_variants *v, shd_span object) {
    const char *at = NULL;
    shd_span key, value;
    v->count = 1;
    while (shd_span_next(object, &at, &key, &value)) {
        shd_axis *a = &v->axes[v->axis_count++];
        a->pointer = shd_span_text(key);
        a->values = list_items(value, &a->count);
        if (!a->pointer || !a->values) return false;
        v->count *= a->count;
    }
    return true;
}

/* Those that the sheet has of its own. */
static bool take_labels(shd_variants *v, shd_span sheet) {
    const char *at = NULL;
    shd_span key, value;
    while (shd_span_next(sheet, &at, &key, &value)) {
        if (!shd_span_is(key, "labels") || *value.at != '[') continue;
        v->labels = list_items(value, &v->label_count);
        return v->labels;
    }
    return true;
}

/* Of a text that was checked. False: memory is short. */
static bool take_parts(shd_variants *v, shd_span whole) {
    const char *at = NULL;
    shd_span key, value;
    bool is_complete = true;
    v->count = 1;
    while (is_complete && shd_span_next(whole, &at, &key, &value)) {
        if (shd_span_is(key, "scene")) {
            v->scene = value;
        } else if (shd_span_is(key, "name")) {
            v->name = shd_span_text(value);
            is_complete = v->name;
        } else if (shd_span_is(key, "variants")) {
            v->patches = list_items(value, &v->count);
            is_complete = v->patches;
        } else if (shd_span_is(key, "sweep")) {
            is_complete = take_axes(v, value);
        } else if (shd_span_is(key, "sheet")) {
            is_complete = take_labels(v, value);
        }
    }
    return is_complete && v->scene.at;
}

/* Whether the pointers lead somewhere. */
static void try_first(const shd_variants *v, const atomic_bool *cancelled, shd_report *report) {
    char *text = NULL;
    size_t length;
    shd_error error;
    const shd_status status =
        v->patches ? SHD_OK : shd_variants_document(v, 0, cancelled, &text, &length, &error);
    if (status != SHD_OK) shd_report_error(report, status, "/sweep", "%s", error.text);
    free(text);
}

static void check_parts(shd_variants *v, const joining *joined, const atomic_bool *cancelled,
                        shd_report *report) {
    v->wish = joined->sheet;
    v->turn = joined->turn;
    if (v->turn.frames) v->count = (size_t)v->turn.frames;
    if (v->wish.wanted && v->count > SHD_CELLS_MOST)
        shd_report_error(report, SHD_SCENE, "/sheet", "a sheet has at most %d variants, not %zu",
                         SHD_CELLS_MOST, v->count);
    if (v->labels && v->label_count != v->count)
        shd_report_error(report, SHD_SCENE, "/sheet/labels",
                         "expected a label for each variant, which are %zu, got %zu", v->count,
                         v->label_count);
    try_first(v, cancelled, report);
}

shd_status shd_variants_read(const char *text, size_t length, const shd_limits *limits,
                             const atomic_bool *cancelled, shd_arena *arena, shd_variants **out,
                             shd_report *report) {
    shd_json json;
    if (!shd_json_parse(text, length, limits->memory, false, cancelled, arena, &json, report))
        return report->status;
    shd_reader r = {
        .limits = limits, .cancelled = cancelled, .arena = arena, .json = &json, .report = report};
    joining joined = {0};
    check_tree(&r, json.tree, &joined);
    shd_json_drop(&json, arena);
    if (report->status != SHD_OK) return report->status;
    shd_variants *v = calloc(1, sizeof *v);
    if (!v || !take_parts(v, shd_span_of(text, text + length)))
        shd_report_error(report, SHD_EXHAUSTED, "", "out of memory");
    else
        check_parts(v, &joined, cancelled, report);
    if (report->status == SHD_OK)
        *out = v;
    else
        shd_variants_drop(v);
    return report->status;
}
