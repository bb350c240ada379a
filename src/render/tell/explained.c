#include "render/tell/explained.h"

#include <math.h>

#include "bound/light/extended.h"
#include "plan/bunches.h"
#include "plan/textures.h"
#include "render/tell/json.h"
#include "render/tell/lamps.h"
#include "shade/westin.h"

/* The bounds with what they count and, if one is not known, why. */
static json_t *tell_bounds(const shd_explained *e) {
    const shd_plan *plan = e->plan;
    const char *const units[] = {plan->scene->working_space->name, "8-bit codes", "CIEDE2000"};
    json_t *all = json_object();
    for (shd_metric m = SHD_LINEAR; m <= SHD_DELTA_E_2000; m++) {
        const double most = shd_bound_in(&plan->bound, m);
        const char *why = m == SHD_LINEAR ? shd_no_linear_bound() : shd_no_shown_bound(plan);
        json_object_set_new(all, shd_metric_names[m],
                            json_pack("{so ss ss ss?}", "most", shd_tell_number(most), "unit",
                                      units[m], "against", m == SHD_LINEAR ? "model" : "exact",
                                      "why", isfinite(most) ? NULL : why));
        if (m == SHD_LINEAR && isfinite(e->estimate))
            json_object_set_new(json_object_get(all, shd_metric_names[m]), "estimate",
                                shd_tell_number(e->estimate));
    }
    return all;
}

/* ---- Terms. ---- */

static json_t *tell_term(const char *name, bool used, const char *why) {
    return json_pack("{ss sb ss?}", "term", name, "used", used, "why", used ? NULL : why);
}

static json_t *tell_terms(const shd_plan *plan) {
    bool emission = false, ambient = false, diffuse = false, specular = false;
    for (size_t i = 0; i < plan->scene->object_count; i++) {
        const shd_plan_object *object = &plan->objects[i];
        const shd_plan_material *material = &plan->materials[object->material];
        emission |= material->has_emissive;
        ambient |= material->has_ambient;
        diffuse |= material->has_diffuse && object->light_count;
        specular |= material->lobe_count && object->light_count;
    }
    bool attenuation = false, spots = false;
    for (size_t j = 0; j < plan->light_count; j++) {
        attenuation |= plan->lights[j].attenuated;
        spots |= plan->lights[j].spot;
    }
    return json_pack(
        "[oooooo]", tell_term("emission", emission, "no material emits light"),
        tell_term("ambient", ambient, "there is no ambient light, or nothing reflects it"),
        tell_term("diffuse", diffuse, "no light reaches an object that is diffuse"),
        tell_term("specular", specular, "no light reaches an object that is specular"),
        tell_term("attenuation", attenuation, "every light is as bright at any distance"),
        tell_term("spots", spots, "no light that is used has a cone"));
}

/* ---- Lights, materials, objects. ---- */

static json_t *tell_lights(const shd_plan *plan) {
    const shd_scene *scene = plan->scene;
    json_t *list = json_array();
    for (size_t i = 0; i < scene->light_count; i++) {
        if (shd_is_cancelled_at(plan->cancelled, i)) break;
        uint32_t at;
        bool used = shd_plan_find_light(plan, i, &at);
        json_t *light = json_pack("{sI ss sb ss?}", "light", (json_int_t)i, "type",
                                  shd_light_names[scene->lights[i].type], "used", used, "why",
                                  used ? NULL : shd_drop_reason(plan->drops[i]));
        if (used && plan->lights[at].environment) {
            double off;
            json_object_set_new(light, "method", json_string(shd_around_method(plan, at, &off)));
            json_object_set_new(light, "off", shd_tell_number(off));
        }
        if (used && plan->lights[at].shape) {
            double off;
            const shd_area_method method = shd_lamp_method(plan, at, &off);
            json_object_set_new(light, "method", json_string(shd_lamp_method_name(method)));
            json_object_set_new(light, "off", shd_tell_number(off));
        }
        json_array_append_new(list, light);
    }
    json_t *told = json_pack("{sI sI so}", "given", (json_int_t)scene->light_count, "used",
                             (json_int_t)plan->light_count, "list", list);
    if (plan->bunches)
        json_object_set_new(told, "groups",
                            json_integer((json_int_t)shd_bunches_groups(plan->bunches)));
    return told;
}

