/* Outputs that show a scope. */
#include "scene/read.h"

static void refuse_member(shd_reader *r, const shd_node *node, const char *name, const char *why) {
    const shd_node at = shd_node_member(node, name);
    shd_wrong(r, at.value ? &at : node, "%s", why);
}

/* What the output would display must be what the scope is of. */
static void check_scoped(shd_reader *r, const shd_node *node, const shd_output *out,
                         shd_holds holds) {
    const shd_channels channels = out->color_space ? out->color_space->channels : SHD_RGB;
    if (holds == SHD_HOLDS_DATA)
        refuse_member(r, node, "scope", "this output is data: scopes are of colors");
    else if (out->scope == SHD_SCOPE_FALSECOLOR && !r->catalog->rec709)
        refuse_member(r, node, "scope",
                      "the color configuration has no space lin_rec709, whose Y is needed");
    else if (out->scope == SHD_SCOPE_GAMUT && channels != SHD_RGB)
        refuse_member(r, node, "scope", "a gamut is of R, G and B: this output has other channels");
    else if (out->scope != SHD_SCOPE_FALSECOLOR && out->scope != SHD_SCOPE_CHROMATICITY &&
             channels != SHD_RGB && channels != SHD_YIQ)
        refuse_member(r, node, "scope",
                      "this scope is of R, G and B or of Y, I and Q: this output has other "
                      "channels");
}

void shd_check_scope(shd_reader *r, const shd_node *node, const shd_output *out, shd_holds holds) {
    static const char *const members[] = {"channel", "layers", "dither"};
    for (size_t i = 0; i < SHD_LENGTH(members); i++)
        if (shd_node_member(node, members[i]).value)
            refuse_member(r, node, members[i],
                          "a scope is a picture of its own, without this member");
    if (shd_format_get(out->format)->linear)
        refuse_member(r, node, "format", "a scope is no light: set format png, jpeg, webp or tiff");
    else if (out->depth && out->depth != SHD_U8)
        refuse_member(r, node, "bitDepth", "a scope has 8 bits");
    if (!r->wrong) check_scoped(r, node, out, holds);
}
