#include "attack/layers.h"

#include <jansson.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "render/planning.h"
#include "render/request.h"
#include "render/tiles/film.h"
#include "sight/sight.h"

typedef struct layered {
    char *json;
    size_t lights, lobes;
    bool bounces, surrounded; /* an environment is seen behind all */
    shd_request *request;
    shd_film film;
    bool good;
} layered;

static size_t most_lobes(const json_t *root) {
    size_t most = 0, i;
    const json_t *object;
    json_array_foreach(json_object_get(root, "objects"), i, object) {
        const json_t *material = json_object_get(object, "material");
        const size_t further = json_array_size(json_object_get(material, "lobes")),
                     given = json_object_get(material, "shininess") ? 1 : 0;
        if (given + further > most) most = given + further;
    }
    return most;
}

static void ask_for(json_t *layers, const char *format, size_t count) {
    char name[40];
    for (size_t i = 0; i < count; i++) {
        snprintf(name, sizeof name, "%s.%zu", format, i);
        json_array_append_new(layers, json_string(name));
    }
}

/* The family's document, black behind all, with all layers that it has. */
static bool write_layered(const family *f, uint64_t seed, const char *accuracy, layered *out) {
    static const char *const plain[] = {"beauty",  "emissive", "ambient",
                                        "diffuse", "specular", "bound"};
    char *text = write_scene(f, seed, accuracy);
    json_t *root = text ? json_loads(text, 0, NULL) : NULL, *layers = json_array();
    const json_t *light;
    size_t i;
    free(text);
    out->lights = json_array_size(json_object_get(root, "lights"));
    out->lobes = most_lobes(root);
    out->bounces = json_object_get(json_object_get(root, "trace"), "depth");
    json_array_foreach(json_object_get(root, "lights"), i, light) out->surrounded |=
        json_is_true(json_object_get(light, "visible"));
    for (i = 0; i < sizeof plain / sizeof plain[0]; i++)
        json_array_append_new(layers, json_string(plain[i]));
    if (out->bounces) json_array_append_new(layers, json_string("bounce"));
    ask_for(layers, "light", out->lights);
    ask_for(layers, "lobe", out->lobes);
    json_object_set_new(root, "background", json_integer(0));
    json_object_set_new(
        root, "output",
        json_pack("{s:s, s:s, s:o}", "format", "exr", "bitDepth", "float", "layers", layers));
    out->json = json_dumps(root, JSON_PRESERVE_ORDER | JSON_REAL_PRECISION(17));
    json_decref(root);
    return out->json;
}

static layered draw(shd_engine *engine, const family *f, uint64_t seed, const char *accuracy) {
    layered out = {.good = false};
    shd_error error = {.status = SHD_OK};
    shd_sight *sight = NULL;
    if (!write_layered(f, seed, accuracy, &out) || shd_request_new(engine, &out.request, &error) ||
        shd_request_read(out.request, out.json, strlen(out.json), SHD_PNG))
        return out;
    shd_rendering *r = &out.request->rendering;
    out.good = !shd_rendering_plan(r, out.request->scene, &error) &&
               !shd_sight_new(r->plan, NULL, r->arena, &sight, &error) &&
               !shd_film_render(r, sight, NULL, NULL, &out.film, &error);
    return out;
}

static void drop(layered *d) {
    shd_request_drop(d->request);
    free(d->json);
}

/* Adds a plane's component to both sums. */
static void add_plane(const layered *d, shd_layer_kind kind, size_t index, size_t at, double *sum,
                      double *size) {
    const shd_plan *plan = d->request->rendering.plan;
    for (size_t p = 1; p < plan->plane_count; p++) {
        if (plan->planes[p].kind != kind || plan->planes[p].light != index) continue;
        *sum += (double)d->film.planes[p][at];
        *size += fabs((double)d->film.planes[p][at]);
        return;
    }
}

/* What f32 may lose of planes that are summed one by one, what of a lobe is so faint that it is
 * left out, and what f32 has of the one color of a pattern where the other one is black. */
static bool differs(double a, double b, double size) {
    return !(fabs(a - b) <= 1e-5 * size + 2e-8);
}

