/* Materials: written in `materials`, at an object, or taken from the library by name. */
#include <string.h>

#include "scene/library.h"
#include "scene/read_model.h"

typedef struct raw_lobe {
    shd_lobe lobe;
    const shd_curve *curve;     /* of its `specular` */
    const shd_texture *texture; /* the same */
    const shd_texture *gloss;   /* in place of its exponent or roughness */
} raw_lobe;

typedef struct raw_lobes {
    int model;  /* of the material: its lobes have the members that it has */
    bool given; /* even if there are none */
    const shd_lobe *lobes;
    size_t count;
    const shd_curve **curves; /* [count] */
    const shd_texture **textures, **gloss;
} raw_lobes;

typedef struct raw_material {
    int model, side;
    bool antialiased;
    double emissive[3], ambient[3], diffuse[3];
    shd_lobe first;
    raw_lobes further;
    double sigma;
    shd_fresnel fresnel;
    const shd_microgeometry *microgeometry;
    bool preset; /* the values of a preset are here */
    double opacity[3], reflection[3], transmission[3], ior;
    double alpha; /* of `diffuse`; negative: it has none */
    const shd_curve *emissive_curve, *ambient_curve, *diffuse_curve, *specular_curve;
    const shd_curve *opacity_curve, *reflection_curve, *transmission_curve;
    const shd_texture *emissive_texture, *ambient_texture, *diffuse_texture, *specular_texture;
    const shd_texture *opacity_texture, *reflection_texture, *transmission_texture, *normal_texture;
    const shd_texture *gloss; /* of the first lobe */
} raw_material;

/* ---- The library ---- */

/* Names for "did you mean": of `materials`, then of the library. */
static shd_hint suggest_material(shd_reader *r, const char *name, bool with_named) {
    enum { MOST = 512 };
    const char *names[MOST];
    size_t count = with_named ? shd_name_entries(&r->named, names, MOST / 2) : 0;
    const shd_node none = {0};
    const shd_library *library;
    shd_reach_library(r, &none, &library);
    for (size_t i = 0; i < shd_preset_count(library) && count < MOST; i++)
        names[count++] = shd_preset_at(library, i)->name;
    return shd_suggest(r->report, name, names, count);
}

static void read_own_members(shd_reader *r, const shd_node *node, int kind, raw_material *raw);

/* Reads an entry of the library as if it were written here, but for the space of its numbers. Its
 * errors were found when the library was read; what is left are those that come of the document's
 * working space. */
static void take_preset(shd_reader *r, const shd_node *node, const shd_library_entry *entry,
                        raw_material *raw) {
    const shd_reader outside = {.report = r->report,
                                .json = r->json,
                                .colors = r->colors,
                                .codes = r->codes,
                                .field = r->field};
    const shd_space_info *space = shd_catalog_space(r->catalog, "lin_rec709");
    const shd_node material = {.value = entry->material};
    shd_report problems;
    shd_report_init(&problems, r->arena);
    r->report = &problems;
    r->json = entry->json;
    r->colors = space ? space : r->scene->working_space;
    r->codes = entry->codes;
    r->in_library = true;
    read_own_members(r, &material, (int)entry->told.model, raw);
    r->report = outside.report;
    r->json = outside.json;
    r->colors = outside.colors;
    r->codes = outside.codes;
    r->in_library = false;
    r->field = outside.field;
    raw->preset = true;
    if (problems.status != SHD_OK)
        shd_node_report(r->report, node, problems.status, "the preset \"%s\": %s", entry->told.name,
                        problems.errors[0].detail);
}

static void read_preset(shd_reader *r, const shd_node *node, void *out) {
    const char *name = shd_get_text(r, node, "the name of a preset");
    const shd_library *library;
    if (!name || !shd_reach_library(r, node, &library)) return;
    const shd_library_entry *preset = shd_library_find(library, name);
    raw_material *raw = out;
    if (r->in_library)
        shd_wrong(r, node, "a material of the library has no preset itself");
    else if (preset && (int)preset->told.model != raw->model)
        shd_wrong(r, node, "the preset \"%s\" is a %s material, not %s", name,
                  shd_model_names[preset->told.model], shd_model_names[raw->model]);
    else if (preset)
        take_preset(r, node, preset, out);
    else
        shd_wrong(r, node, "there is no preset \"%s\"%s", shd_quote(name).text,
                  suggest_material(r, name, false).text);
}

