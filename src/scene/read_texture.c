/* Coefficients that are patterns, and which objects they may be on. */
#include <string.h>

#include "scene/read.h"

const char *const shd_pattern_names[] = {"checker", "grid", "gradient", "noise", NULL};

typedef struct raw_uv {
    double scale[2], offset[2], rotate;
    int wrap;
} raw_uv;

typedef struct raw_pattern {
    raw_uv uv;
    int kind;
    double width;
    int octaves;
    double colors[2][3];
} raw_pattern;

/* A scale of one number is that of both axes. */
static void read_scale(shd_reader *r, const shd_node *node, void *out) {
    double *scale = out;
    if (json_is_array(node->value)) {
        shd_get_numbers(r, node, 2, 2, "an array of 2 numbers", scale);
        return;
    }
    shd_read_number(r, node, scale);
    scale[1] = scale[0];
}

static void read_two(shd_reader *r, const shd_node *node, void *out) {
    shd_get_numbers(r, node, 2, 2, "an array of 2 numbers", out);
}

static const char *const wraps[] = {"clamp", "repeat", "mirror", NULL};

/* What is beyond has footprints that nobody can tell from nothing or from everything. */
static const shd_range modest = {-1e9, 1e9, .text = "-1e9 to 1e9"};

static void read_uv(shd_reader *r, const shd_node *node, void *out) {
    static const shd_field fields[] = {
        {"scale", read_scale, .offset = offsetof(raw_uv, scale), .range = &modest},
        {"offset", read_two, .offset = offsetof(raw_uv, offset), .range = &modest},
        {"rotate", shd_read_degrees, .offset = offsetof(raw_uv, rotate), .range = &modest},
        {"wrap", shd_read_choice, .offset = offsetof(raw_uv, wrap), .kinds = 1u << SHD_GRADIENT,
         .choices = wraps},
    };
    raw_pattern *raw = (raw_pattern *)(void *)((char *)out - offsetof(raw_pattern, uv));
    static const char *const whats[] = {"a checker's `uv`", "a grid's `uv`", "a gradient's `uv`",
                                        "a noise's `uv`"};
    shd_read_fields(r, node, fields, SHD_LENGTH(fields), 1u << raw->kind, whats[raw->kind], out);
}

static void read_colors(shd_reader *r, const shd_node *node, void *out) {
    double(*colors)[3] = out;
    if (!shd_is_array(r, node, 2, 2, "an array of 2 colors")) return;
    for (size_t i = 0; i < json_array_size(node->value) && i < 2; i++) {
        const shd_node item = shd_node_item(node, i);
        shd_read_color(r, &item, colors[i]);
    }
}

static shd_pattern pattern_of(const raw_pattern *raw) {
    const raw_uv *uv = &raw->uv;
    const double c = cos(uv->rotate), s = sin(uv->rotate);
    return (shd_pattern){.kind = (shd_pattern_kind)raw->kind,
                         .map = {{c * uv->scale[0], -s * uv->scale[1], uv->offset[0]},
                                 {s * uv->scale[0], c * uv->scale[1], uv->offset[1]}},
                         .wrap = (shd_wrap)uv->wrap,
                         .width = raw->kind == SHD_GRID ? raw->width : 0,
                         .octaves = raw->kind == SHD_NOISE ? raw->octaves : 0};
}

