/* A material's coefficients from a photo of the scene.
 *
 * The scene is rendered with coefficients of 1, term by term and exponent by exponent: these
 * pictures add up to what the photo shows, once its output's colors are undone. Pixels that are the
 * object's alone count; what is beside its edges is nobody's business. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "render/pair.h"
#include "render/tell/fit_answer.h"
#include "render/tell/fit_bases.h"
#include "render/tell/sample_file.h"
#include "scene/json.h"

typedef struct seeing {
    shd_bases bases;
    bool *chosen; /* [object_count] */
    shd_model model;
    float *coverage, *diffuse; /* [pixels], [pixels][3] */
    uint32_t *pixels;          /* of the object alone */
    size_t seen, edge;
    shd_photo photo;
} seeing;

/* ---- The object ---- */

static shd_status wrong_object(const shd_request *request, const char *name, shd_error *error) {
    const shd_scene *scene = request->scene;
    const char *names[64];
    size_t count = 0;
    for (size_t i = 0; i < scene->object_count && count < 64; i++)
        if (scene->objects[i].name) names[count++] = scene->objects[i].name;
    return shd_fail(error, SHD_SCENE, "/object", "no object has this name or number%s",
                    count ? shd_suggest(&request->report, name, names, count).text : "");
}

/* By name, or else by its number. */
static shd_status choose_named(const shd_request *request, const char *name, bool *chosen,
                               shd_error *error) {
    const shd_scene *scene = request->scene;
    bool any = false;
    for (size_t i = 0; i < scene->object_count; i++) {
        const shd_object *object = &scene->objects[i];
        chosen[i] = !object->emitter && object->name && !strcmp(object->name, name);
        any |= chosen[i];
    }
    if (any) return SHD_OK;
    const size_t digits = strspn(name, "0123456789");
    const unsigned long number =
        digits && !name[digits] && digits < 10 ? strtoul(name, NULL, 10) : scene->object_count;
    if (number >= scene->object_count || scene->objects[number].emitter)
        return wrong_object(request, name, error);
    chosen[number] = true;
    return SHD_OK;
}

static shd_status choose(const shd_request *request, const char *name, seeing *s,
                         shd_error *error) {
    const shd_scene *scene = request->scene;
    size_t material = SIZE_MAX;
    bool several = false;
    s->chosen = shd_arena_zalloc(request->rendering.arena, scene->object_count, sizeof(bool));
    if (!s->chosen) return shd_rendering_full(&request->rendering, "fit", error);
    if (name) {
        const shd_status status = choose_named(request, name, s->chosen, error);
        if (status != SHD_OK) return status;
    } else {
        for (size_t i = 0; i < scene->object_count; i++) s->chosen[i] = !scene->objects[i].emitter;
    }
    for (size_t i = 0; i < scene->object_count; i++) {
        if (!s->chosen[i]) continue;
        several |= material != SIZE_MAX && material != scene->objects[i].material;
        material = scene->objects[i].material;
    }
    if (material == SIZE_MAX)
        return shd_fail(error, SHD_SCENE, "/object", "the scene has no object");
    if (several)
        return shd_fail(error, SHD_SCENE, "/object",
                        "%s have several materials, and one is found: name an object",
                        name ? "objects of this name" : "the scene's objects");
    const shd_material *m = &scene->materials[material];
    const double *rest[] = {m->reflection, m->transmission};
    for (int c = 0; c < 3 && scene->trace.depth; c++)
        if (m->opacity[c] != 1 || rest[0][c] != 0 || rest[1][c] != 0)
            return shd_fail(error, SHD_SCENE, "/object",
                            "its material mirrors or lets light through: a fit takes what lights "
                            "show on it, without `depth` in `trace`");
    if (shd_is_textured(m))
        return shd_fail(
            error, SHD_SCENE, "/object",
            "its material has a pattern or a picture: a fit finds coefficients that are the same "
            "everywhere");
    for (size_t j = 0; j < scene->light_count; j++)
        if (scene->lights[j].type == SHD_LIGHT_ENVIRONMENT)
            return shd_fail(error, SHD_SCENE, "/lights",
                            "light %zu is an environment, which a fit does not take", j);
    s->model = m->model;
    if (s->model > SHD_MODEL_PHONG_NORMALIZED)
        return shd_fail(error, SHD_SCENE, "/object",
                        "its material's model is %s; coefficients of phong, blinn-phong and "
                        "phong-normalized are found",
                        shd_model_names[s->model]);
    return SHD_OK;
}

/* ---- Light ---- */

static shd_status see(shd_request *request, seeing *s, shd_error *error) {
    shd_arena *arena = request->rendering.arena;
    const shd_raster *raster = &request->scene->raster;
    const size_t pixels = (size_t)raster->w * (size_t)raster->h;
    s->coverage = shd_arena_alloc(arena, pixels, sizeof *s->coverage);
    s->diffuse = shd_arena_alloc(arena, pixels, 3 * sizeof *s->diffuse);
    s->pixels = shd_arena_alloc(arena, pixels, sizeof *s->pixels);
    if (!s->coverage || !s->diffuse || !s->pixels)
        return shd_rendering_full(&request->rendering, "fit", error);
    const shd_status status = shd_bases_diffuse(&s->bases, s->coverage, s->diffuse, error);
    if (status != SHD_OK) return status;
    for (size_t i = 0; i < pixels; i++) {
        if (shd_is_cancelled_at(request->rendering.cancelled, i))
            return shd_rendering_cancelled(error);
        const double part = (double)s->coverage[i];
        if (part > 1 - 1e-6)
            s->pixels[s->seen++] = (uint32_t)i;
        else if (part > 0)
            s->edge++;
    }
    if (!s->seen)
        return shd_fail(error, SHD_SCENE, "/object", "no pixel of the picture shows it alone");
    return SHD_OK;
}

