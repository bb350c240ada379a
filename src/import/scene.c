/* The scene document of a model. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/digest.h"
#include "base/vec3.h"
#include "import/writing.h"

/* ---- Materials ---- */

static bool is_all(const double rgb[3], double value) {
    return rgb[0] == value && rgb[1] == value && rgb[2] == value;
}

static void put_color(FILE *out, const char *key, const double rgb[3]) {
    fprintf(out, ", \"%s\": ", key);
    shd_put_numbers(out, rgb, 3);
}

/* A color, or the picture that it follows. */
static bool put_coefficient(shd_scene_writer *w, const shd_import_texture *texture,
                            const double rgb[3]) {
    if (texture->map) return shd_put_texture(w, texture, rgb);
    shd_put_numbers(w->out, rgb, 3);
    return true;
}

static bool put_shininess(shd_scene_writer *w, const shd_import_material *m, double shape) {
    const shd_import_texture *gloss = &m->textures[SHD_MAP_GLOSS];
    fputs(", \"shininess\": ", w->out);
    if (gloss->map && shape > 1) return shd_put_gloss(w, gloss, shape);
    fprintf(w->out, "%.6g", shape);
    return true;
}

/* What Phong and Blinn-Phong have: the first lobe apart from the rest. */
static bool put_lobes(shd_scene_writer *w, const shd_import_material *m) {
    const shd_native *light = &m->light;
    for (size_t k = 0; k < light->lobe_count; k++) {
        double color[3];
        for (int c = 0; c < 3; c++) color[c] = light->specular[c] * light->lobes[k].weight;
        fputs(k == 1 ? ", \"lobes\": [{" : k ? ", {" : ", ", w->out);
        fputs("\"specular\": ", w->out);
        if (!put_coefficient(w, &m->textures[SHD_MAP_SPECULAR], color)) return false;
        if (!put_shininess(w, m, light->lobes[k].shape)) return false;
        if (k) fputc('}', w->out);
    }
    if (light->lobe_count > 1) fputc(']', w->out);
    return true;
}

static bool put_facets(shd_scene_writer *w, const shd_import_material *m) {
    const shd_native *light = &m->light;
    FILE *out = w->out;
    fputs(", \"fresnel\": {\"f0\": ", out);
    if (!put_coefficient(w, &m->textures[SHD_MAP_SPECULAR], light->specular)) return false;
    fputs("}, \"lobes\": [", out);
    for (size_t k = 0; k < light->lobe_count; k++)
        fprintf(out, "%s{\"roughness\": %.6g, \"weight\": %.6g}", k ? ", " : "",
                light->lobes[k].shape, light->lobes[k].weight);
    fputc(']', out);
    return true;
}

/* MTL's mirrors have the color of the highlight. What glass transmits is what the mean of that
 * leaves: a picture could send on more than arrives. False: out of memory, or cancelled. */
static bool put_reflection(shd_scene_writer *w, const shd_import_material *m) {
    static const shd_import_texture none = {.map = NULL};
    const bool clear = !is_all(m->transmission, 0);
    if (is_all(m->reflection, 0)) return true;
    fputs(", \"reflection\": ", w->out);
    return put_coefficient(w, clear ? &none : &m->textures[SHD_MAP_SPECULAR], m->reflection);
}

/* False: out of memory, or cancelled. */
static bool put_material(shd_scene_writer *w, const shd_import_material *m) {
    static const char *const models[] = {[SHD_NATIVE_COOK_TORRANCE] = "cook-torrance",
                                         [SHD_NATIVE_BLINN_PHONG] = "blinn-phong",
                                         [SHD_NATIVE_PHONG] = "phong"};
    const struct {
        shd_model_map_kind kind;
        const char *key;
        const double *rgb;
        bool always;
    } colors[] = {{SHD_MAP_DIFFUSE, "diffuse", m->light.diffuse, true},
                  {SHD_MAP_AMBIENT, "ambient", m->ambient, true},
                  {SHD_MAP_EMISSIVE, "emissive", m->emissive, false}};
    FILE *out = w->out;
    fprintf(out, "{\"model\": \"%s\"", models[m->light.model]);
    for (int k = 0; k < 3; k++) {
        if (!colors[k].always && is_all(colors[k].rgb, 0)) continue;
        fprintf(out, ", \"%s\": ", colors[k].key);
        if (!put_coefficient(w, &m->textures[colors[k].kind], colors[k].rgb)) return false;
    }
    const bool facets = m->light.model == SHD_NATIVE_COOK_TORRANCE;
    if (!(facets ? put_facets : put_lobes)(w, m)) return false;
    if (m->textures[SHD_MAP_OPACITY].map) {
        fputs(", \"opacity\": ", out);
        if (!shd_put_texture(w, &m->textures[SHD_MAP_OPACITY], NULL)) return false;
    } else if (m->opacity < 1) {
        fprintf(out, ", \"opacity\": %.6g", m->opacity);
    }
    if (m->textures[SHD_MAP_NORMAL].map) {
        fputs(", \"normal\": ", out);
        if (!shd_put_normals(w, &m->textures[SHD_MAP_NORMAL])) return false;
    }
    if (!put_reflection(w, m)) return false;
    if (!is_all(m->transmission, 0)) {
        put_color(out, "transmission", m->transmission);
        fprintf(out, ", \"ior\": %.6g", m->ior);
    }
    fputc('}', out);
    return true;
}

