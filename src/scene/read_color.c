/* Colors in every spelling, into the working space. */
#include <string.h>

#include "base/transfer.h"
#include "scene/css.h"
#include "scene/read.h"

void shd_read_space(shd_reader *r, const shd_node *node, void *out) {
    enum { MOST = 256 };
    const char *names[MOST], *name = shd_get_text(r, node, "the name of a color space");
    const shd_space_info *space = name ? shd_catalog_space(r->catalog, name) : NULL;
    *(const shd_space_info **)out = space;
    if (!name || space) return;
    size_t count = 0;
    for (; count < r->catalog->space_count && count < MOST; count++)
        names[count] = r->catalog->spaces[count].name;
    shd_wrong(r, node, "there is no color space \"%s\"%s", shd_quote(name).text,
              shd_suggest(r->report, name, names, count).text);
}

void shd_convert_color(shd_reader *r, const shd_node *node, const shd_space_info *from,
                       double rgb[3]) {
    const shd_space_info *to = r->scene->working_space;
    if (from && from == to) return;
    double converted[3] = {rgb[0], rgb[1], rgb[2]};
    for (int c = 0; c < 3; c++) rgb[c] = NAN;
    if (!from || !to) return;
    shd_error error;
    shd_status status =
        r->catalog->convert(r->catalog->self, from->name, to->name, converted, &error);
    if (status)
        shd_node_report(r->report, node, status, "%s to %s: %s", from->name, to->name, error.text);
    else if (!isfinite(converted[0]) || !isfinite(converted[1]) || !isfinite(converted[2]))
        shd_wrong(r, node, "the color is too large to be converted to %s", to->name);
    else
        memcpy(rgb, converted, sizeof converted);
}

/* I and Q, or a and b, of greys: what integers store of a space has 128/255 there (docs/model.md,
 * Color). */
static double neutral_chroma(const shd_reader *r, const shd_space_info *space) {
    for (size_t i = 0; i < r->catalog->space_count; i++)
        if (r->catalog->spaces[i].file == space) return 128.0 / 255;
    return 0;
}

/* One number as a color of a space, which may be another space than RGB. */
static void make_grey(const shd_reader *r, const shd_space_info *space, double grey,
                      double out[3]) {
    const double none = neutral_chroma(r, space);
    const double greys[][3] = {
        [SHD_RGB] = {grey, grey, grey},
        [SHD_XYZ] = {0.3127 / 0.3290 * grey, grey, (1 - 0.3127 - 0.3290) / 0.3290 * grey}, /* D65 */
        [SHD_YIQ] = {grey, none, none},
        [SHD_HSV] = {0, 0, grey},
        [SHD_LAB] = {grey, none, none},
        [SHD_LCH] = {grey, 0, 0}};
    memcpy(out, greys[space->channels], sizeof greys[0]);
}

static void convert_grey(shd_reader *r, const shd_node *node, double grey, double out[3]) {
    if (r->colors) make_grey(r, r->colors, grey, out);
    shd_convert_color(r, node, r->colors, out);
}

void shd_default_color(shd_reader *r, double grey, double out[3]) {
    const shd_node document = {0};
    convert_grey(r, &document, grey, out);
}

void shd_read_working_space(shd_reader *r, const shd_node *node, void *out) {
    const shd_space_info **space = out;
    shd_read_space(r, node, out);
    if (!*space || (*space)->scene_linear) return;
    shd_wrong(r, node, "\"%s\" is not scene-linear: light cannot be added up in it",
              (*space)->name);
    *space = NULL;
}

/* What cannot be converted is reported here, once, and not for each color and each default. */
void shd_read_plain_space(shd_reader *r, const shd_node *node, void *out) {
    (void)out;
    double white[3] = {0};
    shd_read_space(r, node, &r->colors);
    if (r->colors) convert_grey(r, node, 1, white);
    if (isnan(white[0])) r->colors = NULL;
}

/* Reports a text that is no color. A name gets a suggestion only if one is near: nobody wants to
 * read all of them. */
static void refuse_css(shd_reader *r, const shd_node *node, const char *text,
                       const shd_css_wrong *wrong) {
    const char *names[SHD_CSS_NAMES];
    const shd_quoted quoted = shd_quote(text);
    shd_hint hint = {""};
    for (size_t i = 0; i < SHD_CSS_NAMES; i++) names[i] = shd_css_names[i].name;
    if (wrong->name[0]) hint = shd_suggest(r->report, wrong->name, names, SHD_CSS_NAMES);
    if (wrong->text[0])
        shd_wrong(r, node, "\"%s\" is no color of CSS: %s", quoted.text, wrong->text);
    else if (strstr(hint.text, "mean"))
        shd_wrong(r, node, "there is no color \"%s\" in CSS%s", quoted.text, hint.text);
    else
        shd_wrong(r, node,
                  "expected a color of CSS, as \"red\", \"#rrggbb\" or \"rgb(255 0 0)\", got "
                  "\"%s\"",
                  quoted.text);
}

