/* What a document has in place of colors, numbers and normals: patterns and pictures. */
#include <string.h>

#include "scene/css.h"
#include "scene/read.h"

const char *const shd_pattern_names[] = {"checker", "grid", "gradient", "noise", NULL};

typedef struct raw_uv {
    double scale[2], offset[2], rotate;
    int wrap;
} raw_uv;

/* `kind` is a shd_pattern_kind, SHD_PICTURE among them. */
typedef struct raw_pattern {
    raw_uv uv;
    int kind;
    double width;
    int octaves;
    double colors[2][3];
    double values[2];
    const char *name;
    const shd_space_info *space;
    int channel;
    double tint[3];
    double scale;
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
        {"wrap", shd_read_choice, .offset = offsetof(raw_uv, wrap),
         .kinds = 1u << SHD_GRADIENT | 1u << SHD_PICTURE, .choices = wraps},
    };
    raw_pattern *raw = (raw_pattern *)(void *)((char *)out - offsetof(raw_pattern, uv));
    static const char *const whats[] = {"a checker's `uv`", "a grid's `uv`", "a gradient's `uv`",
                                        "a noise's `uv`", "a picture's `uv`"};
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

/* A normal as a texel has it: numbers that are no color. */
static void read_code(shd_reader *r, const shd_node *node, double out[3]) {
    shd_css_color color;
    shd_css_wrong wrong;
    if (json_is_array(node->value)) {
        shd_get_numbers(r, node, 3, 3, "an array of 3 numbers", out);
        return;
    }
    /* No other notation of CSS: most of these are of colors. */
    const char *text = json_string_value(node->value), *digits = "0123456789abcdefABCDEF";
    const size_t length = text && text[0] == '#' ? strlen(text + 1) : 0;
    if ((length == 3 || length == 6) && strspn(text + 1, digits) == length &&
        shd_css_read(text, &color, &wrong))
        memcpy(out, color.rgb, sizeof color.rgb);
    else
        shd_node_expect(r->report, node, "a normal: 3 numbers from 0 to 1, or \"#rrggbb\"");
}

static void read_codes(shd_reader *r, const shd_node *node, void *out) {
    double(*codes)[3] = out;
    if (!shd_is_array(r, node, 2, 2, "an array of 2 normals")) return;
    for (size_t i = 0; i < json_array_size(node->value) && i < 2; i++) {
        const shd_node item = shd_node_item(node, i);
        read_code(r, &item, codes[i]);
    }
}

/* What a number is where the field is 0 and where it is 1. */
static void read_values(shd_reader *r, const shd_node *node, void *out) {
    shd_get_numbers(r, node, 2, 2, "an array of 2 numbers", out);
}

