#include "render/cost.h"

#include <math.h>

/* Nanoseconds, from medians of `shade compare --threads 1` of api/examples (materials.json,
 * lights.json, sixteen-lights.json), and for encoders of `shade render`, with AVX-512 kernels.
 * Other machines and pictures differ by two times and more: what to compare are estimates. */
static const double RAY = 11;       /* a ray that an object may be in the way of */
static const double SAMPLE = 4;     /* a hit: its way from light sums to the film */
static const double LIGHT = 1.6;    /* a light at a hit: direction and diffuse weight */
static const double LOBE = 1.8;     /* each specular lobe of it */
static const double EXACT = 6;      /* times that in f64 */
static const double CODES = 1.5;    /* a pixel straight to codes, */
static const double FLOATS = 30;    /* or through OpenColorIO's floats */
static const double ADAPTIVE = 1.5; /* rays a pixel where fewer samples do */

static const double encoders[SHD_FORMAT_COUNT] =
    {/* a sample of 8 bits */
     [SHD_PNG] = 6, [SHD_JPEG] = 2, [SHD_WEBP] = 30, [SHD_TIFF] = 6, [SHD_EXR] = 25, [SHD_HDR] = 8};

/* The share of the picture that the objects' spheres cover, one beside the other. */
static double coverage_of(const shd_plan *plan) {
    const shd_scene *scene = plan->scene;
    const shd_camera *camera = &scene->camera;
    const double aspect = (double)scene->raster.width / scene->raster.height;
    double share = 0;
    for (size_t i = 0; i < scene->object_count; i++) {
        const shd_plan_object *object = &plan->objects[i];
        if (!object->bounded) {
            share += 0.5;
            continue;
        }
        double half = camera->height / 2, radius = object->radius;
        if (camera->projection == SHD_PERSPECTIVE) {
            double distance = shd_length(shd_sub(object->center, camera->position));
            half = tan(camera->fov / 2) * distance;
            if (distance <= radius) half = radius;
        }
        /* A shape covers about two thirds of its sphere's disc. */
        share += 0.67 * SHD_PI / 4 * (radius / half) * (radius / half) / aspect;
        if (share > 1) return 1;
    }
    return share;
}

/* Nanoseconds of a hit, averaged over the objects. */
static double hit_of(const shd_plan *plan) {
    const shd_scene *scene = plan->scene;
    double sum = 0;
    for (size_t i = 0; i < scene->object_count; i++) {
        const shd_plan_object *object = &plan->objects[i];
        const shd_plan_material *material = &plan->materials[object->material];
        sum += (double)object->light_count * (LIGHT + LOBE * (double)material->lobe_count);
    }
    if (scene->object_count) sum /= (double)scene->object_count;
    return SAMPLE + (plan->tier == SHD_EXACT ? EXACT : 1) * sum;
}

shd_cost shd_cost_of(const shd_plan *plan, const bool *codes) {
    const shd_scene *scene = plan->scene;
    const double pixels = (double)scene->raster.w * scene->raster.h, million = 1e6;
    double rays = scene->raster.samples;
    if (plan->tier != SHD_EXACT && plan->sampling_absolute > 0) rays = fmin(rays, ADAPTIVE);
    const double hits = pixels * rays * coverage_of(plan);
    shd_cost cost = {.visibility = hits * RAY / million, .shade = hits * hit_of(plan) / million};
    for (size_t o = 0; o < scene->output_count; o++) {
        const shd_output *output = &scene->outputs[o];
        double samples = output->channel < 0 ? 3 : 1;
        double wide = output->depth == SHD_U8 ? 1 : output->depth == SHD_FLOAT ? 4 : 2;
        cost.color +=
            pixels * (codes[o] ? CODES : FLOATS) * (1 + (double)output->layer_count) / million;
        cost.encode += pixels * samples * wide * (1 + (double)output->layer_count) *
                       encoders[output->format] / million;
    }
    return cost;
}
