#include "shade/ways32.h"

bool shd_ways32_hold(const shd_way_point *p, double most) {
    static const double LARGEST = 1e20, INDEX = 1e4, EXPONENT = 1e6, ROUGHNESS = 1e-3;
    const shd_plan_material *m = p->at->material;
    if (!(most < LARGEST && most > 1 / LARGEST) || m->model == SHD_MODEL_WESTIN) return false;
    if (m->model == SHD_MODEL_OREN_NAYAR) return m->lobe_count == 0;
    if (m->lobe_count != 1) return false;
    if (m->model == SHD_MODEL_PHONG_NORMALIZED && !p->energies) return false;
    if (m->model != SHD_MODEL_COOK_TORRANCE) return m->lobes[0].shininess <= EXPONENT;
    shd_fresnel own;
    const shd_fresnel *of = shd_index_at(p->at, &own);
    for (int c = 0; c < 3; c++)
        if (!(of->n[c] <= INDEX && of->k[c] <= INDEX)) return false;
    return m->lobes[0].shininess >= ROUGHNESS;
}
