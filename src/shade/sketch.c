/* What f32 errs by, with u = 2^-24, c the least N.V of what is drawn, o the way of a pixel's ray
 * beside the middle's point in units of the ball's radius, r the most of |o|, and w the ray's
 * direction, which has the length 1 in the middle and is off that by WIDE c at most. The middle's
 * point, normal and ray are of f64.
 *
 * Where a ray meets the ball (sketch.simd.c). As r <= FLAT c^2 and LOW c, C = o.(m + q) is k c^2 at
 * most, with k = 4.25, and k c = 1.25. As -m.w is 0.9 c at least and o.w 0.55 c at most, -b is 0.35
 * c, and root is c at least. Where C > 0, root - b is c (1 + sqrt(1 + 0.81 k)) at least, and s / c
 * no more than 1.4; else it is 1.35 c. o is off by 5.3 u r, w by 3.5 u, C by 10 u r (2 + r), b by
 * 11 u where k is that much, root by 11 u sqrt(1 + 1.21 k) + 6.1 u k c + 5.5 u k c + 2.6 u = 45 u,
 * and s by 10 u k c / 1.35 + 0.9 (45 u + 11 u) + 2 u = 62 u. So normals, with the roundings of m
 * and of two sums, are off by 77 u. On a plane, C is 2 o.m, root is -b, and s is off by no more of
 * itself. Its normal is rounded by u.
 *
 * Lights. The point is o + s w beside the middle. On a ball it is off by those 77 u, and lights
 * are RADII away or more; or it is off by u r (5 + 25 / c + 82 / c^2). bend->points tells that no
 * point is farther from the middle than M, M is r / c or more, and lights are NEAR M / c away
 * or more. On a plane it is off by u r (3 + 14 / c + 10 / c^2), and that is NEAR_PLANE M / c. So
 * none is turned by more than 26 u by that; its own place, relative to the middle, is rounded, and
 * so is the difference: 28 u.
 *
 * Mirrored views. |w| is off by 6.5 u of it, N.V by 55 u, and W = w / |w| + 2 (N.V) N by no more
 * than 11 u + 2 (55 u + 77 u) + 3 u = 278 u.
 *
 * Ellipsoids. All of this is so in the frame in which they are balls, where r <= OWN_FLAT c^2, and
 * r is the most of o by its parts. So C is 0.96 c^2 at most, root off by 28 u, s by 25 u, and m + o
 * + s w - m by 33 u. With h the most that the map of normals lengthens, whose entries are rounded,
 * and n = N there + that map's image, which is no shorter than 3/4 (sight/bend.c), n is off by (4 +
 * 44 h) u, and its unit vector by 4/3 of that and 4 u more: 127 u, as h is STRETCH at most. The
 * ray's w' there is of unit length, and N.w is b' |F w| / |n|, b' as above: |F w| is h |F^T m| at
 * most, and N.V is off by 28 u 4/3 h + 8 u = 83 u. So W is by 11 u + 2 (83 u + 127 u) + 3 u = 434
 * u. Points are off by u r (3 + 14.5 / c + 52 / c^2), and by 7 u of their way from the middle by
 * their map's roundings: with lights NEAR M / c away, 14 u of light's directions.
 *
 * Rims. m is beside the ball, at right angles to w in the middle, where r <= RIM and the square of
 * N.w there is no more than RIM_SQUARE. That square is a polynomial of which the first term is
 * rounded three times and the others six times at most: it is off by e = u (4 |first| + 7 |others|)
 * and what f64 is, which is not less than that under a lens from afar, and tells on which side of
 * the rim the ray is where it is larger. It is sketched where it is (e / 64 u)^2 at least, so that
 * its root is off by 34 u. b = m.(w - way) + o.w is off by 3 u, |w|^2 by 12 u, s, which is -(root +
 * b) / |w|^2 and 1.2 / |w| at most, by 57 u / |w|, and m + o + s w by 66 u; N.V by 45 u, and so W
 * by 200 u. Lights are RADII away or more from all points.
 *
 * tests/property/sketch.c sees an eighth of it: these are the most that roundings add up to where
 * all of them lie one way, at the most grazing rays that are sketched. */
#include <string.h>

#include "shade/sketch_job.h"

/* As above; LOW is in plan/bend.h. */
static const double FLAT = 2, WIDE = 0.1, NEAR = 8, NEAR_PLANE = 3, RADII = 3, STRETCH = 2,
                    OWN_FLAT = 0.4, RIM = 0.125, RIM_SQUARE = 0.3;

/* ---- Lights on materials. ---- */

static shd_sketch_light light_of(const shd_plan_material *material, const shd_packed_light *from) {
    shd_sketch_light out = {.from = from};
    for (int c = 0; c < 3; c++) {
        const double color = (double)from->color[c];
        out.diffuse[c] = (float)(material->diffuse[c] * color);
        for (size_t k = 0; k < material->lobe_count; k++)
            out.specular[k][c] = (float)(material->lobes[k].specular[c] * color);
    }
    return out;
}

