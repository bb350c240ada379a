#include "render/tiles/radiance.h"

#include <string.h>

/* What of a material a plane shows. */
typedef struct part {
    double constant[3];
    bool diffuse, specular;
} part;

static part part_of(const shd_plan *plan, const shd_plan_material *material, size_t plane) {
    const shd_layer_kind kind = plan->planes[plane].kind;
    const bool beauty = kind == SHD_LAYER_BEAUTY, light = kind == SHD_LAYER_LIGHT;
    part p = {.diffuse = (beauty || light || kind == SHD_LAYER_DIFFUSE) && material->has_diffuse,
              .specular = beauty || light || kind == SHD_LAYER_SPECULAR};
    for (int c = 0; c < 3; c++) {
        if (beauty || kind == SHD_LAYER_EMISSIVE) p.constant[c] += material->emissive[c];
        if (beauty || kind == SHD_LAYER_AMBIENT) p.constant[c] += material->ambient[c];
    }
    return p;
}

size_t shd_plane_terms(const shd_plan *plan, const shd_plan_material *material, size_t plane,
                       float constant[3], shd_paint_term *terms, size_t *term_of) {
    const part p = part_of(plan, material, plane);
    size_t count = 0;
    for (int c = 0; c < 3; c++) constant[c] = (float)p.constant[c];
    if (p.diffuse) {
        for (int c = 0; c < 3; c++) terms[count].color[c] = (float)material->diffuse[c];
        term_of[count++] = 0;
    }
    for (size_t k = 0; p.specular && k < material->lobe_count; k++) {
        for (int c = 0; c < 3; c++) terms[count].color[c] = (float)material->lobes[k].specular[c];
        term_of[count++] = 1 + k;
    }
    return count;
}

static void add_exact(const double color[3], bool grey, double *const *sums, size_t i,
                      double radiance[3]) {
    for (int c = 0; c < 3; c++)
        if (color[c] != 0) radiance[c] += color[c] * sums[grey ? 0 : c][i];
}

void shd_mix_exact(const shd_plan *plan, const shd_plan_material *material, size_t plane,
                   double *const *sums, size_t count, float *const out[3]) {
    const part p = part_of(plan, material, plane);
    const bool grey = plan->grey_lights;
    for (size_t i = 0; i < count; i++) {
        double radiance[3];
        memcpy(radiance, p.constant, sizeof radiance);
        if (p.diffuse) add_exact(material->diffuse, grey, sums, i, radiance);
        for (size_t k = 0; p.specular && k < material->lobe_count; k++)
            add_exact(material->lobes[k].specular, grey, sums + 3 * (1 + k), i, radiance);
        for (int c = 0; c < 3; c++) out[c][i] = (float)radiance[c];
    }
}
