#include "plan/plan.h"

#include <string.h>

#include "plan/bunches.h"
#include "plan/bundles.h"
#include "plan/nodes.h"
#include "plan/parts.h"
#include "plan/textures.h"
#include "plan/tier.h"

static shd_plan_light plan_light(const shd_light *light, size_t index) {
    shd_plan_light out = {.index = index};
    memcpy(out.color, light->color, sizeof out.color);
    out.shape = shd_has_shape(light->type) ? light : NULL;
    out.environment = light->type == SHD_LIGHT_ENVIRONMENT ? light : NULL;
    out.directional = light->type == SHD_LIGHT_DIRECTIONAL || out.environment;
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
    if (out.spot) {
        const double rim = 1 - out.outer, cosine = out.exponent > 0 && rim < 0 ? 0 : rim;
        out.cone = (shd_angle){cosine, sqrt(fmax(0, 1 - cosine * cosine))};
        /* The cone fades within less than 5 degrees, or is narrow, or the exponent is steep or,
         * below 1, vertical at 90 degrees. */
        double fade = light->angle * light->penumbra;
        out.steep = (fade > 0 && fade < 0.087) || out.outer < 0.004 || out.exponent > 500 ||
                    (out.exponent > 0 && shd_is_sheer(out.exponent));
    }
    return out;
}

static bool plan_material(const shd_material *material, const double ambient[3], shd_arena *arena,
                          shd_plan_material *out) {
    shd_plan_lobe *lobes = shd_arena_alloc(arena, material->lobe_count, sizeof *lobes);
    if (!lobes) return false;
    *out = (shd_plan_material){.lobes = lobes,
                               .front_only = material->front_only,
                               .model = material->model,
                               .from = material};
    for (int c = 0; c < 3; c++) {
        out->emissive[c] = material->emissive[c];
        out->ambient[c] = material->ambient[c] * ambient[c];
        out->constant[c] = out->emissive[c] + out->ambient[c];
        out->diffuse[c] = material->diffuse[c];
    }
    out->has_emissive = !shd_is_black(out->emissive);
    out->has_ambient = !shd_is_black(out->ambient);
    out->has_diffuse = !shd_is_black(out->diffuse);
    for (size_t i = 0; i < material->lobe_count; i++) {
        const shd_lobe *lobe = &material->lobes[i];
        if (shd_is_black(lobe->specular)) continue;
        lobes[out->lobe_count++] = *lobe;
    }
    return true;
}

