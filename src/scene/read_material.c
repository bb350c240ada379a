/* Materials: written in `materials`, at an object, or taken from the library by name. */
#include <stdlib.h>
#include <string.h>

#include "scene/read.h"

typedef struct raw_lobes {
    const shd_lobe *lobes;
    size_t count;
} raw_lobes;

typedef struct raw_material {
    int model, side;
    double emissive[3], ambient[3], diffuse[3];
    shd_lobe first;
    raw_lobes further;
    bool preset; /* its values are here */
} raw_material;

enum { MODEL, PRESET, EMISSIVE, AMBIENT, DIFFUSE, SPECULAR, SHININESS, LOBES, SIDE, FIELDS };

/* ---- The library ---- */

/* Names for "did you mean": of `materials`, then of the library. */
static shd_hint suggest_material(shd_reader *r, const char *name, bool with_named) {
    enum { MOST = 512 };
    const char *names[MOST];
    size_t count = 0;
    for (size_t i = 0; with_named && i < r->named_count && count < MOST / 2; i++)
        names[count++] = r->named[i].name;
    for (size_t i = 0; i < shd_preset_count() && count < MOST; i++)
        names[count++] = shd_preset_at(i).name;
    return shd_suggest(r->report, name, names, count);
}

/* The library's colors are linear Rec.709. */
static void take_preset(shd_reader *r, const shd_node *node, size_t index, raw_material *raw) {
    const shd_preset preset = shd_preset_at(index);
    memcpy(raw->ambient, preset.ambient, sizeof raw->ambient);
    memcpy(raw->diffuse, preset.diffuse, sizeof raw->diffuse);
    memcpy(raw->first.specular, preset.specular, sizeof raw->first.specular);
    raw->first.shininess = preset.shininess;
    raw->preset = true;
    const shd_space_info *space = shd_catalog_space(r->catalog, "lin_rec709");
    if (!space) return;
    shd_convert_color(r, node, space, raw->ambient);
    shd_convert_color(r, node, space, raw->diffuse);
    shd_convert_color(r, node, space, raw->first.specular);
}

static void read_preset(shd_reader *r, const shd_node *node, const shd_field *field, void *out) {
    (void)field;
    if (!json_is_string(node->value)) {
        shd_node_expect(r->report, node, "the name of a preset");
        return;
    }
    const char *name = json_string_value(node->value);
    const size_t preset = shd_preset_find(name);
    if (preset != SIZE_MAX)
        take_preset(r, node, preset, out);
    else
        shd_node_fail(r->report, node, SHD_SCENE, "there is no preset \"%s\"%s",
                      shd_quote(name).text, suggest_material(r, name, false).text);
}

/* ---- One material ---- */

static void read_lobes(shd_reader *r, const shd_node *node, const shd_field *field, void *out) {
    (void)field;
    enum { COUNT = 2 };
    static const shd_field members[COUNT] = {
        {.name = "specular", .read = shd_read_color, .offset = offsetof(shd_lobe, specular)},
        {.name = "shininess",
         .read = shd_read_number,
         .offset = offsetof(shd_lobe, shininess),
         .range = &shd_not_negative},
    };
    raw_lobes *further = out;
    if (!shd_is_array(r, node, 0, SHD_LOBES_MOST, "an array of up to 64 lobes")) return;
    size_t count = json_array_size(node->value);
    if (count > SHD_LOBES_MOST) count = SHD_LOBES_MOST;
    shd_lobe *lobes = shd_take(r, count, sizeof *lobes);
    if (!lobes) return;
    for (size_t i = 0; i < count; i++) {
        shd_node lobe = shd_node_item(node, i);
        lobes[i].shininess = 32;
        if (shd_is_object(r, &lobe))
            shd_read_fields(r, &lobe, members, COUNT, 0, "a lobe", &lobes[i]);
    }
    *further = (raw_lobes){lobes, count};
}

static const char *const models[] = {"phong", NULL};
static const char *const sides[] = {"both", "front", NULL};

