/* What materials take of pictures. */
#include <math.h>
#include <string.h>

#include "base/format.h"
#include "import/writing.h"

/* ---- What is left out ---- */

static const char *const uses[] = {
    [SHD_MAP_AMBIENT] = "ambient color",   [SHD_MAP_DIFFUSE] = "diffuse color",
    [SHD_MAP_SPECULAR] = "specular color", [SHD_MAP_EMISSIVE] = "emissive color",
    [SHD_MAP_OPACITY] = "opacity",         [SHD_MAP_NORMAL] = "normals",
    [SHD_MAP_GLOSS] = "exponents",         [SHD_MAP_METAL_ROUGH] = "metal and roughness",
    [SHD_MAP_OCCLUSION] = "occlusion",     [SHD_MAP_BENEATH] = "base color",
    [SHD_MAP_MIRRORED] = "metal"};

static const shd_model_picture *picture_of(const shd_scene_writer *w, const shd_model_map *map) {
    const shd_model_picture *pictures = shd_span_items(w->model, w->model->pictures);
    return map->picture ? &pictures[map->picture - 1] : NULL;
}

static shd_format format_of(const shd_scene_writer *w, const shd_model_picture *picture) {
    return shd_format_sniff(shd_span_items(w->model, picture->bytes), picture->bytes.count);
}

static void note_picture(const shd_scene_writer *w, const char *material, shd_span name,
                         const char *text) {
    shd_plain_name plain;
    const shd_raw_name raw = {shd_span_items(w->model, name), name.count};
    if (shd_plain_names(&raw, 1, "", &plain))
        shd_import_note(w->options, "material \"%s\": %s: %s", material, text, plain.text);
}

/* Why a picture cannot be taken; NULL: it can. */
static const char *find_obstacle(const shd_scene_writer *w, size_t material,
                                 const shd_model_map *map, const shd_model_picture *picture) {
    if (!picture->bytes.count) return "it cannot be read";
    const shd_format format = format_of(w, picture);
    if (format == SHD_FORMAT_COUNT) return "it has no format that is read here";
    if (!picture->measured && !shd_format_takes_oiio(format)) return "it is damaged or too large";
    if (!w->options->picture) return "there is no --assets FOLDER for it";
    if (w->material_bare[material]) return "a mesh has no coordinates for it";
    if (map->channel) return "it follows other coordinates than the first";
    if (map->uneven) return "it goes on in one way across and in another one up";
    return NULL;
}

/* ---- Means ---- */

/* Multiplies a color by what its picture is in the mean. */
static void take_mean(const shd_model_picture *picture, float color[3], double mean[3]) {
    for (int c = 0; c < 3; c++) {
        const float part = picture->measured ? picture->linear[c] : 1;
        mean[c] = (double)part;
        color[c] *= part;
    }
}

/* Whether metal has pictures that can be taken. */
static bool has_made_metal(const shd_scene_writer *w, size_t material,
                           const shd_model_material *from) {
    const shd_model_map *map = &from->maps[SHD_MAP_MIRRORED];
    const shd_model_picture *picture = picture_of(w, map);
    return picture && !from->unlit && !w->options->phong &&
           !find_obstacle(w, material, map, picture);
}

static void take_metal_rough(const shd_scene_writer *w, size_t material, const char *name,
                             shd_model_material *m) {
    char text[160];
    const shd_model_map *map = &m->maps[SHD_MAP_METAL_ROUGH];
    const shd_model_picture *picture = picture_of(w, map);
    if (!picture) return;
    if (picture->measured) {
        m->roughness *= picture->mean[1];
        m->metallic *= picture->mean[2];
    }
    if (has_made_metal(w, material, m))
        snprintf(text, sizeof text,
                 "its metal makes pictures of what mirrors and what does not, and its roughness is "
                 "left out but for its mean, %.2f",
                 (double)m->roughness);
    else
        snprintf(text, sizeof text,
                 "the picture of its metal and roughness is left out, %s: %.2f and %.2f",
                 picture->measured ? "but for what they are in the mean" : "which cannot be read",
                 (double)m->metallic, (double)m->roughness);
    note_picture(w, name, picture->name, text);
}

