#include "shade/chart.h"

static const double TURN = 2 * SHD_PI;

/* Slopes of angles near a pole, where they have no limit. */
static const double LEAST = 1e-9;

/* How far from the seam, in radii, a point is on it. */
static const double ON_SEAM = 1e-9;

/* No plane counts as seen with a lesser cosine. */
static const double STEEPEST = 1e-6;

shd_chart shd_chart_of(const shd_object *object) {
    shd_chart out = {.object = object};
    shd_object_frame(object, &out.to_world, &out.from_world);
    return out;
}

/* (u, v), and their gradients in the frame in which the point is given. */
typedef struct place {
    double u, v;
    shd_vec3 du, dv;
} place;

/* The angle around the y axis, from -z on, in turns. Where it begins, points are at its end that
 * rounding may put on either side: what is seen there would else jump with a hit's last bits. */
static void go_around(shd_vec3 p, place *out) {
    const double square = shd_larger(p.x * p.x + p.z * p.z, LEAST * LEAST);
    const bool at_seam = p.z < 0 && fabs(p.x) <= -ON_SEAM * p.z;
    out->u = at_seam ? 1 : 0.5 + atan2(p.x, p.z) / TURN;
    out->du = (shd_vec3){p.z / (TURN * square), 0, -p.x / (TURN * square)};
}

static place chart_sphere(shd_vec3 p) {
    place out;
    const double around = sqrt(p.x * p.x + p.z * p.z);
    go_around(p, &out);
    out.v = 0.5 + atan2(p.y, around) / SHD_PI;
    out.dv = (shd_vec3){0, 1 / (SHD_PI * shd_larger(around, LEAST)), 0};
    return out;
}

/* The same on its faces, which are not perpendicular to the radius. */
static place chart_cut_sphere(shd_vec3 p) {
    place out = chart_sphere(p);
    const double around = shd_larger(sqrt(p.x * p.x + p.z * p.z), LEAST),
                 by = 1 / (SHD_PI * shd_dot(p, p)), radial = -p.y / around * by;
    out.dv = (shd_vec3){radial * p.x, around * by, radial * p.z};
    return out;
}

static place chart_torus(shd_vec3 p) {
    place out;
    const double around = shd_larger(sqrt(p.x * p.x + p.z * p.z), LEAST), out_by = around - 1,
                 square = shd_larger(out_by * out_by + p.y * p.y, LEAST * LEAST);
    go_around(p, &out);
    out.v = 0.5 + atan2(p.y, out_by) / TURN;
    const double radial = -p.y / (TURN * square * around);
    out.dv = (shd_vec3){radial * p.x, out_by / (TURN * square), radial * p.z};
    return out;
}

/* A flat part as it is seen from above: u to x, v to -z; from below, v is to z. `size`: its extent,
 * whose middle is (1/2, 1/2). */
static place chart_flat(shd_vec3 p, double size, bool below) {
    const double z = below ? -1 : 1;
    return (place){0.5 + p.x / size, 0.5 - z * p.z / size, {1 / size, 0, 0}, {0, 0, -z / size}};
}

static place chart_plane(shd_vec3 p) {
    return (place){p.x, -p.z, {1, 0, 0}, {0, 0, -1}};
}

/* The side of a cylinder or a cone, or one of its caps, whose normal is along y. */
static place chart_tall(shd_vec3 p, shd_vec3 normal) {
    if (normal.y * normal.y > 0.81 * shd_dot(normal, normal)) return chart_flat(p, 2, p.y < 0);
    place out;
    go_around(p, &out);
    out.v = p.y + 0.5;
    out.dv = (shd_vec3){0, 1, 0};
    return out;
}

/* The face whose normal it is, seen from outside with y up; from above and below with u to x. */
static place chart_box(shd_vec3 p, shd_vec3 normal) {
    const double x = fabs(normal.x), y = fabs(normal.y), z = fabs(normal.z);
    if (y >= x && y >= z) return chart_flat(p, 1, p.y < 0);
    const double sign = x >= z ? (p.x < 0 ? 1 : -1) : (p.z < 0 ? -1 : 1);
    if (x >= z) return (place){0.5 + sign * p.z, 0.5 + p.y, {0, 0, sign}, {0, 1, 0}};
    return (place){0.5 + sign * p.x, 0.5 + p.y, {sign, 0, 0}, {0, 1, 0}};
}