/* Where no light strikes, a thing is of one color. If all these pixels have one code, its rounding
 * is one error and no mean of many: together they weigh as much as one. Tells how many they are. */
static void weigh_shadow(const shd_photo *photo, const float *diffuse, size_t out[3]) {
    for (size_t c = 0; c < 3; c++) {
        size_t count = 0, first = 0;
        bool alike = !photo->exact;
        for (size_t i = c; i < 3 * photo->count && alike; i += 3) {
            if (diffuse[i] != 0 || !(photo->weight[i] > 0)) continue;
            if (!count++) first = i;
            alike = photo->light[i] == photo->light[first];
        }
        out[c] = alike ? count : 0;
        const float by = count ? (float)(1 / sqrt((double)count)) : 1;
        for (size_t i = c; i < 3 * photo->count && alike && count > 1; i += 3)
            if (diffuse[i] == 0) photo->weight[i] *= by;
    }
}

static shd_status find_lobes(void *context, const double *exponents, size_t lobes, float **out,
                             shd_error *error) {
    seeing *s = context;
    return shd_bases_lobes(&s->bases, exponents, lobes, s->photo.pixels, s->photo.count, out,
                           error);
}

static shd_status fit(shd_request *request, seeing *s, shd_phong_fit *out, shd_error *error) {
    shd_rendering *r = &request->rendering;
    const shd_photo *photo = &s->photo;
    float *scratch[SHD_FIT_LOBES], *diffuse;
    if (!photo->count)
        return shd_fail(error, SHD_SCENE, "",
                        "no pixel of the object tells anything: %zu are transparent, and %zu have "
                        "colors that the scene's output does not make",
                        photo->transparent, photo->outside);
    diffuse = shd_arena_alloc(r->arena, photo->count, 3 * sizeof *diffuse);
    if (!diffuse) return shd_rendering_full(r, "fit", error);
    for (int k = 0; k < SHD_FIT_LOBES; k++) {
        scratch[k] = shd_arena_alloc(r->arena, photo->count, 3 * sizeof **scratch);
        if (!scratch[k]) return shd_rendering_full(r, "fit", error);
    }
    for (size_t i = 0; i < photo->count && !shd_is_cancelled_at(r->cancelled, i); i++)
        memcpy(diffuse + 3 * i, s->diffuse + 3 * (size_t)photo->pixels[i], 3 * sizeof *diffuse);
    shd_fit_rows rows = {.count = photo->count,
                         .light = photo->light,
                         .weight = photo->weight,
                         .diffuse = diffuse,
                         .relative = photo->exact};
    weigh_shadow(photo, diffuse, rows.alike);
    return shd_phong_fit_find(&rows, find_lobes, s, scratch, r->cancelled, out, error);
}

/* ---- The whole ---- */

static shd_status find(shd_request *request, const shd_samples *samples, shd_format format,
                       const char *object, const shd_render_options *options, char **json,
                       shd_error *error) {
    shd_rendering *r = &request->rendering;
    const shd_scene *scene = request->scene;
    seeing s = {.seen = 0};
    shd_phong_fit found;
    if (scene->spectral.channels)
        return shd_fail(error, SHD_SCENE, "/spectral", "a photo has red, green and blue alone");
    shd_status status = choose(request, object, &s, error);
    if (status == SHD_OK)
        status = shd_bases_prepare(r, scene, s.chosen, s.model, options, &s.bases, error);
    if (status == SHD_OK) status = see(request, &s, error);
    if (status == SHD_OK)
        status = shd_photo_undo(r, scene, samples, format, s.pixels, s.seen, &s.photo, error);
    if (status == SHD_OK) status = fit(request, &s, &found, error);
    if (status != SHD_OK) return status;
    const shd_fit_told told = {.scene = scene,
                               .object = object,
                               .model = s.model,
                               .seen = s.seen,
                               .edge = s.edge,
                               .photo = &s.photo,
                               .fit = &found};
    *json = shd_fit_tell(&told, r->cancelled);
    if (*json) return SHD_OK;
    return shd_is_cancelled(r->cancelled) ? shd_rendering_cancelled(error)
                                          : shd_fail(error, SHD_EXHAUSTED, "", "out of memory");
}

shd_status shd_request_fit(shd_request *request, const char *path, shd_format format,
                           const char *object, const shd_render_options *options, char **json,
                           shd_error *error) {
    const shd_raster *raster = &request->scene->raster;
    shd_samples samples;
    shd_status status =
        shd_sample_file_read(request, path, format, raster->w, raster->h, &samples, error);
    if (status != SHD_OK) return status;
    status = find(request, &samples, format, object, options, json, error);
    free(samples.values);
    return shd_request_blame(request, status, error);
}

shd_status shd_request_fit_kept(shd_request *request, char **json, shd_error *error) {
    const shd_pair *pair = request->pair;
    shd_request *side = pair->sides[0];
    shd_error why;
    shd_status status = find(side, pair->photo, pair->format, pair->object, NULL, json, &why);
    shd_times_add(&request->rendering.times, &side->rendering.times);
    status = shd_request_blame(side, status, &why);
    if (status == SHD_OK || !error) return status;
    *error = why;
    if (!*why.path && status == SHD_SCENE)
        strcpy(error->path, "/photo");
    else if (strcmp(why.path, "/object") != 0)
        snprintf(error->path, sizeof error->path, "/scene%.*s", (int)sizeof error->path - 7,
                 why.path);
    return status;
}
