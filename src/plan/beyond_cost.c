/* What lights cost that go beyond Phong's model and points. */
#include <math.h>

#include "plan/around.h"
#include "plan/cost.h"
#include "plan/textures.h"

/* Nanoseconds of a light at a hit, of the processor that kernel_costs.h names:
 * `tests/bench/costs.py --beyond` measures pictures beside what these make of them. */
typedef struct light_cost {
    double light, lobe;
} light_cost;

/* How a light is summed: vectors of points, or one by one where shadows have shares of bins. */
enum { VECTORS, ALONE, WAYS };

/* Lights that are points, beyond what kernels take for Phong's model. */
static const double models[SHD_MODEL_COUNT] = {
    [SHD_MODEL_BLINN_PHONG] = 7,    [SHD_MODEL_PHONG_NORMALIZED] = 10, [SHD_MODEL_OREN_NAYAR] = 2,
    [SHD_MODEL_COOK_TORRANCE] = 10, [SHD_MODEL_WESTIN] = 90,
};
static const light_cost points = {25, 15}; /* alone */

/* How many times as dear microgeometry is without its kernels, which know of one color of facets.
 */
static const double VARIED = 8;

/* The same in f32, by instructions beside those of Phong's model. */
static const double models32[SHD_MODEL_COUNT] = {[SHD_MODEL_BLINN_PHONG] = 0.6,
                                                 [SHD_MODEL_PHONG_NORMALIZED] = 0.8,
                                                 [SHD_MODEL_OREN_NAYAR] = 0.6};

/* What vectors take more behind shadows, for the points of a crowd. */
static const double SHARED = 8;

/* Lights with a shape on Phong's model, by their boundary. */
static const light_cost rects[WAYS] = {{31, 39}, {400, 260}},
                        rounds[WAYS] = {{106, 350}, {380, 600}};

/* A lobe with a real exponent, by quadrature along edges. */
static const double REAL_LOBE = 1950;

/* Other models, by quadrature over the shape: a rectangle, and how many times that others take. */
static const double ROUND = 1.75;
static const double quadratures[SHD_MODEL_COUNT] = {
    [SHD_MODEL_BLINN_PHONG] = 17e3, [SHD_MODEL_PHONG_NORMALIZED] = 29e3,
    [SHD_MODEL_OREN_NAYAR] = 5e3,   [SHD_MODEL_COOK_TORRANCE] = 22e3,
    [SHD_MODEL_WESTIN] = 97e3,
};

static bool has_moments(double shininess) {
    return shininess == floor(shininess) && shininess <= 96; /* SHD_MOMENTS_MOST */
}

static double shape_cost(const shd_plan_material *m, const shd_light *shape, int way) {
    const bool rect = shape->type == SHD_LIGHT_RECT;
    const light_cost *cost = rect ? &rects[way] : &rounds[way];
    if (m->model != SHD_MODEL_PHONG) return (rect ? 1 : ROUND) * quadratures[m->model];
    double sum = cost->light;
    for (size_t k = 0; k < m->lobe_count; k++)
        sum += !rect || has_moments(m->lobes[k].shininess) ? cost->lobe : REAL_LOBE;
    return sum;
}

/* Environments: a look at a table, of a lobe with the cut that some points have; and quadrature. */
static double around_cost(const shd_plan *plan, const shd_plan_material *m,
                          const shd_plan_light *light) {
    static const double DIFFUSE = 90, LOBE = 500, QUADRATURE = 1e6, OF_ROOTS = 2.5e6, WALK = 6e5,
                        QUICK = 4e4, SOME = 0.2 /* of points, where tables are of another lobe */,
                        OWN = 0.4 /* of walks, that a smooth ball has by one sample a pixel */;
    const double walk = plan->glows ? QUICK * (shd_may_share_walks(plan, m)
                                                   ? OWN / pow(plan->scene->raster.samples, 0.25)
                                                   : 1)
                                    : WALK;
    double sum = 0;
    for (size_t t = m->has_diffuse ? 0 : 1; t < 1 + m->lobe_count; t++) {
        const double exponent = t ? m->lobes[t - 1].shininess : 1;
        if (!shd_is_symmetric(m->model, t))
            sum += walk * (t && m->indices ? ceil((double)plan->bins->count / 3) : 1);
        else if (shd_find_glow(plan, m, light, t))
            sum += (t ? LOBE : DIFFUSE) + (shd_may_be_walked(m, t) ? SOME * QUICK : 0);
        else
            sum += exponent < 2 && exponent != floor(exponent) ? OF_ROOTS : QUADRATURE;
    }
    return sum;
}

double shd_beyond_cost(const shd_plan *plan, const shd_plan_material *m,
                       const shd_plan_light *light, shd_tier tier, double vectors) {
    const bool shadows = plan->scene->trace.shadows;
    const int way = shadows && plan->tinted ? ALONE : VECTORS;
    const double shared = shadows ? SHARED : 0;
    if (plan->models32 && tier != SHD_EXACT) return vectors + models32[m->model];
    if (light->environment) return around_cost(plan, m, light);
    const double varied = m->model == SHD_MODEL_WESTIN && shd_facet_slot(m) ? VARIED : 1;
    if (light->shape) return shared + varied * shape_cost(m, light->shape, way);
    if (way == VECTORS) return shared + vectors + varied * models[m->model];
    return points.light + (double)m->lobe_count * points.lobe + models[m->model];
}
