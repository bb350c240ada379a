/* What the models of reflection have beside Phong's members. */
#include <string.h>

#include "scene/library.h"
#include "scene/read_model.h"

int shd_read_model(shd_reader *r, const shd_node *node) {
    const shd_node model = shd_node_member(node, "model"), preset = shd_node_member(node, "preset");
    if (json_is_string(model.value)) {
        for (int i = 0; shd_model_names[i]; i++)
            if (!strcmp(json_string_value(model.value), shd_model_names[i])) return i;
    } else if (!model.value) {
        if (!json_is_string(preset.value)) return SHD_MODEL_PHONG;
        const shd_library *library;
        if (!shd_reach_library(r, &preset, &library)) return -1;
        const size_t index = shd_preset_find(library, json_string_value(preset.value));
        return index == SIZE_MAX ? SHD_MODEL_PHONG : (int)shd_preset_at(library, index)->model;
    }
    shd_read_name(r, &model, shd_model_names);
    return -1;
}

/* ---- Cook-Torrance ---- */

static const double SLACK = 1e-6;

/* Three numbers, one that stands for all, samples over wavelengths, or the name of a metal. */
static void read_index(shd_reader *r, const shd_node *node, bool absorbs, shd_fresnel *index) {
    double *out = absorbs ? index->k : index->n;
    const shd_curve **curve = absorbs ? &index->k_curve : &index->n_curve;
    *curve = NULL;
    if (json_is_string(node->value)) {
        const char *name = json_string_value(node->value);
        const shd_fresnel *metal = shd_metal_find(name);
        if (metal) {
            memcpy(out, absorbs ? metal->k : metal->n, 3 * sizeof *out);
            *curve = absorbs ? metal->k_curve : metal->n_curve;
            return;
        }
        size_t count = 0;
        while (shd_metal_names[count]) count++;
        shd_wrong(r, node, "there is no metal \"%s\"%s", shd_quote(name).text,
                  shd_suggest(r->report, name, shd_metal_names, count).text);
    } else if (json_is_number(node->value)) {
        double value = 0;
        shd_read_number(r, node, &value);
        out[0] = out[1] = out[2] = value;
    } else if (json_is_array(node->value)) {
        double values[3];
        if (shd_get_three(r, node, values)) memcpy(out, values, sizeof values);
    } else if (json_is_object(node->value)) {
        *curve = shd_read_measured(r, node, out);
    } else {
        shd_node_expect(r->report, node,
                        "a number, three numbers, {wavelengths, values}, or the name of a metal");
    }
}

static void read_refraction(shd_reader *r, const shd_node *node, void *out) {
    read_index(r, node, false, out);
}

static void read_absorption(shd_reader *r, const shd_node *node, void *out) {
    read_index(r, node, true, out);
}

static void take_f0(shd_reader *r, const shd_node *node, const double f0[3], shd_fresnel *out) {
    for (int c = 0; c < 3; c++) {
        if (!(f0[c] >= -SLACK && f0[c] <= 1 + SLACK)) {
            if (!isnan(f0[c]))
                shd_wrong(r, node,
                          "must be within 0 to 1 in each channel of the working space, got %.6g",
                          f0[c]);
            return;
        }
        out->n[c] = shd_index_of(f0[c]);
        out->k[c] = 0;
    }
}

/* What a curve reflects at a right angle, which its color in RGB may hide. */
static void check_f0(shd_reader *r, const shd_node *node, const shd_curve *curve) {
    for (size_t i = 0; curve && i < curve->count; i++) {
        const double value = curve->values[i] * curve->scale;
        if (value <= 1 + SLACK) continue;
        shd_wrong(r, node, "reflects %.6g at a wavelength: at most 1", value);
        return;
    }
}