/* ---- One material ---- */

static void read_lobes(shd_reader *r, const shd_node *node, void *out) {
    static const shd_field members[] = {
        {"specular", shd_read_coefficient, .offset = offsetof(raw_lobe, lobe.specular),
         .curve = offsetof(raw_lobe, curve), .texture = offsetof(raw_lobe, texture)},
        {"shininess", shd_read_shininess, offsetof(raw_lobe, lobe.shininess),
         .range = &shd_not_negative, .texture = offsetof(raw_lobe, gloss)},
    };
    raw_lobes *further = out;
    if (!shd_is_array(r, node, 0, SHD_LOBES_MOST, "an array of up to 64 lobes")) return;
    size_t count = json_array_size(node->value);
    if (count > SHD_LOBES_MOST) count = SHD_LOBES_MOST;
    shd_lobe *lobes = shd_take(r, count, sizeof *lobes);
    const shd_curve **curves = shd_take(r, count, sizeof *curves);
    const shd_texture **textures = shd_take(r, count, sizeof *textures);
    const shd_texture **gloss = shd_take(r, count, sizeof *gloss);
    if (!lobes || !curves || !textures || !gloss) return;
    for (size_t i = 0; i < count; i++) {
        shd_node lobe = shd_node_item(node, i);
        raw_lobe raw = {.lobe.shininess = 32};
        if (further->model == SHD_MODEL_COOK_TORRANCE)
            shd_read_facet_lobe(r, &lobe, &raw.lobe, &raw.gloss);
        else
            shd_read_fields(r, &lobe, members, SHD_LENGTH(members), 0, "a lobe", &raw);
        lobes[i] = raw.lobe;
        curves[i] = raw.curve;
        textures[i] = raw.texture;
        gloss[i] = raw.gloss;
    }
    further->given = true;
    further->lobes = lobes;
    further->count = count;
    further->curves = curves;
    further->textures = textures;
    further->gloss = gloss;
}

static const char *const sides[] = {"both", "front", NULL};

/* Its alpha is the opacity. One of 1 says nothing. */
static void read_diffuse(shd_reader *r, const shd_node *node, void *out) {
    raw_material *raw = (raw_material *)(void *)((char *)out - r->field->offset);
    if (json_is_object(node->value)) {
        shd_read_coefficient(r, node, out);
        return;
    }
    raw->diffuse_texture = NULL;
    shd_read_color_alpha(r, node, raw->diffuse, &raw->alpha);
    if (raw->alpha == 1) raw->alpha = -1;
}

enum { AMBIENT = 1, DIFFUSE = 2, MICRO = 4, OPACITY = 8 }; /* marks */

/* The kinds of materials, which are models and one more, as bits of shd_field.kinds. */
enum {
    SHINY = 1 << SHD_MODEL_PHONG | 1 << SHD_MODEL_BLINN_PHONG | 1 << SHD_MODEL_PHONG_NORMALIZED,
    FACETS = 1 << SHD_MODEL_COOK_TORRANCE,
    OREN_NAYAR = 1 << SHD_MODEL_OREN_NAYAR,
    WESTIN = 1 << SHD_MODEL_WESTIN,
    BARE = SHD_MODEL_COUNT, /* has its model by its preset, and only what all models have */
    ANY_KIND = (2 << SHD_MODEL_COUNT) - 1
};

static const shd_range facet_angle = {0, 90, false, false, "0 to 90 degrees"};

#define AT(member) offsetof(raw_material, member)