static bool wants_rays(const shd_import_material *m) {
    return m->opacity < 1 || m->textures[SHD_MAP_OPACITY].map || !is_all(m->reflection, 0) ||
           !is_all(m->transmission, 0);
}

static void tell_fit(const shd_import_options *options, const char *name,
                     const shd_import_material *m) {
    static const char *const sources[] = {[SHD_FOREIGN_GLTF] = "glTF's metal and roughness",
                                          [SHD_FOREIGN_BLINN] = "MTL's Blinn-Phong",
                                          [SHD_FOREIGN_THREE] = "three.js's Blinn-Phong"};
    static const char *const targets[] = {[SHD_NATIVE_COOK_TORRANCE] = "Cook-Torrance",
                                          [SHD_NATIVE_BLINN_PHONG] = "Blinn-Phong",
                                          [SHD_NATIVE_PHONG] = "Phong"};
    if (!m->is_fit) return;
    const shd_fit_error apart = shd_fit_measure(&m->foreign, &m->light);
    shd_import_note(
        options,
        "material \"%s\": %s by %s: deltaE2000 %.2f in the mean, %.1f at most, on a lit sphere",
        name, sources[m->foreign.kind], targets[m->light.model], apart.mean, apart.most);
}

/* ---- Geometry ---- */

static void put_u32(unsigned char *to, uint32_t value) {
    for (int i = 0; i < 4; i++) to[i] = (unsigned char)(value >> 8 * i);
}

/* As PUT /v1/meshes has them: `flags` are 1 if it has normals, and 2 if it has uvs. */
static bool keep_mesh(shd_scene_writer *w, const shd_model_mesh *mesh, unsigned flags,
                      char digits[SHD_DIGEST_TEXT]) {
    const shd_span spans[] = {mesh->positions, mesh->normals, mesh->uvs, mesh->indices};
    const bool there[] = {true, flags & 1, flags & 2, true};
    size_t size = 12;
    for (int s = 0; s < 4; s++) size += there[s] ? 4 * spans[s].count : 0;
    unsigned char *bytes = malloc(size), *at = bytes + 12;
    if (!bytes) return false;
    put_u32(bytes, (uint32_t)(mesh->positions.count / 3));
    put_u32(bytes + 4, (uint32_t)mesh->indices.count);
    put_u32(bytes + 8, flags);
    for (int s = 0; s < 4; s++) {
        if (!there[s]) continue;
        const uint32_t *words = shd_span_items(w->model, spans[s]); /* floats' bits, too */
        for (size_t i = 0; i < spans[s].count; i++, at += 4) {
            uint32_t word;
            memcpy(&word, &words[i], 4);
            put_u32(at, word);
        }
    }
    const shd_digest digest = shd_digest_of(bytes, size);
    shd_digest_write(&digest, digits);
    w->cancelled = !w->options->keep(w->options->context, bytes, size, digits);
    free(bytes);
    return true;
}

static bool put_mesh(shd_scene_writer *w, const shd_model_mesh *mesh) {
    const bool normals = shd_mesh_has_normals(w->model, mesh),
               uvs = shd_mesh_has_uvs(w->model, mesh);
    if (w->options->keep) {
        char digits[SHD_DIGEST_TEXT];
        if (!keep_mesh(w, mesh, normals + 2u * uvs, digits)) return false;
        fprintf(w->out, "{\"data\": \"sha256-%s\"}", digits);
        return true;
    }
    fputs("{\"positions\": ", w->out);
    shd_put_floats(w->out, shd_span_items(w->model, mesh->positions), mesh->positions.count);
    if (normals) {
        fputs(", \"normals\": ", w->out);
        shd_put_floats(w->out, shd_span_items(w->model, mesh->normals), mesh->normals.count);
    }
    if (uvs) {
        fputs(", \"uvs\": ", w->out);
        shd_put_floats(w->out, shd_span_items(w->model, mesh->uvs), mesh->uvs.count);
    }
    const uint32_t *indices = shd_span_items(w->model, mesh->indices);
    fputs(", \"indices\": [", w->out);
    for (size_t i = 0; i < mesh->indices.count; i++)
        fprintf(w->out, "%s%u", i ? "," : "", indices[i]);
    fputs("]}", w->out);
    return true;
}

