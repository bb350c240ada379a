#include "render/tiles/tinted.h"

#include <string.h>

#include "render/tiles/radiance.h"

static void add_bins(size_t count, const double (*from)[3], double (*out)[3]) {
    for (size_t b = 0; b < count; b++)
        for (int c = 0; c < 3; c++) out[b][c] += from[b][c];
}

void shd_tinted_plane(const shd_scenery *scenery, const shd_surface *at, size_t plane,
                      double (*out)[3]) {
    const shd_plan *plan = scenery->plan;
    const shd_plane *of = &plan->planes[plane];
    const shd_part part = shd_part_of(plan, at->material, plane);
    const shd_plan_object *object = &plan->objects[at->object];
    const bool lit = part.terms.diffuse || part.terms.first < part.terms.end;
    if (part.emissive) add_bins(plan->bins->count, at->material->tint->emissive, out);
    if (part.ambient) add_bins(plan->bins->count, at->material->tint->ambient, out);
    for (size_t j = 0; lit && j < object->light_count; j++) {
        const uint32_t light = object->lights[j];
        if (shd_is_cancelled(plan->cancelled)) return;
        if (of->kind == SHD_LAYER_LIGHT && plan->lights[light].index != of->light) continue;
        shd_light_bins(scenery->lighting, light, at, &part.terms, out);
    }
}

void shd_tinted_hit(const shd_scenery *scenery, const shd_surface *at, const shd_tile_scratch *s,
                    size_t i, size_t plane, double (*out)[3]) {
    const shd_plan *plan = scenery->plan;
    double color[3];
    memset(out, 0, plan->bins->count * sizeof *out);
    if (!scenery->facets[at->object]) {
        shd_tinted_plane(scenery, at, plane, out);
        return;
    }
    for (int c = 0; c < 3; c++) color[c] = (double)s->sums[shd_sum_of(plan, plane, 0, c)][i];
    shd_bins_add_lifted(plan->bins, color, out);
}

void shd_tinted_planes(const shd_scenery *scenery, const shd_surface *at, shd_tile_scratch *s,
                       size_t i, const double radiance[3], double (*local)[3]) {
    const shd_plan *plan = scenery->plan;
    const double *opacity = at->material->tint->opacity;
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