static void read_css(shd_reader *r, const shd_node *node, double *out, double *alpha) {
    const char *text = json_string_value(node->value);
    shd_css_color color;
    shd_css_wrong wrong;
    if (!shd_css_read(text, &color, &wrong)) {
        refuse_css(r, node, text, &wrong);
        return;
    }
    const shd_space_info *space = color.linear ? r->catalog->rec709 : r->catalog->css;
    if (!space) {
        shd_wrong(r, node, "the color configuration has no %s space for colors like \"%s\"",
                  color.linear ? "linear Rec.709" : "sRGB", shd_quote(text).text);
        return;
    }
    shd_convert_color(r, node, space, color.rgb);
    memcpy(out, color.rgb, sizeof color.rgb);
    *alpha = color.alpha;
}

/* Whether an object is what stands for a coefficient elsewhere, which is reported. */
static bool is_misplaced(shd_reader *r, const shd_node *node) {
    const shd_node pattern = shd_node_member(node, "pattern"),
                   texture = shd_node_member(node, "texture");
    if (pattern.value)
        shd_wrong(
            r, &pattern,
            "a pattern has no place here: emissive, ambient, diffuse, specular, the specular of "
            "lobes, a fresnel's f0, opacity, reflection, transmission and normal may be patterns");
    else if (texture.value)
        shd_wrong(
            r, &texture,
            "a picture has no place here: emissive, ambient, diffuse, specular, the specular of "
            "lobes, a fresnel's f0, opacity, reflection and transmission may be pictures");
    return pattern.value || texture.value;
}

typedef struct spaced_color {
    const shd_space_info *space;
    shd_vec3 value;
} spaced_color;

static void read_spaced(shd_reader *r, const shd_node *node, double *out) {
    static const shd_field fields[] = {
        {"space", shd_read_space, offsetof(spaced_color, space), .required = true},
        {"value", shd_read_vector, offsetof(spaced_color, value), .required = true},
    };
    spaced_color color;
    if (is_misplaced(r, node)) return;
    shd_read_fields(r, node, fields, SHD_LENGTH(fields), 0, "a color", &color);
    if (r->wrong) return;
    double rgb[3] = {color.value.x, color.value.y, color.value.z};
    shd_convert_color(r, node, color.space, rgb);
    memcpy(out, rgb, sizeof rgb);
}

/* A number that the text has, as one of r->colors. */
static double plain_number(const shd_reader *r, double value) {
    return r->codes ? shd_curve_decode(SHD_TRANSFER_SRGB, value) : value;
}

static void read_components(shd_reader *r, const shd_node *node, double *out, double *alpha) {
    double rgba[4] = {0, 0, 0, *alpha};
    const bool good =
        shd_get_numbers(r, node, 3, 4, "an array of 3 numbers, or 4 with an alpha", rgba);
    if (rgba[3] >= 0 && rgba[3] <= 1) {
        *alpha = rgba[3];
    } else if (json_array_size(node->value) == 4) {
        const shd_node item = shd_node_item(node, 3);
        shd_wrong(r, &item, "an alpha is from 0 to 1, got %.9g", rgba[3]);
    }
    if (!good) return;
    for (int c = 0; c < 3; c++) rgba[c] = plain_number(r, rgba[c]);
    shd_convert_color(r, node, r->colors, rgba);
    memcpy(out, rgba, 3 * sizeof *rgba);
}

void shd_read_color_alpha(shd_reader *r, const shd_node *node, double rgb[3], double *alpha) {
    if (json_is_string(node->value))
        read_css(r, node, rgb, alpha);
    else if (json_is_object(node->value))
        read_spaced(r, node, rgb);
    else if (json_is_number(node->value))
        convert_grey(r, node, plain_number(r, json_number_value(node->value)), rgb);
    else if (json_is_array(node->value))
        read_components(r, node, rgb, alpha);
    else
        shd_node_expect(r->report, node,
                        "a color: a number, [r, g, b], \"#rrggbb\" or {space, value}");
}

void shd_read_color(shd_reader *r, const shd_node *node, void *out) {
    double alpha = 1;
    shd_read_color_alpha(r, node, out, &alpha);
    if (alpha != 1)
        shd_wrong(
            r, node,
            "an alpha below 1 may stand in `background` and a material's `diffuse` alone, got "
            "%.9g",
            alpha);
}