/* ---- Materials ---- */

static bool mirrors_base(const shd_model_material *from) {
    return from->kind == SHD_MODEL_METAL_ROUGH && from->metallic > 0.5f;
}

/* Whether it shows one color, whatever the light. */
static bool glows(const shd_model_material *from) {
    return from->unlit || (from->kind == SHD_MODEL_MTL && !from->illum);
}

/* Which of our coefficients follow the picture of a color of the file. */
static void give_texture(const shd_model_material *from, shd_model_map_kind kind,
                         const shd_import_texture *texture, shd_import_material *out) {
    if (kind == SHD_MAP_OPACITY) {
        const bool alpha = texture->picture->measured && texture->picture->mean[3] < 1;
        out->textures[kind] = *texture;
        out->textures[kind].channel = alpha ? 'A' : 'R';
        return;
    }
    if (kind == SHD_MAP_DIFFUSE && from->cut_out && from->opacity > 0 &&
        texture->picture->measured && texture->picture->mean[3] < 1) {
        out->textures[SHD_MAP_OPACITY] = *texture;
        out->textures[SHD_MAP_OPACITY].channel = 'A';
    }
    if (glows(from)) {
        if (kind == SHD_MAP_DIFFUSE) out->textures[SHD_MAP_EMISSIVE] = *texture;
        return;
    }
    out->textures[kind] = *texture;
    if (kind != SHD_MAP_DIFFUSE) return;
    if (from->kind != SHD_MODEL_MTL) out->textures[SHD_MAP_AMBIENT] = *texture;
    if (mirrors_base(from)) out->textures[SHD_MAP_SPECULAR] = *texture;
}

/* Whether the base color is rather that of what is beneath the facets. */
static bool shows_beneath(const shd_model_material *from) {
    const float most = fmaxf(from->specular[0], fmaxf(from->specular[1], from->specular[2]));
    return from->kind == SHD_MODEL_METAL_ROUGH ? !mirrors_base(from)
                                               : from->kind == SHD_MODEL_GLOSSY && most < 0.5f;
}

/* What rough facets scatter, which is part of the fit's diffuse color, does not follow the base
 * color: where a picture is to be what is beneath, lobes are fitted that do without. */
static void leave_beneath(const shd_model_material *from, shd_import_material *out) {
    if (!out->textures[SHD_MAP_DIFFUSE].map || !shows_beneath(from)) return;
    if (out->light.model != SHD_NATIVE_COOK_TORRANCE) return;
    out->foreign.is_pictured = true;
    shd_fit(&out->foreign, SHD_NATIVE_COOK_TORRANCE, SHD_FIT_LOBES, &out->light);
}

/* What rough facets scatter is in the fit's diffuse color and does not follow the base color, nor
 * does what mirrors and is no metal: where a picture is bright, the factor would make more of it
 * than the fit makes of white. */
static void hold_colors(const shd_model_material *from, bool phong, shd_import_material *out) {
    shd_model_material white = *from;
    shd_import_material most;
    if (from->kind == SHD_MODEL_MTL || !out->textures[SHD_MAP_DIFFUSE].map) return;
    if (out->foreign.is_pictured) return; /* it is the factor that is beneath */
    for (int c = 0; c < 3; c++) white.diffuse[c] = 1;
    shd_import_material_of(&white, phong, &most);
    memcpy(out->textures[SHD_MAP_DIFFUSE].most, most.light.diffuse, sizeof most.light.diffuse);
    if (from->kind == SHD_MODEL_METAL_ROUGH && out->light.model == SHD_NATIVE_COOK_TORRANCE)
        memcpy(out->textures[SHD_MAP_SPECULAR].most, most.light.specular,
               sizeof most.light.specular);
}