void shd_read_fresnel(shd_reader *r, const shd_node *node, void *out) {
    enum { F0 = 1, N = 2, K = 4 };
    typedef struct raw_fresnel {
        double f0[3];
        shd_fresnel index;
    } raw_fresnel;
    /* What squares hold with digits to spare. */
    static const shd_range index = {0, 1e6, true, false, "greater than 0 and at most 1000000"},
                           extinction = {0, 1e6, false, false, "0 to 1000000"};
    static const shd_field fields[] = {
        {"f0", shd_read_reflectance, .offset = offsetof(raw_fresnel, f0), .mark = F0,
         .curve = offsetof(raw_fresnel, index.f0_curve),
         .texture = offsetof(raw_fresnel, index.f0_texture)},
        {"n", read_refraction, offsetof(raw_fresnel, index), .range = &index, .mark = N},
        {"k", read_absorption, offsetof(raw_fresnel, index), .range = &extinction, .mark = K},
    };
    raw_fresnel raw = {.f0 = {NAN, NAN, NAN}};
    if (!shd_read_fields(r, node, fields, SHD_LENGTH(fields), 0, "`fresnel`", &raw)) return;
    const unsigned seen = r->seen;
    if (r->wrong) return;
    if (seen != F0 && !(seen & N && !(seen & F0))) {
        shd_wrong(r, node, "give either `f0`, or `n` and for metals `k`");
        return;
    }
    const shd_node n = shd_node_member(node, "n"), f0 = shd_node_member(node, "f0");
    if (seen & F0) {
        take_f0(r, &f0, raw.f0, &raw.index);
        check_f0(r, &f0, raw.index.f0_curve);
    } else if (!(seen & K) && json_is_string(n.value)) {
        read_index(r, &n, true, &raw.index);
    }
    *(shd_fresnel *)out = raw.index;
}

const shd_fresnel *shd_default_fresnel(void) {
    static const shd_fresnel glass = {.n = {1.5, 1.5, 1.5}};
    return &glass;
}

void shd_read_facet_lobe(shd_reader *r, const shd_node *node, shd_lobe *out,
                         const shd_texture **gloss) {
    typedef struct raw_lobe {
        double roughness, weight;
        const shd_texture *gloss;
    } raw_lobe;
    static const shd_range slope = {1e-4, 10, false, false, "0.0001 to 10"};
    static const shd_field members[] = {
        {"roughness", shd_read_roughness, offsetof(raw_lobe, roughness), .range = &slope,
         .required = true, .texture = offsetof(raw_lobe, gloss)},
        {"weight", shd_read_number, offsetof(raw_lobe, weight), .range = &shd_not_negative},
    };
    raw_lobe raw = {SHD_METAL_ROUGHNESS, 1, NULL};
    shd_read_fields(r, node, members, SHD_LENGTH(members), 0, "a lobe of cook-torrance", &raw);
    *out = (shd_lobe){{raw.weight, raw.weight, raw.weight}, raw.roughness};
    *gloss = raw.gloss;
}

/* ---- How much light a lobe sends on. ---- */

/* Of light from straight above, pi times the integral of the lobe over the hemisphere, where that
 * of a diffuse surface of 1 is 1. */
double shd_lobe_albedo(const shd_material *m, const shd_lobe *lobe) {
    const double n = lobe->shininess;
    switch (m->model) {
    case SHD_MODEL_BLINN_PHONG: {
        /* N.H = u is the cosine of half the angle, from 1 to the root of 1/2. */
        const double u = sqrt(0.5), a = 2 / (n + 4), b = 1 / (n + 2);
        return 8 * (a * (1 - pow(u, n + 4)) - b * (1 - pow(u, n + 2)));
    }
    case SHD_MODEL_PHONG_NORMALIZED:
        return 1;
    case SHD_MODEL_COOK_TORRANCE: {
        double most = 0;
        for (int c = 0; c < 3; c++) most = fmax(most, shd_fresnel_reflectance(&m->fresnel, c, 1));
        return most;
    }
    default:
        return 2 / (n + 2);
    }
}