static const shd_field material_fields[] = {
    {"model", .read = NULL},
    /* Before the members that override it. */
    {"preset", .read = read_preset, .kinds = SHINY | FACETS | OREN_NAYAR | 1 << BARE},
    {"emissive", shd_read_coefficient, .offset = AT(emissive), .curve = AT(emissive_curve),
     .lamp = true, .texture = AT(emissive_texture)},
    {"ambient", shd_read_coefficient, AT(ambient), .mark = AMBIENT, .curve = AT(ambient_curve),
     .texture = AT(ambient_texture)},
    {"diffuse", read_diffuse, AT(diffuse), .mark = DIFFUSE, .curve = AT(diffuse_curve),
     .texture = AT(diffuse_texture)},
    {"specular", shd_read_coefficient, AT(first.specular), .kinds = SHINY,
     .curve = AT(specular_curve), .texture = AT(specular_texture)},
    {"shininess", shd_read_shininess, AT(first.shininess), SHINY, .range = &shd_not_negative,
     .texture = AT(gloss)},
    {"lobes", read_lobes, AT(further), .kinds = SHINY | FACETS},
    {"sigma", shd_read_degrees, AT(sigma), OREN_NAYAR, .range = &facet_angle},
    {"fresnel", shd_read_fresnel, AT(fresnel), .kinds = FACETS},
    {"microgeometry", shd_read_microgeometry, AT(microgeometry), WESTIN, .mark = MICRO},
    {"side", shd_read_choice, AT(side), .choices = sides},
    {"specularAntialiasing", .read = shd_read_switch, .offset = AT(antialiased),
     .kinds = SHINY | FACETS | 1 << BARE},
    {"normal", shd_read_normal_map, AT(normal_texture), .kinds = ANY_KIND},
    {"opacity", shd_read_opacity, AT(opacity), .mark = OPACITY, .curve = AT(opacity_curve),
     .texture = AT(opacity_texture)},
    {"reflection", shd_read_bounced, .offset = AT(reflection), .curve = AT(reflection_curve),
     .texture = AT(reflection_texture)},
    {"transmission", shd_read_bounced, .offset = AT(transmission), .curve = AT(transmission_curve),
     .texture = AT(transmission_texture)},
    {"ior", shd_read_number, AT(ior), .range = &shd_positive},
};

/* All lobes, the first among them. */
typedef struct made_lobes {
    shd_lobe *lobes;
    const shd_curve **curves;
    const shd_texture **textures, **gloss;
    bool textured, glossed;
} made_lobes;

/* False: memory is short. */
static bool make_lobes(shd_reader *r, const raw_material *raw, made_lobes *out) {
    const size_t further = raw->further.count;
    *out = (made_lobes){.lobes = shd_take(r, 1 + further, sizeof *out->lobes),
                        .curves = shd_take(r, 1 + further, sizeof *out->curves),
                        .textures = shd_take(r, 1 + further, sizeof *out->textures),
                        .gloss = shd_take(r, 1 + further, sizeof *out->gloss),
                        .textured = raw->specular_texture,
                        .glossed = raw->gloss};
    if (!out->lobes || !out->curves || !out->textures || !out->gloss) return false;
    out->lobes[0] = raw->first;
    out->curves[0] = raw->specular_curve;
    out->textures[0] = raw->specular_texture;
    out->gloss[0] = raw->gloss;
    for (size_t i = 0; i < further; i++) {
        out->lobes[1 + i] = raw->further.lobes[i];
        out->curves[1 + i] = raw->further.curves[i];
        out->textures[1 + i] = raw->further.textures[i];
        out->gloss[1 + i] = raw->further.gloss[i];
        out->textured = out->textured || raw->further.textures[i];
        out->glossed = out->glossed || raw->further.gloss[i];
    }
    return true;
}

/* `out` stays as it was if memory is short. */
static void make_material(shd_reader *r, const raw_material *raw, const char *name,
                          shd_material *out) {
    made_lobes made;
    if (!make_lobes(r, raw, &made)) return;
    *out = (shd_material){.name = name,
                          .lobes = made.lobes,
                          .lobe_count = 1 + raw->further.count,
                          .front_only = raw->side == 1,
                          .antialiased = raw->antialiased,
                          .model = (shd_model)raw->model,
                          .sigma = raw->sigma,
                          .fresnel = raw->fresnel,
                          .microgeometry = raw->microgeometry,
                          .ior = raw->ior,
                          .emissive_curve = raw->emissive_curve,
                          .ambient_curve = raw->ambient_curve,
                          .diffuse_curve = raw->diffuse_curve,
                          .opacity_curve = raw->alpha < 0 ? raw->opacity_curve : NULL,
                          .reflection_curve = raw->reflection_curve,
                          .transmission_curve = raw->transmission_curve,
                          .lobe_curves = made.curves,
                          .emissive_texture = raw->emissive_texture,
                          .ambient_texture = raw->ambient_texture,
                          .diffuse_texture = raw->diffuse_texture,
                          .lobe_textures = made.textured ? made.textures : NULL,
                          .lobe_gloss = made.glossed ? made.gloss : NULL,
                          .opacity_texture = raw->alpha < 0 ? raw->opacity_texture : NULL,
                          .reflection_texture = raw->reflection_texture,
                          .transmission_texture = raw->transmission_texture,
                          .normal_texture = raw->normal_texture};
    for (int c = 0; c < 3; c++) out->opacity[c] = raw->alpha < 0 ? raw->opacity[c] : raw->alpha;
    memcpy(out->reflection, raw->reflection, sizeof out->reflection);
    memcpy(out->transmission, raw->transmission, sizeof out->transmission);
    memcpy(out->emissive, raw->emissive, sizeof out->emissive);
    memcpy(out->ambient, raw->ambient, sizeof out->ambient);
    memcpy(out->diffuse, raw->diffuse, sizeof out->diffuse);
}

