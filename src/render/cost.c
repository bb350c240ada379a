#include "render/cost.h"

#include <math.h>

/* Nanoseconds with AVX-512 kernels, as `tests/bench/costs.py` measures them beside these estimates:
 * other machines and pictures differ by two times and more. What to compare are estimates. */
static const double SAMPLE = 3;      /* a hit: its way from light sums to the film */
static const double LIGHT = 0.7;     /* a light at a hit: direction and diffuse weight */
static const double LOBE = 0.7;      /* each specular lobe of it */
static const double EXACT = 5;       /* times that in f64, */
static const double EXACT_RAY = 1.5; /* and times a ray */
static const double FACET = 6;       /* a hit between points that are lit */
static const double TRIANGLE = 700;  /* of a mesh, to make it findable */
static const double CODES = 2.5;     /* a pixel straight to codes, */
static const double FLOATS = 48;     /* through OpenColorIO's floats, */
static const double LINEAR = 1.3;    /* or to a linear space */

/* Where samples may be left out: rays a pixel, of pixels farther from outlines than this. */
static const double SETTLED = 1.1, OUTLINE = 17;

/* A ray that an object is in the way of. */
static const double rays[SHD_SHAPE_COUNT] = {
    [SHD_SPHERE] = 10,   [SHD_PLANE] = 14, [SHD_DISC] = 20,  [SHD_BOX] = 20,
    [SHD_CYLINDER] = 22, [SHD_CONE] = 26,  [SHD_TORUS] = 90, [SHD_MESH] = 450,
};

/* How much of its box's outline a shape fills, about; of spheres, of their own. */
static const double fills[SHD_SHAPE_COUNT] = {
    [SHD_SPHERE] = SHD_PI, [SHD_DISC] = SHD_PI, [SHD_BOX] = 4,    [SHD_CYLINDER] = 3.5,
    [SHD_CONE] = 2.2,      [SHD_TORUS] = 2.4,   [SHD_MESH] = 1.7,
};

/* A sample of the depth that the format has by itself. */
static const double encoders[SHD_FORMAT_COUNT] = {
    [SHD_PNG] = 4.2, [SHD_JPEG] = 1.4, [SHD_WEBP] = 26,
    [SHD_TIFF] = 10, [SHD_EXR] = 21,   [SHD_HDR] = 5,
};

static shd_vec3 column(const shd_affine *m, int c, double scale) {
    return (shd_vec3){scale * m->linear[0][c], scale * m->linear[1][c], scale * m->linear[2][c]};
}

/* The share of the picture that an object covers, about: the outline of its box or ellipsoid, as
 * from far away. */
static double share_of(const shd_plan *plan, size_t index) {
    const shd_scene *scene = plan->scene;
    const shd_camera *camera = &scene->camera;
    const shd_object *object = &scene->objects[index];
    shd_vec3 low, high, view = camera->back;
    if (!shd_object_box(object, &low, &high)) return 0.5;
    const shd_vec3 size = shd_scale(shd_sub(high, low), 0.5);
    const shd_vec3 a = column(&object->transform, 0, size.x),
                   b = column(&object->transform, 1, size.y),
                   c = column(&object->transform, 2, size.z);
    double half = camera->height / 2;
    if (camera->projection == SHD_PERSPECTIVE) {
        const shd_plan_object *bounds = &plan->objects[index];
        const shd_vec3 path = shd_sub(camera->position, bounds->center);
        const double distance = shd_length(path);
        if (distance > bounds->radius) view = shd_scale(path, 1 / distance);
        half = tan(camera->fov / 2) * fmax(distance, bounds->radius);
    }
    const double x = fabs(shd_dot(view, shd_cross(b, c))), y = fabs(shd_dot(view, shd_cross(c, a))),
                 z = fabs(shd_dot(view, shd_cross(a, b)));
    const double outline = object->shape == SHD_SPHERE ? sqrt(x * x + y * y + z * z) : x + y + z;
    const double picture = 4 * half * half * scene->raster.width / scene->raster.height;
    return fmin(fills[object->shape] * outline / picture, 1);
}

typedef struct hit {
    double ray, shade; /* nanoseconds of a ray that meets an object, and of its light */
    bool convex;       /* samples may be left out there */
} hit;

static hit hit_of(const shd_plan *plan, size_t index) {
    const shd_object *object = &plan->scene->objects[index];
    const shd_plan_object *lit = &plan->objects[index];
    const size_t lobes = plan->materials[lit->material].lobe_count;
    if (object->interpolation != SHD_PHONG) return (hit){rays[SHD_MESH], SAMPLE + FACET, false};
    const double lights = (double)lit->light_count * (LIGHT + LOBE * (double)lobes);
    const bool exact = plan->tier == SHD_EXACT, mesh = object->shape == SHD_MESH;
    return (hit){rays[object->shape] * (exact && !mesh ? EXACT_RAY : 1),
                 SAMPLE + (exact ? EXACT : 1) * lights, object->shape != SHD_TORUS && !mesh};
}

/* Rays a pixel, of an object that covers `pixels`, as a disc does, and beside which others cover a
 * share of the picture: where these are, too, no samples are left out. */
static double samples_of(const shd_plan *plan, const hit *h, double pixels, double others) {
    const double all = plan->scene->raster.samples;
    if (plan->tier == SHD_EXACT || plan->sampling_absolute == 0 || !h->convex) return all;
    const double unsettled = fmin(2 * OUTLINE / sqrt(pixels / SHD_PI), 1),
                 alone = fmax(1 - others, 0);
    return fmin(SETTLED + (1 - (1 - unsettled) * alone) * all, all);
}

static size_t triangles_of(const shd_object *object) {
    if (object->shape == SHD_MESH) return object->mesh->triangle_count;
    if (object->interpolation == SHD_PHONG) return 0;
    return shd_tessellation_triangles(object->shape, object->segments);
}

shd_cost shd_cost_of(const shd_plan *plan, const bool *codes) {
    const shd_scene *scene = plan->scene;
    const double pixels = (double)scene->raster.w * scene->raster.h, million = 1e6;
    double covered = 0, cast = 0, lit = 0, triangles = 0;
    for (size_t i = 0; i < scene->object_count; i++) covered += share_of(plan, i);
    for (size_t i = 0; i < scene->object_count; i++) {
        const double share = share_of(plan, i);
        const hit h = hit_of(plan, i);
        const double samples = samples_of(plan, &h, share * pixels, covered - share);
        cast += share * samples * h.ray;
        lit += share * samples * h.shade;
        triangles += (double)triangles_of(&scene->objects[i]);
    }
    /* Objects are beside each other until the picture is full, and then before each other: each is
     * asked for its distance, and the nearest one is lit. */
    if (covered > 1) lit /= covered;
    shd_cost cost = {.visibility = (pixels * cast + triangles * TRIANGLE) / million,
                     .shade = pixels * lit / million};
    for (size_t o = 0; o < scene->output_count; o++) {
        const shd_output *output = &scene->outputs[o];
        const shd_format_info *format = shd_format_get(output->format);
        const double pictures = 1 + (double)output->layer_count;
        const double samples = pixels * pictures * (output->channel < 0 ? 3 : 1);
        const bool linear = output->color_space && output->color_space->scene_linear;
        const double color = codes[o] ? CODES : linear ? LINEAR : FLOATS;
        cost.color += pixels * pictures * color / million;
        cost.encode +=
            samples * encoders[output->format] * (output->depth > format->depth ? 2 : 1) / million;
    }
    return cost;
}
