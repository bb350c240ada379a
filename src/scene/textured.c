/* What is known of textures once they are read, and which objects they may be on. */
#include <string.h>

#include "scene/read.h"

/* ---- What they are between. ---- */

/* The color of either end of a picture's range, as its tint has it. */
static void color_at(const shd_texture *texture, const float end[4], double out[3]) {
    const int channel = texture->pattern.channel;
    for (int c = 0; c < 3; c++)
        out[c] = texture->high[c] * (double)end[channel == SHD_ALL_CHANNELS ? c : channel];
}

void shd_texture_ends(const shd_texture *texture, double ends[2][3]) {
    const shd_pyramid *picture = texture->pattern.picture;
    memcpy(ends[0], texture->low, sizeof ends[0]);
    memcpy(ends[1], texture->high, sizeof ends[1]);
    if (!picture) return;
    color_at(texture, picture->texels->low, ends[0]);
    color_at(texture, picture->texels->high, ends[1]);
}

void shd_texture_span(const shd_texture *texture, double *least, double *most) {
    const shd_pattern *p = &texture->pattern;
    const shd_texels *texels = p->picture ? p->picture->texels : NULL;
    const double low = texture->low[0], rise = texture->high[0] - low,
                 from = texels ? low + rise * (double)texels->low[p->channel] : low,
                 to = texels ? low + rise * (double)texels->high[p->channel] : low + rise;
    *least = shd_smaller(from, to);
    *most = shd_larger(from, to);
}

double shd_bounced_most(const shd_material *m, size_t channel) {
    const shd_texture *mirrored = m->reflection_texture, *refracted = m->transmission_texture;
    const double most = m->reflection[channel] + m->transmission[channel];
    double ends[2][2][3];
    if (!mirrored || !refracted || !shd_same_pattern(&mirrored->pattern, &refracted->pattern))
        return most;
    shd_texture_ends(mirrored, ends[0]);
    shd_texture_ends(refracted, ends[1]);
    return shd_smaller(most, shd_larger(ends[0][0][channel] + ends[1][0][channel],
                                        ends[0][1][channel] + ends[1][1][channel]));
}

/* ---- Materials and objects ---- */

static bool is_one_number(const shd_texture *texture) {
    double ends[2][3];
    if (!texture) return true;
    shd_texture_ends(texture, ends);
    for (int e = 0; e < 2; e++)
        for (int c = 1; c < 3; c++)
            if (ends[e][c] != ends[e][0]) return false;
    return shd_pattern_fields(&texture->pattern) == 1;
}

/* What rays go by is the same in all bins of a spectral scene. */
static void check_bins(shd_reader *r, const shd_node *node, const shd_material *m) {
    const char *wrong = !is_one_number(m->opacity_texture)        ? "an opacity"
                        : !is_one_number(m->reflection_texture)   ? "a reflection"
                        : !is_one_number(m->transmission_texture) ? "a transmission"
                                                                  : NULL;
    if (r->scene->spectral.channels && wrong)
        shd_wrong(
            r, node,
            "in a spectral scene %s that is a pattern or a picture is one number: give greys, "
            "or a `channel`",
            wrong);
}

void shd_check_textured(shd_reader *r, const shd_node *node, const shd_object *object) {
    const shd_material *material = &r->materials[object->material];
    if (!shd_is_textured(material)) return;
    const bool bare = object->shape == SHD_MESH && object->mesh && !object->mesh->uvs;
    if (bare)
        shd_wrong(r, node, "a material with %s needs `uvs` on a mesh",
                  material->normal_texture ? "a map of normals" : "a pattern or a picture");
    check_bins(r, node, material);
    if (material->fresnel.f0_texture && object->interpolation != SHD_PHONG)
        shd_wrong(r, node,
                  "a fresnel `f0` that is a pattern or a picture needs interpolation phong: what "
                  "facets mirror is another share at each angle, so that `f0` is no factor of the "
                  "light that faces or corners have");
    if (material->model != SHD_MODEL_WESTIN) return;
    if (material->diffuse_texture && object->interpolation != SHD_PHONG)
        shd_wrong(r, node,
                  "the facets of a westin material with a pattern or picture need interpolation "
                  "phong: they light each other, so that `diffuse` is no factor of the light that "
                  "faces or corners have");
    /* Parts of a spectral scene's material have no table. */
    if (r->scene->spectral.channels &&
        (material->diffuse_texture || material->emissive_texture || material->ambient_texture))
        shd_wrong(r, node,
                  "a westin material has no pattern or picture in a spectral scene: its "
                  "microgeometry is no sum of those of other colors");
}
