#include "render/cost.h"

#include <math.h>

/* Nanoseconds: rays and light from `shade compare --threads 1` of api/examples with one sample
 * (materials.json, lights.json, sixteen-lights.json), colors and encoders from the Server-Timing of
 * a daemon with `--threads 1` that renders materials.json with one sample, all with AVX-512
 * kernels. Other machines and pictures differ by two times and more: what to compare are
 * estimates. */
static const double RAY = 11;       /* a ray that an object may be in the way of */
static const double SAMPLE = 4;     /* a hit: its way from light sums to the film */
static const double LIGHT = 1.6;    /* a light at a hit: direction and diffuse weight */
static const double LOBE = 1.8;     /* each specular lobe of it */
static const double EXACT = 6;      /* times that in f64 */
static const double ADAPTIVE = 1.5; /* rays a pixel where fewer samples do */
static const double CODES = 2.5;    /* a pixel straight to codes, */
static const double FLOATS = 48;    /* through OpenColorIO's floats, */
static const double LINEAR = 1.3;   /* or to a linear space */

/* A sample of the depth that the format has by itself. */
static const double encoders[SHD_FORMAT_COUNT] = {
    [SHD_PNG] = 4.2, [SHD_JPEG] = 1.4, [SHD_WEBP] = 26,
    [SHD_TIFF] = 10, [SHD_EXR] = 21,   [SHD_HDR] = 5,
};

/* The share of the picture that an object covers, about. */
static double share_of(const shd_plan *plan, size_t index) {
    const shd_scene *scene = plan->scene;
    const shd_camera *camera = &scene->camera;
    const shd_plan_object *object = &plan->objects[index];
    if (!object->bounded) return 0.5;
    double half = camera->height / 2;
    if (camera->projection == SHD_PERSPECTIVE) {
        double distance = shd_length(shd_sub(object->center, camera->position));
        half = tan(camera->fov / 2) * fmax(distance, object->radius);
    }
    double part = SHD_PI / 4 * (object->radius / half) * (object->radius / half);
    part *= (double)scene->raster.height / scene->raster.width;
    /* Other shapes cover about two thirds of their sphere's disc. */
    return fmin(scene->objects[index].shape == SHD_SPHERE ? part : 0.67 * part, 1);
}

/* Nanoseconds of a hit of the object. */
static double hit_of(const shd_plan *plan, size_t index) {
    const shd_plan_object *object = &plan->objects[index];
    const size_t lobes = plan->materials[object->material].lobe_count;
    double lights = (double)object->light_count * (LIGHT + LOBE * (double)lobes);
    return SAMPLE + (plan->tier == SHD_EXACT ? EXACT : 1) * lights;
}

shd_cost shd_cost_of(const shd_plan *plan, const bool *codes) {
    const shd_scene *scene = plan->scene;
    const double pixels = (double)scene->raster.w * scene->raster.h, million = 1e6;
    double rays = scene->raster.samples;
    if (plan->tier != SHD_EXACT && plan->sampling_absolute > 0) rays = fmin(rays, ADAPTIVE);
    double covered = 0, lit = 0;
    for (size_t i = 0; i < scene->object_count; i++) {
        covered += share_of(plan, i);
        lit += share_of(plan, i) * hit_of(plan, i);
    }
    /* Objects are beside each other until the picture is full, and then before each other. */
    if (covered > 1) lit /= covered, covered = 1;
    shd_cost cost = {.visibility = pixels * rays * covered * RAY / million,
                     .shade = pixels * rays * lit / million};
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
