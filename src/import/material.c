#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/transfer.h"
#include "import/import.h"

/* Below this, glTF's lobe is narrower than a pixel on any picture. */
#define LEAST_ALPHA 1e-3

static void copy(double out[3], const float in[3]) {
    for (int c = 0; c < 3; c++) out[c] = in[c];
}

static shd_import_material plain_material(void) {
    return (shd_import_material){.light = {.model = SHD_NATIVE_PHONG}, .opacity = 1, .ior = 1.5};
}

/* Fits `foreign`; what has no lobe is Phong's in any case. */
static void fit(shd_import_material *m, shd_native_model model) {
    const size_t lobes = m->foreign.kind == SHD_FOREIGN_GLTF ? SHD_FIT_LOBES : 1;
    shd_fit(&m->foreign, model, lobes, &m->light);
    if (m->light.lobe_count == 0) m->light.model = SHD_NATIVE_PHONG;
    m->is_fit = m->light.lobe_count > 0 &&
                !(m->foreign.kind == SHD_FOREIGN_BLINN && model == SHD_NATIVE_BLINN_PHONG);
}

/* ---- MTL ---- */

/* By the models of illumination of Alias|Wavefront's "Advanced Visualizer" manual, appendix B4: the
 * highlight is (N.H)^Ns. */
static void take_mtl(const shd_model_material *from, bool phong, shd_import_material *out) {
    const int illum = from->kind == SHD_MODEL_MTL ? from->illum : from->shininess > 0 ? 2 : 1;
    const bool mirrors = (illum >= 3 && illum <= 7), refracts = illum == 6 || illum == 7;
    copy(out->ambient, from->kind == SHD_MODEL_MTL ? from->ambient : from->diffuse);
    copy(out->emissive, from->emissive);
    out->opacity = from->opacity;
    if (illum == 0) { /* a color, whatever the light */
        for (int c = 0; c < 3; c++) {
            out->emissive[c] += from->diffuse[c];
            out->ambient[c] = 0;
        }
        return;
    }
    out->foreign = (shd_foreign){.kind = SHD_FOREIGN_BLINN, .shape = from->shininess};
    copy(out->foreign.diffuse, from->diffuse);
    if (illum != 1) copy(out->foreign.specular, from->specular);
    fit(out, phong ? SHD_NATIVE_PHONG : SHD_NATIVE_BLINN_PHONG);
    for (int c = 0; c < 3; c++) {
        const double ks = fmin(from->specular[c], 1);
        if (mirrors) out->reflection[c] = ks;
        if (refracts) out->transmission[c] = (1 - ks) * fmin(from->through[c], 1);
    }
    if (refracts && from->ior > 0) out->ior = from->ior;
}

/* ---- glTF ---- */

static double alpha_of(double roughness) {
    return fmax(roughness * roughness, LEAST_ALPHA);
}

/* `f0` of what is no metal. */
static void take_metal_rough(const double base[3], double metallic, double roughness, double f0,
                             bool phong, shd_import_material *out) {
    out->foreign = (shd_foreign){.kind = SHD_FOREIGN_GLTF, .shape = alpha_of(roughness)};
    for (int c = 0; c < 3; c++) {
        const double color = fmin(base[c], 1);
        out->foreign.diffuse[c] = color * (1 - metallic);
        out->foreign.specular[c] = f0 + (color - f0) * metallic;
        out->ambient[c] = color; /* what surroundings of one color would show */
    }
    fit(out, phong ? SHD_NATIVE_PHONG : SHD_NATIVE_COOK_TORRANCE);
}

static void take_gltf(const shd_model_material *from, bool phong, shd_import_material *out) {
    double base[3];
    copy(base, from->diffuse);
    copy(out->emissive, from->emissive);
    out->opacity = from->opacity;
    if (from->unlit) {
        copy(out->emissive, from->diffuse);
        return;
    }
    const double ior = from->ior >= 1 ? from->ior : 1.5, root = (ior - 1) / (ior + 1);
    take_metal_rough(base, from->metallic, from->roughness, root * root, phong, out);
    const double through = from->transmission * (1 - from->metallic);
    for (int c = 0; c < 3; c++) {
        out->transmission[c] = through * fmin(base[c], 1);
        out->light.diffuse[c] *= 1 - through;
        out->foreign.diffuse[c] *= 1 - through;
    }
    out->ior = ior;
}

/* KHR_materials_pbrSpecularGlossiness: both colors are given, and the greater part of the one is
 * missing from the other. */