/* A reflectance has an end, which only pictures whose codes are known are sure to keep. */
static void hold_facets(shd_import_material *out) {
    shd_import_texture *mirrored = &out->textures[SHD_MAP_SPECULAR];
    if (!mirrored->map || out->light.model != SHD_NATIVE_COOK_TORRANCE) return;
    if (!mirrored->picture->measured) mirrored->map = NULL;
    for (int c = 0; c < 3; c++) mirrored->most[c] = fmin(mirrored->most[c], 1);
}

/* Metal and what is none on one picture: what was made of both takes the place of the base color.
 */
static void take_metal(const shd_scene_writer *w, size_t material, const shd_model_material *from,
                       shd_import_material *out) {
    static const shd_model_map_kind kinds[] = {SHD_MAP_BENEATH, SHD_MAP_MIRRORED};
    static const shd_model_map_kind places[] = {SHD_MAP_DIFFUSE, SHD_MAP_SPECULAR};
    if (out->light.model != SHD_NATIVE_COOK_TORRANCE || !has_made_metal(w, material, from)) return;
    for (int k = 0; k < 2; k++) {
        const shd_model_map *map = &from->maps[kinds[k]];
        out->textures[places[k]] =
            (shd_import_texture){.map = map, .picture = picture_of(w, map), .is_made = true};
    }
}

/* Looks at the picture of one use: it is taken, or leaves its mean in `color` (NULL: it is of no
 * color). */
static void consider_map(const shd_scene_writer *w, size_t material, const char *name,
                         shd_model_map_kind kind, float *color, const shd_model_material *from,
                         shd_import_texture *out) {
    const shd_model_map *map = &from->maps[kind];
    const shd_model_picture *picture = picture_of(w, map);
    char text[160];
    double mean[3] = {1, 1, 1}, factor[3] = {1, 1, 1};
    if (!picture) return;
    for (int c = 0; color && c < 3; c++) factor[c] = (double)color[c];
    if (color) take_mean(picture, color, mean);
    const char *why = find_obstacle(w, material, map, picture);
    if (!why && glows(from) && kind != SHD_MAP_DIFFUSE && kind != SHD_MAP_OPACITY)
        why = "no light changes its color";
    if (!why) {
        *out = (shd_import_texture){.map = map,
                                    .picture = picture,
                                    .mean = {mean[0], mean[1], mean[2]},
                                    .factor = {factor[0], factor[1], factor[2]},
                                    .most = {HUGE_VAL, HUGE_VAL, HUGE_VAL}};
        return;
    }
    if (kind == SHD_MAP_OPACITY && from->cutoff > 0) return; /* its base color's is told */
    snprintf(text, sizeof text, "the picture of its %s is left out%s, because %s", uses[kind],
             color && picture->measured ? " but for its mean" : "", why);
    note_picture(w, name, picture->name, text);
}

/* MTL's picture of exponents: they follow it, or `exponent` has its mean. */
static void take_gloss(const shd_scene_writer *w, size_t material, const char *name,
                       const shd_model_material *from, float *exponent, shd_import_texture *out) {
    const shd_model_map *map = &from->maps[SHD_MAP_GLOSS];
    const shd_model_picture *picture = picture_of(w, map);
    const bool shines =
        from->illum > 1 && from->specular[0] + from->specular[1] + from->specular[2] > 0;
    char text[160];
    if (!picture) return;
    const char *why = find_obstacle(w, material, map, picture);
    if (!why && !shines) why = "it has no highlight";
    if (!why && !(from->shininess > 1)) why = "its Ns is not above 1";
    if (!why) {
        *out = (shd_import_texture){.map = map, .picture = picture, .channel = 'R'};
        return;
    }
    const bool mean = picture->measured && shines;
    if (mean) *exponent *= picture->mean[0];
    snprintf(text, sizeof text, "the picture of its %s is left out%s, because %s",
             uses[SHD_MAP_GLOSS], mean ? " but for its mean" : "", why);
    note_picture(w, name, picture->name, text);
}

