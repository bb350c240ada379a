#include "sight/tie.h"

#include "plan/tier.h"

/* The sizes of what is added up to get from the object to where the ray starts. */
static shd_vec3 away_of(const shd_item *it, const shd_lens *lens, const shd_met *met) {
    return shd_add(shd_sizes(shd_sub(lens->camera->position, it->to_world.origin)),
                   shd_sizes(met->start));
}

/* The row's length, times that of the components at which it is not 0. */
static double reach_of(const double row[3], shd_vec3 v) {
    const shd_vec3 seen = {row[0] != 0 ? v.x : 0, row[1] != 0 ? v.y : 0, row[2] != 0 ? v.z : 0};
    return shd_length((shd_vec3){row[0], row[1], row[2]}) * shd_length(seen);
}

/* The size of the surface's coordinates along its normal. */
static double coordinate_size(const shd_item *it, shd_vec3 point, shd_vec3 normal) {
    const bool capped = it->shape == SHD_CYLINDER || it->shape == SHD_CONE;
    if (it->shape == SHD_PLANE || it->shape == SHD_DISC || it->shape == SHD_BOX ||
        (capped && fabs(normal.y) == 1))
        return fabs(shd_dot(normal, point));
    /* A cone's normal turns ever faster toward the apex. */
    return it->shape == SHD_CONE ? 1 / hypot(point.x, point.z) : 1;
}

double shd_shape_rounding(const shd_item *it, const shd_lens *lens, const shd_met *met,
                          double shift, shd_vec3 point, shd_vec3 normal) {
    const double n[3] = {fabs(normal.x), fabs(normal.y), fabs(normal.z)};
    const shd_vec3 away = away_of(it, lens, met),
                   way = shd_scale(shd_sizes(met->ray), met->t + fabs(shift));
    double sum = coordinate_size(it, point, normal);
    for (int k = 0; k < 3; k++) {
        const double *row = it->from_world.linear[k];
        if (n[k] > 0) sum += n[k] * (reach_of(row, away) + reach_of(row, way));
    }
    return SHD_HIT_ROUNDING * sum / fabs(shd_dot(normal, shd_linear(&it->from_world, met->ray)));
}

/* Lengths are in units of t, so that products neither overflow nor vanish. */
double shd_triangle_rounding(const shd_item *it, const shd_lens *lens, const shd_met *met,
                             uint32_t triangle) {
    const double unit = 1 / met->t;
    const shd_vec3 away = away_of(it, lens, met),
                   eye = shd_add(shd_sub(lens->camera->position, it->to_world.origin), met->start);
    shd_vec3 corner[3];
    double far = 0, edge = 0;
    for (int k = 0; k < 3; k++) {
        const shd_vec3 p = shd_triangle_corner(&it->triangles, triangle, k);
        corner[k] = shd_scale(shd_sub(shd_linear(&it->to_world, p), eye), unit);
        far = fmax(far, shd_length(corner[k]));
    }
    for (int k = 0; k < 3; k++) {
        const double carried = reach_of(it->from_world.linear[k], away) * unit;
        for (int r = 0; r < 3; r++) far += fabs(it->to_world.linear[r][k]) * carried;
        edge = fmax(edge, shd_length(shd_sub(corner[(k + 1) % 3], corner[k])));
    }
    const shd_vec3 normal = shd_cross(shd_sub(corner[1], corner[0]), shd_sub(corner[2], corner[0]));
    const double area = shd_length(normal);
    return SHD_HIT_ROUNDING * met->t * (far * area + edge * edge * edge) /
           fabs(shd_dot(normal, met->ray));
}