static void read_name(shd_reader *r, const shd_node *node, void *out) {
    const char *name =
        shd_get_text(r, node, "the name of a picture, or \"sha256-\" and its digits");
    if (name) *(const char **)out = shd_take_text(r, name);
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

/* Kinds behind those of patterns: pictures of what is no color, and of normals, and patterns of
 * normals, from checkers on; pictures and patterns of numbers. */
enum {
    PLAIN_PICTURE = SHD_PICTURE + 1,
    NORMAL_MAP,
    NORMAL_PATTERN,
    NUMBER_PICTURE = NORMAL_PATTERN + SHD_PATTERN_COUNT,
    NUMBER_PATTERN
};

/* What its field is: a shd_pattern_kind, SHD_PICTURE among them. */
static int field_of(int kind) {
    if (kind >= NUMBER_PATTERN) return kind - NUMBER_PATTERN;
    if (kind >= NORMAL_PATTERN) return kind - NORMAL_PATTERN;
    return kind < SHD_PICTURE ? kind : SHD_PICTURE;
}

/* The same as bits of shd_field.kinds. */
enum {
    PATTERNS = (1 << SHD_PATTERN_COUNT) - 1,
    COLORS = 1 << SHD_PICTURE,
    PICTURES = COLORS | 1 << PLAIN_PICTURE | 1 << NUMBER_PICTURE,
    NORMAL_PATTERNS = PATTERNS << NORMAL_PATTERN,
    NORMALS = 1 << NORMAL_MAP | NORMAL_PATTERNS,
    NUMBER_PATTERNS = PATTERNS << NUMBER_PATTERN,
    NUMBERS = 1 << NUMBER_PICTURE | NUMBER_PATTERNS,
    ALL_PATTERNS = PATTERNS | NORMAL_PATTERNS | NUMBER_PATTERNS,
    GRIDS = (1 | 1 << NORMAL_PATTERN | 1 << NUMBER_PATTERN) << SHD_GRID,
    NOISES = (1 | 1 << NORMAL_PATTERN | 1 << NUMBER_PATTERN) << SHD_NOISE
};

/* What each kind is called. */
static const char *const kind_names[] = {"a checker",
                                         "a grid",
                                         "a gradient",
                                         "a noise",
                                         "a picture",
                                         "a picture of numbers",
                                         "a map of normals",
                                         "a checker of normals",
                                         "a grid of normals",
                                         "a gradient of normals",
                                         "a noise of normals",
                                         "a picture of numbers",
                                         "a checker of numbers",
                                         "a grid of numbers",
                                         "a gradient of numbers",
                                         "a noise of numbers"};

static bool read_members(shd_reader *r, const shd_node *node, int kind, raw_pattern *raw) {
    static const shd_range width = {0, 1, true, true, "between 0 and 1"},
                           octaves = {1, 8, .text = "1 to 8"},
                           scale = {-1000, 1000, .text = "-1000 to 1000"},
                           code = {0, 1, .text = "0 to 1"},
                           number = {0, 1e9, .text = "0 to 1000000000"};
    static const char *const channels[] = {"R", "G", "B", "A", NULL};
    static const shd_field fields[] = {
        {"pattern", .read = NULL, .kinds = ALL_PATTERNS},
        {"texture", read_name, .offset = offsetof(raw_pattern, name),
         .kinds = PICTURES | 1 << NORMAL_MAP},
        {"colors", read_colors, .offset = offsetof(raw_pattern, colors), .kinds = PATTERNS,
         .required = true},
        {"colors", read_codes, .offset = offsetof(raw_pattern, colors), .kinds = NORMAL_PATTERNS,
         .range = &code, .required = true},
        {"values", read_values, .offset = offsetof(raw_pattern, values), .kinds = NUMBERS,
         .range = &number, .required = true},
        {"tint", shd_read_color, .offset = offsetof(raw_pattern, tint), .kinds = COLORS},
        {"space", shd_read_space, .offset = offsetof(raw_pattern, space), .kinds = PICTURES},
        {"channel", shd_read_choice, offsetof(raw_pattern, channel), PICTURES, .choices = channels},
        {"uv", read_uv, .offset = offsetof(raw_pattern, uv)},
        {"width", shd_read_number, offsetof(raw_pattern, width), GRIDS, .range = &width},
        {"octaves", shd_read_integer, offsetof(raw_pattern, octaves), NOISES, .range = &octaves},
        {"scale", shd_read_number, offsetof(raw_pattern, scale), NORMALS, .range = &scale},
    };
    const int field = field_of(kind);
    const size_t errors = r->report->error_count;
    *raw = (raw_pattern){
        .uv = {.scale = {1, 1}, .wrap = field >= SHD_PICTURE ? SHD_WRAP_REPEAT : SHD_WRAP_CLAMP},
        .kind = field,
        .width = 0.1,
        .octaves = 4,
        .channel = SHD_ALL_CHANNELS,
        .tint = {1, 1, 1},
        .scale = 1};
    shd_read_fields(r, node, fields, SHD_LENGTH(fields), 1u << kind, kind_names[kind], raw);
    return r->report->error_count == errors;
}

/* ---- Pictures ---- */

/* NULL after an error, or if it is not kept. */
static const shd_pyramid *find_picture(shd_reader *r, const shd_node *node,
                                       const shd_picture_wish *wish) {
    const shd_node at = shd_node_member(node, "texture");
    const shd_texels *texels;
    const shd_pyramid *out = NULL;
    shd_error error = {.limit = SHD_LIMIT_NONE};
    if (!r->shelf || !r->shelf->texels) {
        shd_wrong(r, &at, "no assets are kept here");
        return NULL;
    }
    shd_status status = r->shelf->texels(r->shelf->context, wish, &texels, &error);
    if (status == SHD_OK) status = r->shelf->pyramid(r->shelf->context, texels, &out, &error);
    if (status == SHD_OK && texels->held)
        shd_warn(r, &at,
                 "the picture has %zu samples that are not finite or beyond half floats, which are "
                 "taken as 0 or as the largest of these",
                 texels->held);
    if (status == SHD_OK) return out;
    if (status == SHD_MISSING) {
        shd_note_missing(r, &at, "asset", wish->name);
    } else {
        shd_node_report(r->report, &at, status, "%s", error.text);
        if (error.limit != SHD_LIMIT_NONE) shd_report_limit(r->report, error.limit);
    }
    return NULL;
}

/* `kind` is SHD_PICTURE, PLAIN_PICTURE, NORMAL_MAP or NUMBER_PICTURE. */
static bool take_picture(shd_reader *r, const shd_node *node, int kind, raw_pattern *raw,
                         shd_pattern *out) {
    const shd_space_info *working = r->scene->working_space;
    if (!read_members(r, node, kind, raw)) return false;
    const bool converts = kind == SHD_PICTURE || raw->space;
    if (!raw->name || (converts && !working)) return false; /* which has been told */
    const shd_picture_wish wish = {raw->name, raw->space, converts ? working : NULL,
                                   kind == NORMAL_MAP, raw->scale};
    const shd_pyramid *picture = find_picture(r, node, &wish);
    *out = pattern_of(raw);
    out->picture = picture;
    /* Of a picture that is grey one component tells all. */
    const bool all =
        raw->channel == SHD_ALL_CHANNELS && kind != NORMAL_MAP && picture && picture->grey;
    out->channel = all ? 0 : raw->channel;
    return picture;
}

/* ---- Coefficients ---- */

static bool read_patterned(shd_reader *r, const shd_node *node, shd_texture *out) {
    const shd_node name = shd_node_member(node, "pattern");
    const int kind = shd_read_name(r, &name, shd_pattern_names);
    raw_pattern raw;
    if (kind < 0 || !read_members(r, node, kind, &raw)) return false;
    out->pattern = pattern_of(&raw);
    memcpy(out->low, raw.colors[0], sizeof out->low);
    memcpy(out->high, raw.colors[1], sizeof out->high);
    return true;
}

/* `kind` is SHD_PICTURE or PLAIN_PICTURE, which has no tint. */
static bool read_pictured(shd_reader *r, const shd_node *node, int kind, shd_texture *out) {
    raw_pattern raw;
    if (!take_picture(r, node, kind, &raw, &out->pattern)) return false;
    memcpy(out->high, raw.tint, sizeof out->high);
    out->name = raw.name;
    return true;
}

/* The pattern, or the picture of that kind, that a coefficient is. NULL: it is wrong, or a picture
 * that is not kept, which is reported. */
static const shd_texture *read_texture(shd_reader *r, const shd_node *node, int kind) {
    if (r->in_library) {
        shd_wrong(r, node, "a material of the library has no patterns or pictures");
        return NULL;
    }
    shd_texture *texture = shd_take(r, 1, sizeof *texture);
    if (!texture) return NULL;
    const bool read = json_object_get(node->value, "texture")
                          ? read_pictured(r, node, kind, texture)
                          : read_patterned(r, node, texture);
    return read ? texture : NULL;
}

/* Where the field in hand, which is at `out`, has its texture. */
static const shd_texture **place_of(const shd_reader *r, void *out) {
    void *at = (char *)out - r->field->offset + r->field->texture;
    return at;
}

/* The field in hand is no spectrum. */
static void clear_curve(const shd_reader *r, void *out) {
    const shd_curve **curve = (void *)((char *)out - r->field->offset + r->field->curve);
    *curve = NULL;
}

void shd_read_coefficient(shd_reader *r, const shd_node *node, void *out) {
    const shd_texture **place = place_of(r, out);
    *place = NULL;
    if (!json_object_get(node->value, "texture") && !json_object_get(node->value, "pattern")) {
        shd_read_color_or_spectrum(r, node, out);
        return;
    }
    clear_curve(r, out);
    const shd_texture *texture = read_texture(r, node, SHD_PICTURE);
    if (!texture) return;
    double *most = out, ends[2][3];
    shd_texture_ends(texture, ends);
    for (int c = 0; c < 3; c++)
        most[c] = fabs(ends[0][c]) > fabs(ends[1][c]) ? ends[0][c] : ends[1][c];
    *place = texture;
}

/* ---- Shares of light: what rays go by, and what facets mirror ---- */

/* Reads one whose ends, held to that, are from 0 to `most`. NULL: it is not as `expected`. */
static const shd_texture *read_shares(shd_reader *r, const shd_node *node, int kind, double most,
                                      const char *expected, double ends[2][3]) {
    static const double SLACK = 1e-6; /* rounding of color conversion */
    const shd_texture *texture = read_texture(r, node, kind);
    if (!texture) return NULL;
    shd_texture_ends(texture, ends);
    for (size_t e = 0; e < 2; e++)
        for (int c = 0; c < 3; c++) {
            double *end = &ends[e][c];
            if (isnan(*end)) return NULL; /* a color space is wrong, which is told there */
            if (!(*end >= -SLACK && *end <= most + SLACK)) {
                shd_wrong(r, node, "%s in every channel, and this has %.9g", expected, *end);
                return NULL;
            }
            *end = shd_smaller(shd_larger(*end, 0), most);
        }
    return texture;
}

void shd_read_opacity_texture(shd_reader *r, const shd_node *node, void *out) {
    const shd_texture **place = place_of(r, out);
    double *least = out, ends[2][3];
    bool opaque = true;
    *place = NULL;
    clear_curve(r, out);
    const shd_texture *texture =
        read_shares(r, node, PLAIN_PICTURE, 1, "an opacity is from 0 to 1", ends);
    if (!texture) return;
    for (int c = 0; c < 3; c++) {
        least[c] = shd_smaller(ends[0][c], ends[1][c]);
        opaque = opaque && least[c] == 1;
    }
    if (!opaque && (r->scene->trace.depth > 0 || r->scene->trace.shadows)) *place = texture;
}

void shd_read_bounced_texture(shd_reader *r, const shd_node *node, void *out) {
    const shd_texture **place = place_of(r, out);
    double *most = out, ends[2][3];
    bool any = false;
    *place = NULL;
    clear_curve(r, out);
    const shd_texture *texture =
        read_shares(r, node, SHD_PICTURE, INFINITY, "must be 0 or more", ends);
    for (int c = 0; texture && c < 3; c++) {
        most[c] = shd_larger(ends[0][c], ends[1][c]);
        any = any || most[c] > 0;
    }
    if (any && r->scene->trace.depth > 0) *place = texture;
}

void shd_read_reflectance(shd_reader *r, const shd_node *node, void *out) {
    const shd_texture **place = place_of(r, out);
    double *most = out, ends[2][3];
    *place = NULL;
    if (!json_object_get(node->value, "texture") && !json_object_get(node->value, "pattern")) {
        shd_read_color_or_spectrum(r, node, out);
        return;
    }
    clear_curve(r, out);
    *place = read_shares(r, node, SHD_PICTURE, 1, "a reflectance is from 0 to 1", ends);
    for (int c = 0; *place && c < 3; c++) most[c] = shd_larger(ends[0][c], ends[1][c]);
}

/* ---- Numbers ---- */

bool shd_read_numbers(shd_reader *r, const shd_node *node, shd_texture *out) {
    const shd_node name = shd_node_member(node, "pattern");
    raw_pattern raw;
    if (json_object_get(node->value, "texture")) {
        if (!take_picture(r, node, NUMBER_PICTURE, &raw, &out->pattern)) return false;
        if (shd_pattern_fields(&out->pattern) != 1) {
            shd_wrong(r, node, "this is one number, and the picture has colors: give a `channel`");
            return false;
        }
        out->name = raw.name;
    } else {
        const int kind = shd_read_name(r, &name, shd_pattern_names);
        if (kind < 0 || !read_members(r, node, NUMBER_PATTERN + kind, &raw)) return false;
        out->pattern = pattern_of(&raw);
    }
    for (int c = 0; c < 3; c++) {
        out->low[c] = raw.values[0];
        out->high[c] = raw.values[1];
    }
    return true;
}

/* ---- Maps of normals ---- */

/* The vector that a code stands for, of any length but 0. */
static void turn_code(const double code[3], double scale, double out[3]) {
    for (int c = 0; c < 3; c++) out[c] = (2 * code[c] - 1) * (c < 2 ? scale : 1);
    if (out[0] == 0 && out[1] == 0 && out[2] == 0) out[2] = 1;
}

static bool read_patterned_normals(shd_reader *r, const shd_node *node, shd_texture *out) {
    const shd_node name = shd_node_member(node, "pattern");
    const int kind = shd_read_name(r, &name, shd_pattern_names);
    raw_pattern raw;
    if (kind < 0 || !read_members(r, node, NORMAL_PATTERN + kind, &raw)) return false;
    out->pattern = pattern_of(&raw);
    turn_code(raw.colors[0], raw.scale, out->low);
    turn_code(raw.colors[1], raw.scale, out->high);
    return true;
}

static bool read_pictured_normals(shd_reader *r, const shd_node *node, shd_texture *out) {
    raw_pattern raw;
    if (!take_picture(r, node, NORMAL_MAP, &raw, &out->pattern)) return false;
    for (int c = 0; c < 3; c++) out->high[c] = raw.scale;
    out->name = raw.name;
    return true;
}

void shd_read_normal_map(shd_reader *r, const shd_node *node, void *out) {
    const shd_texture **place = out;
    const bool is_pattern = json_object_get(node->value, "pattern");
    *place = NULL;
    if (r->in_library) {
        shd_wrong(r, node, "a material of the library has no map of normals");
        return;
    }
    if (!is_pattern && !json_object_get(node->value, "texture")) {
        shd_wrong(r, node,
                  "must be a picture of normals, {texture, scale, uv}, or a pattern of two, "
                  "{pattern, colors, scale, uv}");
        return;
    }
    shd_texture *texture = shd_take(r, 1, sizeof *texture);
    if (texture && (is_pattern ? read_patterned_normals : read_pictured_normals)(r, node, texture))
        *place = texture;
}

/* ---- Materials and objects ---- */

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
        !same_texture(a->diffuse_texture, b->diffuse_texture) ||
        !same_texture(a->fresnel.f0_texture, b->fresnel.f0_texture) ||
        !same_texture(a->opacity_texture, b->opacity_texture) ||
        !same_texture(a->reflection_texture, b->reflection_texture) ||
        !same_texture(a->transmission_texture, b->transmission_texture) ||
        !same_texture(a->normal_texture, b->normal_texture) || a->lobe_count != b->lobe_count)
        return false;
    for (size_t k = 0; k < a->lobe_count; k++)
        if (!same_texture(a->lobe_textures ? a->lobe_textures[k] : NULL,
                          b->lobe_textures ? b->lobe_textures[k] : NULL) ||
            !same_texture(a->lobe_gloss ? a->lobe_gloss[k] : NULL,
                          b->lobe_gloss ? b->lobe_gloss[k] : NULL))
            return false;
    return true;
}
