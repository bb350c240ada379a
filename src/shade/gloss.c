#include "shade/gloss.h"

#include "shade/texture.h"

double shd_gloss_of(const shd_plan_material *material, size_t lobe, const shd_footprint *uv) {
    const shd_gloss *gloss = material->gloss ? &material->gloss[lobe] : NULL;
    if (!gloss || !gloss->texture) return material->lobes[lobe].shininess;
    const shd_texture *texture = gloss->texture;
    const double low = texture->low[0], rise = texture->high[0] - low;
    double means[3];
    shd_pattern_means(&texture->pattern, uv, means);
    return shd_smaller(shd_larger(low + rise * means[0], gloss->least), gloss->most);
}
