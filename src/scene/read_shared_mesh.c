/* `meshes`: geometry by name, which is there once however many objects have it. */
#include <string.h>

#include "scene/read.h"

static int compare_key(const void *key, const void *shared) {
    return strcmp(key, ((const shd_shared_mesh *)shared)->name);
}

static int compare_shared(const void *a, const void *b) {
    return compare_key(((const shd_shared_mesh *)a)->name, b);
}

/* The scene's own mesh gets `shared` set; one that is kept is constant, and shared in any case. */
static void read_shared_mesh(shd_reader *r, const shd_node *node, shd_shared_mesh *out) {
    static const shd_field fields[] = {
        {"positions", shd_keep_value, .offset = offsetof(shd_mesh_source, positions)},
        {"indices", shd_keep_value, .offset = offsetof(shd_mesh_source, indices)},
        {"normals", shd_keep_value, .offset = offsetof(shd_mesh_source, normals)},
        {"uvs", shd_keep_value, .offset = offsetof(shd_mesh_source, uvs)},
        {"data", shd_keep_value, .offset = offsetof(shd_mesh_source, data)},
    };
    shd_mesh_source source = {.positions = NULL};
    if (!shd_read_fields(r, node, fields, SHD_LENGTH(fields), 0, "a mesh", &source)) return;
    if (!source.positions && !source.data)
        shd_wrong(r, node, "the member \"positions\" is missing");
    out->mesh = shd_read_mesh(r, node, &source, &out->own);
    if (out->own) out->own->shared = true;
}

void shd_read_meshes(shd_reader *r, const shd_node *node, void *out) {
    (void)out;
    r->shared_unknown = !shd_is_object(r, node);
    if (r->shared_unknown) return;
    size_t count = json_object_size(node->value);
    if (count > r->limits->objects) {
        shd_node_report(r->report, node, SHD_LIMIT,
                        "the scene has %zu meshes, more than objects may have: the limit "
                        "`objects` is %llu",
                        count, (unsigned long long)r->limits->objects);
        shd_report_limit(r->report, SHD_LIMIT_OBJECTS);
        count = (size_t)r->limits->objects;
    }
    r->shared = shd_take(r, count, sizeof *r->shared);
    if (!r->shared) return;
    for (void *at = json_object_iter(node->value); at && r->shared_count < count;
         at = json_object_iter_next(node->value, at)) {
        if (shd_is_cancelled(r->cancelled)) return;
        const char *key = json_object_iter_key(at);
        if (!shd_is_plain_name(key))
            shd_wrong(r, node,
                      "the name \"%s\" is longer than 64 characters or has control characters",
                      shd_quote(key).text);
        const shd_node mesh = {node, key, 0, json_object_iter_value(at)};
        shd_shared_mesh *shared = &r->shared[r->shared_count++];
        *shared = (shd_shared_mesh){.name = key};
        read_shared_mesh(r, &mesh, shared);
    }
    qsort(r->shared, r->shared_count, sizeof *r->shared, compare_shared);
}

static shd_hint suggest_mesh(const shd_reader *r, const char *name) {
    enum { MOST = 256 };
    const char *names[MOST];
    size_t count = 0;
    while (count < r->shared_count && count < MOST) {
        names[count] = r->shared[count].name;
        count++;
    }
    return shd_suggest(r->report, name, names, count);
}

const shd_mesh *shd_use_mesh(shd_reader *r, const shd_node *node, size_t object) {
    const char *name = shd_get_text(r, node, "the name of a mesh");
    if (!name) return NULL;
    shd_shared_mesh *shared = NULL;
    if (r->shared_count)
        shared = bsearch(name, r->shared, r->shared_count, sizeof *r->shared, compare_key);
    if (!shared) {
        if (!r->shared_unknown)
            shd_wrong(r, node, "there is no mesh \"%s\" among `meshes`%s", shd_quote(name).text,
                      suggest_mesh(r, name).text);
        return NULL;
    }
    if (shared->own && !shared->used) shared->own->first = object;
    shared->used = true;
    return shared->mesh;
}
