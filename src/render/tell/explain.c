/* What an explanation is of: the plan that was asked for, those of all tiers, their costs. */
#include <stdlib.h>
#include <string.h>

#include "base/json_memory.h"
#include "bound/light/brightest.h"
#include "bound/light/extended.h"
#include "plan/cost.h"
#include "render/planning.h"
#include "render/request.h"
#include "render/show/output.h"
#include "render/tell/explained.h"
#include "render/tell/json.h"
#include "render/tell/words.h"
#include "shade/westin.h"
#include "sight/tree.h"

/* ---- What it costs. ---- */

/* Nanoseconds, as those of plan/cost.c, of a pixel: straight to codes, through OpenColorIO's
 * floats, or to a linear space. */
static const double CODES = 2.5, FLOATS = 48, LINEAR = 1.3;

/* To encode a sample of the depth that the format has by itself. */
static const double encoders[SHD_FORMAT_COUNT] = {
    [SHD_PNG] = 4.2, [SHD_JPEG] = 1.4, [SHD_WEBP] = 26,
    [SHD_TIFF] = 10, [SHD_EXR] = 21,   [SHD_HDR] = 5};

/* PNG's `fast` stores; `small` was seen to take 33 of a smooth picture and 148 of a rich one. */
static double encoder_of(const shd_output *output) {
    if (output->format != SHD_PNG || !output->compression) return encoders[output->format];
    return *output->compression == 'f' ? 0.7 : 70;
}

static shd_cost cost_of(const shd_plan *plan, const bool *codes) {
    const shd_scene *scene = plan->scene;
    const double pixels = (double)scene->raster.w * scene->raster.h, million = 1e6;
    const shd_ray_cost rays = shd_plan_ray_cost(plan, plan->tier, shd_plan_kernel_costs(plan));
    shd_cost cost = {.build = rays.meshes / million,
                     .visibility = pixels * rays.rays / million,
                     .shade = pixels * rays.light / million,
                     .shadow = pixels * rays.shadow / million,
                     .trace = pixels * rays.trace / million};
    for (size_t o = 0; o < scene->output_count; o++) {
        const shd_output *output = &scene->outputs[o];
        const shd_format_info *format = shd_format_get(output->format);
        const double pictures = 1 + (double)output->layer_count;
        const double values = pixels * pictures * (output->channel < 0 ? 3 : 1);
        const bool linear = output->color_space && output->color_space->scene_linear;
        const double color = codes[o] ? CODES : linear ? LINEAR : FLOATS;
        const int deep = output->depth > format->depth ? 2 : 1;
        cost.color += pixels * pictures * color / million;
        cost.encode += values * encoder_of(output) * deep / million;
    }
    cost.total = cost.build + cost.visibility + cost.shade + cost.shadow + cost.trace + cost.color +
                 cost.encode;
    return cost;
}

/* ---- The answer. ---- */

static bool channels_keep_apart(const shd_shown *shown) {
    bool apart = shown->coded;
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++) apart = apart && (r == c || shown->matrix[r][c] == 0);
    return apart;
}

/* The largest standard errors of simulated microgeometries. [material_count], 0: not simulated.
 * NULL: there are none, or no memory, for which an estimate is missing. */
static const double *find_noise(const shd_plan *plan, shd_arena *arena) {
    const size_t count = plan->scene->material_count;
    double *noise = plan->westin ? shd_arena_zalloc(arena, count, sizeof *noise) : NULL;
    for (size_t m = 0; noise && m < count; m++)
        if (plan->westin[m]) noise[m] = shd_westin_noise(plan->westin[m]).max;
    return noise;
}

static void find_estimates(shd_explained *e, shd_arena *arena) {
    e->paths = shd_find_paths(e->plan);
    e->cut = e->paths.cut > 0 ? e->paths.cut * shd_brightest(e->plan) : 0;
    e->estimate = shd_linear_estimate(e->plan, find_noise(e->plan, arena));
}

static shd_trees count_trees(const shd_plan *plan) {
    const shd_scene *scene = plan->scene;
    shd_trees trees = {0};
    for (size_t i = 0; i < scene->object_count; i++) {
        if (shd_is_cancelled_at(plan->cancelled, i)) break;
        const shd_object *object = &scene->objects[i];
        const size_t triangles = shd_plan_built_triangles(scene, i);
        if (triangles) {
            trees.built++;
            trees.triangles += triangles;
            trees.nodes += triangles > 1 ? triangles - 1 : 1;
            trees.bytes += shd_mesh_tree_bytes(triangles);
        } else if (object->mesh) {
            trees.reused++;
        }
    }
    return trees;
}

/* Whether anything may be between the object and the light. */
static bool may_be_shadowed(const shd_explained *e, size_t object, uint32_t light) {
    const shd_occluders *pairs = e->occlusion.pairs;
    return !pairs || pairs[object * e->plan->light_count + light].count;
}

