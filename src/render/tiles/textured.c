#include "render/tiles/textured.h"

#include "render/tiles/seen_by.h"
#include "shade/beam.h"
#include "shade/chart.h"
#include "shade/split32.h"
#include "shade/texture.h"

/* ---- Points, as all tiers have them. ---- */

/* A coordinate of the frame, to 48 bits. */
static double rounded(double x) {
    float high, low;
    shd_split32(x, &high, &low);
    return (double)high + (double)low;
}

/* The normal of the plane of a shape's face. Only its direction counts. */
static shd_vec3 face_normal(const shd_facets *facets, uint32_t triangle) {
    const uint32_t *corner = facets->corners + 3 * (size_t)triangle;
    const shd_vec3 *at = facets->positions, first = at[corner[0]];
    if (corner[0] == corner[1]) return facets->normals[corner[0]];
    return shd_cross(shd_sub(at[corner[1]], first), shd_sub(at[corner[2]], first));
}

static shd_charted_point point_of(const shd_plan *plan, const shd_facets *facets,
                                  const shd_hits *hits, size_t i) {
    const double origin[3] = {plan->origin.x, plan->origin.y, plan->origin.z};
    double position[3], normal[3];
    for (int c = 0; c < 3; c++) {
        if (hits->position[c]) {
            position[c] = rounded((hits->position[c][i] - origin[c]) * plan->scale);
            normal[c] = (double)(float)hits->normal[c][i];
        } else {
            position[c] = (double)hits->position32[c][i] + (double)hits->low32[c][i];
            normal[c] = (double)hits->normal32[c][i];
        }
    }
    const shd_vec3 frame = {position[0], position[1], position[2]};
    shd_charted_point out = {.position = shd_madd(plan->origin, frame, 1 / plan->scale),
                             .normal = {normal[0], normal[1], normal[2]}};
    if (hits->triangle) {
        out.triangle = hits->triangle[i];
        out.b = hits->u[i];
        out.c = hits->v[i];
    }
    if (facets) out.normal = face_normal(facets, out.triangle);
    return out;
}

/* ---- Weights. ---- */

void shd_textured_weigh(const shd_scenery *scenery, const shd_plan_textures *textures,
                        const shd_hits *hits, size_t first, size_t count, shd_tile_scratch *s) {
    const shd_plan *plan = scenery->plan;
    const shd_image_plane plane = shd_image_plane_of(plan->scene);
    shd_chart chart = {.object = NULL};
    const shd_facets *facets = NULL;
    for (size_t i = 0; i < count; i++) {
        const shd_object *object = &plan->scene->objects[hits->object[first + i]];
        if (i % SHD_LANES == 0 && shd_is_cancelled(plan->cancelled)) return;
        if (chart.object != object) {
            chart = shd_chart_of(object);
            facets = shd_sight_facets(scenery->sight, (size_t)hits->object[first + i]);
        }
        const shd_charted_point point = point_of(plan, facets, hits, first + i);
        const shd_seen_by ray =
            shd_see_point(&plane, point.position, s->sample[hits->shot[first + i]]);
        const shd_footprint uv = shd_chart_footprint(&chart, &point, &ray);
        size_t field = 0;
        for (size_t p = 0; p < textures->pattern_count; p++) {
            const shd_pattern *pattern = &textures->patterns[p];
            const int fields = shd_pattern_fields(pattern);
            double means[3];
            shd_pattern_means(pattern, &uv, means);
            for (int c = 0; c < fields; c++) s->weights[field++][i] = means[c];
        }
        for (int k = 0; textures->rayed && k < SHD_RAY_COEFFICIENTS; k++) {
            if (!textures->rays[k].texture || !s->shares[k]) continue;
            double mean[3];
            shd_ray_mean(&textures->rays[k], &uv, mean);
            for (int c = 0; c < 3; c++) s->shares[k][c][first + i] = mean[c];
        }
    }
}

void shd_textured_weigh_beam(const shd_scenery *scenery, const shd_plan_textures *textures,
                             const shd_beam *beam, shd_tile_scratch *s) {
    const shd_footprint uv = shd_beam_footprint(scenery->plan->scene, beam);
    size_t field = 0;
    for (size_t p = 0; p < textures->pattern_count; p++) {
        const int fields = shd_pattern_fields(&textures->patterns[p]);
        double means[3];
        shd_pattern_means(&textures->patterns[p], &uv, means);
        for (int c = 0; c < fields; c++) s->beam[field++][0] = means[c];
    }
}

/* Both colors have a part of f0, so that one near 0, of whose root the index is, errs by no more of
 * itself than they do. */
static void find_indices(const shd_plan_textures *textures, double *const *weights, size_t count,
                         double *const out[3]) {
    for (int c = 0; c < 3; c++) {
        const double *w = weights[textures->fresnel->field[c]], low = textures->f0[0][c],
                     high = textures->f0[1][c];
        for (size_t i = 0; i < count; i++) out[c][i] = shd_index_of((1 - w[i]) * low + w[i] * high);
    }
}

void shd_textured_facets(const shd_plan_material *material, const shd_plan_slot *slot,
                         double *const *weights, size_t count, double *const out[3]) {
    const double *low = material->textures->low->diffuse;
    if (slot == material->textures->fresnel) {
        find_indices(material->textures, weights, count, out);
        return;
    }
    for (int c = 0; c < 3; c++) {
        const double *w = weights[slot->field[c]];
        for (size_t i = 0; i < count; i++)
            out[c][i] = shd_smaller(shd_larger(low[c] + slot->rise[c] * w[i], -1), 1);
    }
}

void shd_textured_sums(const shd_scenery *scenery, const shd_plan_material *material, size_t plane,
                       size_t first, size_t count, shd_tile_scratch *s) {
    const shd_plan *plan = scenery->plan;
    const int channels = plan->grey_lights ? 1 : 3;
    for (size_t e = 0; e < material->textures->slot_count; e++) {
        const shd_plan_slot *slot = &material->textures->slots[e];
        for (int c = 0; c < channels; c++) {
            const double *w = s->weights[slot->field[c]];
            float *out = s->sums[shd_sum_of(plan, plane, 1 + material->lobe_count + e, c)] + first;
            const float *sum = s->sums[shd_sum_of(plan, plane, slot->term, c)] + first;
            if (slot->of == SHD_SLOT_TERM)
                for (size_t i = 0; i < count; i++) out[i] = (float)w[i] * sum[i];
            else
                for (size_t i = 0; i < count; i++) out[i] = (float)w[i];
        }
    }
}