static json_t *tell_objects(const shd_plan *plan) {
    const shd_scene *scene = plan->scene;
    json_t *list = json_array();
    for (size_t i = 0; i < scene->object_count; i++) {
        if (shd_is_cancelled_at(plan->cancelled, i)) break;
        const shd_plan_object *object = &plan->objects[i];
        const shd_mesh *mesh = scene->objects[i].mesh;
        const shd_shape shape = scene->objects[i].shape;
        const char *type = mesh && mesh->type ? mesh->type : shd_shape_names[shape];
        json_array_append_new(list, json_pack("{ss ss sI sI}", "type", type, "material",
                                              scene->materials[scene->objects[i].material].name,
                                              "group", (json_int_t)object->group, "lights",
                                              (json_int_t)object->light_count));
    }
    return json_pack("{sI sI so}", "given", (json_int_t)scene->object_count, "groups",
                     (json_int_t)plan->group_count, "list", list);
}

/* NULL: the material is not simulated. */
static json_t *tell_noise(const shd_plan *plan, size_t material) {
    const shd_westin *table = plan->westin ? plan->westin[material] : NULL;
    if (!table) return NULL;
    const shd_westin_error noise = shd_westin_noise(table);
    return json_pack("{sf sf}", "rms", noise.rms, "max", noise.max);
}

static json_t *tell_texture(const shd_pattern *pattern, const char *name) {
    const shd_pyramid *picture = pattern->picture;
    if (!picture) return json_pack("{ss}", "pattern", shd_pattern_names[pattern->kind]);
    const shd_texels *texels = picture->texels;
    return json_pack("{ss sI sI sI sI}", "texture", name, "width", (json_int_t)texels->width,
                     "height", (json_int_t)texels->height, "levels", (json_int_t)picture->count,
                     "bytes", (json_int_t)(shd_texels_size(texels) + shd_pyramid_size(texels)));
}

static json_t *tell_member(json_t *list, const shd_texture *texture, const char *member) {
    json_t *told = tell_texture(&texture->pattern, texture->name);
    json_object_set_new(told, "coefficient", json_string(member));
    json_array_append_new(list, told);
    return told;
}

static void tell_gloss(json_t *list, const shd_gloss *gloss, size_t lobe, bool facets) {
    json_t *told = tell_member(list, gloss->texture, facets ? "roughness" : "shininess");
    json_object_set_new(told, "lobe", json_integer((json_int_t)lobe));
    json_object_set_new(told, "range", json_pack("[ff]", gloss->least, gloss->most));
}

/* NULL: the material has no patterns and no map of normals. */
static json_t *tell_patterns(const shd_plan_material *material) {
    const shd_plan_textures *textures = material->textures;
    if (!textures && !material->normal && !material->gloss) return NULL;
    json_t *list = json_array();
    for (size_t e = 0; e < shd_material_slots(material); e++) {
        const shd_plan_slot *slot = &textures->slots[e];
        const char *of = slot->of == SHD_SLOT_EMISSIVE  ? "emissive"
                         : slot->of == SHD_SLOT_AMBIENT ? "ambient"
                         : slot->term                   ? "specular"
                                                        : "diffuse";
        json_t *told = tell_texture(&textures->patterns[slot->pattern], slot->name);
        json_object_set_new(told, "coefficient", json_string(of));
        if (slot->of == SHD_SLOT_TERM && slot->term)
            json_object_set_new(told, "lobe", json_integer((json_int_t)slot->term - 1));
        json_array_append_new(list, told);
    }
    if (textures && textures->fresnel) tell_member(list, material->from->fresnel.f0_texture, "f0");
    static const char *const rays[] = {"opacity", "reflection", "transmission"};
    for (int k = 0; textures && k < SHD_RAY_COEFFICIENTS; k++)
        if (textures->rays[k].texture) tell_member(list, textures->rays[k].texture, rays[k]);
    if (material->normal) tell_member(list, material->normal, "normal");
    const bool facets = material->model == SHD_MODEL_COOK_TORRANCE;
    for (size_t k = 0; material->gloss && k < material->lobe_count; k++)
        if (material->gloss[k].texture) tell_gloss(list, &material->gloss[k], k, facets);
    return list;
}

