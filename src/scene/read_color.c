/* Colors in every spelling, into the working space. */
#include <stdlib.h>
#include <string.h>

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
        [SHD_LAB] = {grey, none, none}};
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

/* "#rgb" or "#rrggbb" */
static bool parse_css(const char *text, double rgb[3]) {
    size_t digits = text[0] == '#' ? strlen(text + 1) : 0;
    if (digits != 3 && digits != 6) return false;
    if (strspn(text + 1, "0123456789abcdefABCDEF") != digits) return false;
    unsigned long value = strtoul(text + 1, NULL, 16);
    for (int c = 0; c < 3; c++) {
        unsigned shift = (unsigned)(2 - c) * (digits == 3 ? 4 : 8);
        unsigned byte = digits == 3 ? (value >> shift & 0xf) * 0x11 : value >> shift & 0xff;
        rgb[c] = byte / 255.0;
    }
    return true;
}

static void read_css(shd_reader *r, const shd_node *node, double *out) {
    double rgb[3];
    const char *text = json_string_value(node->value);
    if (!parse_css(text, rgb)) {
        shd_wrong(r, node, "expected a color like \"#rgb\" or \"#rrggbb\", got \"%s\"",
                  shd_quote(text).text);
        return;
    }
    if (!r->catalog->css) {
        shd_wrong(r, node, "the color configuration has no sRGB space for \"#rrggbb\" colors");
        return;
    }
    shd_convert_color(r, node, r->catalog->css, rgb);
    memcpy(out, rgb, sizeof rgb);
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
    shd_read_fields(r, node, fields, SHD_LENGTH(fields), 0, "a color", &color);
    if (r->wrong) return;
    double rgb[3] = {color.value.x, color.value.y, color.value.z};
    shd_convert_color(r, node, color.space, rgb);
    memcpy(out, rgb, sizeof rgb);
}

void shd_read_color(shd_reader *r, const shd_node *node, void *out) {
    double rgb[3] = {0};
    if (json_is_string(node->value)) {
        read_css(r, node, out);
    } else if (json_is_object(node->value)) {
        read_spaced(r, node, out);
    } else if (json_is_number(node->value)) {
        convert_grey(r, node, json_number_value(node->value), out);
    } else if (!json_is_array(node->value)) {
        shd_node_expect(r->report, node,
                        "a color: a number, [r, g, b], \"#rrggbb\" or {space, value}");
    } else if (shd_get_three(r, node, rgb)) {
        shd_convert_color(r, node, r->colors, rgb);
        memcpy(out, rgb, sizeof rgb);
    }
}
