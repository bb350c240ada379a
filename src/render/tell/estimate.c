#include "render/tell/estimate.h"

#include "render/show/route.h"

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

/* Bytes a pixel of the film: RGBA floats, and a plane for each kind of layer. Light planes are
 * counted as the entry of one output that has the most, for others may have the same. */
static uint64_t film_bytes(const shd_scene *scene) {
    if (!shd_route_of(scene, &scene->outputs[0], true).film) return 0; /* it may have none */
    static const unsigned channels[SHD_LAYER_KINDS] = {
        [SHD_LAYER_EMISSIVE] = 3, [SHD_LAYER_AMBIENT] = 3, [SHD_LAYER_DIFFUSE] = 3,
        [SHD_LAYER_SPECULAR] = 3, [SHD_LAYER_NORMAL] = 3,  [SHD_LAYER_POSITION] = 3,
        [SHD_LAYER_DEPTH] = 1,    [SHD_LAYER_OBJECT] = 1};
    bool wanted[SHD_LAYER_KINDS] = {false};
    uint64_t floats = 4, most_lights = 0;
    for (size_t o = 0; o < scene->output_count; o++) {
        const shd_output *output = &scene->outputs[o];
        uint64_t lights = 0;
        for (size_t l = 0; l < output->layer_count; l++) {
            shd_layer_kind kind = output->layers[l].kind;
            lights += kind == SHD_LAYER_LIGHT;
            floats += wanted[kind] ? 0 : channels[kind];
            wanted[kind] = true;
        }
        if (lights > most_lights) most_lights = lights;
    }
    return sizeof(float) * (floats + 3 * most_lights);
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
    return times(pixels, add(film_bytes(scene), bytes));
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
