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

void shd_ray_mean(const shd_ray_texture *of, const shd_footprint *uv, double out[3]) {
    const shd_texture *texture = of->texture;
    double means[3];
    shd_pattern_means(&texture->pattern, uv, means);
    const bool all = shd_pattern_fields(&texture->pattern) == 3;
    for (int c = 0; c < 3; c++) {
        const double low = texture->low[c], rise = texture->high[c] - low;
        out[c] = shd_smaller(shd_larger(low + rise * means[all ? c : 0], 0), of->most[c]);
    }
}

/* A coefficient in the channels that rays carry: in bins it is one number. */
static void fill_row(const shd_plan *plan, const shd_ray_texture *of, const shd_footprint *uv,
                     double *row) {
    double mean[3];
    shd_ray_mean(of, uv, mean);
    for (size_t c = 0; c < shd_ray_channels(plan); c++) row[c] = mean[plan->tinted ? 0 : c];
}

static const shd_plan_textures *textures_of(const shd_plan *plan, size_t object) {
    return plan->materials[plan->objects[object].material].textures;
}

shd_coefficients shd_coefficients_at(const shd_plan *plan, const shd_beam *beam,
                                     shd_ray_rows rows) {
    const shd_plan_textures *textures = textures_of(plan, beam->object);
    shd_coefficients out = shd_coefficients_of(plan, beam->object);
    const shd_footprint uv = shd_beam_footprint(plan->scene, beam);
    for (int k = 0; k < SHD_RAY_COEFFICIENTS; k++)
        if (textures->rays[k].texture) fill_row(plan, &textures->rays[k], &uv, rows[k]);
    shd_take_rows(textures, rows, &out);
    return out;
}

const double *shd_opacity_at(const shd_plan *plan, const shd_beam *beam, double *row) {
    const shd_plan_textures *textures = textures_of(plan, beam->object);
    if (!textures || !textures->rays[SHD_RAY_OPACITY].texture)
        return shd_coefficients_of(plan, beam->object).opacity;
    const shd_footprint uv = shd_beam_footprint(plan->scene, beam);
    fill_row(plan, &textures->rays[SHD_RAY_OPACITY], &uv, row);
    return row;
}