static bool read_pattern(shd_reader *r, const shd_node *node, raw_pattern *raw) {
    static const shd_range width = {0, 1, true, true, "between 0 and 1"},
                           octaves = {1, 8, .text = "1 to 8"};
    static const shd_field fields[] = {
        {"pattern", .read = NULL},
        {"colors", read_colors, .offset = offsetof(raw_pattern, colors), .required = true},
        {"uv", read_uv, .offset = offsetof(raw_pattern, uv)},
        {"width", shd_read_number, offsetof(raw_pattern, width), 1u << SHD_GRID, .range = &width},
        {"octaves", shd_read_integer, offsetof(raw_pattern, octaves), 1u << SHD_NOISE,
         .range = &octaves},
    };
    static const char *const whats[] = {"a checker", "a grid", "a gradient", "a noise"};
    const shd_node name = shd_node_member(node, "pattern");
    const size_t errors = r->report->error_count;
    *raw = (raw_pattern){.uv.scale = {1, 1}, .width = 0.1, .octaves = 4};
    raw->kind = shd_read_name(r, &name, shd_pattern_names);
    if (raw->kind < 0) return false;
    shd_read_fields(r, node, fields, SHD_LENGTH(fields), 1u << raw->kind, whats[raw->kind], raw);
    return r->report->error_count == errors;
}

void shd_read_coefficient(shd_reader *r, const shd_node *node, void *out) {
    const shd_field *field = r->field;
    void *at = (char *)out - field->offset + field->texture;
    const shd_texture **place = at;
    raw_pattern raw;
    *place = NULL;
    if (!json_is_object(node->value) || !json_object_get(node->value, "pattern")) {
        shd_read_color_or_spectrum(r, node, out);
        return;
    }
    if (r->in_library) {
        shd_wrong(r, node, "a material of the library has no patterns");
        return;
    }
    if (!read_pattern(r, node, &raw)) return;
    shd_texture *texture = shd_take(r, 1, sizeof *texture);
    if (!texture) return;
    texture->pattern = pattern_of(&raw);
    memcpy(texture->low, raw.colors[0], sizeof texture->low);
    memcpy(texture->high, raw.colors[1], sizeof texture->high);
    double *most = out;
    for (int c = 0; c < 3; c++) {
        const double low = texture->low[c], high = texture->high[c];
        most[c] = fabs(low) > fabs(high) ? low : high;
    }
    *place = texture;
    const shd_curve **curve = (void *)((char *)out - field->offset + field->curve);
    *curve = NULL;
}

static bool same_texture(const shd_texture *a, const shd_texture *b) {
    if (!a || !b) return a == b;
    bool same = shd_same_pattern(&a->pattern, &b->pattern);
    for (int c = 0; c < 3; c++) same = same && a->low[c] == b->low[c] && a->high[c] == b->high[c];
    return same;
}

bool shd_same_textures(const shd_material *a, const shd_material *b) {
    if (!shd_is_textured(a) && !shd_is_textured(b)) return true;
    if (!same_texture(a->emissive_texture, b->emissive_texture) ||
        !same_texture(a->ambient_texture, b->ambient_texture) ||
        !same_texture(a->diffuse_texture, b->diffuse_texture) || a->lobe_count != b->lobe_count)
        return false;
    for (size_t k = 0; k < a->lobe_count; k++)
        if (!same_texture(a->lobe_textures ? a->lobe_textures[k] : NULL,
                          b->lobe_textures ? b->lobe_textures[k] : NULL))
            return false;
    return true;
}

void shd_check_textured(shd_reader *r, const shd_node *node, const shd_object *object) {
    const shd_material *material = &r->materials[object->material];
    if (!shd_is_textured(material)) return;
    const shd_mesh *mesh = object->mesh;
    if (object->interpolation != SHD_PHONG)
        shd_wrong(r, node, "a material with a pattern needs interpolation phong");
    if (object->shape == SHD_MESH && mesh && !mesh->uvs)
        shd_wrong(r, node, "a material with a pattern needs `uvs` on a mesh%s",
                  mesh->type ? ": what is built in has none" : "");
    if (r->scene->spectral.channels) shd_wrong(r, node, "a spectral scene has no patterns");
    if (r->scene->trace.depth > 0)
        shd_wrong(r, node,
                  "patterns are not seen by mirrored or refracted rays: `trace` with a "
                  "`depth` has none");
    if (material->model == SHD_MODEL_WESTIN)
        shd_wrong(r, node, "the facets of a westin material have no pattern");
}
