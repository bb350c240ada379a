#include "import/gltf.h"

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>

#include "import/files.h"

enum { HEAD = 20, SIZE_MOST = 1 << 29 };

static uint32_t get_u32(const unsigned char *from) {
    return from[0] | (uint32_t)from[1] << 8 | (uint32_t)from[2] << 16 | (uint32_t)from[3] << 24;
}

/* The length of the text where the file stands. A .glb is a head of 12 bytes, and chunks: their
 * length, "JSON", and the text first. */
static size_t find_text(FILE *file) {
    unsigned char head[HEAD];
    const size_t got = fread(head, 1, sizeof head, file);
    if (got == HEAD && !memcmp(head, "glTF", 4))
        return memcmp(head + 16, "JSON", 4) ? 0 : get_u32(head + 12);
    if (fseek(file, 0, SEEK_END)) return 0;
    const long size = ftell(file);
    rewind(file);
    return size > 0 ? (size_t)size : 0;
}

bool shd_gltf_is_whole(const char *path) {
    FILE *file = shd_open_regular(path);
    unsigned char head[HEAD];
    struct stat info;
    const bool is_glb = file && fread(head, 1, sizeof head, file) == HEAD &&
                        !memcmp(head, "glTF", 4) && !fstat(fileno(file), &info);
    const bool is_whole = !is_glb || get_u32(head + 12) <= (uint64_t)info.st_size - HEAD;
    if (file) fclose(file);
    return is_whole;
}

json_t *shd_gltf_open(const char *path) {
    const char *suffix = strrchr(path, '.');
    if (!suffix || (strcasecmp(suffix, ".gltf") && strcasecmp(suffix, ".glb"))) return NULL;
    FILE *file = shd_open_regular(path);
    if (!file) return NULL;
    const size_t size = find_text(file);
    char *text = size > 0 && size <= SIZE_MOST ? malloc(size) : NULL;
    json_t *document = NULL;
    if (text && fread(text, 1, size, file) == size) document = json_loadb(text, size, 0, NULL);
    free(text);
    fclose(file);
    return document;
}

static const json_t *extension(const json_t *of, const char *name) {
    return json_object_get(json_object_get(of, "extensions"), name);
}

static double strength_of(const json_t *material) {
    const json_t *strength =
        json_object_get(extension(material, "KHR_materials_emissive_strength"), "emissiveStrength");
    return json_is_number(strength) ? json_number_value(strength) : 1;
}

bool shd_gltf_strength(const json_t *document, const char *name, float *out) {
    const json_t *materials = json_object_get(document, "materials");
    bool found = false;
    *out = 1;
    for (size_t i = 0; i < json_array_size(materials); i++) {
        const json_t *material = json_array_get(materials, i);
        const char *called = json_string_value(json_object_get(material, "name"));
        if (strcmp(called ? called : "", name) != 0) continue;
        const float strength = (float)strength_of(material);
        if (found && strength != *out) return false;
        *out = strength;
        found = true;
    }
    return true;
}

size_t shd_gltf_ranges(const json_t *document) {
    const json_t *lights = json_object_get(extension(document, "KHR_lights_punctual"), "lights");
    size_t count = 0;
    for (size_t i = 0; i < json_array_size(lights); i++)
        count += json_object_get(json_array_get(lights, i), "range") != NULL;
    return count;
}

static bool is_taken(const char *name) {
    static const char *const taken[] = {
        "KHR_lights_punctual",        "KHR_materials_emissive_strength",
        "KHR_materials_ior",          "KHR_materials_pbrSpecularGlossiness",
        "KHR_materials_transmission", "KHR_materials_unlit",
        "KHR_mesh_quantization",      "KHR_texture_transform"};
    for (size_t i = 0; i < sizeof taken / sizeof *taken; i++)
        if (!strcmp(name, taken[i])) return true;
    return false;
}

/* Of all primitives: those that are no triangles, have a further set of coordinates, and move. */
static void count_primitives(const json_t *document, size_t *thin, size_t *moving) {
    size_t m, p;
    json_t *mesh, *primitive;
    json_array_foreach(json_object_get(document, "meshes"), m, mesh) {
        json_array_foreach(json_object_get(mesh, "primitives"), p, primitive) {
            const json_t *mode = json_object_get(primitive, "mode");
            *thin += json_is_integer(mode) && json_integer_value(mode) < 4;
            *moving += json_array_size(json_object_get(primitive, "targets")) > 0;
        }
    }
}

void shd_gltf_losses(const json_t *document, shd_losses *losses) {
    static const char *const moves[] = {"animations", "skins"};
    size_t i, thin = 0, moving = 0;
    json_t *name;
    json_array_foreach(json_object_get(document, "extensionsUsed"), i, name) {
        const char *text = json_string_value(name);
        if (text && !is_taken(text)) shd_lose(losses, "what %s says is left out", text);
    }
    for (i = 0; i < sizeof moves / sizeof *moves; i++) {
        const size_t count = json_array_size(json_object_get(document, moves[i]));
        if (count) shd_lose(losses, "its %zu %s are left out", count, moves[i]);
    }
    count_primitives(document, &thin, &moving);
    if (thin) shd_lose(losses, "%zu parts of points and lines are left out", thin);
    if (moving) shd_lose(losses, "%zu parts stand without their morph targets", moving);
}