/* What pictures cannot do that were taken, or not. */
static void tell_losses(const shd_scene_writer *w, const char *name, const shd_model_material *from,
                        const shd_import_material *made) {
    const shd_import_texture *mirrored = &made->textures[SHD_MAP_SPECULAR];
    if (mirrored->picture && !mirrored->map)
        note_picture(w, name, mirrored->picture->name,
                     "what it mirrors has the mean color of its picture");
    const shd_model_picture *base = picture_of(w, &from->maps[SHD_MAP_DIFFUSE]);
    const bool clear = made->textures[SHD_MAP_OPACITY].map;
    if (base && from->cut_out && base->measured && base->mean[3] < 1 && !clear)
        note_picture(w, name, base->name, "the alpha of its base color is left out");
    if (clear && from->opacity < 1)
        shd_import_note(w->options, "material \"%s\": the factor of its opacity, %.3g, is left out",
                        name, (double)from->opacity);
    if (clear && from->cutoff > 0 && !from->maps[SHD_MAP_OPACITY].picture)
        shd_import_note(
            w->options,
            "material \"%s\": what it cuts out below an alpha of %.3g fades by its alpha", name,
            (double)from->cutoff);
    if (from->strength_lost)
        shd_import_note(w->options,
                        "material \"%s\": its emissiveStrength is left out, because "
                        "another material has its name",
                        name);
}

/* glTF's picture of occlusion darkens the light of surroundings: the ambient color follows it, if
 * it follows no other picture, or has its mean. */
static void take_occlusion(const shd_scene_writer *w, size_t material, const char *name,
                           const shd_model_material *from, shd_import_material *out) {
    const shd_model_map *map = &from->maps[SHD_MAP_OCCLUSION];
    const shd_model_picture *picture = picture_of(w, map);
    shd_import_texture *ambient = &out->textures[SHD_MAP_AMBIENT];
    char text[160];
    if (!picture || from->unlit) return;
    const char *why = find_obstacle(w, material, map, picture);
    if (!why && ambient->map) why = "its ambient color follows another one";
    if (!why && from->occlusion < 1) why = "its strength is less than 1";
    if (!why) {
        *ambient = (shd_import_texture){.map = map,
                                        .picture = picture,
                                        .mean = {1, 1, 1},
                                        .most = {HUGE_VAL, HUGE_VAL, HUGE_VAL},
                                        .channel = 'R',
                                        .is_tinted = true};
        return;
    }
    const double mean = picture->measured ? (double)picture->mean[0] : 1;
    for (int c = 0; c < 3; c++) out->ambient[c] *= 1 + (double)from->occlusion * (mean - 1);
    snprintf(text, sizeof text, "the picture of its occlusion is left out%s, because %s",
             picture->measured ? " but for its mean" : "", why);
    note_picture(w, name, picture->name, text);
}

void shd_make_material(shd_scene_writer *w, size_t index, const char *name,
                       shd_import_material *out) {
    const shd_model_material *materials = shd_span_items(w->model, w->model->materials);
    const shd_model_material *from = &materials[index];
    shd_model_material even = *from;
    shd_import_texture taken[SHD_MAP_TAKEN] = {{.map = NULL}};
    float *const colors[SHD_MAP_COLORS] = {even.ambient, even.diffuse, even.specular,
                                           even.emissive};
    for (int kind = 0; kind < SHD_MAP_GLOSS; kind++)
        consider_map(w, index, name, (shd_model_map_kind)kind,
                     kind < SHD_MAP_COLORS ? colors[kind] : NULL, from, &taken[kind]);
    take_gloss(w, index, name, from, &even.shininess, &taken[SHD_MAP_GLOSS]);
    take_metal_rough(w, index, name, &even);
    shd_import_material_of(&even, w->options->phong, out);
    for (int kind = 0; kind < SHD_MAP_TAKEN; kind++)
        if (taken[kind].map) give_texture(&even, (shd_model_map_kind)kind, &taken[kind], out);
    if (!has_made_metal(w, index, from)) leave_beneath(&even, out);
    hold_colors(&even, w->options->phong, out);
    take_metal(w, index, from, out);
    hold_facets(out);
    take_occlusion(w, index, name, from, out);
    tell_losses(w, name, &even, out);
}

