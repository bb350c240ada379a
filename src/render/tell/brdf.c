/* The materials of a scene as functions of two directions: figures, verdicts, and their plot. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/json_memory.h"
#include "image/image.h"
#include "plan/textures.h"
#include "render/planning.h"
#include "render/request.h"
#include "render/tell/figures.h"
#include "render/tell/json.h"
#include "render/tell/lobe_plot.h"
#include "shade/westin.h"

#define DEGREE (SHD_PI / 180)

enum { PLOTTED = 6 }; /* materials side by side */
static const double PLOT_ANGLE = 45;

static const char *const formulas[SHD_MODEL_COUNT] = {
    [SHD_MODEL_PHONG] = "f_r = kd / pi + sum of ks (R.V)+^n / (pi N.L)",
    [SHD_MODEL_BLINN_PHONG] = "f_r = kd / pi + sum of ks (N.H)+^n / (pi N.L)",
    [SHD_MODEL_PHONG_NORMALIZED] = "f_r = kd / pi + sum of ks (R.V)+^n / E(N.L, n)",
    [SHD_MODEL_OREN_NAYAR] = "f_r = kd (A + B s) / pi",
    [SHD_MODEL_COOK_TORRANCE] = "f_r = kd / pi + sum of weight F D G / (4 pi N.L N.V)",
    [SHD_MODEL_WESTIN] = "f_r = sum of kd^n rho_n(L, V) / pi, as simulated",
};

/* What is found of a scene's materials, one for each group's material. */
typedef struct finding {
    size_t count;
    shd_reflectance *list;
} finding;

/* Whether what it reflects of light depends on the place. */
static bool has_pattern(const shd_plan_material *material) {
    bool any = material->gloss || shd_facet_slot(material);
    for (size_t e = 0; e < shd_material_slots(material); e++)
        any = any || material->textures->slots[e].of == SHD_SLOT_TERM;
    return any;
}

static shd_status find_all(shd_rendering *r, const shd_scene *scene, size_t most, finding *out,
                           shd_error *error) {
    shd_scene *whole = shd_arena_alloc(r->arena, 1, sizeof *whole);
    if (!whole) return shd_fail(error, SHD_MEMORY, "", "the limit `memory` is reached");
    *whole = *scene;
    whole->accuracy = (shd_accuracy){.tier = SHD_EXACT}; /* no budget decides on anything here */
    const shd_status status = shd_rendering_plan_for(r, whole, NULL, NULL, &r->plan, error);
    if (status != SHD_OK) return status;
    const shd_plan *plan = r->plan;
    *out = (finding){0, shd_arena_alloc(r->arena, scene->material_count, sizeof *out->list)};
    bool *done = shd_arena_zalloc(r->arena, scene->material_count, sizeof *done);
    if (!out->list || !done)
        return shd_fail(error, SHD_MEMORY, "", "the limit `memory` is reached");
    for (size_t i = 0; i < scene->object_count && out->count < most; i++) {
        const size_t material = plan->objects[i].material;
        if (done[material]) continue;
        done[material] = true;
        if (has_pattern(&plan->materials[material])) {
            char path[48];
            snprintf(path, sizeof path, "/objects/%zu/material", i);
            return shd_fail(
                error, SHD_SCENE, path,
                "a pattern or a picture is many reflectances: give one of them instead");
        }
        if (!shd_reflectance_find(plan, i, &out->list[out->count++]))
            return shd_rendering_cancelled(error);
    }
    return SHD_OK;
}

/* ---- In words. ---- */

