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

/* A texture of what rays go by over a footprint, in [0, most]. */
void shd_ray_mean(const shd_ray_texture *of, const shd_footprint *uv, double out[3]);

/* Of an object at one point: a row for each of its textures. */
typedef double shd_ray_rows[SHD_RAY_COEFFICIENTS][SHD_BINS_MOST];

/* What an object some of whose coefficients of rays are textures makes of them there, in the
 * channels that they carry: of textures, which `rows` takes, or as the plan has it. */
shd_coefficients shd_coefficients_at(const shd_plan *plan, const shd_beam *beam, shd_ray_rows rows);

/* The same of the opacity of any object, with one row. */
const double *shd_opacity_at(const shd_plan *plan, const shd_beam *beam, double *row);

/* Takes the rows of the material's textures in place of what is the material's own. */
static inline void shd_take_rows(const shd_plan_textures *textures, const shd_ray_rows rows,
                                 shd_coefficients *out) {
    const double **to[SHD_RAY_COEFFICIENTS] = {&out->opacity, &out->reflection, &out->transmission};
    for (int k = 0; k < SHD_RAY_COEFFICIENTS; k++)
        if (textures->rays[k].texture) *to[k] = rows[k];
}
