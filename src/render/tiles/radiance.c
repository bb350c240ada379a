#include "render/tiles/radiance.h"

#include <string.h>

#include "plan/textures.h"

static bool counts(const shd_lobe *lobe) {
    return lobe->specular[0] != 0 || lobe->specular[1] != 0 || lobe->specular[2] != 0;
}

/* Where lobe `index` of the scene's material is among those that are not black. */
static void find_lobe(const shd_plan_material *material, size_t index, shd_terms *p) {
    const shd_material *from = material->from;
    p->first = 0;
    for (size_t k = 0; k < from->lobe_count && k < index; k++) p->first += counts(&from->lobes[k]);
    p->end = p->first;
    if (index < from->lobe_count) p->end += counts(&from->lobes[index]);
}

/* What is left of a material where its patterns are 0. */
static const shd_plan_material *low_of(const shd_plan_material *material) {
    return material->textures ? material->textures->low : material;
}

shd_part shd_part_of(const shd_plan *plan, const shd_plan_material *material, size_t plane) {
    const shd_layer_kind kind = plan->planes[plane].kind;
    const bool beauty = kind == SHD_LAYER_BEAUTY, light = kind == SHD_LAYER_LIGHT;
    shd_part p = {.emissive = beauty || kind == SHD_LAYER_EMISSIVE,
                  .ambient = beauty || kind == SHD_LAYER_AMBIENT};
    p.terms.diffuse = (beauty || light || kind == SHD_LAYER_DIFFUSE) && material->has_diffuse;
    if (beauty || light || kind == SHD_LAYER_SPECULAR) p.terms.end = material->lobe_count;
    if (kind == SHD_LAYER_LOBE) find_lobe(material, plan->planes[plane].light, &p.terms);
    const shd_plan_material *low = low_of(material);
    for (int c = 0; c < 3; c++) {
        if (p.emissive) p.constant[c] += low->emissive[c];
        if (p.ambient) p.constant[c] += low->ambient[c];
    }
    return p;
}

bool shd_has_slot(const shd_part *part, const shd_plan_slot *slot) {
    if (slot->of == SHD_SLOT_EMISSIVE) return part->emissive;
    if (slot->of == SHD_SLOT_AMBIENT) return part->ambient;
    if (slot->term == 0) return part->terms.diffuse;
    return slot->term - 1 >= part->terms.first && slot->term - 1 < part->terms.end;
}

size_t shd_plane_terms(const shd_plan *plan, const shd_plan_material *material, size_t plane,
                       float constant[3], shd_paint_term *terms, size_t *term_of) {
    const shd_part p = shd_part_of(plan, material, plane);
    const shd_plan_material *low = low_of(material);
    size_t count = 0;
    for (int c = 0; c < 3; c++) constant[c] = (float)p.constant[c];
    if (p.terms.diffuse) {
        for (int c = 0; c < 3; c++) terms[count].color[c] = (float)low->diffuse[c];
        term_of[count++] = 0;
    }
    for (size_t k = p.terms.first; k < p.terms.end; k++) {
        for (int c = 0; c < 3; c++) terms[count].color[c] = (float)low->lobes[k].specular[c];
        term_of[count++] = 1 + k;
    }
    for (size_t e = 0; e < shd_material_slots(material); e++) {
        const shd_plan_slot *slot = &material->textures->slots[e];
        if (!shd_has_slot(&p, slot)) continue;
        for (int c = 0; c < 3; c++) terms[count].color[c] = (float)slot->rise[c];
        term_of[count++] = 1 + material->lobe_count + e;
    }
    return count;
}

static void add_exact(const double color[3], bool grey, double *const *sums, size_t i,
                      double radiance[3]) {
    for (int c = 0; c < 3; c++)
        if (color[c] != 0) radiance[c] += color[c] * sums[grey ? 0 : c][i];
}

/* The same in a spectral scene, where each field has its own sums, or its own color. */
static void add_fields(const shd_plan_material *material, const shd_part *p, double *const *sums,
                       const double *const *weights, size_t i, double radiance[3]) {
    const size_t terms = 1 + material->lobe_count;
    for (size_t e = 0; e < material->textures->slot_count; e++) {
        const shd_plan_slot *slot = &material->textures->slots[e];
        const size_t fields = slot->field[0] == slot->field[1] ? 1 : 3;
        if (!shd_has_slot(p, slot)) continue;
        for (size_t k = 0; k < fields; k++) {
            const double w = weights[slot->field[k]][i];
            double *const *sum = sums + 3 * ((1 + k) * terms + slot->term);
            for (int c = 0; c < 3; c++)
                radiance[c] += w * (slot->of == SHD_SLOT_TERM ? sum[c][i] : slot->rises[k][c]);
        }
    }
}

