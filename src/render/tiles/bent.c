#include "render/tiles/bent.h"

#include "render/tiles/seen_by.h"
#include "shade/bump.h"
#include "shade/gloss.h"

static shd_vec3 vector_at(double *const v[3], size_t i) {
    return (shd_vec3){v[0][i], v[1][i], v[2][i]};
}

static void set_vector(double *const v[3], size_t i, shd_vec3 value) {
    v[0][i] = value.x;
    v[1][i] = value.y;
    v[2][i] = value.z;
}

static shd_charted_point point_of(const shd_hits *hits, size_t i) {
    shd_charted_point out = {.position = vector_at(hits->position, i),
                             .normal = vector_at(hits->normal, i)};
    if (hits->triangle) {
        out.triangle = hits->triangle[i];
        out.b = hits->u[i];
        out.c = hits->v[i];
    }
    return out;
}

/* Turns the hit's normal, and keeps the surface's own. Returns the mean normal's length. */
static double turn_normal(const shd_plan_material *material, const shd_chart *chart,
                          const shd_charted_point *point, const shd_footprint *uv,
                          const shd_hits *hits, size_t i, shd_tile_scratch *s) {
    const shd_bump bump = shd_bump_at(material->normal, chart, point, uv);
    set_vector(s->sharp + 2 * material->lobe_count, i, point->normal);
    set_vector(hits->normal, i, bump.normal);
    return bump.length;
}

void shd_bent_sharpen(const shd_scenery *scenery, const shd_plan_material *material,
                      const shd_hits *hits, size_t first, size_t count, shd_tile_scratch *s) {
    const shd_plan *plan = scenery->plan;
    const shd_image_plane plane = shd_image_plane_of(plan->scene);
    shd_chart chart = {.object = NULL};
    for (size_t i = first; i < first + count; i++) {
        const shd_object *object = &plan->scene->objects[hits->object[i]];
        if (i % SHD_LANES == 0 && shd_is_cancelled(plan->cancelled)) return;
        if (chart.object != object) chart = shd_chart_of(object);
        const shd_charted_point point = point_of(hits, i);
        const shd_seen_by ray = shd_see_point(&plane, point.position, s->sample[hits->shot[i]]);
        shd_vec3 bend[2];
        shd_widening spread = {0, 0};
        shd_footprint uv;
        if (material->normal || material->gloss) uv = shd_chart_footprint(&chart, &point, &ray);
        const double length =
            material->normal ? turn_normal(material, &chart, &point, &uv, hits, i, s) : 1;
        if (material->antialiased && shd_is_curved(object) &&
            shd_bend_at(&chart, &point, &ray, bend))
            spread = shd_widening_of(material->model, plane.samples, bend,
                                     vector_at(hits->normal, i), vector_at(hits->view, i));
        for (size_t k = 0; k < material->lobe_count; k++) {
            const shd_sharpness mapped = shd_toksvig(material->model,
                                                     shd_gloss_of(material, k, &uv), length),
                                lobe = shd_widen(material->model, mapped.shininess, &spread);
            s->sharp[2 * k][i] = lobe.shininess;
            s->sharp[2 * k + 1][i] = mapped.share * lobe.share;
        }
    }
}
