#include "render/tell/estimate.h"

#include "render/show/output.h"
#include "shade/glow_needs.h"

/* Sums and products of numbers of up to 2^46 saturate instead of wrapping. */
static uint64_t add_sat(uint64_t a, uint64_t b) {
    uint64_t sum;
    return __builtin_add_overflow(a, b, &sum) ? UINT64_MAX : sum;
}

static uint64_t mul_sat(uint64_t a, uint64_t b) {
    uint64_t product;
    return __builtin_mul_overflow(a, b, &product) ? UINT64_MAX : product;
}

/* Bytes of the film's floats, if it has any. Planes of lights and lobes are counted in the output
 * that has the most of them, for others may have the same ones. */
static uint64_t film_bytes(const shd_scene *scene) {
    if (!shd_route_of(scene, &scene->outputs[0], true).film) return 0;
    bool wants[SHD_LAYER_KINDS] = {false};
    size_t most_numbered = 0, planes = 1;
    for (size_t o = 0; o < scene->output_count; o++) {
        const shd_output *output = &scene->outputs[o];
        size_t numbered = 0;
        for (size_t l = 0; l < output->layer_count; l++) {
            const shd_layer_kind kind = output->layers[l].kind;
            wants[kind] = true;
            numbered += kind == SHD_LAYER_LIGHT || kind == SHD_LAYER_LOBE;
        }
        if (numbered > most_numbered) most_numbered = numbered;
    }
    for (int k = SHD_LAYER_EMISSIVE; k < SHD_LAYER_NORMAL; k++)
        planes += wants[k] && k != SHD_LAYER_LIGHT && k != SHD_LAYER_LOBE;
    return shd_film_size(&scene->raster, planes + most_numbered, wants);
}

static uint64_t pixels_of(const shd_scene *scene) {
    return (uint64_t)scene->raster.w * (uint64_t)scene->raster.h;
}

/* Bytes that one output takes for a pixel: each layer's converted colors, and what is encoded. */
static uint64_t output_bytes(const shd_output *output) {
    const uint64_t sample = output->depth == SHD_U8 ? 1 : output->depth == SHD_U16 ? 2 : 0;
    return 3 * sizeof(float) * shd_output_color_layers(output) +
           sample * (output->channel >= 0 ? 1 : 3);
}

uint64_t shd_estimate_memory(const shd_scene *scene) {
    uint64_t bytes = 0;
    for (size_t o = 0; o < scene->output_count; o++) {
        const uint64_t one = output_bytes(&scene->outputs[o]);
        if (one > bytes) bytes = one;
    }
    return add_sat(film_bytes(scene), mul_sat(pixels_of(scene), bytes));
}

uint64_t shd_estimate_light_samples(const shd_scene *scene) {
    uint64_t lobes = 0;
    for (size_t m = 0; m < scene->material_count; m++)
        if (scene->materials[m].lobe_count > lobes) lobes = scene->materials[m].lobe_count;
    return mul_sat(mul_sat(pixels_of(scene), (uint64_t)scene->raster.samples),
                   mul_sat(scene->light_count, 1 + lobes));
}

uint64_t shd_estimate_object_lights(const shd_scene *scene) {
    return mul_sat(scene->object_count, scene->light_count);
}

uint64_t shd_estimate_planning(const shd_scene *scene) {
    enum { TABLE = 40000000 }; /* some 0.2 seconds */
    return mul_sat(TABLE, shd_glow_needs_of(scene).tables);
}

uint64_t shd_estimate_work(const shd_scene *scene) {
    enum {
        PIXEL = 4,
        LAYER = 4,
        DOUBLE_PRECISION = 4,
        MESH_TRIANGLE = 8,
        AREA = 500,
        AROUND = 200,
        SUMMED = 200000, /* an environment's term by quadrature */
        WALKED = 10000   /* and by walking the map */
    };
    const uint64_t pixels = pixels_of(scene);
    uint64_t samples = mul_sat(pixels, (uint64_t)scene->raster.samples), triangles = 0, layers = 0;
    for (size_t i = 0; i < scene->object_count; i++)
        if (scene->objects[i].mesh)
            triangles = add_sat(triangles, scene->objects[i].mesh->triangle_count);
    for (size_t o = 0; o < scene->output_count; o++)
        layers = add_sat(layers, 1 + scene->outputs[o].layer_count);
    /* To see a sample costs about as much as two lights on it. Tiles skip most objects. */
    uint64_t a_sample = add_sat(add_sat(2, scene->light_count), scene->object_count / 16);
    for (size_t j = 0; j < scene->light_count; j++)
        if (shd_has_shape(scene->lights[j].type))
            a_sample = add_sat(a_sample, AREA);
        else if (scene->lights[j].type == SHD_LIGHT_ENVIRONMENT)
            a_sample = add_sat(a_sample, AROUND);
    const shd_glow_needs around = shd_glow_needs_of(scene);
    a_sample =
        add_sat(a_sample, add_sat(mul_sat(SUMMED, around.summed), mul_sat(WALKED, around.walked)));
    if (scene->accuracy.tier == SHD_EXACT) a_sample = mul_sat(a_sample, DOUBLE_PRECISION);
    return add_sat(shd_estimate_planning(scene),
                   add_sat(add_sat(mul_sat(samples, a_sample),
                                   mul_sat(pixels, add_sat(PIXEL, mul_sat(LAYER, layers)))),
                           mul_sat(triangles, MESH_TRIANGLE)));
}
