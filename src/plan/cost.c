#include "plan/cost.h"

#include <math.h>

#include "plan/kernel_costs.h"

/* Nanoseconds with AVX-512 kernels, as `tests/bench/costs.py` measures them beside these estimates:
 * other machines and pictures differ by two times and more. What to compare are estimates. */
static const double SAMPLE = 4.5;    /* a hit: its way from light sums to the film */
static const double EXACT_RAY = 1.3; /* times a ray in f64 all the way */
static const double FACET = 6;       /* a hit between points that are lit */
static const double TRIANGLE = 700;  /* of a mesh, to make it findable */

/* Times that, with other kernels, but for meshes. */
static const double slower[SHD_ISA_COUNT] = {
    [SHD_PORTABLE] = 2.4, [SHD_AVX2] = 1.45, [SHD_AVX512] = 1};

/* A ray that an object may be in the way of, as far as its block of pixels tells. */
static const double rays[SHD_SHAPE_COUNT] = {
    [SHD_SPHERE] = 8.5,  [SHD_PLANE] = 15, [SHD_DISC] = 22,   [SHD_BOX] = 24,
    [SHD_CYLINDER] = 30, [SHD_CONE] = 30,  [SHD_TORUS] = 110, [SHD_MESH] = 140,
};

/* Pixels on a side: a block's rays are cast at what it may see. */
static const double BLOCK = 8;

/* How much of its box's outline a shape fills, about; of spheres, of their own. */
static const double fills[SHD_SHAPE_COUNT] = {
    [SHD_SPHERE] = SHD_PI, [SHD_DISC] = SHD_PI, [SHD_BOX] = 4,    [SHD_CYLINDER] = 3.5,
    [SHD_CONE] = 2.2,      [SHD_TORUS] = 2.4,   [SHD_MESH] = 1.7,
};

static shd_vec3 column(const shd_affine *m, int c, double scale) {
    return (shd_vec3){scale * m->linear[0][c], scale * m->linear[1][c], scale * m->linear[2][c]};
}

/* An object on the picture, about, in pixels: the outline of its box or ellipsoid, as from far
 * away. */
typedef struct outline {
    double area, length;
} outline;

static outline outline_of(const shd_plan *plan, size_t index) {
    const shd_scene *scene = plan->scene;
    const shd_camera *camera = &scene->camera;
    const shd_object *object = &scene->objects[index];
    const double all = (double)scene->raster.width * scene->raster.height;
    shd_vec3 low, high, view = camera->back;
    if (!shd_object_box(object, &low, &high)) return (outline){0.7 * all, sqrt(all)};
    const shd_vec3 size = shd_scale(shd_sub(high, low), 0.5);
    const shd_vec3 a = column(&object->transform, 0, size.x),
                   b = column(&object->transform, 1, size.y),
                   c = column(&object->transform, 2, size.z);
    const double radius = plan->objects[index].radius;
    double half = camera->height / 2;
    if (camera->projection == SHD_PERSPECTIVE) {
        const shd_vec3 path = shd_sub(camera->position, plan->objects[index].center);
        const double distance = shd_length(path);
        if (distance > radius) view = shd_scale(path, 1 / distance);
        half = tan(camera->fov / 2) * fmax(distance, radius);
    }
    const double x = fabs(shd_dot(view, shd_cross(b, c))), y = fabs(shd_dot(view, shd_cross(c, a))),
                 z = fabs(shd_dot(view, shd_cross(a, b)));
    const double seen = object->shape == SHD_SPHERE ? sqrt(x * x + y * y + z * z) : x + y + z;
    const double pixels = scene->raster.height / (2 * half);
    return (outline){fmin(fills[object->shape] * seen * pixels * pixels, all),
                     fmin(2 * radius * pixels, 2 * sqrt(all))};
}

/* Pixels of the squares of so many on a side that it touches. */
static double touched(const outline *o, double side) {
    const double length = fmax(o->length, sqrt(o->area));
    return (length + side) * ((length > 0 ? o->area / length : 0) + side);
}

/* Of a ray: of one that may meet the object, and of the light of one that does. */
static double cast_of(const shd_plan *plan, const shd_object *object, shd_tier tier) {
    if (object->shape == SHD_MESH || object->interpolation != SHD_PHONG) return rays[SHD_MESH];
    return rays[object->shape] * slower[plan->isa] * (tier == SHD_EXACT ? EXACT_RAY : 1);
}

static double light_of(const shd_plan *plan, size_t index, const shd_kernel_cost *cost) {
    const shd_plan_object *lit = &plan->objects[index];
    const double lobes = (double)plan->materials[lit->material].lobe_count;
    if (plan->scene->objects[index].interpolation != SHD_PHONG) return SAMPLE + FACET;
    return SAMPLE * slower[plan->isa] +
           (double)lit->light_count * (cost->light + lobes * cost->lobe);
}

static size_t triangles_of(const shd_object *object) {
    if (object->shape == SHD_MESH) return object->mesh->triangle_count;
    if (object->interpolation == SHD_PHONG) return 0;
    return shd_tessellation_triangles(object->shape, object->segments);
}

const shd_kernel_cost *shd_plan_kernel_costs(const shd_plan *plan) {
    return shd_kernel_costs[plan->isa];
}

shd_ray_cost shd_plan_ray_cost(const shd_plan *plan, shd_tier tier, const shd_kernel_cost *costs) {
    const shd_scene *scene = plan->scene;
    const double all = (double)scene->raster.width * scene->raster.height;
    const double samples = scene->raster.samples;
    double covered = 0;
    shd_ray_cost cost = {0, 0, 0};
    for (size_t i = 0; i < scene->object_count; i++) {
        const outline o = outline_of(plan, i);
        const double meets = fmin(touched(&o, BLOCK) / all, 1);
        covered += o.area / all;
        cost.rays += samples * meets * cast_of(plan, &scene->objects[i], tier);
        cost.light += samples * o.area / all * light_of(plan, i, &costs[tier]);
        cost.meshes += (double)triangles_of(&scene->objects[i]) * TRIANGLE;
    }
    /* Objects are beside each other until the picture is full, and then before each other: each is
     * asked for its distance, and the nearest one is lit. */
    if (covered > 1) cost.light /= covered;
    return cost;
}

void shd_plan_rank_tiers(const shd_plan *plan, const shd_kernel_cost *costs,
                         shd_tier out[SHD_EXACT + 1]) {
    double total[SHD_EXACT + 1];
    for (int t = 0; t <= SHD_EXACT; t++) {
        const shd_ray_cost cost = shd_plan_ray_cost(plan, (shd_tier)t, costs);
        total[t] = cost.rays + cost.light;
        int at = t;
        for (; at > 0 && total[t] <= total[out[at - 1]]; at--) out[at] = out[at - 1];
        out[at] = (shd_tier)t;
    }
}
