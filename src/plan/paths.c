#include "plan/paths.h"

/* Nanoseconds of a ray, of the processor that kernel_costs.h names: it depends on what it passes,
 * and this is for a few objects. */
static const double RAY = 300;

/* The most that rays bring from a surface; *rays is how many there are. */
static double find_most(const shd_material *m, int *rays) {
    double mirrored = 0, bent = 0, behind = 0;
    for (int c = 0; c < 3; c++) {
        mirrored = shd_larger(m->opacity[c] * m->reflection[c], mirrored);
        bent = shd_larger(m->opacity[c] * m->transmission[c], bent);
        behind = shd_larger(1 - m->opacity[c], behind);
    }
    *rays = (mirrored > 0) + (bent > 0) + (behind > 0);
    return mirrored + bent + behind;
}

shd_paths shd_find_paths(const shd_plan *plan) {
    const shd_trace *trace = &plan->scene->trace;
    shd_paths paths = {0, 0, 0};
    double most = 0, rays = 0;
    for (size_t i = 0; trace->depth && i < plan->scene->object_count; i++) {
        int some;
        const double m = find_most(plan->materials[plan->objects[i].material].from, &some);
        paths.bouncing += some > 0;
        most = shd_larger(m, most);
        rays = shd_larger(some, rays);
    }
    if (!paths.bouncing) return paths;
    double weight = 1, wide = 1;
    for (int l = 0; l < trace->depth && wide < 1e9; l++) {
        weight *= most;
        if (weight < trace->min_contribution) break;
        wide *= rays;
        paths.steps += wide;
    }
    const double deep = pow(most, trace->depth + 1),
                 faint = trace->min_contribution * pow(rays, trace->depth);
    paths.cut = fmin(fmax(deep, 1), deep + faint);
    return paths;
}

/* Rays from a point to the lights of an object. */
static double count_lights(const shd_plan *plan, size_t object) {
    const shd_trace *trace = &plan->scene->trace;
    const shd_plan_object *lit = &plan->objects[object];
    double rays = 0;
    for (size_t j = 0; trace->shadows && j < lit->light_count; j++)
        rays += plan->lights[lit->lights[j]].shape ? trace->shadow_samples : 1;
    return rays;
}

double shd_traced_cost(const shd_plan *plan, const shd_paths *paths, size_t object) {
    if (!shd_is_traced(plan->scene)) return 0;
    const shd_material *m = plan->materials[plan->objects[object].material].from;
    int rays;
    double from = find_most(m, &rays) > 0 ? paths->steps : 0;
    return RAY * (count_lights(plan, object) * (1 + from) + from);
}
