#include "render/tiles/tinted.h"

#include <string.h>

#include "render/tiles/radiance.h"
#include "render/tiles/textured.h"

static void add_bins(size_t count, double by, const double (*from)[3], double (*out)[3]) {
    for (size_t b = 0; b < count; b++)
        for (int c = 0; c < 3; c++) out[b][c] += by * from[b][c];
}

/* Adds what lights do on some terms of the surface's material in a plane. */
static void add_lights(const shd_scenery *scenery, const shd_surface *at, size_t plane,
                       const shd_terms *terms, double (*out)[3]) {
    const shd_plan *plan = scenery->plan;
    const shd_plane *of = &plan->planes[plane];
    const shd_plan_object *object = &plan->objects[at->object];
    const bool lit = terms->diffuse || terms->first < terms->end;
    for (size_t j = 0; lit && j < object->light_count; j++) {
        const uint32_t light = object->lights[j];
        if (shd_is_cancelled(plan->cancelled)) return;
        if (of->kind == SHD_LAYER_LIGHT && plan->lights[light].index != of->light) continue;
        shd_light_bins(scenery->lighting, light, at, terms, out);
    }
}

/* Adds what a field of a slot does, whose part is the surface's material. */
static void add_field(const shd_scenery *scenery, const shd_surface *at, size_t plane,
                      const shd_plan_slot *slot, double w, double (*out)[3]) {
    const size_t bins = scenery->plan->bins->count;
    const shd_terms term = {slot->term == 0, slot->term ? slot->term - 1 : 0, slot->term};
    double spread[SHD_BINS_MOST][3];
    memset(spread, 0, bins * sizeof *spread);
    if (slot->of == SHD_SLOT_TERM) add_lights(scenery, at, plane, &term, spread);
    add_bins(bins, w,
             slot->of == SHD_SLOT_EMISSIVE  ? at->material->tint->emissive
             : slot->of == SHD_SLOT_AMBIENT ? at->material->tint->ambient
                                            : (const double(*)[3])spread,
             out);
}

void shd_tinted_plane(const shd_scenery *scenery, const shd_surface *at, size_t plane,
                      double *const *weights, double (*out)[3]) {
    const shd_plan *plan = scenery->plan;
    const shd_plan_textures *textures = at->material->textures;
    const shd_part part = shd_part_of(plan, at->material, plane);
    const bool mixed = textures && textures->part_count;
    shd_surface of = *at;
    const shd_plan_slot *facets = shd_facet_slot(at->material);
    double reflected[3], *const rows[3] = {&reflected[0], &reflected[1], &reflected[2]};
    if (facets) {
        shd_textured_facets(at->material, facets, weights, 1, rows);
        of.facets = (const double *const *)rows;
    }
    if (mixed) of.material = &plan->materials[textures->parts];
    if (part.emissive) add_bins(plan->bins->count, 1, of.material->tint->emissive, out);
    if (part.ambient) add_bins(plan->bins->count, 1, of.material->tint->ambient, out);
    add_lights(scenery, &of, plane, &part.terms, out);
    for (size_t e = 0; mixed && e < textures->slot_count; e++) {
        const shd_plan_slot *slot = &textures->slots[e];
        const size_t fields = slot->field[0] == slot->field[1] ? 1 : 3;
        for (size_t k = 0; shd_has_slot(&part, slot) && k < fields; k++) {
            of.material = &plan->materials[textures->parts + 1 + k];
            add_field(scenery, &of, plane, slot, weights[slot->field[k]][0], out);
        }
    }
}

void shd_tinted_hit(const shd_scenery *scenery, const shd_surface *at, const shd_tile_scratch *s,
                    size_t i, size_t plane, double (*out)[3]) {
    const shd_plan *plan = scenery->plan;
    double color[3];
    memset(out, 0, plan->bins->count * sizeof *out);
    if (!shd_sight_facets(scenery->sight, at->object)) {
        shd_tinted_plane(scenery, at, plane, s->weights, out);
        return;
    }
    for (int c = 0; c < 3; c++) color[c] = (double)s->sums[shd_sum_of(plan, plane, 0, c)][i];
    shd_bins_add_lifted(plan->bins, color, out);
}

void shd_tinted_planes(const shd_scenery *scenery, const shd_surface *at, shd_tile_scratch *s,
                       size_t i, const double radiance[3], double (*local)[3]) {
    const shd_plan *plan = scenery->plan;
    const double *opacity = at->rays ? at->rays->opacity : at->material->tint->opacity;
    double beauty[3], color[3] = {0};
    shd_bins_mix(plan->bins->count, opacity, (const double(*)[3])local, beauty);
    for (size_t p = 0; p < plan->plane_count; p++) {
        const shd_layer_kind kind = plan->planes[p].kind;
        if (kind == SHD_LAYER_SHADOW) continue;
        if (kind != SHD_LAYER_BEAUTY && kind != SHD_LAYER_BOUNCE) {
            shd_tinted_hit(scenery, at, s, i, p, local);
            shd_bins_mix(plan->bins->count, opacity, (const double(*)[3])local, color);
        }
        for (int c = 0; c < 3; c++) {
            if (kind == SHD_LAYER_BEAUTY) color[c] = radiance[c];
            if (kind == SHD_LAYER_BOUNCE) color[c] = radiance[c] - beauty[c];
            s->sums[shd_sum_of(plan, p, 0, c)][i] = (float)color[c];
        }
    }
}
