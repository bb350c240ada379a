#include "shade/bend.h"

#include "plan/spread.h"

/* Of the unit form, near the axis, where what is around it has no slope. */
static const double LEAST = 1e-9;

/* A surface's gradient in the unit form's frame, and how it changes by two steps. */
typedef struct gradient {
    shd_vec3 at, by[2];
} gradient;

/* How (x, z) / |(x, z)| changes by a step. */
static shd_vec3 turn_around(shd_vec3 p, double around, shd_vec3 step) {
    const double along = (p.x * step.x + p.z * step.z) / (around * around);
    return (shd_vec3){(step.x - along * p.x) / around, 0, (step.z - along * p.z) / around};
}

/* The side of a cylinder or a cone. Caps have their normals along y, and do not bend. */
static bool bend_tall(bool cone, shd_vec3 p, shd_vec3 normal, const shd_vec3 step[2],
                      gradient *out) {
    if (normal.y * normal.y > 0.81 * shd_dot(normal, normal)) return false;
    const double around = shd_larger(sqrt(p.x * p.x + p.z * p.z), LEAST);
    out->at = (shd_vec3){p.x / around, cone ? 1 : 0, p.z / around};
    for (int k = 0; k < 2; k++) out->by[k] = turn_around(p, around, step[k]);
    return true;
}

static void bend_torus(shd_vec3 p, const shd_vec3 step[2], gradient *out) {
    const double around = shd_larger(sqrt(p.x * p.x + p.z * p.z), LEAST);
    out->at = (shd_vec3){p.x - p.x / around, p.y, p.z - p.z / around};
    for (int k = 0; k < 2; k++) out->by[k] = shd_sub(step[k], turn_around(p, around, step[k]));
}

/* False: it does not bend. */
static bool bend_shape(shd_shape shape, shd_vec3 p, shd_vec3 normal, const shd_vec3 step[2],
                       gradient *out) {
    switch (shape) {
    case SHD_SPHERE:
        *out = (gradient){p, {step[0], step[1]}};
        return true;
    case SHD_CYLINDER:
    case SHD_CONE:
        return bend_tall(shape == SHD_CONE, p, normal, step, out);
    case SHD_TORUS:
        bend_torus(p, step, out);
        return true;
    default:
        return false;
    }
}

/* False: the mesh has no normals, or the triangle is too thin to tell how they change along it. */
static bool bend_mesh(const shd_chart *chart, const shd_charted_point *point,
                      const shd_seen_by *ray, gradient *out) {
    static const double THIN = 1e-8;
    const shd_mesh *mesh = chart->object->mesh;
    if (!mesh->normals) return false;
    const uint32_t *corner = mesh->indices + 3 * (size_t)point->triangle;
    shd_vec3 n[3], side[2];
    for (int k = 0; k < 3; k++)
        if (!shd_normalize(shd_vec3_at(mesh->normals, corner[k]), &n[k])) return false;
    const shd_vec3 first = shd_vec3_at(mesh->positions, corner[0]);
    for (int k = 0; k < 2; k++)
        side[k] = shd_linear(&chart->to_world,
                             shd_sub(shd_vec3_at(mesh->positions, corner[k + 1]), first));
    const shd_vec3 flat = shd_cross(side[0], side[1]);
    if (!(shd_dot(flat, flat) > THIN * shd_dot(side[0], side[0]) * shd_dot(side[1], side[1])))
        return false;
    const shd_vec3 b = shd_sub(n[1], n[0]), c = shd_sub(n[2], n[0]);
    out->at = shd_madd(shd_madd(n[0], b, point->b), c, point->c);
    for (int k = 0; k < 2; k++) {
        double weights[2];
        shd_step_weights(side, shd_slide(ray, flat, k ? ray->down : ray->right, SHD_BENT_STEEPEST),
                         weights);
        out->by[k] = shd_madd(shd_scale(b, weights[0]), c, weights[1]);
    }
    return true;
}