static place chart_shape(const shd_object *object, shd_vec3 p, shd_vec3 normal) {
    switch (object->shape) {
    case SHD_SPHERE:
        return object->interpolation == SHD_PHONG ? chart_sphere(p) : chart_cut_sphere(p);
    case SHD_DISC:
        return chart_flat(p, 2, false);
    case SHD_BOX:
        return chart_box(p, normal);
    case SHD_CYLINDER:
    case SHD_CONE:
        return chart_tall(p, normal);
    case SHD_TORUS:
        return chart_torus(p);
    default:
        return chart_plane(p);
    }
}

shd_vec3 shd_carry_normal(const shd_chart *chart, shd_vec3 n) {
    const double(*m)[3] = chart->to_world.linear;
    return (shd_vec3){m[0][0] * n.x + m[1][0] * n.y + m[2][0] * n.z,
                      m[0][1] * n.x + m[1][1] * n.y + m[2][1] * n.z,
                      m[0][2] * n.x + m[1][2] * n.y + m[2][2] * n.z};
}

shd_vec3 shd_slide(const shd_seen_by *ray, shd_vec3 normal, shd_vec3 side, double least) {
    const double steep = least * sqrt(shd_dot(ray->way, ray->way) * shd_dot(normal, normal));
    double facing = shd_dot(normal, ray->way);
    if (fabs(facing) < steep) facing = facing < 0 ? -steep : steep;
    return shd_madd(side, ray->way, -shd_dot(normal, side) / facing);
}

/* Moves a ray to its pixel's middle, where it meets the tangent plane nearly as far away. Returns
 * by how much that moves the point. */
static shd_vec3 center_ray(shd_seen_by *ray, shd_vec3 normal) {
    const shd_vec3 shift = shd_madd(shd_scale(ray->right, ray->aside), ray->down, ray->below);
    if (!ray->perspective) return shd_slide(ray, normal, shift, STEEPEST);
    const shd_vec3 way = shd_add(ray->way, shift);
    const double t = shd_dot(normal, ray->way) / shd_dot(normal, way);
    if (!(t > 0.5 && t < 2)) return (shd_vec3){0, 0, 0};
    const shd_vec3 moved = shd_sub(shd_scale(way, t), ray->way);
    ray->way = shd_scale(way, t);
    ray->right = shd_scale(ray->right, t);
    ray->down = shd_scale(ray->down, t);
    return moved;
}

/* A parallelogram in the tangent plane of a point, around what is `moved` from that. */
typedef struct patch {
    shd_vec3 moved, right, down;
} patch;

/* What the ray's pixel sees of the plane of this normal. */
static patch patch_seen(const shd_seen_by *ray, shd_vec3 normal) {
    shd_seen_by middle = *ray;
    const shd_vec3 moved = center_ray(&middle, normal);
    return (patch){moved, shd_slide(&middle, normal, middle.right, STEEPEST),
                   shd_slide(&middle, normal, middle.down, STEEPEST)};
}

static shd_footprint lay_on_shape(const shd_chart *chart, const shd_charted_point *point,
                                  const patch *p) {
    const shd_vec3 from = shd_sub(point->position, chart->to_world.origin),
                   local = shd_linear(&chart->from_world, shd_add(from, p->moved)),
                   right = shd_linear(&chart->from_world, p->right),
                   down = shd_linear(&chart->from_world, p->down);
    const place at = chart_shape(chart->object, local, shd_carry_normal(chart, point->normal));
    return (shd_footprint){{at.u, at.v},
                           {shd_dot(at.du, right), shd_dot(at.dv, right)},
                           {shd_dot(at.du, down), shd_dot(at.dv, down)}};
}

/* ---- Frames. ---- */

/* dP/ds in the world, but for its length, of a chart's slope, and whether (s, t, N) is left-handed
 * in the world for the front's N. */
