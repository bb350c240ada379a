#include "render/tell/fit_bases.h"

#include <string.h>

#include "analysis/phong_fit.h"
#include "render/planning.h"
#include "render/request.h"
#include "render/tell/estimate.h"
#include "render/tiles/film.h"

/* How often a fit renders at most: the diffuse light, a grid, two valleys, and the solution. */
enum { RENDERINGS = 18, LAYERS = SHD_FIT_LOBES + 2 };

/* ---- The scene ---- */

static shd_material black_material(const shd_material *from, const shd_lobe *lobes) {
    shd_material m = {.name = "",
                      .lobes = lobes,
                      .lobe_count = 1,
                      .front_only = from->front_only,
                      .model = SHD_MODEL_PHONG,
                      .ior = from->ior};
    memcpy(m.opacity, from->opacity, sizeof m.opacity);
    return m;
}

/* Every material becomes two: in the middle of the list those that are black. */
static bool make_scene(shd_bases *b, const shd_scene *given, const bool *chosen, shd_model model) {
    shd_arena *arena = b->r->arena;
    const size_t count = given->material_count;
    shd_scene *scene = shd_arena_alloc(arena, 1, sizeof *scene);
    b->objects = shd_arena_alloc(arena, given->object_count, sizeof *b->objects);
    b->materials = shd_arena_alloc(arena, count, 2 * sizeof *b->materials);
    b->lobes = shd_arena_zalloc(arena, SHD_FIT_LOBES + 1, sizeof *b->lobes);
    b->layers = shd_arena_zalloc(arena, LAYERS, sizeof *b->layers);
    b->output = shd_arena_alloc(arena, 1, sizeof *b->output);
    if (!scene || !b->objects || !b->materials || !b->lobes || !b->layers || !b->output)
        return false;
    for (size_t i = 0; i < count; i++) {
        const shd_material *from = &given->materials[i];
        b->materials[i] = black_material(from, b->lobes + SHD_FIT_LOBES);
        b->materials[count + i] = black_material(from, b->lobes);
        b->materials[count + i].model = model;
    }
    memcpy(b->objects, given->objects, given->object_count * sizeof *b->objects);
    for (size_t i = 0; i < given->object_count; i++)
        if (chosen[i]) b->objects[i].material += count;
    *scene = *given;
    *b->output = given->outputs[0];
    b->output->layers = b->layers;
    scene->objects = b->objects;
    scene->materials = b->materials;
    scene->material_count = 2 * count;
    scene->outputs = b->output;
    scene->output_count = 1;
    scene->accuracy = (shd_accuracy){.tier = SHD_EXACT};
    scene->trace.depth = 0;
    for (int c = 0; c < 3; c++) scene->background[c] = 0;
    b->scene = scene;
    return true;
}

static void set_materials(shd_bases *b, double matte, size_t lobes) {
    const size_t count = b->scene->material_count / 2;
    for (size_t i = count; i < 2 * count; i++) {
        shd_material *m = &b->materials[i];
        for (int c = 0; c < 3; c++) m->emissive[c] = m->diffuse[c] = matte;
        m->lobe_count = lobes ? lobes : 1;
    }
    for (size_t k = 0; k < SHD_FIT_LOBES; k++)
        for (int c = 0; c < 3; c++) b->lobes[k].specular[c] = k < lobes;
}

/* ---- Limits ---- */

static shd_status check_light(const shd_bases *b, shd_error *error) {
    const uint64_t found = shd_estimate_light_samples(b->scene), most = b->r->limits->light_samples;
    if (found <= most) return SHD_OK;
    shd_fail(error, SHD_LIMIT, "/lights",
             "samples times lights times the %d exponents that are tried at once are %llu; the "
             "limit `light-samples` is %llu",
             SHD_FIT_LOBES, (unsigned long long)found, (unsigned long long)most);
    return shd_fail_limit(error, SHD_LIMIT_LIGHT_SAMPLES);
}

static shd_status check_work(const shd_bases *b, shd_error *error) {
    const double seconds = RENDERINGS * shd_rendering_seconds(b->r);
    if (seconds <= (double)b->r->limits->work) return SHD_OK;
    shd_fail(error, SHD_LIMIT, "",
             "%d renderings are expected to take %.0f seconds of one processor; the limit `work` "
             "is %llu",
             RENDERINGS, seconds, (unsigned long long)b->r->limits->work);
    return shd_fail_limit(error, SHD_LIMIT_WORK);
}

