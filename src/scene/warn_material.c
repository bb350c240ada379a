/* What of a material looks like a mistake. */
#include <string.h>

#include "scene/read_model.h"

static bool is_negative(const double rgb[3]) {
    return rgb[0] < 0 || rgb[1] < 0 || rgb[2] < 0;
}

/* As it is where it sends on most. */
static shd_lobe widest_lobe(const shd_material *m, size_t index) {
    shd_lobe out = m->lobes[index];
    double most;
    if (m->lobe_gloss && m->lobe_gloss[index] && m->model != SHD_MODEL_COOK_TORRANCE)
        shd_texture_span(m->lobe_gloss[index], &out.shininess, &most);
    return out;
}

/* The largest component of the share of light that a material sends on. Of ambient light it is
 * `ambient`. Of other light, from straight above, it is diffuse and each lobe's share: of Phong's,
 * 2 specular / (shininess + 2), since the lobe (R.V)^n holds 2 pi / (n + 2) of the hemisphere's pi.
 * Light from aside is sent on by more. */
static double most_reflected(const shd_material *m) {
    /* Patterns of metal and of what is none: the one is where the other is not. */
    const bool by_turns = m->diffuse_texture && m->fresnel.f0_texture;
    double most = 0;
    for (int c = 0; c < 3; c++) {
        double direct = m->diffuse[c], lobes = 0;
        for (size_t i = 0; i < m->lobe_count; i++) {
            const shd_lobe lobe = widest_lobe(m, i);
            lobes += lobe.specular[c] * shd_lobe_albedo(m, &lobe);
        }
        direct = by_turns ? shd_larger(direct, lobes) : direct + lobes;
        most = shd_larger(m->ambient[c], shd_larger(direct, most)); /* NAN is left out */
    }
    return most;
}

static bool same_lobes(const shd_material *a, const shd_material *b) {
    for (size_t i = 0; i < a->lobe_count; i++)
        if (memcmp(a->lobes[i].specular, b->lobes[i].specular, sizeof a->lobes[i].specular) != 0 ||
            a->lobes[i].shininess != b->lobes[i].shininess)
            return false;
    return true;
}

/* Whether there are warnings already about a material that is like this one. */
static bool is_warned(shd_reader *r, const shd_material *m) {
    for (size_t i = 0; i < r->warned_count; i++) {
        const shd_material *known = &r->warned[i];
        if (!memcmp(known->emissive, m->emissive, sizeof m->emissive) &&
            !memcmp(known->ambient, m->ambient, sizeof m->ambient) &&
            !memcmp(known->diffuse, m->diffuse, sizeof m->diffuse) && known->model == m->model &&
            known->lobe_count == m->lobe_count && same_lobes(known, m) && shd_same_rays(known, m) &&
            shd_same_textures(known, m))
            return true;
    }
    return false;
}

void shd_warn_of_material(shd_reader *r, const shd_node *node, const shd_material *m) {
    static const double slack = 1e-6; /* rounding of decimals and of color conversion */
    double reflected = most_reflected(m), sharpest = 0;
    bool negative = is_negative(m->emissive) || is_negative(m->ambient) || is_negative(m->diffuse);
    for (size_t i = 0; i < m->lobe_count; i++) {
        if (m->model != SHD_MODEL_COOK_TORRANCE)
            sharpest = shd_larger(m->lobes[i].shininess, sharpest);
        negative = negative || is_negative(m->lobes[i].specular);
    }
    bool amplifies = reflected > 1 + slack, sharp = sharpest > 1000;
    if (!(amplifies || sharp || negative || shd_is_rayed(m)) || is_warned(r, m)) return;
    if (amplifies)
        shd_warn(r, node,
                 "it sends on %.4g times the light that arrives, in a channel: ambient, or "
                 "diffuse + %s, is above 1",
                 reflected,
                 m->model == SHD_MODEL_PHONG ? "2 specular / (shininess + 2)"
                                             : "what its lobes reflect");
    if (sharp)
        shd_warn(r, node,
                 "a shininess of %.6g is above 1000: the highlight may be smaller than a pixel",
                 sharpest);
    if (negative) shd_warn(r, node, "a coefficient is negative");
    shd_warn_of_trace(r, node, m);
    if (r->warned_count < SHD_REPORT_KEEP) r->warned[r->warned_count++] = *m;
}