static json_t *tell_verdict(const shd_reflectance *r) {
    json_t *words = json_array();
    const double most = r->most, angle = r->most_angle;
    const int digits = most < 1.01 ? 9 : 3; /* a gain does not read as 1 */
    if (isnan(r->gains))
        json_array_append_new(words,
                              json_sprintf("sends on no more light than arrives: at most %.3g "
                                           "of it, at %.4g degrees",
                                           most, angle));
    else if (most <= 1 && r->gains < 90)
        json_array_append_new(words,
                              json_sprintf("gains energy within %.2g degrees of the surface: up to "
                                           "89.99 degrees at most %.3g of the light that arrives "
                                           "leaves",
                                           90 - r->gains, most));
    else if (most <= 1)
        json_array_append_new(words,
                              json_sprintf("gains energy along the surface, nearer than angles "
                                           "tell: up to 89.99 degrees at most %.3g of the light "
                                           "that arrives leaves",
                                           most));
    else if (r->gains > 0)
        json_array_append_new(words, json_sprintf("gains energy above %.4g degrees: %.*g times the "
                                                  "light that arrives leaves at %.4g degrees",
                                                  r->gains, digits, most, angle));
    else
        json_array_append_new(words,
                              json_sprintf("gains energy, also of light from straight above: up "
                                           "to %.*g times the light that arrives leaves",
                                           digits, most));
    if (r->residual > 1e-9)
        json_array_append_new(
            words, json_sprintf("is not reciprocal: f_r differs by %.2g of itself if a light "
                                "at %.0f degrees and an eye at %.3g change places",
                                r->residual, r->residual_light, r->residual_view));
    else
        json_array_append_new(words, json_string("is reciprocal"));
    json_array_append_new(words, json_string(r->unbounded ? "has no limit where light grazes the "
                                                            "surface"
                                                          : "is bounded, also at grazing light"));
    return words;
}

/* ---- In JSON. ---- */

static json_t *tell_color(const double rgb[3]) {
    return json_pack("[ooo]", shd_tell_number(rgb[0]), shd_tell_number(rgb[1]),
                     shd_tell_number(rgb[2]));
}

static json_t *tell_albedo(const shd_reflectance *r) {
    json_t *angles = json_array(), *values = json_array();
    for (size_t i = 0; i < SHD_ALBEDO_ANGLES; i++) {
        json_array_append_new(angles, json_real(shd_albedo_angles[i]));
        json_array_append_new(values, tell_color(r->albedo[i]));
    }
    return json_pack("{so so sf}", "angles", angles, "values", values, "quadratureError",
                     r->quadrature);
}

/* f_r in the plane of incidence. Light comes from the side of negative angles. */
static json_t *tell_samples(const shd_reflectance *r) {
    static const double lights[] = {0, 30, 45, 60, 80};
    json_t *list = json_array();
    for (size_t i = 0; i < sizeof lights / sizeof lights[0]; i++) {
        json_t *views = json_array(), *values = json_array();
        for (int view = -85; view <= 85; view += 5) {
            double f[3];
            shd_reflectance_at(r, shd_polar(lights[i] * DEGREE, SHD_PI),
                               shd_polar(abs(view) * DEGREE, view < 0 ? SHD_PI : 0), f);
            json_array_append_new(views, json_integer(view));
            json_array_append_new(values, tell_color(f));
        }
        json_array_append_new(
            list, json_pack("{sf so so}", "light", lights[i], "views", views, "values", values));
    }
    return list;
}

/* Null where nothing was simulated. */
static json_t *tell_noise(const shd_reflectance *r) {
    const shd_plan *plan = r->plan;
    const shd_westin *table = plan->westin ? plan->westin[r->material - plan->materials] : NULL;
    if (!table) return json_null();
    const shd_westin_error noise = shd_westin_noise(table);
    return json_pack("{sf sf}", "rms", noise.rms, "max", noise.max);
}

static json_t *tell_one(const shd_scene *scene, const shd_reflectance *r) {
    const shd_material *material = &scene->materials[scene->objects[r->object].material];
    return json_pack(
        "{ss ss ss so so so s{sf sf sf sf} sb so so}", "material", material->name, "model",
        shd_model_names[r->material->model], "formula", formulas[r->material->model], "verdict",
        tell_verdict(r), "albedo", tell_albedo(r), "noise", tell_noise(r), "reciprocity",
        "residual", r->residual, "light", r->residual_light, "view", r->residual_view, "turn",
        r->residual_turn, "unbounded", r->unbounded, "gainsEnergyAbove",
        isnan(r->gains) ? json_null() : json_real(r->gains), "samples", tell_samples(r));
}

