#include "shade/beam.h"

#include "shade/texture.h"

double shd_beam_width(const shd_scene *scene, double length) {
    const shd_camera *camera = &scene->camera;
    const double side =
        2 * shd_half_height(camera) / scene->raster.height / sqrt((double)scene->raster.samples);
    return camera->projection == SHD_PERSPECTIVE ? side * length : side;
}

/* Two directions that are perpendicular to a unit one and each other. */
static void stand_across(shd_vec3 way, shd_vec3 out[2]) {
    const double x = fabs(way.x), y = fabs(way.y), z = fabs(way.z);
    const shd_vec3 axis = {x <= y && x <= z, y < x && y <= z, z < x && z < y};
    const shd_vec3 across = shd_cross(way, axis);
    out[0] = shd_scale(across, 1 / shd_length(across));
    out[1] = shd_cross(way, out[0]);
}

/* A mesh's weights are those of the point of the triangle's plane. */
static void weigh_corners(const shd_chart *chart, shd_charted_point *point) {
    const shd_mesh *mesh = chart->object->mesh;
    const uint32_t *corner = mesh->indices + 3 * (size_t)point->triangle;
    const shd_vec3 first = shd_vec3_at(mesh->positions, corner[0]);
    shd_vec3 side[2];
    double weights[2];
    for (int k = 0; k < 2; k++)
        side[k] = shd_linear(&chart->to_world,
                             shd_sub(shd_vec3_at(mesh->positions, corner[k + 1]), first));
    shd_step_weights(side, shd_sub(point->position, shd_transform(&chart->to_world, first)),
                     weights);
    point->b = weights[0];
    point->c = weights[1];
}

shd_charted_point shd_beam_point(const shd_chart *chart, const shd_beam *beam, shd_vec3 normal) {
    shd_charted_point point = {
        .position = beam->position, .normal = normal, .triangle = beam->triangle};
    if (chart->object->shape == SHD_MESH) weigh_corners(chart, &point);
    return point;
}

shd_footprint shd_beam_footprint(const shd_scene *scene, const shd_beam *beam) {
    const shd_chart chart = shd_chart_of(&scene->objects[beam->object]);
    const shd_charted_point point = shd_beam_point(&chart, beam, beam->normal);
    shd_vec3 across[2];
    stand_across(beam->way, across);
    const shd_seen_by ray = {.way = beam->way,
                             .right = shd_scale(across[0], beam->width),
                             .down = shd_scale(across[1], beam->width)};
    return shd_chart_footprint(&chart, &point, &ray);
}

void shd_opacity_mean(const shd_texture *opacity, const shd_footprint *uv, double out[3]) {
    double means[3];
    shd_pattern_means(&opacity->pattern, uv, means);
    const bool all = shd_pattern_fields(&opacity->pattern) == 3;
    for (int c = 0; c < 3; c++) {
        const double low = opacity->low[c], rise = opacity->high[c] - low;
        out[c] = shd_smaller(shd_larger(low + rise * means[all ? c : 0], 0), 1);
    }
}

const double *shd_opacity_at(const shd_plan *plan, const shd_beam *beam, double *scratch) {
    const shd_plan_material *m = &plan->materials[plan->objects[beam->object].material];
    if (!m->textures || !m->textures->opacity)
        return shd_coefficients_of(plan, beam->object).opacity;
    const shd_footprint uv = shd_beam_footprint(plan->scene, beam);
    double mean[3];
    shd_opacity_mean(m->textures->opacity, &uv, mean);
    for (size_t c = 0; c < shd_ray_channels(plan); c++) scratch[c] = mean[plan->tinted ? 0 : c];
    return scratch;
}