static json_t *tell_materials(const shd_plan *plan) {
    const shd_scene *scene = plan->scene;
    json_t *list = json_array();
    for (size_t g = 0; g < plan->group_count && !shd_is_cancelled(plan->cancelled); g++) {
        const shd_plan_group *group = &plan->groups[g];
        const shd_plan_material *material = &plan->materials[group->material];
        json_t *terms = json_array(), *shininess = json_array();
        if (material->has_emissive) json_array_append_new(terms, json_string("emission"));
        if (material->has_ambient) json_array_append_new(terms, json_string("ambient"));
        if (material->has_diffuse) json_array_append_new(terms, json_string("diffuse"));
        if (material->lobe_count) json_array_append_new(terms, json_string("specular"));
        for (size_t k = 0; k < material->lobe_count; k++)
            json_array_append_new(shininess, json_real(material->lobes[k].shininess));
        json_t *told = json_pack(
            "{ss ss so so sI so* so*}", "material", scene->materials[group->material].name, "model",
            shd_model_names[material->model], "terms", terms, "shininess", shininess, "lights",
            (json_int_t)group->light_count, "noise", tell_noise(plan, group->material), "patterns",
            tell_patterns(material));
        if (material->antialiased) json_object_set_new(told, "specularAntialiasing", json_true());
        json_array_append_new(list, told);
    }
    return json_pack("{sI so}", "given", (json_int_t)scene->material_count, "groups", list);
}

/* NULL: there are none. */
static json_t *tell_trees(const shd_trees *trees) {
    if (!trees->built && !trees->reused) return NULL;
    return json_pack("{sI sI sI sI sI}", "built", (json_int_t)trees->built, "reused",
                     (json_int_t)trees->reused, "triangles", (json_int_t)trees->triangles, "nodes",
                     (json_int_t)trees->nodes, "bytes", (json_int_t)trees->bytes);
}

/* ---- What is traced. ---- */

static json_t *tell_unbounded(const shd_explained *e) {
    json_t *list = json_array();
    for (size_t i = 0; i < e->unbounded_count && i < SHD_UNBOUNDED_TOLD; i++)
        json_array_append_new(list, json_pack("{sI sI}", "light", (json_int_t)e->unbounded[i][0],
                                              "object", (json_int_t)e->unbounded[i][1]));
    return json_pack("{sI so}", "pairs", (json_int_t)e->unbounded_count, "list", list);
}

static json_t *tell_traced(const shd_explained *e) {
    const shd_trace *trace = &e->plan->scene->trace;
    return json_pack("{sb si sI sI so si sf sI sf so}", "shadows", trace->shadows, "shadowSamples",
                     trace->shadow_samples, "pairs",
                     (json_int_t)(trace->shadows ? e->occlusion.pair_count : 0), "shadowed",
                     (json_int_t)(trace->shadows ? e->occlusion.shadowed : 0), "unboundedShadows",
                     tell_unbounded(e), "depth", trace->depth, "minContribution",
                     trace->min_contribution, "objects", (json_int_t)e->paths.bouncing, "cut",
                     e->paths.cut, "cutLinear", shd_tell_number(e->cut));
}

/* ---- Outputs, tiers. ---- */