/* What patterns of a part add at point i. */
static void add_slots(const shd_plan_material *material, const shd_part *p, bool grey,
                      double *const *sums, const double *const *weights, size_t i,
                      double radiance[3]) {
    if (material->textures->part_count) {
        add_fields(material, p, sums, weights, i, radiance);
        return;
    }
    for (size_t e = 0; e < material->textures->slot_count; e++) {
        const shd_plan_slot *slot = &material->textures->slots[e];
        if (!shd_has_slot(p, slot)) continue;
        double color[3];
        for (int c = 0; c < 3; c++) color[c] = slot->rise[c] * weights[slot->field[c]][i];
        if (slot->of == SHD_SLOT_TERM)
            add_exact(color, grey, sums + 3 * slot->term, i, radiance);
        else
            for (int c = 0; c < 3; c++) radiance[c] += color[c];
    }
}

void shd_sum_exactly(const shd_lighting *lighting, const shd_plan *plan,
                     const shd_plan_material *material, const uint32_t *which, size_t lights,
                     const shd_points64 *points, double *const *sums) {
    const size_t terms = 1 + material->lobe_count,
                 parts = material->textures ? material->textures->part_count : 0;
    for (size_t k = 0; k < (parts ? parts : 1); k++, sums += 3 * terms) {
        const shd_plan_material *of =
            parts ? &plan->materials[material->textures->parts + k] : material;
        shd_light_sums64(lighting, of, which, lights, points, of->has_diffuse ? sums : NULL,
                         sums + 3);
    }
}

enum { MIXED = 64 }; /* points at a time */

static void add_run(double color, const double *sums, size_t count, double *radiance) {
    for (size_t i = 0; color != 0 && i < count; i++) radiance[i] += color * sums[i];
}

/* Of points [first, first + count) of the sums; count <= MIXED. */
static void mix_terms(const shd_part *p, const shd_plan_material *low, bool grey,
                      double *const *sums, size_t first, size_t count, double radiance[3][MIXED]) {
    for (size_t c = 0; c < 3; c++) {
        const size_t of = grey ? 0 : c;
        for (size_t i = 0; i < count; i++) radiance[c][i] = p->constant[c];
        if (p->terms.diffuse) add_run(low->diffuse[c], sums[of] + first, count, radiance[c]);
        for (size_t k = p->terms.first; k < p->terms.end; k++)
            add_run(low->lobes[k].specular[c], sums[3 * (1 + k) + of] + first, count, radiance[c]);
    }
}

void shd_mix_exact(const shd_plan *plan, const shd_plan_material *material, size_t plane,
                   double *const *sums, const double *const *weights, size_t count,
                   float *const out[3]) {
    const shd_part p = shd_part_of(plan, material, plane);
    const shd_plan_material *low = low_of(material);
    const bool grey = plan->grey_lights;
    for (size_t first = 0; first < count; first += MIXED) {
        const size_t left = count - first, some = left < MIXED ? left : MIXED;
        double radiance[3][MIXED];
        mix_terms(&p, low, grey, sums, first, some, radiance);
        for (size_t i = 0; material->textures && i < some; i++) {
            double sum[3] = {radiance[0][i], radiance[1][i], radiance[2][i]};
            add_slots(material, &p, grey, sums, weights, first + i, sum);
            for (int c = 0; c < 3; c++) radiance[c][i] = sum[c];
        }
        for (int c = 0; c < 3; c++)
            for (size_t i = 0; i < some; i++) out[c][first + i] = (float)radiance[c][i];
    }
}

void shd_add_slots(const shd_plan *plan, const shd_plan_material *material, size_t plane,
                   double *const *sums, const double *const *weights, size_t count,
                   double *const radiance[3]) {
    const shd_part p = shd_part_of(plan, material, plane);
    for (size_t i = 0; i < count; i++) {
        double sum[3] = {radiance[0][i], radiance[1][i], radiance[2][i]};
        add_slots(material, &p, plan->grey_lights, sums, weights, i, sum);
        for (int c = 0; c < 3; c++) radiance[c][i] = sum[c];
    }
}