typedef struct slope {
    shd_vec3 along, front; /* `front`: of any length */
    bool mirrored;
} slope;

static double sign_of(double x) {
    return (x > 0) - (x < 0);
}

static double triple(shd_vec3 a, shd_vec3 b, shd_vec3 c) {
    return shd_dot(shd_cross(a, b), c);
}

/* Whether a gradient of the unit form points outward. */
static bool points_outward(shd_shape shape, shd_vec3 p, shd_vec3 normal) {
    if (shape == SHD_PLANE || shape == SHD_DISC) return normal.y > 0;
    if (shape == SHD_TORUS) {
        const double around = shd_larger(sqrt(p.x * p.x + p.z * p.z), LEAST);
        p.x -= p.x / around;
        p.z -= p.z / around;
    }
    return shd_dot(p, normal) > 0;
}

/* dP/ds goes where t stays: along the gradient of t times the normal. */
static slope slope_on_shape(const shd_chart *chart, const shd_charted_point *point,
                            const double map[2][3]) {
    const double(*m)[3] = chart->to_world.linear;
    const shd_vec3 p =
        shd_linear(&chart->from_world, shd_sub(point->position, chart->to_world.origin));
    shd_vec3 normal = shd_carry_normal(chart, point->normal);
    const bool outward = points_outward(chart->object->shape, p, normal);
    const place at = chart_shape(chart->object, p, normal);
    if (!outward) normal = shd_scale(normal, -1);
    const shd_vec3 ds = shd_madd(shd_scale(at.du, map[0][0]), at.dv, map[0][1]),
                   dt = shd_madd(shd_scale(at.du, map[1][0]), at.dv, map[1][1]),
                   column[3] = {{m[0][0], m[1][0], m[2][0]},
                                {m[0][1], m[1][1], m[2][1]},
                                {m[0][2], m[1][2], m[2][2]}};
    const double turns = triple(ds, dt, normal), mirrors = triple(column[0], column[1], column[2]);
    const shd_vec3 along = shd_linear(&chart->to_world, shd_cross(dt, normal));
    return (slope){shd_scale(along, sign_of(turns)),
                   outward ? point->normal : shd_scale(point->normal, -1),
                   (turns < 0) != (mirrors < 0)};
}

static slope slope_on_mesh(const shd_chart *chart, const shd_charted_point *point,
                           const double map[2][3]) {
    const shd_mesh *mesh = chart->object->mesh;
    const uint32_t *corner = mesh->indices + 3 * (size_t)point->triangle;
    const shd_affine normals = shd_normal_map(&chart->to_world);
    shd_vec3 side[2], n[3] = {{0, 0, 0}};
    double st[2][2];
    for (int k = 0; k < 2; k++) {
        const double *from = mesh->uvs + 2 * (size_t)corner[0],
                     *to = mesh->uvs + 2 * (size_t)corner[k + 1], u = to[0] - from[0],
                     v = to[1] - from[1];
        side[k] = shd_sub(shd_vec3_at(mesh->positions, corner[k + 1]),
                          shd_vec3_at(mesh->positions, corner[0]));
        for (int c = 0; c < 2; c++) st[k][c] = map[c][0] * u + map[c][1] * v;
    }
    shd_vec3 local = shd_cross(side[0], side[1]);
    for (int k = 0; k < 2; k++) side[k] = shd_linear(&chart->to_world, side[k]);
    const bool smooth = mesh->normals && chart->object->interpolation != SHD_FLAT;
    for (int k = 0; smooth && k < 3; k++)
        shd_normalize(shd_vec3_at(mesh->normals, corner[k]), &n[k]);
    if (smooth)
        local = shd_madd(shd_madd(shd_scale(n[0], 1 - point->b - point->c), n[1], point->b), n[2],
                         point->c);
    const shd_vec3 front = shd_linear(&normals, local);
    const double turns = st[0][0] * st[1][1] - st[0][1] * st[1][0];
    const shd_vec3 along = shd_madd(shd_scale(side[0], st[1][1]), side[1], -st[0][1]);
    return (slope){shd_scale(along, sign_of(turns)), front,
                   (turns < 0) != (triple(side[0], side[1], front) < 0)};
}