static const char *name_encoder(const shd_output *output) {
    static const char *const names[SHD_FORMAT_COUNT] = {
        [SHD_PNG] = "own",          [SHD_JPEG] = "libjpeg-turbo", [SHD_WEBP] = "libwebp",
        [SHD_TIFF] = "OpenImageIO", [SHD_EXR] = "OpenImageIO",    [SHD_HDR] = "OpenImageIO"};
    const bool packed = output->format == SHD_PNG && output->compression;
    return packed ? "libdeflate" : names[output->format];
}

static json_t *tell_outputs(const shd_explained *e) {
    const shd_scene *scene = e->plan->scene;
    json_t *list = json_array();
    for (size_t i = 0; i < scene->output_count; i++) {
        const shd_output *output = &scene->outputs[i];
        const char *scope = output->scope ? shd_scope_names[output->scope] : NULL;
        json_array_append_new(list, json_pack("{ss? ss ss ss sb ss ss*}", "name", output->name,
                                              "format", shd_format_get(output->format)->name,
                                              "depth", shd_depth_name(output->depth), "color",
                                              e->codes[i] ? "codes" : "floats", "curveKnown",
                                              e->shown[i].coded, "encoder", name_encoder(output),
                                              "scope", scope));
    }
    return list;
}

static json_t *tell_cost(const shd_cost *cost) {
    json_t *told =
        json_pack("{sf sf sf sf sf}", "visibility", cost->visibility, "shade", cost->shade, "color",
                  cost->color, "encode", cost->encode, "total", cost->total);
    if (cost->build > 0) json_object_set_new(told, "build", json_real(cost->build));
    if (cost->shadow > 0) json_object_set_new(told, "shadow", json_real(cost->shadow));
    if (cost->trace > 0) json_object_set_new(told, "trace", json_real(cost->trace));
    return told;
}

static json_t *tell_tiers(const shd_explained *e) {
    json_t *list = json_array();
    for (int t = 0; t < e->tier_count; t++)
        json_array_append_new(list, json_pack("{ss so so}", "tier", e->tiers[t].name, "bound",
                                              shd_tell_bound(&e->tiers[t].bound), "milliseconds",
                                              tell_cost(&e->tiers[t].cost)));
    return list;
}

static json_t *tell_accuracy(const shd_accuracy *accuracy) {
    if (!accuracy->budget) return json_pack("{ss}", "tier", shd_asked_tier(accuracy));
    return json_pack("{sf ss}", "maxError", accuracy->whole, "metric",
                     shd_metric_names[accuracy->metric]);
}

json_t *shd_tell_explained(const shd_explained *e, json_t *words) {
    const shd_plan *plan = e->plan;
    const int samples = plan->scene->raster.samples;
    return json_pack(
        "{so ss ss ss so so so so so si si sb so s{si ss} so so so so so* so*}", "asked",
        tell_accuracy(&plan->scene->accuracy), "tier", shd_plan_tier_name(plan), "kernel",
        shd_isa_name(plan->isa), "plan", plan->summary, "bound", tell_bounds(e), "milliseconds",
        tell_cost(&e->cost), "terms", tell_terms(plan), "lights", tell_lights(plan), "materials",
        tell_materials(plan), "lightChannels", plan->grey_lights ? 1 : 3, "channels",
        plan->grey ? 1 : 3, "splitPositions", plan->split_positions, "objects", tell_objects(plan),
        "samples", "pixel", samples, "pattern",
        samples == 1                                                                     ? "center"
        : shd_plan_is_thin(plan) || (shd_plan_rules(plan, plan->tier) && !plan->bunches) ? "mixed"
                                                                                         : "full",
        "leftOut",
        json_pack("{sf s{sf sf} s{sf sf}}", "lights", plan->dropped, "tileLights", "absolute",
                  plan->drop_tolerance, "relative", plan->drop_relative, "samples", "absolute",
                  plan->mean_room.absolute, "relative", plan->mean_room.relative),
        "outputs", tell_outputs(e), "tiers", tell_tiers(e), "words", words, "trace",
        shd_is_traced(plan->scene) ? tell_traced(e) : NULL, "trees", tell_trees(&e->trees));
}