static raw_material default_material(shd_reader *r, shd_model model) {
    raw_material raw = {.model = (int)model,
                        .first.shininess = 32,
                        .further.model = (int)model,
                        .opacity = {1, 1, 1},
                        .ior = 1.5,
                        .alpha = -1};
    if (model == SHD_MODEL_COOK_TORRANCE) {
        raw.first = (shd_lobe){{1, 1, 1}, SHD_METAL_ROUGHNESS};
        raw.fresnel = *shd_default_fresnel();
    }
    shd_default_color(r, 0.8, raw.diffuse);
    memcpy(raw.ambient, raw.diffuse, sizeof raw.ambient);
    return raw;
}

static void check_westin(shd_reader *r, const shd_node *node, const raw_material *raw) {
    const shd_node diffuse = shd_node_member(node, "diffuse");
    const unsigned seen = r->seen, wrong = r->wrong;
    if (!(seen & MICRO) && !raw->microgeometry)
        shd_wrong(r, node, "the member \"microgeometry\" is missing");
    if (!(wrong & DIFFUSE)) shd_check_facets(r, &diffuse, raw->diffuse);
}

/* The first lobe of a list that has all of them. It is black if there is none. */
static void take_first(raw_material *raw) {
    raw_lobes *lobes = &raw->further;
    raw->first = (shd_lobe){.shininess = 1};
    raw->gloss = NULL;
    if (!lobes->count) return;
    lobes->count--;
    raw->first = *lobes->lobes++;
    raw->gloss = *lobes->gloss++;
}

/* Reads the members of a material of this kind, a model or BARE; what is absent is as in the model
 * of `raw`, or as its preset has it. */
static void read_members(shd_reader *r, const shd_node *node, int kind, raw_material *raw) {
    static const char *const names[] = {[SHD_MODEL_PHONG] = "a material",
                                        [SHD_MODEL_BLINN_PHONG] = "a blinn-phong material",
                                        [SHD_MODEL_PHONG_NORMALIZED] =
                                            "a phong-normalized material",
                                        [SHD_MODEL_OREN_NAYAR] = "an oren-nayar material",
                                        [SHD_MODEL_COOK_TORRANCE] = "a cook-torrance material",
                                        [SHD_MODEL_WESTIN] = "a westin material",
                                        [BARE] = "a preset's material without `model`"};
    if (!shd_read_fields(r, node, material_fields, SHD_LENGTH(material_fields),
                         kind < 0 ? ANY_KIND : 1u << kind, kind < 0 ? "a material" : names[kind],
                         raw))
        return;
    if (kind < 0) r->wrong |= SHD_SOME_FIELD;
    if (raw->model == SHD_MODEL_WESTIN) check_westin(r, node, raw);
    if (raw->model == SHD_MODEL_COOK_TORRANCE && raw->further.given) take_first(raw);
    raw->further.given = false;
    if (r->seen & OPACITY && raw->alpha >= 0)
        shd_wrong(r, node, "give either `opacity` or a fourth component of `diffuse`, not both");
    if (!raw->preset && !(r->seen & AMBIENT)) {
        memcpy(raw->ambient, raw->diffuse, sizeof raw->ambient);
        raw->ambient_curve = raw->diffuse_curve;
        raw->ambient_texture = raw->diffuse_texture;
    }
}

static void read_own_members(shd_reader *r, const shd_node *node, int kind, raw_material *raw) {
    *raw = default_material(r, (shd_model)kind);
    read_members(r, node, kind, raw);
    for (int c = 0; c < 3 && raw->alpha >= 0; c++) raw->opacity[c] = raw->alpha;
    if (raw->alpha >= 0) raw->opacity_curve = NULL;
    raw->alpha = -1;
}

