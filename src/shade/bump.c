#include "shade/bump.h"

#include "plan/spread.h"
#include "shade/chart.h"
#include "shade/gloss.h"
#include "shade/texture.h"

/* Lengths nearer to 1 are 1. */
static const double ROUNDED = 0x1p-22;

/* A mean that is shorter has no direction. */
static const double SHORTEST = 1e-6;

static shd_vec3 unit_of(shd_vec3 v) {
    shd_vec3 out;
    return shd_normalize(v, &out) ? out : (shd_vec3){0, 0, 1};
}

/* The mean of a pattern's normals, unit(low + w (high - low)), where its field w has this mean and
 * variance: that of a w that is 0, its mean or 1, as often as it takes for both. So it is exact
 * where w is 0 or 1, as in checkers, where it is constant, and otherwise to the second order of w.
 */
static shd_vec3 mean_of_pattern(const shd_texture *map, const shd_footprint *uv) {
    const shd_vec3 low = {map->low[0], map->low[1], map->low[2]},
                   high = {map->high[0], map->high[1], map->high[2]};
    const double w = shd_pattern_mean(&map->pattern, uv), most = w * (1 - w),
                 variance = shd_pattern_variance(&map->pattern, uv, w),
                 ends = most > 0 ? variance / most : 0;
    const shd_vec3 mixed = shd_madd(shd_scale(unit_of(low), 1 - w), unit_of(high), w);
    if (ends == 1) return mixed;
    const shd_vec3 middle = unit_of(shd_madd(shd_scale(low, 1 - w), high, w));
    return shd_madd(shd_scale(middle, 1 - ends), mixed, ends);
}

static shd_vec3 mean_of(const shd_texture *map, const shd_footprint *uv) {
    double mean[4];
    if (!map->pattern.picture) return mean_of_pattern(map, uv);
    shd_texture_mean(&map->pattern, uv, mean);
    return (shd_vec3){mean[0], mean[1], mean[2]};
}

shd_bump shd_bump_at(const shd_texture *map, const shd_chart *chart, const shd_charted_point *point,
                     const shd_footprint *uv) {
    const shd_vec3 m = mean_of(map, uv);
    shd_bump out = {point->normal, shd_smaller(shd_length(m), 1)};
    shd_tangent_frame frame;
    if (!(out.length > SHORTEST) || !shd_chart_frame(chart, point, map->pattern.map, &frame))
        return out;
    const shd_vec3 in_plane = shd_madd(shd_scale(frame.across, m.x), frame.up, m.y);
    shd_normalize(shd_madd(shd_scale(point->normal, m.z), in_plane, frame.back ? -1 : 1),
                  &out.normal);
    return out;
}

shd_sharpness shd_toksvig(shd_model model, double shininess, double length) {
    const double variance =
        (shd_turns_twice(model) ? 4 : 1) * (length > 0 ? (1 - length) / length : INFINITY);
    if (!(1 - length > ROUNDED)) return (shd_sharpness){shininess, 1};
    if (model == SHD_MODEL_COOK_TORRANCE) {
        const double wide = sqrt(shininess * shininess + 2 * variance);
        return (shd_sharpness){shd_larger(shininess, shd_smaller(wide, SHD_ROUGHEST)), 1};
    }
    const double least = shd_smaller(shininess, SHD_BLUNTEST),
                 n = shd_larger(shininess > 0 ? shininess / (1 + shininess * variance) : 0, least);
    return (shd_sharpness){n, model == SHD_MODEL_PHONG_NORMALIZED ? 1 : (n + 1) / (shininess + 1)};
}

void shd_bump_beam(const shd_scene *scene, const shd_beam *beam, shd_sharp_point *room,
                   shd_surface *at) {
    const shd_plan_material *m = at->material;
    const shd_chart chart = shd_chart_of(&scene->objects[beam->object]);
    const shd_charted_point point = shd_beam_point(&chart, beam, at->normal);
    const shd_footprint uv = shd_beam_footprint(scene, beam);
    shd_bump bump = {at->normal, 1};
    if (m->normal) bump = shd_bump_at(m->normal, &chart, &point, &uv);
    const double own[3] = {at->normal.x, at->normal.y, at->normal.z};
    for (size_t k = 0; k < m->lobe_count; k++) {
        const shd_sharpness lobe = shd_toksvig(m->model, shd_gloss_of(m, k, &uv), bump.length);
        room->values[2 * k] = lobe.shininess;
        room->values[2 * k + 1] = lobe.share;
    }
    for (size_t c = 0; c < 3; c++) room->values[2 * m->lobe_count + c] = own[c];
    for (size_t r = 0; r < 2 * m->lobe_count + 3; r++) room->rows[r] = &room->values[r];
    at->normal = bump.normal;
    at->mirror = shd_sub(shd_scale(bump.normal, 2 * shd_dot(bump.normal, at->view)), at->view);
    at->sharp = room->rows;
    at->sharp_at = 0;
}