static const shd_field fields[FIELDS] = {
    [MODEL] = {.name = "model",
               .read = shd_read_choice,
               .offset = offsetof(raw_material, model),
               .choices = models},
    [PRESET] = {.name = "preset", .read = read_preset}, /* before what overrides it */
    [EMISSIVE] = {.name = "emissive",
                  .read = shd_read_color,
                  .offset = offsetof(raw_material, emissive)},
    [AMBIENT] = {.name = "ambient",
                 .read = shd_read_color,
                 .offset = offsetof(raw_material, ambient)},
    [DIFFUSE] = {.name = "diffuse",
                 .read = shd_read_color,
                 .offset = offsetof(raw_material, diffuse)},
    [SPECULAR] = {.name = "specular",
                  .read = shd_read_color,
                  .offset = offsetof(raw_material, first.specular)},
    [SHININESS] = {.name = "shininess",
                   .read = shd_read_number,
                   .offset = offsetof(raw_material, first.shininess),
                   .range = &shd_not_negative},
    [LOBES] = {.name = "lobes", .read = read_lobes, .offset = offsetof(raw_material, further)},
    [SIDE] = {.name = "side",
              .read = shd_read_choice,
              .offset = offsetof(raw_material, side),
              .choices = sides},
};

static bool is_negative(const double rgb[3]) {
    return rgb[0] < 0 || rgb[1] < 0 || rgb[2] < 0;
}

/* Adds a coefficient that the document states to the sum; true where it is negative. */
static bool add_stated(bool stated, const double rgb[3], double sum[3]) {
    if (!stated) return false;
    for (int c = 0; c < 3; c++) sum[c] += rgb[c];
    return is_negative(rgb);
}

/* Materials are never changed silently; what looks like a mistake is named. Only what the
 * document itself says counts: nobody wants a word about a default or the library's brass. */
static void warn(shd_reader *r, const shd_node *node, const raw_material *raw, uint32_t stated) {
    enum { SLACK = 1000000 }; /* rounding of decimals and of color conversion */
    double sum[3] = {0, 0, 0}, brightest = raw->first.shininess;
    bool negative = stated >> EMISSIVE & 1 && is_negative(raw->emissive);
    negative |= add_stated(stated >> AMBIENT & 1, raw->ambient, sum);
    negative |= add_stated(stated >> DIFFUSE & 1, raw->diffuse, sum);
    negative |= add_stated(stated >> SPECULAR & 1, raw->first.specular, sum);
    for (size_t i = 0; i < raw->further.count; i++) {
        const shd_lobe *lobe = &raw->further.lobes[i];
        negative |= add_stated(true, lobe->specular, sum);
        if (lobe->shininess > brightest) brightest = lobe->shininess;
    }
    double most = sum[0] > sum[1] ? sum[0] : sum[1];
    if (sum[2] > most) most = sum[2];
    if (most > 1 + 1.0 / SLACK)
        shd_node_warn(r->report, node,
                      "ambient + diffuse + specular is %.4g in a channel: more light may leave "
                      "than arrives",
                      most);
    if (brightest > 1000)
        shd_node_warn(r->report, node,
                      "a shininess of %.6g is above 1000: the highlight may be "
                      "smaller than a pixel",
                      brightest);
    if (negative) shd_node_warn(r->report, node, "a coefficient is negative");
}

/* `out` stays as it was where memory is short. */
static void make_material(shd_reader *r, const raw_material *raw, const char *name,
                          shd_material *out) {
    shd_lobe *lobes = shd_take(r, 1 + raw->further.count, sizeof *lobes);
    if (!lobes) return;
    lobes[0] = raw->first;
    if (raw->further.count)
        memcpy(lobes + 1, raw->further.lobes, raw->further.count * sizeof *lobes);
    *out = (shd_material){.name = name,
                          .lobes = lobes,
                          .lobe_count = 1 + raw->further.count,
                          .front_only = raw->side == 1};
    memcpy(out->emissive, raw->emissive, sizeof out->emissive);
    memcpy(out->ambient, raw->ambient, sizeof out->ambient);
    memcpy(out->diffuse, raw->diffuse, sizeof out->diffuse);
}

static raw_material default_material(shd_reader *r) {
    raw_material raw = {.first.shininess = 32};
    shd_default_color(r, 0.8, raw.diffuse);
    memcpy(raw.ambient, raw.diffuse, sizeof raw.ambient);
    return raw;
}