/* Where a group's lights are. False: memory. */
static bool place_lights(const shd_plan *plan, const shd_plan_group *group, shd_arena *arena,
                         shd_sketch_group *out) {
    enum { LANES = 8, ROWS = 5 }; /* the most doubles of a vector */
    const size_t count = (group->light_count + LANES - 1) / LANES * LANES;
    double *rows = shd_arena_zalloc(arena, ROWS * count, sizeof *rows);
    if (!rows) return false;
    for (size_t k = 0; k < count; k++) rows[k] = 1; /* directional ones at the end */
    for (size_t k = 0; k < group->light_count; k++) {
        const shd_plan_light *light = &plan->lights[group->lights[k]];
        const shd_vec3 at = light->directional ? light->toward : light->position;
        rows[k] = at.x;
        rows[count + k] = at.y;
        rows[2 * count + k] = at.z;
        rows[3 * count + k] = light->directional ? 0 : 1;
        rows[4 * count + k] = light->directional ? 1 : plan->scale;
    }
    for (size_t c = 0; c < 3; c++) out->at[c] = rows + c * count;
    out->point = rows + 3 * count;
    out->scale = rows + 4 * count;
    return true;
}

/* False: memory. */
static bool prepare_group(const shd_lighting *lighting, const shd_plan_group *group,
                          shd_arena *arena, shd_sketch_group *out) {
    const shd_plan *plan = lighting->plan;
    const shd_plan_material *material = &plan->materials[group->material];
    *out = (shd_sketch_group){.fits = shd_plan_sketches(plan, group),
                              .lobes = lighting->materials[group->material].lobes,
                              .lobe_count = material->lobe_count,
                              .light_count = group->light_count};
    shd_sketch_light *lights =
        out->fits ? shd_arena_alloc(arena, group->light_count, sizeof *lights) : NULL;
    out->lights = lights;
    if (!out->fits) return true;
    for (int c = 0; c < 3; c++) out->constant[c] = (float)material->constant[c];
    for (size_t k = 0; k < out->lobe_count; k++)
        out->reach = fmaxf(out->reach, out->lobes[k].reach);
    for (size_t k = 0; lights && k < group->light_count; k++) {
        const shd_packed_light *from = &lighting->lights[group->lights[k]];
        out->fits = out->fits && from->kind != SHD_KIND_WIDE;
        lights[k] = light_of(material, from);
    }
    return lights && place_lights(plan, group, arena, out);
}

bool shd_sketch_prepare(shd_lighting *lighting, shd_arena *arena) {
    const shd_plan *plan = lighting->plan;
    shd_sketch_group *groups = shd_arena_alloc(arena, plan->group_count, sizeof *groups);
    lighting->sketches = groups;
    for (size_t g = 0; groups && g < plan->group_count; g++)
        if (!prepare_group(lighting, &plan->groups[g], arena, &groups[g])) return false;
    return groups;
}

/* ---- Blocks. ---- */

static shd_sketch_function *const kernels[SHD_ISA_COUNT] = SHD_VARIANTS(shd_sketch);

static void round_vec(shd_vec3 v, float out[3]) {
    out[0] = (float)v.x;
    out[1] = (float)v.y;
    out[2] = (float)v.z;
}

/* Whether a vector that grows by `x` and `y`, at right angles to each other, to the right and down
 * is `most` at most. */
static bool is_within(const shd_block_rays *rays, shd_vec3 x, shd_vec3 y, double most) {
    const double half = (rays->blocks * SHD_SKETCH_SIDE - 1) * 0.5;
    return half * half * (shd_dot(x, x) + shd_dot(y, y)) <= most * most;
}

static bool is_steady(const shd_block_rays *rays) {
    static const double HALF_ROOT2 = 0.7071067811;
    const double c = rays->cosine;
    if (rays->to_world) /* whatever the angle */
        return rays->stretch <= STRETCH &&
               is_within(rays, rays->way_x, rays->way_y, HALF_ROOT2 * WIDE * c) &&
               is_within(rays, rays->at_x, rays->at_y, HALF_ROOT2 * OWN_FLAT * c * c);
    return is_within(rays, rays->way_x, rays->way_y, WIDE * c) &&
           (!rays->curved ||
            is_within(rays, rays->at_x, rays->at_y, fmin(FLAT * c, SHD_SKETCH_LOW) * c));
}

/* How near lights may be. */
static double nearest_for(const shd_block_rays *rays, double moved) {
    const double near = (rays->curved ? NEAR : NEAR_PLANE) * moved / rays->cosine;
    return rays->curved && !rays->to_world ? fmin(near, RADII * rays->size) : near;
}