static void read_material(shd_reader *r, const shd_node *node, const char *name,
                          shd_material *out) {
    const int model = shd_read_model(r, node);
    const bool shiny = model >= 0 && 1u << model & SHINY;
    const bool bare = model >= 0 && !shiny && !shd_node_member(node, "model").value;
    raw_material raw = default_material(r, model < 0 ? SHD_MODEL_PHONG : (shd_model)model);
    if (!json_is_object(node->value)) {
        shd_is_object(r, node);
        return;
    }
    read_members(r, node, bare ? BARE : model, &raw);
    make_material(r, &raw, name, out);
    if (!r->wrong) shd_warn_of_material(r, node, out);
}

void shd_read_library_material(shd_reader *r, const shd_node *node, shd_material *out) {
    read_material(r, node, "", out);
}

void shd_tell_preset(const shd_material *material, shd_preset *out) {
    const shd_lobe *lobe = &material->lobes[0];
    out->model = material->model;
    memcpy(out->ambient, material->ambient, sizeof out->ambient);
    memcpy(out->diffuse, material->diffuse, sizeof out->diffuse);
    if (material->model == SHD_MODEL_COOK_TORRANCE) {
        for (int c = 0; c < 3; c++)
            out->specular[c] = shd_fresnel_reflectance(&material->fresnel, c, 1);
    } else if (1u << material->model & SHINY) {
        memcpy(out->specular, lobe->specular, sizeof out->specular);
        out->shininess = lobe->shininess;
    }
}

/* ---- `materials` ---- */

static void read_named(shd_reader *r, const shd_node *node, void *entry) {
    shd_named_material *named = entry;
    named->used = SIZE_MAX;
    read_material(r, node, named->name, &named->material);
}

void shd_read_materials(shd_reader *r, const shd_node *node, void *out) {
    (void)out;
    shd_read_entries(r, node, "materials", sizeof(shd_named_material), read_named, &r->named);
}

/* ---- The materials of objects ---- */

static size_t append_material(shd_reader *r, const shd_material *material) {
    r->materials[r->material_count] = *material;
    return r->material_count++;
}

static size_t use_preset(shd_reader *r, const shd_node *node, const shd_library *library,
                         size_t index) {
    const size_t count = shd_preset_count(library);
    if (!r->presets_used) {
        r->presets_used = shd_take(r, count, sizeof *r->presets_used);
        if (!r->presets_used) return 0;
        for (size_t i = 0; i < count; i++) r->presets_used[i] = SIZE_MAX;
    }
    size_t *used = &r->presets_used[index];
    if (*used != SIZE_MAX) return *used;
    raw_material raw;
    const char *name = shd_preset_at(library, index)->name;
    take_preset(r, node, shd_library_find(library, name), &raw);
    const char *kept = shd_take_text(r, name); /* the scene may outlive the library */
    shd_material material = {.name = ""};
    make_material(r, &raw, kept ? kept : "", &material);
    if (r->report->status == SHD_OK) shd_warn_of_material(r, node, &material);
    return *used = append_material(r, &material);
}

static size_t use_default(shd_reader *r) {
    if (r->default_used != SIZE_MAX) return r->default_used;
    raw_material raw = default_material(r, SHD_MODEL_PHONG);
    shd_material material = {.name = ""};
    make_material(r, &raw, "", &material);
    return r->default_used = append_material(r, &material);
}

size_t shd_use_material(shd_reader *r, const shd_node *node) {
    if (!node->value) return use_default(r);
    if (json_is_object(node->value)) {
        shd_material material = {.name = ""};
        read_material(r, node, "", &material);
        return append_material(r, &material);
    }
    const char *name = shd_get_text(r, node, "a material or its name");
    if (!name) return 0;
    shd_named_material *named = shd_find_entry(&r->named, name);
    if (named) {
        if (named->used == SIZE_MAX) named->used = append_material(r, &named->material);
        return named->used;
    }
    const shd_library *library;
    if (!shd_reach_library(r, node, &library)) return 0;
    const size_t preset = shd_preset_find(library, name);
    if (preset != SIZE_MAX) return use_preset(r, node, library, preset);
    if (r->named.unknown) return 0;
    shd_wrong(r, node, "there is no material \"%s\"%s", shd_quote(name).text,
              suggest_material(r, name, true).text);
    return 0;
}