static bool has_inverse(const double m[16]) {
    const shd_vec3 x = {m[0], m[1], m[2]}, y = {m[4], m[5], m[6]}, z = {m[8], m[9], m[10]};
    const double volume = shd_dot(shd_cross(x, y), z),
                 sides = shd_length(x) * shd_length(y) * shd_length(z);
    return m[3] == 0 && m[7] == 0 && m[11] == 0 && m[15] == 1 && isnormal(sides) &&
           fabs(volume) > 1e-9 * sides;
}

static bool is_identity(const double m[16]) {
    for (int i = 0; i < 16; i++)
        if (m[i] != (i % 5 == 0)) return false;
    return true;
}

static void put_objects(shd_scene_writer *w) {
    const shd_model_object *objects = shd_span_items(w->model, w->model->objects);
    const shd_model_mesh *meshes = shd_span_items(w->model, w->model->meshes);
    bool first = true;
    fputs("  \"objects\": [", w->out);
    for (size_t i = 0; i < w->model->objects.count; i++) {
        const shd_model_object *o = &objects[i];
        if (!w->object_used[i]) continue;
        shd_plain_name name;
        const shd_raw_name raw = {shd_span_items(w->model, o->name), o->name.count};
        fputs(first ? "\n    {\"type\": \"mesh\"" : ",\n    {\"type\": \"mesh\"", w->out);
        first = false;
        if (shd_plain_names(&raw, 1, "object", &name)) {
            fputs(", \"name\": ", w->out);
            shd_put_text(w->out, name.text);
        }
        fputs(", \"mesh\": ", w->out);
        shd_put_text(w->out, w->meshes[o->mesh].text);
        fputs(", \"material\": ", w->out);
        shd_put_text(w->out, w->materials[meshes[o->mesh].material].text);
        if (!is_identity(o->matrix)) {
            fputs(", \"transform\": {\"matrix\": ", w->out);
            shd_put_numbers(w->out, o->matrix, 16);
            fputc('}', w->out);
        }
        fputc('}', w->out);
    }
    fputs("\n  ]\n}\n", w->out);
}

/* ---- The whole ---- */

/* What no object uses is not written. */
static void find_used(shd_scene_writer *w) {
    const shd_model_object *objects = shd_span_items(w->model, w->model->objects);
    const shd_model_mesh *meshes = shd_span_items(w->model, w->model->meshes);
    size_t flattened = 0;
    for (size_t i = 0; i < w->model->objects.count; i++) {
        w->object_used[i] = has_inverse(objects[i].matrix);
        flattened += !w->object_used[i];
        if (!w->object_used[i]) continue;
        const shd_model_mesh *mesh = &meshes[objects[i].mesh];
        if (!w->mesh_used[objects[i].mesh] && !shd_mesh_has_uvs(w->model, mesh))
            w->material_bare[mesh->material] = true;
        w->mesh_used[objects[i].mesh] = true;
        w->material_used[mesh->material] = true;
    }
    if (flattened)
        shd_import_note(w->options, "%zu objects are left out, whose transform has no inverse",
                        flattened);
}

/* False: out of memory, or cancelled. */
static bool put_materials(shd_scene_writer *w) {
    bool first = true;
    fputs("  \"materials\": {", w->out);
    for (size_t i = 0; i < w->model->materials.count; i++) {
        if (!w->material_used[i]) continue;
        shd_import_material made;
        const char *name = w->materials[i].text;
        shd_make_material(w, i, name, &made);
        fputs(first ? "\n    " : ",\n    ", w->out);
        first = false;
        shd_put_text(w->out, name);
        fputs(": ", w->out);
        if (!put_material(w, &made)) return false;
        w->rays |= wants_rays(&made);
        tell_fit(w->options, name, &made);
    }
    fputs("\n  },\n", w->out);
    return true;
}

static bool put_meshes(shd_scene_writer *w) {
    const shd_model_mesh *meshes = shd_span_items(w->model, w->model->meshes);
    bool first = true;
    fputs("  \"meshes\": {", w->out);
    for (size_t i = 0; i < w->model->meshes.count; i++) {
        if (!w->mesh_used[i]) continue;
        fputs(first ? "\n    " : ",\n    ", w->out);
        first = false;
        shd_put_text(w->out, w->meshes[i].text);
        fputs(": ", w->out);
        if (!put_mesh(w, &meshes[i])) return false;
        if (w->cancelled) return true;
        if (meshes[i].colored)
            shd_import_note(w->options, "mesh \"%s\": the colors of its vertices are left out",
                            w->meshes[i].text);
    }
    fputs("\n  },\n", w->out);
    return true;
}

