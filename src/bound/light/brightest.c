#include "bound/light/brightest.h"

#include "plan/around.h"
#include "plan/paths.h"

double shd_shape_distance(const shd_place *place, const shd_light *shape) {
    return shd_larger(shd_least_distance(place, shape->position) - shd_light_reach(shape), 0);
}

double shd_tinted_most(const shd_plan *plan, const shd_plan_material *material,
                       const shd_light *emitter) {
    double color[SHD_BINS_MOST][3];
    const double most = shd_most_in_bins(plan->bins, material->tint->emissive) +
                        shd_most_in_bins(plan->bins, material->tint->ambient);
    if (!emitter) return most;
    shd_light_in_bins(plan, emitter, color);
    const double shines = shd_most_in_bins(plan->bins, (const double(*)[3])color);
    return shd_larger(most, shines * (SHD_PI / shd_light_area(emitter)));
}

/* Adds the most of one light on one term to each channel. */
static void add_term(const shd_plan *plan, const shd_plan_material *m, const shd_plan_light *light,
                     size_t term, const shd_place *place, double most[3]) {
    const double *color = term ? m->lobes[term - 1].specular : m->diffuse;
    const shd_peak peak = shd_peak_of(m, term);
    double by[3], weight;
    for (int c = 0; c < 3; c++) by[c] = fabs(color[c] * light->color[c]);
    if (plan->bins) shd_term_most(plan, m, light, term, by);
    if (light->environment)
        weight = shd_around_most_of(light->environment, m, term, INFINITY);
    else if (light->shape)
        weight = shd_shape_most(light->shape, &peak, shd_shape_distance(place, light->shape));
    else if (light->directional)
        weight = peak.most * light->gain;
    else
        weight = peak.most * shd_attenuation(light, shd_least_distance(place, light->position));
    for (int c = 0; c < 3; c++)
        if (by[c] > 0) most[c] += by[c] * weight;
}

static double brightest_of(const shd_plan *plan, size_t index) {
    const shd_plan_object *bounds = &plan->objects[index];
    const shd_plan_material *m = &plan->materials[bounds->material];
    const shd_light *emitter = plan->scene->objects[index].emitter;
    const shd_place place = shd_place_of(&plan->scene->objects[index], bounds);
    double most[3], worst = 0;
    for (int c = 0; c < 3; c++) most[c] = fabs(m->emissive[c]) + fabs(m->ambient[c]);
    for (int c = 0; emitter && c < 3; c++) /* a mirror may see the side that the eye does not */
        most[c] = shd_larger(most[c], fabs(emitter->color[c]) * (SHD_PI / shd_light_area(emitter)));
    if (plan->tinted) most[0] = most[1] = most[2] = shd_tinted_most(plan, m, emitter);
    for (size_t j = 0; j < bounds->light_count; j++) {
        if (shd_is_cancelled_at(plan->cancelled, j)) break;
        for (size_t t = 0; t < 1 + m->lobe_count; t++)
            add_term(plan, m, &plan->lights[bounds->lights[j]], t, &place, most);
    }
    for (int c = 0; c < 3; c++) worst = shd_larger(worst, most[c]);
    return worst;
}

/* With I = o (local + r I' + t I'') + (1 - o) I''' and r + t at most s, no I is more than the
 * largest of local / (1 - s) and the background. */
double shd_brightest(const shd_plan *plan) {
    const shd_scene *scene = plan->scene;
    double local = 0, on = 0, behind = shd_backdrop_most(plan);
    for (int c = 0; c < 3 && !scene->transparent; c++)
        behind = shd_larger(behind, fabs(scene->background[c]));
    for (size_t i = 0; i < scene->object_count; i++) {
        if (shd_is_cancelled_at(plan->cancelled, i)) break;
        local = shd_larger(local, brightest_of(plan, i));
        on = shd_larger(on, shd_sent_on(plan, i));
    }
    if (plan->tinted)
        behind =
            shd_larger(shd_backdrop_most(plan), shd_most_in_bins(plan->bins, plan->background));
    if (!(on < 1) || plan->beyond) return local > 0 || behind > 0 ? INFINITY : 0;
    const double most = shd_larger(local / (1 - on), behind);
    return most < 1e37 ? most : INFINITY;
}