/* A covector of the unit form's frame in the world: the inverse's transpose carries it there. */
static shd_vec3 carry_gradient(const shd_chart *chart, shd_vec3 g) {
    const double(*m)[3] = chart->from_world.linear;
    return (shd_vec3){m[0][0] * g.x + m[1][0] * g.y + m[2][0] * g.z,
                      m[0][1] * g.x + m[1][1] * g.y + m[2][1] * g.z,
                      m[0][2] * g.x + m[1][2] * g.y + m[2][2] * g.z};
}

bool shd_bend_at(const shd_chart *chart, const shd_charted_point *point, const shd_seen_by *ray,
                 shd_vec3 out[2]) {
    gradient g;
    if (chart->object->shape == SHD_MESH) {
        if (!bend_mesh(chart, point, ray, &g)) return false;
    } else {
        const shd_vec3 normal = point->normal,
                       local = shd_linear(&chart->from_world,
                                          shd_sub(point->position, chart->to_world.origin)),
                       step[2] = {shd_linear(&chart->from_world,
                                             shd_slide(ray, normal, ray->right, SHD_BENT_STEEPEST)),
                                  shd_linear(&chart->from_world,
                                             shd_slide(ray, normal, ray->down, SHD_BENT_STEEPEST))};
        if (!bend_shape(chart->object->shape, local, shd_carry_normal(chart, normal), step, &g))
            return false;
    }
    const shd_vec3 n = carry_gradient(chart, g.at);
    shd_vec3 unit;
    if (!shd_normalize(n, &unit)) return false;
    /* The seen side's normal may be the other one. */
    const double side = shd_dot(unit, point->normal) < 0 ? -1 : 1, length = side * shd_length(n);
    for (int k = 0; k < 2; k++) {
        const shd_vec3 by = carry_gradient(chart, g.by[k]);
        out[k] = shd_scale(shd_madd(by, unit, -shd_dot(unit, by)), 1 / length);
    }
    return true;
}

shd_widening shd_widening_of(shd_model model, int samples, const shd_vec3 bend[2], shd_vec3 normal,
                             shd_vec3 view) {
    const double variance = 1 / (12 * (double)samples), most = shd_spread_most(model);
    shd_vec3 turn[2] = {bend[0], bend[1]};
    for (int k = 0; k < 2 && shd_turns_twice(model); k++)
        turn[k] = shd_madd(shd_scale(bend[k], 2 * shd_dot(normal, view)), normal,
                           2 * shd_dot(bend[k], view));
    const shd_vec3 across = shd_cross(turn[0], turn[1]);
    shd_widening out = {variance * (shd_dot(turn[0], turn[0]) + shd_dot(turn[1], turn[1])),
                        variance * variance * shd_dot(across, across)};
    if (isnan(out.sum) || isnan(out.product)) return (shd_widening){most, most * most / 4};
    if (out.sum > most) {
        const double part = most / out.sum;
        out = (shd_widening){most, out.product * part * part};
    }
    /* Two numbers have no larger product, but by what squares overflow to. */
    out.product = shd_smaller(out.product, out.sum * out.sum / 4);
    return out;
}

shd_sharpness shd_widen(shd_model model, double shininess, const shd_widening *spread) {
    if (!(spread->sum > 0)) return (shd_sharpness){shininess, 1};
    const double own = shd_variance_of(model, shininess),
                 square = own * own + own * spread->sum + spread->product,
                 widened = shd_sharpness_at(model, sqrt(square));
    if (model == SHD_MODEL_COOK_TORRANCE) return (shd_sharpness){shd_larger(widened, shininess), 1};
    const double least = shd_smaller(shininess, SHD_BLUNTEST),
                 n = shd_smaller(shd_larger(widened, least), shininess);
    return (shd_sharpness){n, model == SHD_MODEL_PHONG_NORMALIZED ? 1 : (n + 1) / (shininess + 1)};
}
