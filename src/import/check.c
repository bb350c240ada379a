#include <math.h>
#include <string.h>

#include "import/model.h"

static bool lies_within(const shd_model *model, shd_span span, size_t item) {
    return span.at % 8 == 0 && span.at >= sizeof *model && span.at <= model->size &&
           span.count <= (model->size - span.at) / item;
}

static bool are_finite(const double *values, size_t count) {
    for (size_t i = 0; i < count; i++)
        if (!isfinite(values[i])) return false;
    return true;
}

static bool floats_are_finite(const shd_model *model, shd_span span) {
    const float *values = shd_span_items(model, span);
    for (size_t i = 0; i < span.count; i++)
        if (!isfinite(values[i])) return false;
    return true;
}

/* NULL, or what is wrong. */
static const char *blame_mesh(const shd_model *model, const shd_model_mesh *mesh) {
    if (!lies_within(model, mesh->name, 1) || !lies_within(model, mesh->positions, 4) ||
        !lies_within(model, mesh->normals, 4) || !lies_within(model, mesh->uvs, 4) ||
        !lies_within(model, mesh->indices, 4) || mesh->positions.count % 3 ||
        mesh->indices.count % 3 ||
        (mesh->normals.count && mesh->normals.count != mesh->positions.count) ||
        (mesh->uvs.count && mesh->uvs.count != mesh->positions.count / 3 * 2) ||
        mesh->material >= model->materials.count)
        return "its arrays have no sound lengths";
    if (!mesh->positions.count || !mesh->indices.count) return "it has a mesh without triangles";
    if (!floats_are_finite(model, mesh->positions)) return "it has a position that is not finite";
    const uint32_t *indices = shd_span_items(model, mesh->indices);
    for (size_t i = 0; i < mesh->indices.count; i++)
        if (indices[i] >= mesh->positions.count / 3) return "it has an index of no vertex";
    return NULL;
}

static bool is_color(const float rgb[3]) {
    for (int c = 0; c < 3; c++)
        if (!(rgb[c] >= 0 && rgb[c] <= 1e6f)) return false;
    return true;
}

static bool are_in_range(const float *values, size_t count, float least, float most) {
    for (size_t i = 0; i < count; i++)
        if (!(values[i] >= least && values[i] <= most)) return false;
    return true;
}

static const char *blame_picture(const shd_model *model, const shd_model_picture *p) {
    const bool sound =
        lies_within(model, p->name, 1) && lies_within(model, p->bytes, 1) &&
        (!p->measured || (are_in_range(p->mean, 4, 0, 1) && are_in_range(p->linear, 3, 0, 1)));
    return sound ? NULL : "it has a picture that cannot be read";
}

/* Within what scenes may have. */
static bool is_map(const shd_model *model, const shd_model_map *map) {
    return map->picture <= model->pictures.count && map->wrap <= SHD_MODEL_MIRROR &&
           are_in_range(map->scale, 2, -1e9f, 1e9f) && are_in_range(map->offset, 2, -1e9f, 1e9f) &&
           are_in_range(&map->rotate, 1, -1e9f, 1e9f);
}

static const char *blame_material(const shd_model *model, const shd_model_material *m) {
    if (!lies_within(model, m->name, 1) || m->kind > SHD_MODEL_GLOSSY)
        return "it has a material that cannot be read";
    for (size_t k = 0; k < SHD_MAP_KINDS; k++)
        if (!is_map(model, &m->maps[k]))
            return "it has a material whose picture has no sound place";
    const shd_model_map *normals = &m->maps[SHD_MAP_NORMAL];
    if (normals->picture && !are_in_range(&normals->bump, 1, -1000, 1000))
        return "it has a picture of normals whose scale is beyond 1000";
    const bool sound = is_color(m->ambient) && is_color(m->diffuse) && is_color(m->specular) &&
                       is_color(m->emissive) && is_color(m->through) && m->shininess >= 0 &&
                       m->shininess <= 1e9f && m->opacity >= 0 && m->opacity <= 1 &&
                       isfinite(m->ior) && m->metallic >= 0 && m->metallic <= 1 &&
                       m->roughness >= 0 && m->roughness <= 1 && m->transmission >= 0 &&
                       m->transmission <= 1 && m->cutoff >= 0 && m->cutoff <= 1e6f &&
                       m->occlusion >= 0 && m->occlusion <= 1;
    return sound ? NULL : "it has a material with a number that is out of range";
}

