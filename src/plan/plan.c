#include "plan/plan.h"

#include <stdio.h>
#include <string.h>

static bool is_black(const double color[3]) {
    return color[0] == 0 && color[1] == 0 && color[2] == 0;
}

static shd_plan_light plan_light(const shd_light *light, size_t index) {
    shd_plan_light out = {.index = index};
    memcpy(out.color, light->color, sizeof out.color);
    out.directional = light->type == SHD_LIGHT_DIRECTIONAL;
    out.spot = light->type == SHD_LIGHT_SPOT;
    out.position = light->position;
    out.toward = shd_scale(light->direction, -1);
    out.axis = light->direction;

    const double *f = light->attenuation;
    double largest = fmax(f[0], fmax(f[1], f[2]));
    out.a = f[0] / largest;
    out.b = f[1] / largest;
    out.c = f[2] / largest;
    out.gain = 1 / largest;
    out.attenuated = !out.directional && (f[1] != 0 || f[2] != 0);
    if (out.directional) out.gain = 1;
    out.min_distance = light->min_distance;

    /* 1 - cos(t) = 2 sin^2(t/2) */
    double outer = sin(light->angle / 2), inner = sin(light->angle * (1 - light->penumbra) / 2);
    out.outer = 2 * outer * outer;
    out.inner = 2 * inner * inner;
    out.exponent = light->exponent;
    return out;
}

static bool plan_material(const shd_material *material, const double ambient[3], shd_arena *arena,
                          shd_plan_material *out) {
    shd_plan_lobe *lobes = shd_arena_alloc(arena, material->lobe_count, sizeof *lobes);
    if (!lobes) return false;
    *out = (shd_plan_material){.lobes = lobes, .front_only = material->front_only};
    for (int c = 0; c < 3; c++) {
        out->emissive[c] = material->emissive[c];
        out->ambient[c] = material->ambient[c] * ambient[c];
        out->diffuse[c] = material->diffuse[c];
    }
    out->has_diffuse = !is_black(out->diffuse);
    for (size_t i = 0; i < material->lobe_count; i++) {
        const shd_lobe *lobe = &material->lobes[i];
        if (is_black(lobe->specular)) continue;
        shd_plan_lobe *kept = &lobes[out->lobe_count++];
        memcpy(kept->specular, lobe->specular, sizeof kept->specular);
        kept->shininess = lobe->shininess;
    }
    return true;
}

/* The beauty and the color layers, each once, and which kinds of data layers are wanted. */
static bool plan_planes(const shd_scene *scene, shd_arena *arena, shd_plan *plan) {
    size_t most = 1;
    for (size_t o = 0; o < scene->output_count; o++) most += scene->outputs[o].layer_count;
    shd_plane *planes = shd_arena_alloc(arena, most, sizeof *planes);
    if (!planes) return false;
    planes[0] = (shd_plane){SHD_LAYER_BEAUTY, 0};
    size_t count = 1;
    for (size_t o = 0; o < scene->output_count; o++) {
        for (size_t l = 0; l < scene->outputs[o].layer_count; l++) {
            const shd_layer *layer = &scene->outputs[o].layers[l];
            plan->wants[layer->kind] = true;
            if (layer->kind > SHD_LAYER_LIGHT) continue;
            shd_plane plane = {layer->kind, layer->kind == SHD_LAYER_LIGHT ? layer->light : 0};
            size_t known = 0;
            while (known < count &&
                   (planes[known].kind != plane.kind || planes[known].light != plane.light))
                known++;
            if (known == count) planes[count++] = plane;
        }
    }
    plan->planes = planes;
    plan->plane_count = count;
    return true;
}

/* The frame in which f32 positions are small: around the finite objects, or around the camera
 * where there are none. */
static void plan_frame(const shd_scene *scene, shd_plan *plan) {
    shd_vec3 low = {INFINITY, INFINITY, INFINITY}, high = {-INFINITY, -INFINITY, -INFINITY};
    for (size_t i = 0; i < scene->object_count; i++) {
        shd_vec3 c;
        double r;
        if (!shd_object_bounds(&scene->objects[i], &c, &r)) continue;
        low = (shd_vec3){fmin(low.x, c.x - r), fmin(low.y, c.y - r), fmin(low.z, c.z - r)};
        high = (shd_vec3){fmax(high.x, c.x + r), fmax(high.y, c.y + r), fmax(high.z, c.z + r)};
    }
    double size;
    if (low.x <= high.x) {
        plan->origin = shd_madd(shd_scale(low, 0.5), high, 0.5);
        size = shd_max_abs(shd_sub(shd_scale(high, 0.5), shd_scale(low, 0.5)));
    } else {
        plan->origin = scene->camera.position;
        size = shd_max_abs(scene->camera.position);
    }
    if (!shd_is_finite(plan->origin)) plan->origin = (shd_vec3){0, 0, 0};
    plan->scale = size > 1e-280 && size < 1e280 ? ldexp(1, -ilogb(size)) : 1;
}

shd_status shd_plan_make(const shd_scene *scene, shd_isa isa, shd_arena *arena,
                         const shd_plan **out, shd_error *error) {
    shd_plan *plan = shd_arena_zalloc(arena, 1, sizeof *plan);
    shd_plan_light *lights = shd_arena_alloc(arena, scene->light_count, sizeof *lights);
    shd_plan_material *materials = shd_arena_alloc(arena, scene->material_count, sizeof *materials);
    if (!plan || !lights || !materials || !plan_planes(scene, arena, plan)) goto no_memory;
    plan->scene = scene;
    plan->isa = isa;

    /* A budget is met by the exact tier, whose error no output format can show. The draft tier
     * may be answered by a better one. */
    plan->tier =
        scene->accuracy.budget || scene->accuracy.tier == SHD_EXACT ? SHD_EXACT : SHD_STANDARD;

    double ambient[3];
    memcpy(ambient, scene->ambient, sizeof ambient);
    for (size_t i = 0; i < scene->light_count; i++) {
        const shd_light *light = &scene->lights[i];
        for (int c = 0; c < 3; c++) ambient[c] += light->ambient[c];
        if (light->type == SHD_LIGHT_AMBIENT || is_black(light->color)) continue;
        lights[plan->light_count++] = plan_light(light, i);
    }
    plan->lights = lights;

    for (size_t i = 0; i < scene->material_count; i++) {
        if (!plan_material(&scene->materials[i], ambient, arena, &materials[i])) goto no_memory;
        if (materials[i].lobe_count > plan->max_lobes) plan->max_lobes = materials[i].lobe_count;
    }
    plan->materials = materials;
    plan_frame(scene, plan);

    plan->summary = shd_arena_printf(arena, "tier=%s; lights=%zu/%zu",
                                     plan->tier == SHD_EXACT ? "exact" : "standard",
                                     plan->light_count, scene->light_count);
    if (!plan->summary) goto no_memory;
    *out = plan;
    return SHD_OK;

no_memory:
    return shd_fail(error, SHD_MEMORY, "", "the limit `memory` is too small for this scene's plan");
}