static void read_material(shd_reader *r, const shd_node *node, const char *name,
                          shd_material *out) {
    if (!shd_is_object(r, node)) return;
    raw_material raw = default_material(r);
    uint32_t seen = shd_read_fields(r, node, fields, FIELDS, 0, "a material", &raw);
    uint32_t right = seen & ~r->wrong;
    if (!raw.preset && !(seen >> AMBIENT & 1)) memcpy(raw.ambient, raw.diffuse, sizeof raw.ambient);
    warn(r, node, &raw, right);
    make_material(r, &raw, name, out);
}

/* ---- `materials` ---- */

static int compare_named(const void *a, const void *b) {
    return strcmp(((const shd_named_material *)a)->name, ((const shd_named_material *)b)->name);
}

static int compare_key(const void *key, const void *named) {
    return strcmp(key, ((const shd_named_material *)named)->name);
}

void shd_read_materials(shd_reader *r, const shd_node *node, const shd_field *field, void *out) {
    (void)field, (void)out;
    r->names_unknown = !shd_is_object(r, node);
    if (r->names_unknown) return;
    size_t count = json_object_size(node->value);
    r->named = shd_take(r, count, sizeof *r->named);
    if (!r->named) return;
    json_t *object = (json_t *)(uintptr_t)node->value; /* jansson's iterators are not const */
    for (void *at = json_object_iter(object); at; at = json_object_iter_next(object, at)) {
        const char *key = json_object_iter_key(at);
        if (!shd_is_plain_name(key))
            shd_node_fail(r->report, node, SHD_SCENE,
                          "the name \"%s\" is longer than 64 characters or has control characters",
                          shd_quote(key).text);
        const char *name = shd_take_text(r, key);
        if (!name) return;
        shd_named_material *named = &r->named[r->named_count++];
        *named = (shd_named_material){.name = name, .used = SIZE_MAX};
        shd_node material = {node, key, 0, json_object_iter_value(at)};
        read_material(r, &material, name, &named->material);
    }
    qsort(r->named, r->named_count, sizeof *r->named, compare_named);
}

/* ---- The materials of objects ---- */

static size_t append(shd_reader *r, const shd_material *material) {
    r->materials[r->material_count] = *material;
    return r->material_count++;
}

static size_t use_preset(shd_reader *r, const shd_node *node, size_t index) {
    const size_t count = shd_preset_count();
    if (!r->presets_used) {
        r->presets_used = shd_take(r, count, sizeof *r->presets_used);
        if (!r->presets_used) return 0;
        for (size_t i = 0; i < count; i++) r->presets_used[i] = SIZE_MAX;
    }
    size_t *used = &r->presets_used[index];
    if (*used != SIZE_MAX) return *used;
    raw_material raw = {0};
    take_preset(r, node, index, &raw);
    const char *name = shd_preset_at(index).name;
    shd_material material = {.name = name};
    make_material(r, &raw, name, &material);
    return *used = append(r, &material);
}

static size_t use_default(shd_reader *r) {
    if (r->default_used != SIZE_MAX) return r->default_used;
    raw_material raw = default_material(r);
    shd_material material = {.name = ""};
    make_material(r, &raw, "", &material);
    return r->default_used = append(r, &material);
}

size_t shd_use_material(shd_reader *r, const shd_node *node) {
    if (!node->value) return use_default(r);
    if (json_is_object(node->value)) {
        shd_material material = {.name = ""};
        read_material(r, node, "", &material);
        return append(r, &material);
    }
    if (!json_is_string(node->value)) {
        shd_node_expect(r->report, node, "a material or its name");
        return 0;
    }
    const char *name = json_string_value(node->value);
    shd_named_material *named = NULL;
    if (r->named_count)
        named = bsearch(name, r->named, r->named_count, sizeof *r->named, compare_key);
    if (named) {
        if (named->used == SIZE_MAX) named->used = append(r, &named->material);
        return named->used;
    }
    const size_t preset = shd_preset_find(name);
    if (preset != SIZE_MAX) return use_preset(r, node, preset);
    if (r->names_unknown) return 0;
    shd_node_fail(r->report, node, SHD_SCENE, "there is no material \"%s\"%s", shd_quote(name).text,
                  suggest_material(r, name, true).text);
    return 0;
}