bool shd_chart_frame(const shd_chart *chart, const shd_charted_point *point, const double map[2][3],
                     shd_tangent_frame *out) {
    const bool mesh = chart->object->shape == SHD_MESH;
    const slope s = (mesh ? slope_on_mesh : slope_on_shape)(chart, point, map);
    const bool back = shd_dot(s.front, point->normal) < 0;
    const shd_vec3 front = back ? shd_scale(point->normal, -1) : point->normal;
    shd_vec3 along, across;
    /* Unit first, so that lengths of any size are taken off alike. */
    if (!shd_normalize(s.along, &along) ||
        !shd_normalize(shd_madd(along, front, -shd_dot(along, front)), &across))
        return false;
    *out =
        (shd_tangent_frame){across, shd_scale(shd_cross(front, across), s.mirrored ? -1 : 1), back};
    return true;
}

void shd_step_weights(const shd_vec3 side[2], shd_vec3 step, double out[2]) {
    const double aa = shd_dot(side[0], side[0]), ab = shd_dot(side[0], side[1]),
                 bb = shd_dot(side[1], side[1]), a = shd_dot(step, side[0]),
                 b = shd_dot(step, side[1]), determinant = aa * bb - ab * ab;
    out[0] = determinant > 0 ? (bb * a - ab * b) / determinant : 0;
    out[1] = determinant > 0 ? (aa * b - ab * a) / determinant : 0;
}

/* The sides of the point's triangle, in the world. */
static void sides_of(const shd_chart *chart, const shd_charted_point *point, shd_vec3 out[2]) {
    const shd_mesh *mesh = chart->object->mesh;
    const uint32_t *corner = mesh->indices + 3 * (size_t)point->triangle;
    const shd_vec3 first = shd_vec3_at(mesh->positions, corner[0]);
    for (int k = 0; k < 2; k++)
        out[k] = shd_linear(&chart->to_world,
                            shd_sub(shd_vec3_at(mesh->positions, corner[k + 1]), first));
}

static shd_footprint lay_on_mesh(const shd_chart *chart, const shd_charted_point *point,
                                 const shd_vec3 side[2], const patch *p) {
    const shd_mesh *mesh = chart->object->mesh;
    const uint32_t *corner = mesh->indices + 3 * (size_t)point->triangle;
    const double *a = mesh->uvs + 2 * (size_t)corner[0], *b = mesh->uvs + 2 * (size_t)corner[1],
                 *c = mesh->uvs + 2 * (size_t)corner[2];
    double right[2], down[2], step[2];
    shd_step_weights(side, p->moved, step);
    shd_step_weights(side, p->right, right);
    shd_step_weights(side, p->down, down);
    shd_footprint out;
    for (int k = 0; k < 2; k++) {
        const double ab = b[k] - a[k], ac = c[k] - a[k];
        out.at[k] = a[k] + (point->b + step[0]) * ab + (point->c + step[1]) * ac;
        out.x[k] = right[0] * ab + right[1] * ac;
        out.y[k] = down[0] * ab + down[1] * ac;
    }
    return out;
}

shd_footprint shd_chart_footprint(const shd_chart *chart, const shd_charted_point *point,
                                  const shd_seen_by *ray) {
    if (chart->object->shape == SHD_MESH) {
        shd_vec3 side[2];
        sides_of(chart, point, side);
        const patch seen = patch_seen(ray, shd_cross(side[0], side[1]));
        return lay_on_mesh(chart, point, side, &seen);
    }
    const patch seen = patch_seen(ray, point->normal);
    return lay_on_shape(chart, point, &seen);
}

shd_footprint shd_chart_around(const shd_chart *chart, const shd_charted_point *point,
                               const shd_vec3 sides[2]) {
    const patch p = {{0, 0, 0}, sides[0], sides[1]};
    if (chart->object->shape != SHD_MESH) return lay_on_shape(chart, point, &p);
    shd_vec3 side[2];
    sides_of(chart, point, side);
    return lay_on_mesh(chart, point, side, &p);
}
