/* What rays that the camera does not send see of patterns and pictures: a beam around the ray, as
 * wide as a sample's share of a pixel has become on the whole way from the eye. Curved mirrors and
 * glass leave its width alone. Any thread. */
#pragma once

#include "plan/textures.h"
#include "shade/chart.h"

/* A beam that meets a surface. */
typedef struct shd_beam {
    size_t object;
    uint32_t triangle;         /* of a mesh */
    shd_vec3 position, normal; /* of the surface, its own of any side */
    shd_vec3 way;              /* unit */
    double width;
} shd_beam;

/* The side of a sample's share of a pixel after `length` on the way from the camera. */
double shd_beam_width(const shd_scene *scene, double length);

shd_footprint shd_beam_footprint(const shd_scene *scene, const shd_beam *beam);

/* The point where the beam meets the surface of the chart, as it has this normal. */
shd_charted_point shd_beam_point(const shd_chart *chart, const shd_beam *beam, shd_vec3 normal);

/* An opacity's texture over a footprint, in [0, 1]. */
void shd_opacity_mean(const shd_texture *opacity, const shd_footprint *uv, double out[3]);

/* The opacity of the object there, in the channels that rays carry: a texture's, for which
 * `scratch` has room, or the plan's own, which is returned as it is. */
const double *shd_opacity_at(const shd_plan *plan, const shd_beam *beam, double *scratch);
