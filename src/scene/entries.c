/* Members of the document that objects name: `materials` and `meshes`. */
#include <stdlib.h>
#include <string.h>

#include "scene/read.h"

static const char *name_of(const void *entry) {
    return *(const char *const *)entry;
}

static int compare_key(const void *key, const void *entry) {
    return strcmp(key, name_of(entry));
}

static int compare_entries(const void *a, const void *b) {
    return compare_key(name_of(a), b);
}

void shd_read_entries(shd_reader *r, const shd_node *node, const char *what, size_t size,
                      shd_read_entry *read_one, shd_entries *out) {
    *out = (shd_entries){.size = size, .unknown = !shd_is_object(r, node)};
    if (out->unknown) return;
    size_t count = json_object_size(node->value);
    if (count > r->limits->objects) {
        shd_node_report(
            r->report, node, SHD_LIMIT,
            "the scene has %zu %s, more than objects may have: the limit `objects` is %llu", count,
            what, (unsigned long long)r->limits->objects);
        shd_report_limit(r->report, SHD_LIMIT_OBJECTS);
        count = (size_t)r->limits->objects;
    }
    out->list = shd_take(r, count, size);
    if (!out->list) return;
    for (void *at = json_object_iter(node->value); at && out->count < count;
         at = json_object_iter_next(node->value, at)) {
        if (shd_is_cancelled(r->cancelled)) return;
        const char *key = json_object_iter_key(at);
        if (!shd_is_plain_name(key))
            shd_wrong(r, node,
                      "the name \"%s\" is longer than 64 characters or has control characters",
                      shd_quote(key).text);
        const char *name = shd_take_text(r, key);
        if (!name) return;
        void *entry = (char *)out->list + size * out->count++;
        memset(entry, 0, size);
        *(const char **)entry = name;
        const shd_node member = {node, key, 0, json_object_iter_value(at)};
        read_one(r, &member, entry);
    }
    qsort(out->list, out->count, size, compare_entries);
}

void *shd_find_entry(const shd_entries *entries, const char *name) {
    if (!entries->count) return NULL;
    return bsearch(name, entries->list, entries->count, entries->size, compare_key);
}

size_t shd_name_entries(const shd_entries *entries, const char **names, size_t most) {
    const size_t count = entries->count < most ? entries->count : most;
    for (size_t i = 0; i < count; i++)
        names[i] = name_of((const char *)entries->list + entries->size * i);
    return count;
}
