/* Exponents and roughness of lobes, which may be patterns or pictures of numbers. */
#include "scene/read.h"

/* A number, or a texture of numbers within `range`, of which `out` becomes the least or the most.
 */
static void read_gloss(shd_reader *r, const shd_node *node, const shd_range *range, bool most,
                       double *out) {
    const shd_texture **place = (void *)((char *)out - r->field->offset + r->field->texture);
    double ends[2];
    *place = NULL;
    if (json_is_number(node->value)) {
        shd_read_number(r, node, out);
        return;
    }
    if (!json_object_get(node->value, "texture") && !json_object_get(node->value, "pattern")) {
        shd_node_expect(r->report, node,
                        r->in_library ? "a number"
                                      : "a number, or {pattern, values, uv}, or {texture, values, "
                                        "channel, uv}");
        return;
    }
    if (r->in_library) {
        shd_wrong(r, node, "a material of the library has no patterns or pictures");
        return;
    }
    shd_texture *texture = shd_take(r, 1, sizeof *texture);
    if (!texture || !shd_read_numbers(r, node, texture)) return;
    shd_texture_span(texture, &ends[0], &ends[1]);
    for (int e = 0; e < 2; e++) {
        if (shd_in_range(ends[e], range)) continue;
        shd_wrong(r, node, "as a pattern or a picture it must be %s everywhere, and this has %.9g",
                  range->text, ends[e]);
        return;
    }
    *out = ends[most];
    if (ends[0] < ends[1]) *place = texture;
}

void shd_read_shininess(shd_reader *r, const shd_node *node, void *out) {
    /* Below 1 highlights end at an edge, of which no mean over a footprint tells where it is. */
    static const shd_range exponents = {1, 1e9, .text = "1 to 1e9"};
    read_gloss(r, node, &exponents, true, out);
}

void shd_read_roughness(shd_reader *r, const shd_node *node, void *out) {
    read_gloss(r, node, r->field->range, false, out);
}