static const char *blame_rest(const shd_model *model) {
    const shd_model_object *objects = shd_span_items(model, model->objects);
    for (size_t i = 0; i < model->objects.count; i++)
        if (!lies_within(model, objects[i].name, 1) || objects[i].mesh >= model->meshes.count ||
            !are_finite(objects[i].matrix, 16))
            return "it has an object that cannot be read";
    const shd_model_camera *cameras = shd_span_items(model, model->cameras);
    for (size_t i = 0; i < model->cameras.count; i++)
        if (!lies_within(model, cameras[i].name, 1) || !are_finite(cameras[i].position, 12))
            return "it has a camera that cannot be read";
    const shd_model_light *lights = shd_span_items(model, model->lights);
    for (size_t i = 0; i < model->lights.count; i++)
        if (!lies_within(model, lights[i].name, 1) || lights[i].type > SHD_MODEL_SPOT ||
            !are_finite(lights[i].position, 11))
            return "it has a light that cannot be read";
    return NULL;
}

static const char *blame_model(const shd_model *model, size_t size) {
    static const char broken[] = "the importer's answer is broken";
    if (size < sizeof *model || memcmp(model->magic, SHD_MODEL_MAGIC, 8) || model->size != size ||
        !memchr(model->failure, 0, sizeof model->failure))
        return broken;
    if (*model->failure) return model->failure;
    if (!lies_within(model, model->pictures, sizeof(shd_model_picture)) ||
        !lies_within(model, model->meshes, sizeof(shd_model_mesh)) ||
        !lies_within(model, model->materials, sizeof(shd_model_material)) ||
        !lies_within(model, model->objects, sizeof(shd_model_object)) ||
        !lies_within(model, model->cameras, sizeof(shd_model_camera)) ||
        !lies_within(model, model->lights, sizeof(shd_model_light)) ||
        !lies_within(model, model->losses, 1))
        return broken;
    const shd_model_picture *pictures = shd_span_items(model, model->pictures);
    const shd_model_mesh *meshes = shd_span_items(model, model->meshes);
    const shd_model_material *materials = shd_span_items(model, model->materials);
    const char *why = NULL;
    for (size_t i = 0; i < model->pictures.count && !why; i++)
        why = blame_picture(model, &pictures[i]);
    for (size_t i = 0; i < model->materials.count && !why; i++)
        why = blame_material(model, &materials[i]);
    for (size_t i = 0; i < model->meshes.count && !why; i++) why = blame_mesh(model, &meshes[i]);
    return why ? why : blame_rest(model);
}

shd_status shd_model_check(const void *block, size_t size, shd_error *error) {
    const char *why = blame_model(block, size);
    return why ? shd_fail(error, SHD_SCENE, "", "%s", why) : SHD_OK;
}

bool shd_mesh_has_normals(const shd_model *model, const shd_model_mesh *mesh) {
    const float *n = shd_span_items(model, mesh->normals);
    for (size_t i = 0; i < mesh->normals.count; i += 3)
        if (!isfinite(n[i]) || !isfinite(n[i + 1]) || !isfinite(n[i + 2]) ||
            (n[i] == 0 && n[i + 1] == 0 && n[i + 2] == 0))
            return false;
    return mesh->normals.count > 0;
}

bool shd_mesh_has_uvs(const shd_model *model, const shd_model_mesh *mesh) {
    return mesh->uvs.count > 0 && floats_are_finite(model, mesh->uvs);
}
