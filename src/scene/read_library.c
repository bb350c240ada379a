/* The files of the material library: config/materials.json and those of operators. */
#include <string.h>

#include "base/json_memory.h"
#include "scene/library.h"
#include "scene/read.h"

/* config/materials.json */
extern const unsigned char shd_embedded_materials[];
extern const unsigned long shd_embedded_materials_size;

typedef struct raw_entry {
    const char *group, *source, *note;
    int encoding;
    json_t *material;
} raw_entry;

static void read_text(shd_reader *r, const shd_node *node, void *out) {
    const char *text = shd_get_text(r, node, "a string");
    if (text) *(const char **)out = text; /* the file's tree has it as long as there is a library */
}

static void read_entry(shd_reader *r, const shd_node *node, shd_library_entry *out) {
    enum { LINEAR, CODES };
    static const char *const encodings[] = {[LINEAR] = "linear", [CODES] = "sRGB", NULL};
    static const shd_field fields[] = {
        {"group", read_text, offsetof(raw_entry, group), .required = true},
        {"source", read_text, offsetof(raw_entry, source), .required = true},
        {"note", read_text, .offset = offsetof(raw_entry, note)},
        {"encoding", shd_read_choice, offsetof(raw_entry, encoding), .choices = encodings},
        {"material", shd_keep_value, offsetof(raw_entry, material), .required = true},
    };
    raw_entry raw = {"", "", "", LINEAR, NULL};
    shd_read_fields(r, node, fields, SHD_LENGTH(fields), 0, "a material of the library", &raw);
    if (!raw.material || r->wrong) return;
    *out = (shd_library_entry){
        .told = {.name = node->key, .group = raw.group, .source = raw.source, .note = raw.note},
        .material = raw.material,
        .json = r->json,
        .codes = raw.encoding == CODES};
    const shd_node material = shd_node_member(node, "material");
    shd_material made = {.name = ""};
    r->codes = out->codes;
    shd_read_library_material(r, &material, &made);
    if (r->report->status == SHD_OK) shd_tell_preset(&made, &out->told);
}

/* What a file adds. */
typedef struct reading {
    const shd_library *library; /* what there is already */
    shd_library_entry *entries;
    size_t count;
} reading;

static void read_entries(shd_reader *r, const shd_node *node, void *out) {
    reading *added = out;
    if (!shd_is_object(r, node)) return;
    added->entries = shd_take(r, json_object_size(node->value), sizeof *added->entries);
    if (!added->entries) return;
    for (void *at = json_object_iter(node->value); at;
         at = json_object_iter_next(node->value, at)) {
        const shd_node entry = {node, json_object_iter_key(at), 0, json_object_iter_value(at)};
        if (!*entry.key || !shd_is_plain_name(entry.key))
            shd_wrong(r, node,
                      "the name \"%s\" is empty, longer than 64 characters, or has "
                      "control characters",
                      shd_quote(entry.key).text);
        else if (shd_library_find(added->library, entry.key))
            shd_wrong(r, &entry, "there is a material of that name in the library already");
        else
            read_entry(r, &entry, &added->entries[added->count++]);
    }
}

static void read_file(shd_reader *r, const shd_json *json, reading *added) {
    static const shd_field fields[] = {
        {"$schema", .read = shd_read_label},
        {"description", .read = shd_read_label},
        {"materials", read_entries, .required = true},
    };
    const shd_node root = {.value = json->tree};
    shd_read_fields(r, &root, fields, SHD_LENGTH(fields), 0, "a file of materials", added);
}

/* In the reader's spaces of linear Rec.709, whose numbers are told. */
static void read_tree(shd_library *library, const shd_catalog *catalog, const shd_json *json,
                      shd_report *report, reading *added) {
    const shd_limits limits = {.memory = SHD_LIBRARY_BYTES, .objects = UINT64_MAX};
    const shd_space_info *space = shd_catalog_space(catalog, "lin_rec709");
    shd_scene scene = {.working_space = space ? space : catalog->scene_linear};
    shd_reader r = {.catalog = catalog,
                    .limits = &limits,
                    .arena = library->arena,
                    .json = json,
                    .report = report,
                    .scene = &scene,
                    .colors = scene.working_space,
                    .in_library = true};
    read_file(&r, json, added);
}

static shd_status blame(const shd_report *report, const char *path, shd_error *error) {
    const shd_problem *first = &report->errors[0];
    if (report->status == SHD_MEMORY && shd_json_memory_short())
        return shd_fail(error, SHD_EXHAUSTED, path, "out of memory");
    return shd_fail(error, SHD_CONFIG, path, "%s%s%s", first->pointer, *first->pointer ? ": " : "",
                    first->detail);
}

shd_status shd_library_add(shd_library *library, const char *path, const char *text, size_t length,
                           const shd_catalog *catalog, shd_error *error) {
    shd_report report;
    shd_report_init(&report, library->arena);
    shd_library_file *file = shd_arena_zalloc(library->arena, 1, sizeof *file);
    if (!file) return shd_fail(error, SHD_EXHAUSTED, path, "out of memory");
    if (!shd_json_parse(text, length, SHD_LIBRARY_BYTES, false, NULL, library->arena, &file->json,
                        &report))
        return blame(&report, path, error);
    file->next = library->files;
    library->files = file;
    reading added = {.library = library};
    read_tree(library, catalog, &file->json, &report, &added);
    if (report.status != SHD_OK) return blame(&report, path, error);
    if (!shd_library_append(library, added.entries, added.count))
        return shd_fail(error, SHD_EXHAUSTED, path, "out of memory");
    return SHD_OK;
}

shd_status shd_library_new(const shd_catalog *catalog, shd_library **out, shd_error *error) {
    shd_library *library = shd_library_make();
    if (!library) return shd_fail(error, SHD_EXHAUSTED, "", "out of memory");
    const shd_status status = shd_library_add(library, "", (const char *)shd_embedded_materials,
                                              shd_embedded_materials_size, catalog, error);
    if (status == SHD_OK)
        *out = library;
    else
        shd_library_drop(library);
    return status;
}
