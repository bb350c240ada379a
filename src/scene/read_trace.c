/* What rays beyond the eye's need: `trace`, and the members of materials that count with it. */
#include <string.h>

#include "scene/read.h"

void shd_read_switch(shd_reader *r, const shd_node *node, void *out) {
    if (json_is_boolean(node->value))
        *(bool *)out = json_is_true(node->value);
    else
        shd_node_expect(r->report, node, "true or false");
}

void shd_read_trace(shd_reader *r, const shd_node *node, void *out) {
    static const shd_range samples = {1, 1024, false, false, "1 to 1024"},
                           depth = {0, 16, false, false, "0 to 16"},
                           share = {0, 1, false, false, "0 to 1"};
    static const shd_field fields[] = {
        {"shadows", shd_read_switch, .offset = offsetof(shd_trace, shadows)},
        {"shadowSamples", shd_read_integer, offsetof(shd_trace, shadow_samples), .range = &samples},
        {"depth", shd_read_integer, offsetof(shd_trace, depth), .range = &depth},
        {"minContribution", shd_read_number, offsetof(shd_trace, min_contribution),
         .range = &share},
    };
    shd_trace *trace = out;
    *trace = (shd_trace){.shadow_samples = 16, .min_contribution = 0.001};
    if (node->value) shd_read_fields(r, node, fields, SHD_LENGTH(fields), 0, "trace", trace);
}

/* Rounding of color conversion. */
static const double SLACK = 1e-6;

/* NULL: it is none, or wrong. */
static const shd_curve *read_curve(shd_reader *r, const shd_node *node, double most,
                                   const char *expected, void *out) {
    void *at = (char *)out - r->field->offset + r->field->curve;
    const shd_curve **place = at;
    *place = NULL;
    if (!json_is_object(node->value)) return NULL;
    shd_read_color_or_spectrum(r, node, out);
    const shd_curve *curve = *place;
    for (size_t i = 0; curve && i < curve->count; i++) {
        const double value = curve->values[i] * curve->scale;
        if (value <= most) continue;
        shd_wrong(r, node, "must be %s at every wavelength, got %.9g", expected, value);
        return NULL;
    }
    return curve;
}

/* Reads a coefficient that is from 0 to `most` in every channel, as it is given and in the working
 * space, or at every wavelength. A number is every channel's, in any working space. */
static void read_share(shd_reader *r, const shd_node *node, double most, const char *expected,
                       double out[3]) {
    const size_t before = r->report->error_count;
    const bool grey = json_is_number(node->value);
    double rgb[3] = {0, 0, 0};
    const shd_curve *curve = read_curve(r, node, most, expected, out);
    /* Without `spectral`, it is its color. */
    if (curve && r->scene->spectral.channels) return;
    for (size_t k = 0; k < (grey ? 1 : json_array_size(node->value)) && k < 3; k++) {
        const shd_node item = grey ? *node : shd_node_item(node, k);
        const double given = json_is_number(item.value) ? json_number_value(item.value) : 0;
        if (!(given >= 0 && given <= most))
            shd_wrong(r, &item, "must be %s, got %.9g", expected, given);
    }
    if (grey)
        rgb[0] = rgb[1] = rgb[2] = json_number_value(node->value);
    else if (json_is_object(node->value))
        memcpy(rgb, out, sizeof rgb);
    else
        shd_read_color(r, node, rgb);
    if (r->report->error_count > before || isnan(rgb[0])) return;
    for (int c = 0; c < 3; c++) {
        if (rgb[c] >= -SLACK && rgb[c] <= most + SLACK) continue;
        shd_wrong(r, node, "must be %s in every channel of the working space, got %.9g", expected,
                  rgb[c]);
        return;
    }
    for (int c = 0; c < 3 && !grey; c++) {
        if (fabs(rgb[c]) <= SLACK) rgb[c] = 0;
        if (fabs(rgb[c] - 1) <= SLACK) rgb[c] = 1;
    }
    memcpy(out, rgb, sizeof rgb);
}

static bool is_texture(const shd_node *node) {
    return json_object_get(node->value, "pattern") || json_object_get(node->value, "texture");
}

void shd_read_opacity(shd_reader *r, const shd_node *node, void *out) {
    if (is_texture(node))
        shd_read_opacity_texture(r, node, out);
    else
        read_share(r, node, 1, "from 0 to 1", out);
}

void shd_read_bounced(shd_reader *r, const shd_node *node, void *out) {
    if (is_texture(node))
        shd_read_bounced_texture(r, node, out);
    else
        read_share(r, node, INFINITY, "0 or more", out);
}

static bool is_usual(const double rgb[3], double usual) {
    return rgb[0] == usual && rgb[1] == usual && rgb[2] == usual;
}

bool shd_is_rayed(const shd_material *m) {
    if (m->opacity_curve || m->reflection_curve || m->transmission_curve) return true;
    return !(is_usual(m->opacity, 1) && is_usual(m->reflection, 0) && is_usual(m->transmission, 0));
}

bool shd_same_rays(const shd_material *a, const shd_material *b) {
    return !memcmp(a->opacity, b->opacity, sizeof a->opacity) &&
           !memcmp(a->reflection, b->reflection, sizeof a->reflection) &&
           !memcmp(a->transmission, b->transmission, sizeof a->transmission);
}

void shd_warn_of_trace(shd_reader *r, const shd_node *node, const shd_material *m) {
    double most = 0;
    for (size_t c = 0; c < 3; c++) most = shd_larger(shd_bounced_most(m, c), most);
    if (shd_is_rayed(m) && !r->scene->trace.depth)
        shd_warn(r, node,
                 "opacity, reflection and transmission are not seen without a `depth` in "
                 "`trace`%s",
                 r->scene->trace.shadows ? ": only shadows are let through" : "");
    if (most > 1 + SLACK)
        shd_warn(r, node, "it mirrors and transmits %.4g times what its rays meet, in a channel",
                 most);
}
