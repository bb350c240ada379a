/* What kernels of the standard tier need of models beside Phong's. */
#include <math.h>

#include "shade/packed.h"

/* Terms below this, of the first one, are nothing beside f32's rounding. */
static const double LEAST_TERM = 2e-9;

static shd_packed_energy32 pack_energy(const shd_packed_energy *from) {
    shd_packed_energy32 out = {.exponent = (float)(from->half + 1),
                               .beta = (float)from->beta,
                               .kappa = (float)from->kappa,
                               .twice = (float)from->twice,
                               .shift = (float)(-from->middle * from->twice),
                               .gain = (float)(SHD_PI * (2 * from->half + 2)),
                               .slope = (float)(2 * SHD_PI),
                               .low = (float)shd_normalized_low(2 * from->half)};
    for (int k = 0; k < SHD_ENERGY_TERMS; k++) {
        out.terms[k] = (float)from->terms[k];
        if (fabs(from->terms[k]) > LEAST_TERM * fabs(from->terms[0])) out.count = k + 1;
    }
    return out;
}

const shd_packed_model *shd_pack_model32(const shd_plan *plan, const shd_plan_material *material,
                                         const shd_packed_energy *energies, shd_arena *arena) {
    const double square = material->from->sigma * material->from->sigma;
    shd_packed_model *out = shd_arena_alloc(arena, 1, sizeof *out);
    shd_packed_energy32 *narrow =
        shd_arena_alloc(arena, energies ? material->lobe_count : 0, sizeof *narrow);
    if (!out || !narrow) return NULL;
    for (size_t k = 0; energies && k < material->lobe_count; k++)
        narrow[k] = pack_energy(&energies[k]);
    *out = (shd_packed_model){.even = (float)(1 - square / (2 * (square + 0.33))),
                              .rough = (float)(0.45 * square / (square + 0.09)),
                              .cut = (float)shd_lobe_cut(plan->scene->light_count),
                              .energies = energies ? narrow : NULL};
    return out;
}
