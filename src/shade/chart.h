/* Charts: where a point of a surface is in (u, v), and how that changes along the surface. They are
 * told in docs/textures.md. Any thread. */
#pragma once

#include "scene/scene.h"
#include "shade/wave.h"

/* An object's frames, found once. */
typedef struct shd_chart {
    const shd_object *object;
    shd_affine to_world, from_world; /* of the unit form; from_world is linear */
} shd_chart;

shd_chart shd_chart_of(const shd_object *object);

/* A point of the surface. */
typedef struct shd_charted_point {
    /* World frame; the normal of either side, of a mesh interpolated, of a shape's faces theirs. */
    shd_vec3 position, normal;
    uint32_t triangle; /* of a mesh */
    double b, c;       /* weights of its second and third corner */
} shd_charted_point;

/* The ray that sees it: the way there from the eye (orthographic: any length of it), by how much
 * the way's end moves from pixel to pixel to the right and down on a screen through the point, and
 * how far the ray is from its pixel's middle, in pixels. */
typedef struct shd_seen_by {
    shd_vec3 way, right, down;
    bool perspective;
    double aside, below; /* to the middle: to the right and down */
} shd_seen_by;

/* The footprint of the ray's pixel on the chart, as the tangent plane at the point has it. Where
 * that plane is too steep for it, it is of a pixel around the ray. */
shd_footprint shd_chart_footprint(const shd_chart *chart, const shd_charted_point *point,
                                  const shd_seen_by *ray);

/* The footprint of the parallelogram that has these sides, of the world, around the point, as the
 * tangent plane at the point has it. */
shd_footprint shd_chart_around(const shd_chart *chart, const shd_charted_point *point,
                               const shd_vec3 sides[2]);

/* The frame in which a map's normals are told (shade/bump.h): unit, at right angles to each other
 * and to the normal of the surface's front. */
typedef struct shd_tangent_frame {
    shd_vec3 across, up;
    bool back; /* the point's normal is that of the surface's back */
} shd_tangent_frame;

/* That of a picture whose (s, t) is `map` of the chart's (u, v, 1); the point's normal is unit.
 * False: the chart has no directions there. */
bool shd_chart_frame(const shd_chart *chart, const shd_charted_point *point, const double map[2][3],
                     shd_tangent_frame *out);

/* A covector of the world in the unit form's frame: the map's transpose carries it back. */
shd_vec3 shd_carry_normal(const shd_chart *chart, shd_vec3 n);

/* How the point in which a pixel sees the plane of this normal moves if the way's end moves aside
 * by `side`. The cosine between both is taken for `least` at least. */
shd_vec3 shd_slide(const shd_seen_by *ray, shd_vec3 normal, shd_vec3 side, double least);

/* The weights of the second and third corner that a step along a triangle adds, whose sides go from
 * its first corner to these. */
void shd_step_weights(const shd_vec3 side[2], shd_vec3 step, double out[2]);