shd_status shd_bases_prepare(shd_rendering *r, const shd_scene *scene, const bool *chosen,
                             shd_model model, const shd_render_options *options, shd_bases *out,
                             shd_error *error) {
    shd_bases b = {.r = r, .options = options};
    if (!make_scene(&b, scene, chosen, model)) return shd_rendering_full(r, "fit", error);
    set_materials(&b, 1, SHD_FIT_LOBES);
    const shd_status status = check_light(&b, error);
    if (status == SHD_OK) *out = b;
    return status;
}

/* ---- Rendering ---- */

static void on_progress(void *context, double share) {
    const shd_bases *b = context;
    const double all = (b->done + share) / RENDERINGS;
    if (b->options && b->options->progress)
        b->options->progress(b->options->context, all < 1 ? all : 1);
}

static shd_status render(shd_bases *b, shd_film *film, shd_error *error) {
    shd_rendering *r = b->r;
    shd_sight *sight;
    const shd_render_options options = {on_progress, b};
    shd_stage_begin(r);
    shd_status status = shd_rendering_plan(r, b->scene, error);
    if (status == SHD_OK) status = check_work(b, error);
    if (status == SHD_OK) status = shd_rendering_admit(r, NULL, true, error);
    shd_stage_end(r, &r->times.plan);
    if (status == SHD_OK) status = shd_sight_new(r->plan, r->cancelled, r->arena, &sight, error);
    shd_stage_end(r, &r->times.visibility);
    *film = (shd_film){0};
    if (status == SHD_OK) status = shd_film_render(r, sight, NULL, &options, film, error);
    b->done++;
    return status;
}

/* What was rendered goes, and the plan with it. */
static void forget(shd_bases *b, shd_arena_mark mark) {
    b->r->plan = NULL;
    shd_arena_return(b->r->arena, mark);
}

static const float *plane_of(const shd_bases *b, const shd_film *film, shd_layer_kind kind,
                             size_t index) {
    const shd_plan *plan = b->r->plan;
    size_t p = 1;
    while (plan->planes[p].kind != kind || plan->planes[p].light != index) p++;
    return film->planes[p];
}

shd_status shd_bases_diffuse(shd_bases *b, float *coverage, float *diffuse, shd_error *error) {
    const shd_arena_mark mark = shd_arena_mark_here(b->r->arena);
    const size_t pixels = (size_t)b->scene->raster.w * (size_t)b->scene->raster.h;
    shd_film film;
    set_materials(b, 1, 0);
    b->layers[0] = (shd_layer){.kind = SHD_LAYER_EMISSIVE, .name = "emissive"};
    b->layers[1] = (shd_layer){.kind = SHD_LAYER_DIFFUSE, .name = "diffuse"};
    b->output->layer_count = 2;
    const shd_status status = render(b, &film, error);
    if (status == SHD_OK) {
        const float *one = plane_of(b, &film, SHD_LAYER_EMISSIVE, 0);
        const float *lit = plane_of(b, &film, SHD_LAYER_DIFFUSE, 0);
        for (size_t i = 0; i < pixels && !shd_is_cancelled_at(b->r->cancelled, i); i++) {
            coverage[i] = one[3 * i];
            memcpy(diffuse + 3 * i, lit + 3 * i, 3 * sizeof *lit);
        }
    }
    forget(b, mark);
    return status == SHD_OK && shd_is_cancelled(b->r->cancelled) ? shd_rendering_cancelled(error)
                                                                 : status;
}

shd_status shd_bases_lobes(shd_bases *b, const double *exponents, size_t lobes,
                           const uint32_t *pixels, size_t count, float **out, shd_error *error) {
    const shd_arena_mark mark = shd_arena_mark_here(b->r->arena);
    shd_film film;
    set_materials(b, 0, lobes);
    for (size_t k = 0; k < lobes; k++) {
        b->lobes[k].shininess = exponents[k];
        b->layers[k] = (shd_layer){.kind = SHD_LAYER_LOBE, .light = k, .name = "lobe"};
    }
    b->output->layer_count = lobes;
    const shd_status status = render(b, &film, error);
    for (size_t k = 0; k < lobes && status == SHD_OK; k++) {
        const float *plane = plane_of(b, &film, SHD_LAYER_LOBE, k);
        for (size_t i = 0; i < count && !shd_is_cancelled_at(b->r->cancelled, i); i++)
            memcpy(out[k] + 3 * i, plane + 3 * (size_t)pixels[i], 3 * sizeof *plane);
    }
    forget(b, mark);
    return status == SHD_OK && shd_is_cancelled(b->r->cancelled) ? shd_rendering_cancelled(error)
                                                                 : status;
}