/* Lists the beauty and the color layers, each once, and notes which kinds of layers are wanted. */
static bool plan_planes(const shd_scene *scene, shd_arena *arena, shd_plan *plan) {
    size_t most = 1;
    for (size_t o = 0; o < scene->output_count; o++) most += scene->outputs[o].layer_count;
    shd_plane *planes = shd_arena_alloc(arena, most, sizeof *planes);
    if (!planes) return false;
    planes[0] = (shd_plane){SHD_LAYER_BEAUTY, 0};
    size_t count = 1;
    for (size_t o = 0; o < scene->output_count; o++) {
        for (size_t l = 0; l < scene->outputs[o].layer_count; l++) {
            if (shd_is_cancelled(plan->cancelled)) return false;
            const shd_layer *layer = &scene->outputs[o].layers[l];
            plan->wants[layer->kind] = true;
            if (layer->kind >= SHD_LAYER_NORMAL) continue;
            shd_plane plane = {
                layer->kind,
                layer->kind == SHD_LAYER_LIGHT || layer->kind == SHD_LAYER_LOBE ? layer->light : 0};
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

/* Finds whether channels are equal. */
static void find_greys(shd_plan *plan) {
    const shd_scene *scene = plan->scene;
    /* Sums of these have three channels. */
    plan->grey_lights = !plan->extended && !plan->hued;
    for (size_t j = 0; j < plan->light_count; j++)
        plan->grey_lights &= shd_is_grey(plan->lights[j].color);
    plan->opaque = !scene->transparent;
    plan->grey = plan->grey_lights && shd_is_grey(scene->background) && !scene->backdrop;
    for (size_t i = 0; i < scene->material_count; i++) {
        const shd_plan_material *material = &plan->materials[i];
        plan->grey &= shd_is_grey(material->emissive) && shd_is_grey(material->ambient) &&
                      shd_is_grey(material->diffuse);
        for (size_t k = 0; k < material->lobe_count; k++)
            plan->grey &= shd_is_grey(material->lobes[k].specular);
        if (material->textures) plan->grey &= material->textures->grey;
    }
}

/* Whether anything that is used goes beyond lights that are points in RGB. */
static bool is_beyond_points(const shd_scene *scene, const shd_plan_light *lights, size_t count) {
    if (shd_is_traced(scene) || scene->spectral.channels || scene->backdrop) return true;
    for (size_t j = 0; j < count; j++)
        if (lights[j].shape || lights[j].environment) return true;
    return false;
}

typedef struct value_range {
    double least, most; /* of those that are not 0; 0: there are none */
} value_range;

static void note_values(value_range *range, const double color[3]) {
    for (int c = 0; c < 3; c++) {
        const double value = fabs(color[c]);
        if (value > range->most) range->most = value;
        if (value > 0 && (range->least == 0 || value < range->least)) range->least = value;
    }
}

/* Whether f32 does not hold what lights have, or coefficients, or what is lit. What is below it is
 * 0 there, which counts if the other factor makes it something. */
static bool is_beyond_floats(const shd_scene *scene, const shd_plan_light *lights, size_t count) {
    static const double MOST = 1e37, LEAST = 1e-37, NOTHING = 1e-30;
    value_range lit = {0, 0}, colors = {0, 0};
    for (size_t j = 0; j < count; j++) note_values(&lit, lights[j].color);
    for (size_t m = 0; m < scene->material_count; m++) {
        const shd_material *material = &scene->materials[m];
        note_values(&colors, material->diffuse);
        for (size_t k = 0; k < material->lobe_count; k++)
            note_values(&colors, material->lobes[k].specular);
    }
    return lit.most > MOST || colors.most > MOST || lit.most * colors.most * (double)count > MOST ||
           (colors.least < LEAST && colors.least * lit.most * (double)count > NOTHING) ||
           (lit.least < LEAST && lit.least * colors.most > NOTHING);
}

/* Whether anything that is used goes beyond Phong's model. */
static bool has_models(const shd_scene *scene) {
    for (size_t m = 0; m < scene->material_count; m++)
        if (scene->materials[m].model != SHD_MODEL_PHONG) return true;
    return false;
}

/* Whether f32 has kernels that are good for a material. */
static bool fits_f32(const shd_material *material) {
    if (material->model == SHD_MODEL_PHONG || material->model == SHD_MODEL_OREN_NAYAR) return true;
    const bool blinn = material->model == SHD_MODEL_BLINN_PHONG;
    if (!blinn && material->model != SHD_MODEL_PHONG_NORMALIZED) return false;
    const double steepest = blinn ? SHD_STEEPEST_BLINN : SHD_STEEPEST_NORMALIZED;
    for (size_t k = 0; k < material->lobe_count; k++) {
        const double shininess = material->lobes[k].shininess;
        if (shd_is_sheer(shininess) || shininess > steepest) return false;
    }
    return true;
}

static bool has_models32(const shd_plan *plan, const shd_plan_light *lights, size_t count) {
    const shd_scene *scene = plan->scene;
    if (!plan->extended || plan->beyond_points || !shd_isa_fuses(plan->isa)) return false;
    for (size_t m = 0; m < scene->material_count; m++)
        if (!fits_f32(&scene->materials[m])) return false;
    for (size_t j = 0; j < count; j++)
        if (lights[j].steep) return false;
    return true;
}

/* Whether highlights of the object are widened where it bends. */
static bool widens(const shd_scene *scene, const shd_object *object) {
    const shd_material *m = &scene->materials[object->material];
    bool shines = false;
    if (!m->antialiased || !shd_is_curved(object)) return false;
    for (size_t k = 0; k < m->lobe_count; k++) shines |= !shd_is_black(m->lobes[k].specular);
    return shines;
}

/* Makes the lists of lights and everything that follows from them. `from`: as of shd_plan_sheets.
 */
static bool arrange_lights(shd_plan *plan, const shd_plan *from, const shd_plan_light *lights,
                           size_t count, uint8_t *drops, shd_arena *arena) {
    if (!shd_plan_reach(plan, lights, count, drops, arena)) return false;
    find_greys(plan);
    shd_bundles bundles = {0};
    return shd_plan_frame(plan, &bundles, arena) && shd_plan_sheets(plan, from, &bundles, arena) &&
           shd_plan_term_colors(plan, arena);
}

/* Scenes all of whose objects are flat know nothing of it. */
static void note_antialiased(shd_plan *plan) {
    const shd_scene *scene = plan->scene;
    for (size_t i = 0; i < scene->object_count; i++) {
        if (!widens(scene, &scene->objects[i])) continue;
        plan->antialiased = true;
        plan->bent_meshes |= scene->objects[i].shape == SHD_MESH;
    }
}

static void note_bumped(shd_plan *plan) {
    const shd_scene *scene = plan->scene;
    for (size_t i = 0; i < scene->object_count; i++) {
        const shd_object *object = &scene->objects[i];
        if (!scene->materials[object->material].normal_texture) continue;
        plan->bumped = true;
        plan->charted |= object->shape == SHD_MESH;
    }
}

static bool is_glossy(const shd_material *m) {
    bool any = false;
    for (size_t k = 0; m->lobe_gloss && k < m->lobe_count; k++)
        any |= m->lobe_gloss[k] && !shd_is_black(m->lobes[k].specular);
    return any;
}

static void note_glossed(shd_plan *plan) {
    const shd_scene *scene = plan->scene;
    for (size_t i = 0; i < scene->object_count; i++) {
        const shd_object *object = &scene->objects[i];
        if (!is_glossy(&scene->materials[object->material])) continue;
        plan->glossed = true;
        plan->charted |= object->shape == SHD_MESH;
    }
}

/* False: memory. */
static bool plan_gloss(const shd_material *from, shd_arena *arena, shd_plan_material *out) {
    if (!is_glossy(from)) return true;
    shd_gloss *gloss = shd_arena_alloc(arena, out->lobe_count, sizeof *gloss);
    if (!gloss) return false;
    for (size_t i = 0, k = 0; i < from->lobe_count; i++) {
        if (shd_is_black(from->lobes[i].specular)) continue;
        const double own = from->lobes[i].shininess;
        gloss[k] = (shd_gloss){from->lobe_gloss[i], own, own};
        if (gloss[k].texture) shd_texture_span(gloss[k].texture, &gloss[k].least, &gloss[k].most);
        k++;
    }
    out->gloss = gloss;
    return true;
}

static void note_textures(shd_plan *plan, const shd_plan_textures *textures) {
    plan->textured = true;
    plan->hued |= textures->hued;
    for (int k = 0; k < SHD_RAY_COEFFICIENTS; k++)
        plan->rayed[k] |= textures->rays[k].texture != NULL;
    if (textures->field_count > plan->max_fields) plan->max_fields = textures->field_count;
}

/* Adds the parts of a spectral scene's material. False: memory. */
static bool add_parts(shd_plan *plan, const shd_ambience *ambient, shd_arena *arena,
                      const shd_plan_material *material, shd_plan_material *materials) {
    const size_t count = material->textures ? material->textures->part_count : 0;
    for (size_t k = 0; k < count; k++, plan->part_count++) {
        shd_plan_material *part = &materials[shd_all_materials(plan)];
        if (!shd_plan_part(plan, ambient, k, arena, material, part)) return false;
    }
    const size_t terms = (1 + material->lobe_count) * count;
    if (terms > plan->max_terms) plan->max_terms = terms;
    return true;
}

/* What differs from point to point beside colors. */
static void note_points(const shd_plan *plan, shd_plan_material *m) {
    m->antialiased = plan->antialiased && m->from->antialiased && m->lobe_count > 0;
    m->normal = m->from->normal_texture;
    m->pointwise = m->antialiased || m->normal || m->gloss;
}

static bool make_materials(shd_plan *plan, const shd_ambience *ambient, shd_arena *arena) {
    enum { PARTS = 4 };
    const shd_scene *scene = plan->scene;
    size_t room = scene->material_count;
    for (size_t i = 0; plan->bins && i < scene->material_count; i++)
        if (shd_is_textured(&scene->materials[i])) room += PARTS;
    shd_plan_material *materials = shd_arena_alloc(arena, room, sizeof *materials);
    if (!materials) return false;
    for (size_t i = 0; i < scene->material_count; i++) {
        if (!plan_material(&scene->materials[i], ambient->rgb, arena, &materials[i]) ||
            !plan_gloss(&scene->materials[i], arena, &materials[i]) ||
            !shd_plan_material_bins(plan, ambient->bins, arena, &materials[i]))
            return false;
        note_points(plan, &materials[i]);
        if (!shd_plan_tint(plan, ambient->bins, arena, &materials[i]) ||
            !shd_plan_textures_make(plan, ambient, shd_all_materials(plan), arena, &materials[i]) ||
            !add_parts(plan, ambient, arena, &materials[i], materials))
            return false;
        const size_t lobes = materials[i].lobe_count,
                     terms = 1 + lobes + shd_material_slots(&materials[i]);
        if (lobes > plan->max_lobes) plan->max_lobes = lobes;
        if (terms > plan->max_terms) plan->max_terms = terms;
        if (materials[i].textures) note_textures(plan, materials[i].textures);
    }
    plan->materials = materials;
    for (size_t i = 0; plan->textured && i < scene->object_count; i++) {
        const shd_object *object = &scene->objects[i];
        const bool triangles = object->shape == SHD_MESH || object->interpolation != SHD_PHONG;
        plan->charted |= triangles && materials[object->material].textures;
    }
    return true;
}

bool shd_plan_draft(const shd_scene *scene, shd_isa isa, bool whole, const atomic_bool *cancelled,
                    shd_arena *arena, const shd_plan **out) {
    shd_plan *plan = shd_arena_alloc(arena, 1, sizeof *plan);
    shd_plan_light *lights = shd_arena_alloc(arena, scene->light_count, sizeof *lights);
    uint8_t *drops = shd_arena_zalloc(arena, scene->light_count, sizeof *drops);
    if (!plan || !lights || !drops) return false;
    *plan = (shd_plan){
        .scene = scene, .isa = isa, .whole = whole, .max_terms = 1, .cancelled = cancelled};

    shd_ambience ambient;
    size_t count = 0, around = 0;
    if (!shd_plan_bins(plan, &ambient.bins, arena) || !shd_plan_tinted(plan, arena)) return false;
    memcpy(ambient.rgb, scene->ambient, sizeof ambient.rgb);
    for (size_t i = 0; i < scene->light_count; i++) {
        const shd_light *light = &scene->lights[i];
        for (int c = 0; c < 3; c++) ambient.rgb[c] += light->ambient[c];
        if (!shd_plan_ambient_bins(plan, light, ambient.bins)) return false;
        if (light->type == SHD_LIGHT_AMBIENT)
            drops[i] = SHD_DROP_AMBIENT;
        else if (shd_is_black(light->color))
            drops[i] = SHD_DROP_BLACK;
        else
            lights[count++] = plan_light(light, i);
        if (light->type == SHD_LIGHT_ENVIRONMENT) {
            if (drops[i] == 0) lights[count - 1].around = around;
            around++;
        }
    }
    if (!shd_plan_light_bins(plan, lights, count, arena)) return false;
    note_antialiased(plan);
    note_bumped(plan);
    note_glossed(plan);
    plan->beyond_points = plan->antialiased || plan->bumped || plan->glossed ||
                          is_beyond_points(scene, lights, count) ||
                          is_beyond_floats(scene, lights, count);
    plan->extended = plan->beyond_points || has_models(scene);
    plan->models32 = has_models32(plan, lights, count);
    if (!plan_planes(scene, arena, plan) || !make_materials(plan, &ambient, arena) ||
        !arrange_lights(plan, NULL, lights, count, drops, arena))
        return false;
    *out = plan;
    return true;
}

bool shd_plan_without(const shd_plan *draft, const bool *out_of_budget, shd_arena *arena,
                      const shd_plan **out) {
    const size_t in_scene = draft->scene->light_count;
    shd_plan *plan = shd_arena_alloc(arena, 1, sizeof *plan);
    shd_plan_light *lights = shd_arena_alloc(arena, draft->light_count, sizeof *lights);
    uint8_t *drops = shd_arena_alloc(arena, in_scene, sizeof *drops);
    if (!plan || !lights || !drops) return false;
    *plan = *draft;
    memcpy(drops, draft->drops, in_scene * sizeof *drops);
    size_t count = 0;
    for (size_t j = 0; j < draft->light_count; j++)
        if (out_of_budget[j])
            drops[draft->lights[j].index] = SHD_DROP_BUDGET;
        else
            lights[count++] = draft->lights[j];
    if (!arrange_lights(plan, draft, lights, count, drops, arena)) return false;
    *out = plan;
    return true;
}

size_t shd_plan_rules(const shd_plan *plan, shd_tier tier) {
    if (tier == SHD_EXACT || !shd_plan_may_thin(plan)) return 0;
    return shd_rule_count(plan->scene->raster.samples);
}

bool shd_plan_finish(const shd_choice *choice, shd_arena *arena, const shd_plan **out) {
    shd_plan *plan = shd_arena_alloc(arena, 1, sizeof *plan);
    if (!plan) return false;
    *plan = *choice->plan;
    plan->tier = choice->tier;
    plan->drop_tolerance = choice->drop_tolerance;
    plan->drop_relative = choice->drop_relative;
    plan->dropped = choice->dropped;
    plan->point_off = choice->point_off;
    plan->mean_room = choice->mean_room;
    if (choice->by_quadrature) plan->glows = NULL;
    plan->bound = choice->bound;
    if (plan->drop_tolerance > 0 && plan->light_count >= SHD_BUNCHES_LEAST &&
        plan->tier != SHD_EXACT && !shd_bunches_new(plan, arena, &plan->bunches))
        return false;
    if (!shd_plan_summarize(plan, arena)) return false;
    *out = plan;
    return true;
}

bool shd_plan_find_light(const shd_plan *plan, size_t index, uint32_t *out) {
    if (plan->drops[index]) return false;
    size_t low = 0, high = plan->light_count; /* lights are in the scene's order */
    while (high - low > 1) {
        size_t middle = low + (high - low) / 2;
        *(plan->lights[middle].index <= index ? &low : &high) = middle;
    }
    *out = (uint32_t)low;
    return true;
}