static void take_glossy(const shd_model_material *from, bool phong, shd_import_material *out) {
    out->opacity = from->opacity;
    copy(out->emissive, from->emissive);
    copy(out->ambient, from->diffuse);
    out->foreign = (shd_foreign){.kind = SHD_FOREIGN_GLTF, .shape = alpha_of(from->roughness)};
    const double most = fmax(from->specular[0], fmax(from->specular[1], from->specular[2]));
    for (int c = 0; c < 3; c++) {
        out->foreign.diffuse[c] = from->diffuse[c] * (1 - fmin(most, 1));
        out->foreign.specular[c] = fmin(from->specular[c], 1);
    }
    fit(out, phong ? SHD_NATIVE_PHONG : SHD_NATIVE_COOK_TORRANCE);
}

void shd_import_material_of(const shd_model_material *from, bool phong, shd_import_material *out) {
    *out = plain_material();
    if (from->kind == SHD_MODEL_METAL_ROUGH)
        take_gltf(from, phong, out);
    else if (from->kind == SHD_MODEL_GLOSSY)
        take_glossy(from, phong, out);
    else
        take_mtl(from, phong, out);
}

/* ---- three.js ---- */

/* Numbers of files are not to be trusted. */
static double number_of(const json_t *tree, const char *key, double usual, double most) {
    const json_t *value = json_object_get(tree, key);
    const double number = json_is_number(value) ? json_number_value(value) : usual;
    return number >= 0 && number <= most ? number : usual;
}

/* A color is an integer, 0xrrggbb, whose channels are encoded as in sRGB. */
static void color_of(const json_t *tree, const char *key, unsigned usual, double out[3]) {
    const unsigned code = (unsigned)number_of(tree, key, usual, 0xffffff);
    for (int c = 0; c < 3; c++)
        out[c] = shd_curve_decode(SHD_TRANSFER_SRGB, (code >> (16 - 8 * c) & 255) / 255.0);
}

static void list_maps(json_t *tree, char maps[256]) {
    const char *key;
    json_t *value;
    *maps = 0;
    json_object_foreach(tree, key, value) {
        const size_t length = strlen(key), used = strlen(maps);
        if (length < 3 || !json_is_string(value) || used + length + 3 > 256) continue;
        if (strcasecmp(key + length - 3, "map")) continue;
        snprintf(maps + used, 256 - used, "%s%s", used ? ", " : "", key);
    }
}

static shd_status take_three(json_t *tree, bool phong, shd_import_material *out, shd_error *error) {
    const char *type = json_string_value(json_object_get(tree, "type"));
    double color[3], emissive[3];
    if (!type) return shd_fail(error, SHD_SCENE, "/type", "it is no material of three.js");
    color_of(tree, "color", 0xffffff, color);
    color_of(tree, "emissive", 0, emissive);
    const double glow = number_of(tree, "emissiveIntensity", 1, 1e6);
    for (int c = 0; c < 3; c++) out->emissive[c] = emissive[c] * glow;
    if (json_is_true(json_object_get(tree, "transparent")))
        out->opacity = number_of(tree, "opacity", 1, 1);
    if (!strcmp(type, "MeshStandardMaterial") || !strcmp(type, "MeshPhysicalMaterial")) {
        const double metal = number_of(tree, "metalness", 0, 1),
                     rough = number_of(tree, "roughness", 1, 1);
        take_metal_rough(color, metal, rough, 0.04, phong, out);
        return SHD_OK;
    }
    const bool shines = !strcmp(type, "MeshPhongMaterial");
    if (!shines && strcmp(type, "MeshLambertMaterial"))
        return shd_fail(error, SHD_SCENE, "/type",
                        "a %.40s is not known: there is MeshPhongMaterial, MeshLambertMaterial and "
                        "MeshStandardMaterial",
                        type);
    out->foreign =
        (shd_foreign){.kind = SHD_FOREIGN_THREE, .shape = number_of(tree, "shininess", 30, 1e5)};
    for (int c = 0; c < 3; c++) out->foreign.diffuse[c] = out->ambient[c] = color[c];
    if (shines) color_of(tree, "specular", 0x111111, out->foreign.specular);
    fit(out, phong ? SHD_NATIVE_PHONG : SHD_NATIVE_BLINN_PHONG);
    return SHD_OK;
}

shd_status shd_import_three(const char *json, size_t length, bool phong, char name[64],
                            char maps[256], shd_import_material *out, shd_error *error) {
    json_error_t wrong;
    json_t *tree = json_loadb(json, length, JSON_REJECT_DUPLICATES, &wrong);
    *out = plain_material();
    if (!json_is_object(tree)) {
        json_decref(tree);
        return shd_fail(error, SHD_SCENE, "", "%s", tree ? "it is no object" : wrong.text);
    }
    const char *given = json_string_value(json_object_get(tree, "name"));
    snprintf(name, 64, "%s", given && *given ? given : "material");
    list_maps(tree, maps);
    const shd_status status = take_three(tree, phong, out, error);
    json_decref(tree);
    return status;
}