/* ---- Writing ---- */

/* Keeps the picture's file, once. */
static bool keep_picture(shd_scene_writer *w, const shd_import_texture *texture, char **digits) {
    const void *bytes = shd_span_items(w->model, texture->picture->bytes);
    const size_t size = texture->picture->bytes.count;
    shd_kept_picture *kept = &w->pictures[texture->map->picture - 1];
    *digits = kept->digits;
    if (*kept->digits) return true;
    const shd_digest digest = shd_digest_of(bytes, size);
    shd_digest_write(&digest, kept->digits);
    const char *suffix = shd_format_get(format_of(w, texture->picture))->name;
    w->cancelled = !w->options->picture(w->options->context, bytes, size, kept->digits, suffix);
    return !w->cancelled;
}

static void put_factor(shd_scene_writer *w, const shd_import_texture *texture,
                       const double rgb[3]) {
    double tint[3];
    for (int c = 0; c < 3; c++) /* what is black tells nothing of its factor */
        tint[c] = fmin(texture->mean[c] > 0 ? rgb[c] / texture->mean[c] : texture->factor[c],
                       texture->most[c]);
    if (texture->is_made) {
        fputs(", \"space\": \"sRGB\"", w->out);
        return;
    }
    if (texture->channel) /* numbers, whatever is said of colors in its file */
        fputs(", \"space\": \"lin_rec709\"", w->out);
    else if (!shd_format_get(format_of(w, texture->picture))->linear)
        fputs(", \"space\": \"sRGB\"", w->out);
    fputs(", \"tint\": ", w->out);
    shd_put_numbers(w->out, tint, 3);
}

/* Where on the surface the picture is. */
static void put_place(FILE *out, const shd_model_map *map) {
    static const char *const wraps[] = {
        [SHD_MODEL_REPEAT] = "repeat", [SHD_MODEL_CLAMP] = "clamp", [SHD_MODEL_MIRROR] = "mirror"};
    fprintf(out, ", \"uv\": {\"wrap\": \"%s\"", wraps[map->wrap]);
    if (map->scale[0] != 1 || map->scale[1] != 1) {
        fputs(", \"scale\": ", out);
        shd_put_floats(out, map->scale, 2);
    }
    if (map->rotate != 0) {
        fputs(", \"rotate\": ", out);
        shd_put_float(out, map->rotate);
    }
    if (map->offset[0] != 0 || map->offset[1] != 0) {
        fputs(", \"offset\": ", out);
        shd_put_floats(out, map->offset, 2);
    }
    fputs("}}", out);
}

bool shd_put_texture(shd_scene_writer *w, const shd_import_texture *texture, const double rgb[3]) {
    char *digits;
    if (!keep_picture(w, texture, &digits)) return false;
    fprintf(w->out, "{\"texture\": \"sha256-%s\"", digits);
    if (texture->channel) fprintf(w->out, ", \"channel\": \"%c\"", texture->channel);
    if (!texture->channel || texture->is_tinted) put_factor(w, texture, rgb);
    put_place(w->out, texture->map);
    return true;
}

bool shd_put_gloss(shd_scene_writer *w, const shd_import_texture *texture, double most) {
    char *digits;
    if (!keep_picture(w, texture, &digits)) return false;
    fprintf(w->out, "{\"texture\": \"sha256-%s\", \"channel\": \"%c\", \"values\": [1, %.6g]",
            digits, texture->channel, most);
    put_place(w->out, texture->map);
    return true;
}

bool shd_put_normals(shd_scene_writer *w, const shd_import_texture *texture) {
    char *digits;
    if (!keep_picture(w, texture, &digits)) return false;
    fprintf(w->out, "{\"texture\": \"sha256-%s\"", digits);
    if (texture->map->bump != 1) {
        fputs(", \"scale\": ", w->out);
        shd_put_float(w->out, texture->map->bump);
    }
    put_place(w->out, texture->map);
    return true;
}
