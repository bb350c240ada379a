/* `meshes`: geometry by name, which is there once however many objects have it. */
#include "scene/read.h"

/* The scene's own mesh gets `shared` set; one that is kept is constant, and shared in any case. */
static void read_shared_mesh(shd_reader *r, const shd_node *node, void *entry) {
    shd_shared_mesh *out = entry;
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
    shd_read_entries(r, node, "meshes", sizeof(shd_shared_mesh), read_shared_mesh, &r->shared);
}

static shd_hint suggest_mesh(const shd_reader *r, const char *name) {
    const char *names[256];
    return shd_suggest(r->report, name, names,
                       shd_name_entries(&r->shared, names, SHD_LENGTH(names)));
}

const shd_mesh *shd_use_mesh(shd_reader *r, const shd_node *node, size_t object) {
    const char *name = shd_get_text(r, node, "the name of a mesh");
    if (!name) return NULL;
    shd_shared_mesh *shared = shd_find_entry(&r->shared, name);
    if (!shared) {
        if (!r->shared.unknown)
            shd_wrong(r, node, "there is no mesh \"%s\" among `meshes`%s", shd_quote(name).text,
                      suggest_mesh(r, name).text);
        return NULL;
    }
    if (shared->own && !shared->used) shared->own->first = object;
    shared->used = true;
    return shared->mesh;
}
