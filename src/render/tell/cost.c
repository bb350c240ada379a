#include "render/tell/cost.h"

#include "plan/cost.h"

/* Nanoseconds, as those of plan/cost.c. */
static const double CODES = 2.5;  /* a pixel straight to codes, */
static const double FLOATS = 48;  /* through OpenColorIO's floats, */
static const double LINEAR = 1.3; /* or to a linear space */

/* To encode a sample of the depth that the format has by itself. */
static const double encoders[SHD_FORMAT_COUNT] = {
    [SHD_PNG] = 4.2, [SHD_JPEG] = 1.4, [SHD_WEBP] = 26,
    [SHD_TIFF] = 10, [SHD_EXR] = 21,   [SHD_HDR] = 5,
};

shd_cost shd_cost_of(const shd_plan *plan, const bool *codes) {
    const shd_scene *scene = plan->scene;
    const double pixels = (double)scene->raster.w * scene->raster.h, million = 1e6;
    const shd_ray_cost rays = shd_plan_ray_cost(plan, plan->tier, shd_plan_kernel_costs(plan));
    shd_cost cost = {.visibility = (pixels * rays.rays + rays.meshes) / million,
                     .shade = pixels * rays.light / million};
    for (size_t o = 0; o < scene->output_count; o++) {
        const shd_output *output = &scene->outputs[o];
        const shd_format_info *format = shd_format_get(output->format);
        const double pictures = 1 + (double)output->layer_count;
        const double values = pixels * pictures * (output->channel < 0 ? 3 : 1);
        const bool linear = output->color_space && output->color_space->scene_linear;
        const double color = codes[o] ? CODES : linear ? LINEAR : FLOATS;
        cost.color += pixels * pictures * color / million;
        cost.encode +=
            values * encoders[output->format] * (output->depth > format->depth ? 2 : 1) / million;
    }
    cost.total = cost.visibility + cost.shade + cost.color + cost.encode;
    return cost;
}
