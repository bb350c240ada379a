#include "render/tell/estimate.h"

#include "render/show/route.h"
#include "render/tiles/film.h"

/* Scenes are within limits of 2^46 and below: sums and products of them are kept from wrapping. */
static uint64_t add(uint64_t a, uint64_t b) {
    uint64_t sum;
    return __builtin_add_overflow(a, b, &sum) ? UINT64_MAX : sum;
}

static uint64_t times(uint64_t a, uint64_t b) {
    uint64_t product;
    return __builtin_mul_overflow(a, b, &product) ? UINT64_MAX : product;
}

static bool is_color(const shd_layer *layer) {
    return layer->kind < SHD_LAYER_NORMAL;
}

/* Bytes of the film, if it has floats. Light planes are counted as those of one output that has the
 * most, for others may have the same. */
static uint64_t film_bytes(const shd_scene *scene) {
    if (!shd_route_of(scene, &scene->outputs[0], true).film) return 0;
    bool wants[SHD_LAYER_KINDS] = {false};
    size_t most_lights = 0, planes = 1;
    for (size_t o = 0; o < scene->output_count; o++) {
        const shd_output *output = &scene->outputs[o];
        size_t lights = 0;
        for (size_t l = 0; l < output->layer_count; l++) {
            wants[output->layers[l].kind] = true;
            lights += output->layers[l].kind == SHD_LAYER_LIGHT;
        }
        if (lights > most_lights) most_lights = lights;
    }
    for (int k = SHD_LAYER_EMISSIVE; k < SHD_LAYER_LIGHT; k++) planes += wants[k];
    return shd_film_size(&scene->raster, planes + most_lights, wants);
}

/* Bytes a pixel of one output: the colors of each layer, converted; and what is encoded. */
static uint64_t output_bytes(const shd_output *output) {
    uint64_t floats = 0;
    for (size_t l = 0; l < output->layer_count; l++)
        if (is_color(&output->layers[l])) floats += 3;
    uint64_t sample = output->depth == SHD_U8 ? 1 : output->depth == SHD_U16 ? 2 : 4;
    uint64_t channels = output->channel >= 0 ? 1 : 3;
    bool packed = output->depth == SHD_U8 || output->depth == SHD_U16;
    return sizeof(float) * floats + (packed ? sample * channels : 0);
}

uint64_t shd_estimate_memory(const shd_scene *scene) {
    uint64_t pixels = (uint64_t)scene->raster.w * (uint64_t)scene->raster.h, bytes = 0;
    for (size_t o = 0; o < scene->output_count; o++) {
        const uint64_t one = output_bytes(&scene->outputs[o]);
        if (one > bytes) bytes = one;
    }
    return add(film_bytes(scene), times(pixels, bytes));
}

uint64_t shd_estimate_light_samples(const shd_scene *scene) {
    const uint64_t pixels = (uint64_t)scene->raster.w * (uint64_t)scene->raster.h;
    uint64_t lobes = 0;
    for (size_t m = 0; m < scene->material_count; m++)
        if (scene->materials[m].lobe_count > lobes) lobes = scene->materials[m].lobe_count;
    return times(times(pixels, (uint64_t)scene->raster.samples),
                 times(scene->light_count, 1 + lobes));
}

uint64_t shd_estimate_object_lights(const shd_scene *scene) {
    return times(scene->object_count, scene->light_count);
}

uint64_t shd_estimate_work(const shd_scene *scene) {
    enum { PIXEL = 4, LAYER = 4, DOUBLE_PRECISION = 4, MESH_TRIANGLE = 8 };
    uint64_t pixels = (uint64_t)scene->raster.w * (uint64_t)scene->raster.h;
    uint64_t samples = times(pixels, (uint64_t)scene->raster.samples), triangles = 0, layers = 0;
    for (size_t i = 0; i < scene->object_count; i++)
        if (scene->objects[i].mesh)
            triangles = add(triangles, scene->objects[i].mesh->triangle_count);
    for (size_t o = 0; o < scene->output_count; o++)
        layers = add(layers, 1 + scene->outputs[o].layer_count);
    /* Seeing a sample costs about as much as two lights on it; tiles skip most objects. */
    uint64_t a_sample = add(add(2, scene->light_count), scene->object_count / 16);
    if (scene->accuracy.tier == SHD_EXACT) a_sample = times(a_sample, DOUBLE_PRECISION);
    return add(add(times(samples, a_sample), times(pixels, add(PIXEL, times(LAYER, layers)))),
               times(triangles, MESH_TRIANGLE));
}
