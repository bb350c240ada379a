/* Colors in every spelling, into the working space. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "scene/read.h"

static const shd_space_info *find_space(shd_reader *r, const shd_node *node, const char *name) {
    const shd_space_info *space = shd_catalog_space(r->catalog, name);
    if (space) return space;
    enum { MOST = 256 };
    const char *names[MOST];
    size_t count = r->catalog->space_count < MOST ? r->catalog->space_count : MOST;
    for (size_t i = 0; i < count; i++) names[i] = r->catalog->spaces[i].name;
    shd_wrong(r, node, "there is no color space \"%s\"%s", shd_quote(name).text,
              shd_suggest(r->report, name, names, count).text);
    return NULL;
}

const shd_space_info *shd_read_space(shd_reader *r, const shd_node *node) {
    if (json_is_string(node->value)) return find_space(r, node, json_string_value(node->value));
    shd_node_expect(r->report, node, "the name of a color space");
    return NULL;
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
        shd_node_fail(r->report, node, status, "%s to %s: %s", from->name, to->name, error.text);
    else if (!isfinite(converted[0]) || !isfinite(converted[1]) || !isfinite(converted[2]))
        shd_wrong(r, node, "the color is too large to be converted to %s", to->name);
    else
        memcpy(rgb, converted, sizeof converted);
}

/* One number as a color of a space, which may be another space than RGB. */
static void make_grey(const shd_space_info *space, double grey, double out[3]) {
    out[0] = space->channels == SHD_HSV ? 0 : grey;
    out[1] = space->channels == SHD_RGB ? grey : 0;
    out[2] = space->channels == SHD_YIQ ? 0 : grey;
}

/* Reads `colorSpace` and `workingSpace` of the document, whichever the node is. */
void shd_read_spaces(shd_reader *r, const shd_node *node, void *out) {
    (void)out;
    bool working = !strcmp(node->key, "workingSpace");
    const shd_space_info *space = shd_read_space(r, node);
    if (space && working && !space->scene_linear) {
        shd_wrong(r, node, "\"%s\" is not scene-linear: light cannot be added up in it",
                  space->name);
        space = NULL;
    }
    *(working ? &r->scene->working_space : &r->colors) = space;
    if (working || !space) return;
    /* Reported once, not for each color and each default. */
    double white[3];
    make_grey(space, 1, white);
    shd_convert_color(r, node, space, white);
    if (isnan(white[0])) r->colors = NULL;
}

void shd_default_color(shd_reader *r, double grey, double out[3]) {
    shd_node document = {0};
    if (r->colors) make_grey(r->colors, grey, out);
    shd_convert_color(r, &document, r->colors, out);
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
    double value[3];
    bool good;
} spaced_color;

static void read_color_space(shd_reader *r, const shd_node *node, void *out) {
    if (node->value)
        *(const shd_space_info **)out = shd_read_space(r, node);
    else
        shd_wrong(r, node->parent, "the member \"space\" is missing");
}

static void read_color_value(shd_reader *r, const shd_node *node, void *out) {
    spaced_color *color = out;
    if (!node->value)
        shd_wrong(r, node->parent, "the member \"value\" is missing");
    else
        color->good = shd_get_three(r, node, &shd_any_number, color->value);
}

static void read_spaced(shd_reader *r, const shd_node *node, double *out) {
    static const shd_field fields[] = {
        {"space", read_color_space, offsetof(spaced_color, space), .always = true},
        {"value", read_color_value, .always = true},
    };
    spaced_color color = {0};
    shd_read_fields(r, node, fields, sizeof fields / sizeof fields[0], 0, "a color", &color);
    if (!color.space || !color.good) return;
    shd_convert_color(r, node, color.space, color.value);
    memcpy(out, color.value, sizeof color.value);
}

void shd_read_color(shd_reader *r, const shd_node *node, void *out) {
    double rgb[3] = {0};
    if (json_is_string(node->value)) {
        read_css(r, node, out);
        return;
    }
    if (json_is_object(node->value)) {
        read_spaced(r, node, out);
        return;
    }
    if (json_is_number(node->value)) {
        if (r->colors) make_grey(r->colors, json_number_value(node->value), rgb);
    } else if (!json_is_array(node->value)) {
        shd_node_expect(r->report, node,
                        "a color: a number, [r, g, b], \"#rrggbb\" or {space, value}");
        return;
    } else if (!shd_get_three(r, node, &shd_any_number, rgb)) {
        return;
    }
    shd_convert_color(r, node, r->colors, rgb);
    memcpy(out, rgb, sizeof rgb);
}