/* The component of a pixel whose sums differ, and how: NULL, if none do. */
static const char *apart_at(const layered *d, size_t pixel, size_t c, double values[2]) {
    const size_t at = 3 * pixel + c;
    double common = 0, size = 0, terms = 0, lights = 0, specular = 0, lobes = 0;
    add_plane(d, SHD_LAYER_EMISSIVE, 0, at, &common, &size);
    add_plane(d, SHD_LAYER_AMBIENT, 0, at, &common, &size);
    add_plane(d, SHD_LAYER_BOUNCE, 0, at, &common, &size);
    add_plane(d, SHD_LAYER_DIFFUSE, 0, at, &terms, &size);
    add_plane(d, SHD_LAYER_SPECULAR, 0, at, &specular, &size);
    terms += specular;
    for (size_t i = 0; i < d->lights; i++) add_plane(d, SHD_LAYER_LIGHT, i, at, &lights, &size);
    for (size_t i = 0; i < d->lobes; i++) add_plane(d, SHD_LAYER_LOBE, i, at, &lobes, &size);
    const double beauty = (double)d->film.rgba[4 * pixel + c];
    values[0] = common + terms, values[1] = beauty;
    if (!d->surrounded && differs(values[0], values[1], size)) return "terms and the picture";
    values[0] = lights, values[1] = terms;
    if (differs(values[0], values[1], size)) return "lights and terms";
    values[0] = lobes, values[1] = specular;
    return differs(values[0], values[1], size) ? "lobes and the specular layer" : NULL;
}

static void check_sums(const layered *d, const char *tier, same_teller *tell, void *context) {
    const size_t pixels = (size_t)d->film.width * (size_t)d->film.height;
    char line[300];
    for (size_t i = 0; i < 3 * pixels; i++) {
        double values[2];
        const char *what = apart_at(d, i / 3, i % 3, values);
        if (!what) continue;
        snprintf(line, sizeof line, "%s: %s differ at (%zu, %zu): %.9g and %.9g", tier, what,
                 i / 3 % (size_t)d->film.width, i / 3 / (size_t)d->film.width, values[0],
                 values[1]);
        tell(context, line, d->json);
        return;
    }
}

static void check_bounds(const layered *d, const layered *exact, const char *tier,
                         same_teller *tell, void *context) {
    const size_t pixels = (size_t)d->film.width * (size_t)d->film.height;
    const shd_plan *plan = d->request->rendering.plan;
    const double most = fmax(plan->bound.linear, d->request->rendering.ray_error);
    char line[300];
    for (size_t i = 0; i < pixels; i++) {
        double off = 0;
        for (size_t c = 0; c < 3; c++)
            off = fmax(off,
                       fabs((double)d->film.rgba[4 * i + c] - (double)exact->film.rgba[4 * i + c]));
        const double told = (double)d->film.bound[i], of_exact = (double)exact->film.bound[i];
        const bool wide = told > most * (1 + 1e-6);
        if (off <= told + of_exact && !wide) continue;
        snprintf(line, sizeof line,
                 "%s: at (%zu, %zu) it is off by %.4g, and its layer tells %.4g, of %.4g", tier,
                 i % (size_t)d->film.width, i / (size_t)d->film.width, off, told, most);
        tell(context, line, d->json);
        return;
    }
}

void layers_check(shd_engine *engine, const family *f, uint64_t seed, same_teller *tell,
                  void *context) {
    layered exact = draw(engine, f, seed, "\"tier\": \"exact\""),
            other =
                draw(engine, f, seed, seed % 2 ? "\"tier\": \"standard\"" : "\"tier\": \"draft\"");
    if (!exact.good || !other.good) {
        const layered *bad = exact.good ? &other : &exact;
        const shd_report *report = bad->request ? shd_request_report(bad->request) : NULL;
        tell(context,
             report && report->error_count ? report->errors[0].detail : "its layers are not drawn",
             bad->json ? bad->json : "");
    } else {
        check_sums(&exact, "exact", tell, context);
        check_sums(&other, "another tier", tell, context);
        check_bounds(&other, &exact, "another tier", tell, context);
    }
    drop(&exact);
    drop(&other);
}