static shd_sketch_view view_of(const shd_bend *bend, const shd_block_rays *rays,
                               const shd_sketch_group *group) {
    const shd_vec3 n = bend->normal,
                   mirror = shd_sub(shd_scale(n, 2 * shd_dot(n, bend->view)), bend->view);
    const double moved = bend->points.first * bend->reach;
    shd_sketch_view v = {.moved = moved,
                         .turned = bend->normals.first * bend->reach,
                         .chord = sqrt((double)group->reach) +
                                  (2 * bend->normals.first + bend->views.first) * bend->reach +
                                  SHD_SKETCH_OFF,
                         .near = nearest_for(rays, moved)};
    memcpy(v.point, &bend->point, sizeof v.point);
    memcpy(v.normal, &n, sizeof v.normal);
    memcpy(v.mirror, &mirror, sizeof v.mirror);
    return v;
}

/* The maps of an ellipsoid's frame, and its rays in the world. */
static void set_ellipsoid(const shd_bend *bend, const shd_block_rays *rays, double scale,
                          shd_sketch_job *j) {
    const shd_affine *map = rays->to_world;
    const shd_vec3 way = shd_linear(map, rays->way);
    const double length = shd_length(way);
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++) {
            j->to_frame[r][c] = (float)(map->linear[r][c] * scale);
            j->to_normal[r][c] = (float)(rays->from_world->linear[c][r] * rays->to_normal);
        }
    j->along = (float)(rays->to_normal / length);
    round_vec(bend->normal, j->normal);
    round_vec(shd_scale(way, 1 / length), j->seen);
    round_vec(shd_scale(shd_linear(map, rays->way_x), 1 / length), j->seen_x);
    round_vec(shd_scale(shd_linear(map, rays->way_y), 1 / length), j->seen_y);
}

/* The rays from the block's middle on. */
static void set_rays(const shd_block_rays *rays, shd_sketch_job *j) {
    j->blocks = rays->blocks;
    round_vec(rays->middle, j->middle);
    round_vec(rays->way, j->way);
    round_vec(rays->way_x, j->way_x);
    round_vec(rays->way_y, j->way_y);
    round_vec(rays->at_x, j->at_x);
    round_vec(rays->at_y, j->at_y);
}

bool shd_sketch_blocks(const shd_lighting *lighting, const shd_bend *bend,
                       const shd_block_rays *rays, size_t stride, float *const rgb[3],
                       bool *drawn) {
    const shd_plan *plan = lighting->plan;
    const size_t of = plan->objects[bend->object].group;
    const shd_sketch_group *group = &lighting->sketches[of];
    if (!group->fits || !is_steady(rays)) return false;
    shd_sketch_job j;
    j.group = group;
    j.form = rays->to_world ? SHD_SKETCH_ELLIPSOID
             : rays->curved ? SHD_SKETCH_BALL
                            : SHD_SKETCH_PLANE;
    const double turned = (rays->to_world ? 2 : 1) * SHD_SKETCH_TURNED;
    j.turned2 = (float)(turned * turned);
    j.scale = (float)(rays->size * plan->scale);
    j.view = view_of(bend, rays, group);
    set_rays(rays, &j);
    if (rays->to_world) set_ellipsoid(bend, rays, plan->scale, &j);
    return kernels[plan->isa](&j, stride, rgb, drawn);
}

/* N is m there and what it moved by; W, mirrored, is w but for 2 N.V. */
static shd_sketch_view view_of_rim(const shd_rim *rim, const shd_block_rays *rays,
                                   const shd_sketch_group *group) {
    shd_sketch_view v = {.moved = rim->moved,
                         .turned = rim->moved / rays->size,
                         .chord = sqrt((double)group->reach) + 2 * rim->cosine + rim->turned +
                                  SHD_SKETCH_OFF,
                         .near = RADII * rays->size};
    memcpy(v.point, &rim->point, sizeof v.point);
    memcpy(v.normal, &rays->middle, sizeof v.normal);
    memcpy(v.mirror, &rays->way, sizeof v.mirror);
    return v;
}

bool shd_sketch_rim(const shd_lighting *lighting, const shd_rim *rim, const shd_block_rays *rays,
                    const float beyond[3], size_t stride, float *const rgb[3]) {
    static const double U = 0x1p-24, SURE = 64;
    const shd_plan *plan = lighting->plan;
    shd_sketch_job j = {.group = &lighting->sketches[plan->objects[rim->object].group],
                        .form = SHD_SKETCH_RIM};
    if (!j.group->fits || !(rim->least <= RIM_SQUARE) ||
        !is_within(rays, rays->way_x, rays->way_y, WIDE) ||
        !is_within(rays, rays->at_x, rays->at_y, RIM))
        return false;
    const double off = U * (4 * rim->least + 7 * rim->rest) + rim->off, root = off / (SURE * U);
    j.turned2 = (float)(SHD_SKETCH_TURNED * SHD_SKETCH_TURNED);
    j.scale = (float)(rays->size * plan->scale);
    j.unsure = (float)(2 * off);
    j.sure = (float)fmax(root * root, 4 * off);
    for (int k = 0; k < 6; k++) j.square[k] = (float)rim->square[k];
    memcpy(j.beyond, beyond, sizeof j.beyond);
    j.view = view_of_rim(rim, rays, j.group);
    set_rays(rays, &j);
    bool drawn = false;
    return kernels[plan->isa](&j, stride, rgb, &drawn) && drawn;
}