static shd_status tell_json(shd_request *request, shd_bytes *out, shd_error *error) {
    finding found;
    const shd_scene *scene = request->scene;
    shd_status status = find_all(&request->rendering, scene, SIZE_MAX, &found, error);
    if (status != SHD_OK) return status;
    shd_json_memory_watch();
    json_t *list = json_array();
    for (size_t i = 0; i < found.count; i++)
        json_array_append_new(list, tell_one(scene, &found.list[i]));
    json_t *all = json_pack("{ss ss so}", "unit", "1/sr", "colorSpace", scene->working_space->name,
                            "materials", list);
    char *text = shd_tell_print(all, 12, &request->cancelled);
    if (shd_is_cancelled(&request->cancelled)) {
        free(text);
        return shd_rendering_cancelled(error);
    }
    if (!text) return shd_fail(error, SHD_EXHAUSTED, "", "out of memory");
    *out = (shd_bytes){(unsigned char *)text, strlen(text)};
    return SHD_OK;
}

/* ---- As a figure. ---- */

static shd_status draw(shd_request *request, shd_drawing **out, double *width, shd_error *error) {
    finding found;
    const shd_scene *scene = request->scene;
    shd_rendering *r = &request->rendering;
    shd_status status = find_all(r, scene, PLOTTED, &found, error);
    if (status != SHD_OK) return status;
    *width = (double)SHD_LOBE_PLOT_WIDTH * (double)(found.count ? found.count : 1);
    *out = shd_drawing_new(r->arena, *width, SHD_LOBE_PLOT_HEIGHT);
    for (size_t i = 0; *out && i < found.count; i++)
        shd_draw_lobe(*out, (double)i * SHD_LOBE_PLOT_WIDTH, 0, &found.list[i],
                      scene->materials[scene->objects[found.list[i].object].material].name,
                      PLOT_ANGLE);
    if (!*out || shd_drawing_full(*out))
        return shd_fail(error, SHD_MEMORY, "", "the limit `memory` is reached");
    return SHD_OK;
}

static shd_status tell_svg(shd_request *request, shd_bytes *out, shd_error *error) {
    shd_drawing *drawing;
    double width;
    shd_status status = draw(request, &drawing, &width, error);
    if (status != SHD_OK) return status;
    size_t length;
    const char *svg = shd_drawing_svg(drawing, "Reflection of materials, light at 45 degrees",
                                      request->rendering.arena, &length);
    if (!svg) return shd_fail(error, SHD_MEMORY, "", "the limit `memory` is reached");
    *out = (shd_bytes){malloc(length + 1), length};
    if (!out->data) return shd_fail(error, SHD_EXHAUSTED, "", "out of memory");
    memcpy(out->data, svg, length + 1);
    return SHD_OK;
}

static shd_status tell_png(shd_request *request, shd_bytes *out, shd_error *error) {
    shd_drawing *drawing;
    double width;
    shd_arena *arena = request->rendering.arena;
    shd_status status = draw(request, &drawing, &width, error);
    if (status != SHD_OK) return status;
    const int w = (int)width, h = SHD_LOBE_PLOT_HEIGHT;
    unsigned char *rgb = shd_arena_alloc(arena, (size_t)w * (size_t)h, 3);
    if (!rgb) return shd_fail(error, SHD_MEMORY, "", "the limit `memory` is reached");
    memset(rgb, 255, 3 * (size_t)w * (size_t)h);
    if (!shd_drawing_paint(drawing, 1, w, h, rgb, arena, &request->cancelled))
        return shd_is_cancelled(&request->cancelled)
                   ? shd_rendering_cancelled(error)
                   : shd_fail(error, SHD_MEMORY, "", "the limit `memory` is reached");
    const shd_image image = {
        .width = w, .height = h, .depth = SHD_U8, .channel = -1, .samples = rgb};
    return shd_image_encode(&image, SHD_PNG, arena, out, error);
}

shd_status shd_request_brdf(shd_request *request, shd_brdf_form form, unsigned char **data,
                            size_t *size, shd_error *error) {
    static shd_status (*const tell[])(shd_request *, shd_bytes *, shd_error *) = {
        [SHD_BRDF_JSON] = tell_json, [SHD_BRDF_SVG] = tell_svg, [SHD_BRDF_PNG] = tell_png};
    shd_bytes bytes = {NULL, 0};
    const shd_status status = shd_request_blame(request, tell[form](request, &bytes, error), error);
    *data = bytes.data;
    *size = bytes.size;
    return status;
}