/* False: the arena is full. */
static bool find_unbounded(shd_explained *e, shd_arena *arena) {
    const shd_plan *plan = e->plan;
    e->unbounded = shd_arena_alloc(arena, SHD_UNBOUNDED_TOLD, sizeof *e->unbounded);
    if (!e->unbounded) return false;
    for (size_t i = 0; i < plan->scene->object_count; i++) {
        const shd_plan_object *object = &plan->objects[i];
        for (size_t k = 0; k < object->light_count; k++) {
            const uint32_t j = object->lights[k];
            if (shd_is_cancelled(plan->cancelled)) return true;
            if (!plan->lights[j].shape || !may_be_shadowed(e, i, j) ||
                shd_share_has_bound(plan, i, &plan->lights[j]))
                continue;
            if (e->unbounded_count < SHD_UNBOUNDED_TOLD) {
                e->unbounded[e->unbounded_count][0] = plan->lights[j].index;
                e->unbounded[e->unbounded_count][1] = i;
            }
            e->unbounded_count++;
        }
    }
    return true;
}

/* Plans a tier as if it had been asked for, which it may have been. */
static shd_status add_tier(shd_rendering *r, const shd_scene *scene, const shd_plan **drafted,
                           shd_accuracy accuracy, shd_explained *e, shd_error *error) {
    shd_scene asking = *scene;
    asking.accuracy = accuracy;
    const shd_plan *plan = e->plan;
    const shd_accuracy *asked = &scene->accuracy;
    const bool same =
        !asked->budget && asked->tier == accuracy.tier && asked->draft == accuracy.draft;
    const shd_status status =
        same ? SHD_OK : shd_rendering_plan_for(r, &asking, e->shown, drafted, &plan, error);
    if (status != SHD_OK) return status;
    e->tiers[e->tier_count++] =
        (shd_told_tier){shd_asked_tier(&accuracy), plan->bound, cost_of(plan, e->codes)};
    return SHD_OK;
}

static shd_status explain_plan(shd_rendering *r, const shd_scene *scene, shd_explained *e,
                               shd_error *error) {
    const shd_plan *drafted = NULL;
    shd_status status = shd_shown_make(r, scene, &e->shown, error);
    if (status == SHD_OK)
        status = shd_rendering_plan_for(r, scene, e->shown, &drafted, &r->plan, error);
    if (status != SHD_OK) return status;
    e->plan = r->plan;
    bool *codes = shd_arena_alloc(r->arena, scene->output_count, sizeof *codes);
    e->codes = codes;
    if (!codes) return shd_fail(error, SHD_MEMORY, "", "the limit `memory` is too small");
    for (size_t i = 0; i < scene->output_count; i++)
        codes[i] = shd_route_of(scene, &scene->outputs[i], channels_keep_apart(&e->shown[i])).codes;
    e->cost = cost_of(e->plan, codes);
    find_estimates(e, r->arena);
    e->trees = count_trees(e->plan);
    if (scene->trace.shadows &&
        !(shd_find_occlusion(e->plan, r->arena, &e->occlusion) && find_unbounded(e, r->arena)))
        return shd_fail(error, SHD_MEMORY, "", "the limit `memory` is too small");
    if (shd_plan_may_draft(e->plan))
        status = add_tier(r, scene, &drafted, (shd_accuracy){.draft = true}, e, error);
    for (int t = 0; t <= SHD_EXACT && status == SHD_OK; t++)
        status = add_tier(r, scene, &drafted, (shd_accuracy){.tier = (shd_tier)t}, e, error);
    return status;
}

/* NULL: no memory. */
static char *join_lines(const json_t *words) {
    size_t i, length = 1;
    json_t *line;
    json_array_foreach(words, i, line) length += json_string_length(line) + 1;
    char *text = shd_json_memory_short() ? NULL : malloc(length), *end = text;
    if (!text) return NULL;
    json_array_foreach(words, i, line) {
        end = stpcpy(end, json_string_value(line));
        *end++ = '\n';
    }
    *end = 0;
    return text;
}

shd_status shd_request_explain(shd_request *request, shd_telling telling, char **text,
                               shd_error *error) {
    shd_explained e = {.plan = NULL};
    shd_status status = shd_request_blame(
        request, explain_plan(&request->rendering, request->scene, &e, error), error);
    if (status != SHD_OK) return status;
    shd_json_memory_watch();
    json_t *words = shd_explain_words(&e);
    char *out;
    if (telling == SHD_IN_WORDS) {
        out = join_lines(words);
        json_decref(words);
    } else {
        out = shd_tell_print(shd_tell_explained(&e, words), 9, &request->cancelled);
    }
    if (shd_is_cancelled(&request->cancelled)) {
        free(out);
        return shd_fail(error, SHD_CANCELLED, "", "the explanation was cancelled");
    }
    if (!out) return shd_fail(error, SHD_EXHAUSTED, "", "out of memory");
    *text = out;
    return SHD_OK;
}