/* The sentences of the importer, which a hostile file may have had any say in. */
static void tell_losses(const shd_scene_writer *w) {
    const char *text = shd_span_items(w->model, w->model->losses);
    size_t left = w->model->losses.count;
    while (left) {
        char line[320];
        const char *end = memchr(text, '\n', left);
        const size_t length = end ? (size_t)(end - text) : left;
        const size_t kept = length < sizeof line ? length : sizeof line - 1;
        for (size_t i = 0; i < kept; i++)
            line[i] = (unsigned char)text[i] < 0x20 || text[i] == 0x7f ? '_' : text[i];
        line[kept] = 0;
        shd_import_note(w->options, "%s", line);
        text += length + (end != NULL);
        left -= length + (end != NULL);
    }
}

static bool write_scene(shd_scene_writer *w) {
    find_used(w);
    tell_losses(w);
    fputs("{\n", w->out);
    shd_put_view(w);
    shd_put_lights(w);
    if (!put_materials(w)) return false;
    if (w->rays) fputs("  \"trace\": {\"depth\": 8},\n", w->out);
    if (!put_meshes(w)) return false;
    put_objects(w);
    return true;
}

/* Plain names of all meshes or materials, which begin with their names. */
static bool name_all(const shd_model *model, shd_span span, size_t size, const char *usual,
                     shd_plain_name *out) {
    shd_raw_name *raw = calloc(span.count + 1, sizeof *raw);
    const char *items = shd_span_items(model, span);
    for (size_t i = 0; raw && i < span.count; i++) {
        shd_span name;
        memcpy(&name, items + i * size, sizeof name);
        raw[i] = (shd_raw_name){shd_span_items(model, name), name.count};
    }
    const bool named = raw && shd_plain_names(raw, span.count, usual, out);
    free(raw);
    return named;
}

/* Ends the text. */
static shd_status finish(FILE *out, bool written, bool cancelled, char **json, shd_error *error) {
    const bool whole = out && !ferror(out) && written;
    const bool closed = out && !fclose(out);
    if (whole && closed && !cancelled) return SHD_OK;
    free(*json);
    *json = NULL;
    return cancelled ? shd_fail(error, SHD_CANCELLED, "", "files could not be written")
                     : shd_fail(error, SHD_EXHAUSTED, "", "out of memory");
}

shd_status shd_import_scene(const shd_model *model, const shd_import_options *options, char **json,
                            size_t *length, shd_error *error) {
    const size_t meshes = model->meshes.count, materials = model->materials.count;
    shd_scene_writer w = {.model = model,
                          .options = options,
                          .meshes = calloc(meshes + 1, sizeof *w.meshes),
                          .materials = calloc(materials + 1, sizeof *w.materials),
                          .mesh_used = calloc(meshes + 1, 1),
                          .material_used = calloc(materials + 1, 1),
                          .object_used = calloc(model->objects.count + 1, 1),
                          .material_bare = calloc(materials + 1, 1),
                          .pictures = calloc(model->pictures.count + 1, sizeof *w.pictures)};
    *json = NULL;
    w.out = open_memstream(json, length);
    const bool written =
        w.meshes && w.materials && w.mesh_used && w.material_used && w.object_used &&
        w.material_bare && w.pictures && w.out &&
        name_all(model, model->meshes, sizeof(shd_model_mesh), "mesh", w.meshes) &&
        name_all(model, model->materials, sizeof(shd_model_material), "material", w.materials) &&
        write_scene(&w);
    free(w.meshes);
    free(w.materials);
    free(w.mesh_used);
    free(w.material_used);
    free(w.object_used);
    free(w.material_bare);
    free(w.pictures);
    return finish(w.out, written, w.cancelled, json, error);
}

shd_status shd_import_sphere(const char *name, const shd_import_material *material,
                             const shd_import_options *options, char **json, size_t *length,
                             shd_error *error) {
    shd_plain_name plain;
    const shd_raw_name raw = {name, strlen(name)};
    *json = NULL;
    shd_scene_writer w = {.options = options, .out = open_memstream(json, length)};
    const bool written = w.out && shd_plain_names(&raw, 1, "material", &plain);
    if (written) {
        fputs("{\n  \"camera\": {\"position\": [0, 0, 4], \"fov\": 32},\n"
              "  \"lights\": [{\"type\": \"directional\", \"direction\": [-1, -1, -1]}],\n"
              "  \"materials\": {\n    ",
              w.out);
        shd_put_text(w.out, plain.text);
        fputs(": ", w.out);
        put_material(&w, material);
        fputs("\n  },\n", w.out);
        if (wants_rays(material)) fputs("  \"trace\": {\"depth\": 8},\n", w.out);
        fputs("  \"objects\": [{\"type\": \"sphere\", \"material\": ", w.out);
        shd_put_text(w.out, plain.text);
        fputs("}]\n}\n", w.out);
        tell_fit(options, plain.text, material);
    }
    return finish(w.out, written, false, json, error);
}
