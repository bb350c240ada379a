/* The drift of a path, from step to step.
 *
 * A ray that is beside by q meets a surface at N.V = c in a point that is beside by q / c, and one
 * that is turned by d gains t d on the length t. f64 puts the hit off the surface by u, 16 half
 * ulps of the lengths on its way, which is as if the ray had been beside by u. A surface that bends
 * by k for each length turns its normal by 1.1 k q / c there, if c^2 >= 8 k q: the ray gains c s -
 * k s^2 / 2 of height on the length s (misplaced.c), which is q at s <= 1.1 q / c.
 *
 * Mirrors turn a ray by 2 |dN|, and keep d and what it is beside by. With Snell's law, out = eta d
 * + (eta c - s) N and s the cosine behind the surface, |out'| <= eta |d'| + eta |1 - eta c / s|
 * (|d'| + |dN|) + |s - eta c| |dN|, where |s - eta c| is at most M = max(1, eta): no more than
 * 2 M^2 (|d'| + |dN|) / s. s^2 changes by less than half of itself if s^2 >= 4 M^2 (|d'| + |dN|).
 * Refracted rays start beside by q / c.
 *
 * So each hit divides by c, or by c s, and with p the product of all of these before it,
 *
 *     q <= Q / p,  d <= D / p:   D' = G D + H k Q + rounding,   Q' = 1.1 Q + t D' + u
 *
 * with (G, H) = (1, 2.2) for mirrors and (2 M^2, 2.2 M^2) for glass. Where p c >= g on all of a
 * path, both conditions hold if g^2 >= 8 k Q and g^2 >= 4 M^2 (D + 1.1 k Q), for p >= g / c and c
 * >= g.
 *
 * Infinite planes are met at t <= T / c from T above them, and left over as much: that c is in the
 * product already, as planes do not bend, unless they refract. Then Q is divided by g once more. */
#include "bound/light/drift.h"

#include "bound/light/misplaced.h"
#include "bound/light/weights.h"

static const double LEAST = 1e-4;

static const shd_material *material_of(const shd_plan *plan, size_t object) {
    return plan->materials[plan->objects[object].material].from;
}

/* The middle of what is bounded. */
static shd_vec3 find_middle(const shd_plan *plan) {
    shd_vec3 low = {INFINITY, INFINITY, INFINITY}, high = {-INFINITY, -INFINITY, -INFINITY};
    bool any = false;
    for (size_t i = 0; i < plan->scene->object_count; i++) {
        const shd_plan_object *o = &plan->objects[i];
        if (shd_is_cancelled_at(plan->cancelled, i)) break;
        if (!o->bounded) continue;
        const shd_vec3 r = {o->radius, o->radius, o->radius};
        low = shd_vec3_min(low, shd_sub(o->center, r));
        high = shd_vec3_max(high, shd_madd(o->center, r, 1));
        any = true;
    }
    return any ? shd_scale(shd_madd(low, high, 1), 0.5) : plan->scene->camera.position;
}

shd_extent shd_extent_of(const shd_plan *plan) {
    const shd_scene *scene = plan->scene;
    const shd_camera *camera = &scene->camera;
    shd_extent out = {.middle = find_middle(plan)};
    double reach = 0, high = 0, eye = shd_length(shd_sub(camera->position, out.middle));
    if (camera->projection == SHD_ORTHOGRAPHIC)
        eye += camera->height * (1 + (double)scene->raster.width / scene->raster.height);
    for (size_t i = 0; i < scene->object_count; i++) {
        const shd_plan_object *object = &plan->objects[i];
        const shd_vec3 origin = scene->objects[i].transform.origin,
                       off = shd_sub(object->bounded ? object->center : origin, out.middle);
        if (shd_is_cancelled_at(plan->cancelled, i)) break;
        if (object->bounded)
            reach = shd_larger(reach, shd_length(off) + object->radius);
        else
            high = shd_larger(high, shd_length(off));
    }
    out.wide = 2 * reach;
    /* Planes are met from as high as their own origin is away, and left for as far again. */
    if (high > 0) out.wide = 2 * (2 * reach + high);
    out.sizes = 7 * (shd_length(out.middle) + reach + high) + 2 * eye;
    return out;
}

/* What the scene's surfaces do to rays. */
typedef struct optics {
    double met, left; /* by how much surfaces bend that are met, and from which rays go on */
    double glass;     /* M, or 0: nothing refracts */
    bool sheet;       /* an infinite plane refracts */
} optics;

static optics find_optics(const shd_plan *plan) {
    const shd_scene *scene = plan->scene;
    optics out = {0};
    for (size_t i = 0; i < scene->object_count; i++) {
        const shd_material *m = material_of(plan, i);
        const shd_place place = shd_place_of(&scene->objects[i], &plan->objects[i]);
        const double bend = shd_misplaced_of(scene, &place).bend;
        const shd_coefficients k = shd_coefficients_of(plan, i);
        const bool refracts = !shd_is_all(k.transmission, k.count, 0);
        if (shd_is_cancelled_at(plan->cancelled, i)) break;
        out.met = shd_larger(out.met, bend);
        if (refracts || !shd_is_all(k.reflection, k.count, 0))
            out.left = shd_larger(out.left, bend);
        if (!refracts) continue;
        out.glass = shd_larger(out.glass, shd_larger(m->ior, 1 / m->ior));
        out.sheet |= !plan->objects[i].bounded;
    }
    return out;
}

void shd_find_drifts(const shd_plan *plan, const shd_extent *extent, shd_drift out[SHD_DRIFTS]) {
    const optics o = find_optics(plan);
    const double square = 2 * o.glass * o.glass, keeps = shd_larger(1, square),
                 turns = 1.1 * shd_larger(2, square);
    const double rounding = SHD_DRIFT_ROUNDING * extent->sizes;
    shd_drift now = {rounding, SHD_WEIGHT_DIRECTION, LEAST, true};
    for (int k = 0; k < SHD_DRIFTS; k++) {
        const double bent = 8 * o.met * now.beside,
                     refracted = 2 * square * (now.turned + 1.1 * o.left * now.beside);
        now.least = shd_larger(LEAST, sqrt(shd_larger(bent, refracted)));
        now.known = now.known && now.least <= SHD_LEAST_PATH;
        out[k] = now;
        now.turned = keeps * now.turned + turns * o.left * now.beside + SHD_WEIGHT_DIRECTION;
        now.beside = 1.1 * now.beside + extent->wide * now.turned + rounding;
        if (o.sheet) now.beside /= now.least;
    }
}
