/* Scenes as JSON text, rendered to floats: what the property tests compare.
 *
 * film_of() gives the film (f32, filtered, with its layers); samples_of() casts and lights the
 * same scene sample by sample and gives radiance in f64 and what was hit, so that the exact tier's
 * agreement can be seen below f32's last digit; png_of() goes the public way and gives a file's
 * bytes. */
#ifndef SHD_TEST_FILM_OF_H
#define SHD_TEST_FILM_OF_H

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "render/planning.h"
#include "render/request.h"
#include "render/show/shown.h"
#include "render/tell/measure.h"
#include "render/tiles/film.h"
#include "shade/lighting.h"

/* Says by how much a bound is missed; with SHADED_MEASURE set, what every figure is. */
#define assert_below(value, bound) check_below((value), (bound), #value, __LINE__)

static inline void check_below(double value, double bound, const char *what, int line) {
    if (getenv("SHADED_MEASURE")) printf("%d: %.3g of %.3g: %s\n", line, value, bound, what);
    if (!(value < bound)) fail_msg("line %d: %s is %g, not below %g", line, what, value, bound);
}

/* ---- Texts. ---- */

/* A scene being written: fprintf to `out`, then finish() gives the text, which is free()d. */
typedef struct writing {
    FILE *out;
    char *text;
    size_t size;
} writing;

static inline void start(writing *w) {
    w->out = open_memstream(&w->text, &w->size);
    assert_non_null(w->out);
}

static inline char *finish(writing *w) {
    fclose(w->out);
    return w->text;
}

/* printf into memory that the caller frees. */
static inline SHD_PRINTF(1, 2) char *text_of(const char *format, ...) {
    char *text = NULL;
    va_list args;
    va_start(args, format);
    int length = vasprintf(&text, format, args);
    va_end(args);
    assert_true(length >= 0);
    return text;
}

/* The document is no scene, and its first mistake is there. Frees it. */
static inline void refuse_text(shd_engine *engine, char *text, const char *pointer) {
    shd_request *request;
    shd_error error;
    assert_int_equal(shd_request_new(engine, &request, &error), SHD_OK);
    assert_int_equal(shd_request_read(request, text, strlen(text), SHD_PNG), SHD_SCENE);
    assert_string_equal(shd_request_report(request)->errors[0].pointer, pointer);
    shd_request_drop(request);
    free(text);
}

/* Evenly spread in [low, high); the same numbers in every run. */
static inline double uniform(uint64_t *random, double low, double high) {
    *random = *random * 6364136223846793005u + 1442695040888963407u;
    return low + (high - low) * ((double)(*random >> 11) * 0x1p-53);
}

static inline int below(uint64_t *random, int count) {
    return (int)uniform(random, 0, count);
}

static inline shd_vec3 random_direction(uint64_t *random) {
    shd_vec3 v;
    do {
        v = (shd_vec3){uniform(random, -1, 1), uniform(random, -1, 1), uniform(random, -1, 1)};
    } while (shd_dot(v, v) > 1 || shd_dot(v, v) < 0.01);
    shd_normalize(v, &v);
    return v;
}

/* ---- Pictures. ---- */

/* `reuse` 0: each picture is made from its own document alone. */
static inline shd_engine *new_engine_that_keeps(size_t reuse, unsigned threads,
                                                const char *kernel) {
    shd_engine_options options = shd_engine_defaults();
    options.threads = threads;
    options.kernel = kernel;
    options.reuse = reuse;
    shd_engine *engine = NULL;
    shd_error error = {.status = SHD_OK};
    if (shd_engine_new(&options, &engine, &error)) fail_msg("%s: %s", error.path, error.text);
    return engine;
}

static inline shd_engine *new_engine_of(unsigned threads, const char *kernel) {
    return new_engine_that_keeps(0, threads, kernel);
}

static inline shd_engine *new_engine(unsigned threads) {
    return new_engine_of(threads, NULL);
}

/* Memory for so many hits. */
static inline shd_hits new_hits(const shd_plan *plan, size_t capacity, shd_arena *arena) {
    shd_scratch memory = {.arena = arena};
    shd_hits hits;
    shd_hits_lay_out(plan, capacity, &memory, &hits);
    assert_false(memory.full);
    return hits;
}

/* For cmocka's group fixtures: the engine is *state. */
static inline int make_engine(void **state) {
    *state = new_engine(2);
    return 0;
}

static inline int drop_engine(void **state) {
    shd_engine_drop(*state);
    return 0;
}

static inline shd_request *read_scene(shd_engine *engine, const char *json) {
    shd_request *request = NULL;
    shd_error error = {.status = SHD_OK};
    if (shd_request_new(engine, &request, &error)) fail_msg("%s", error.text);
    if (shd_request_read(request, json, strlen(json), SHD_PNG)) {
        const shd_problem *problem = &shd_request_report(request)->errors[0];
        fail_msg("%s: %s in\n%.1000s", problem->pointer, problem->detail, json);
    }
    return request;
}

/* What is drawn lives in the request; drop_drawn() ends both. */
typedef struct drawn {
    shd_request *request;
    shd_film film;
} drawn;

static inline shd_sight *plan_and_see(shd_request *request) {
    shd_error error = {.status = SHD_OK};
    shd_sight *sight = NULL;
    if (shd_plan_make(request->scene, request->rendering.engine->isa, NULL, NULL,
                      request->rendering.arena, &request->rendering.plan, &error) ||
        shd_sight_new(request->rendering.plan, NULL, request->rendering.arena, &sight, &error))
        fail_msg("%s: %s", error.path, error.text);
    return sight;
}

static inline drawn film_of(shd_engine *engine, const char *json) {
    drawn d = {.request = read_scene(engine, json)};
    shd_sight *sight = plan_and_see(d.request);
    shd_error error = {.status = SHD_OK};
    shd_status status = shd_film_render(&d.request->rendering, sight, NULL, NULL, &d.film, &error);
    if (status != SHD_OK) fail_msg("%s: %s", error.path, error.text);
    return d;
}

/* The same, planned for what its outputs show. */
static inline drawn shown_film_of(shd_engine *engine, const char *json) {
    drawn d = {.request = read_scene(engine, json)};
    shd_error error = {.status = SHD_OK};
    shd_sight *sight = NULL;
    if (shd_rendering_plan(&d.request->rendering, d.request->scene, &error) ||
        shd_sight_new(d.request->rendering.plan, NULL, d.request->rendering.arena, &sight, &error))
        fail_msg("%s: %s", error.path, error.text);
    shd_status status = shd_film_render(&d.request->rendering, sight, NULL, NULL, &d.film, &error);
    if (status != SHD_OK) fail_msg("%s: %s", error.path, error.text);
    return d;
}

static inline void drop_drawn(drawn *d) {
    shd_request_drop(d->request);
}

/* How far a film is from the exact tier's, both planned for what their outputs show. Uses the film
 * up. */
static inline shd_difference measured(const drawn *exact, drawn *d) {
    shd_rendering *r = &d->request->rendering;
    shd_showing showing;
    shd_error error;
    shd_difference difference;
    double seconds;
    assert_int_equal(
        shd_showing_make(r, d->request->scene, &d->request->scene->outputs[0], &showing, &error),
        SHD_OK);
    assert_int_equal(
        shd_film_measure(r, &showing, &exact->film, &d->film, &difference, &seconds, &error),
        SHD_OK);
    return difference;
}

static inline size_t pixels_of(const drawn *d) {
    return (size_t)d->film.width * (size_t)d->film.height;
}

/* The plane of a layer; it must have been asked for. */
static inline const float *plane_of(const drawn *d, shd_layer_kind kind, size_t light) {
    const shd_plan *plan = d->request->rendering.plan;
    for (size_t p = 1; p < plan->plane_count; p++)
        if (plan->planes[p].kind == kind && plan->planes[p].light == light)
            return d->film.planes[p];
    fail_msg("layer %d is not there", (int)kind);
    return NULL;
}

/* The largest difference of two films' colors over the largest value of the first. */
static inline double film_difference(const drawn *a, const drawn *b) {
    assert_int_equal(a->film.width, b->film.width);
    assert_int_equal(a->film.height, b->film.height);
    double most = 0, largest = 0;
    for (size_t i = 0; i < 4 * pixels_of(a); i++) {
        double va = (double)a->film.rgba[i], vb = (double)b->film.rgba[i];
        most = fmax(most, fabs(va - vb));
        if (i % 4 != 3) largest = fmax(largest, fabs(va));
    }
    return most / (largest > 0 ? largest : 1);
}

static inline bool same_film(const drawn *a, const drawn *b) {
    return a->film.width == b->film.width && a->film.height == b->film.height &&
           !memcmp(a->film.rgba, b->film.rgba, 4 * pixels_of(a) * sizeof(float));
}

/* ---- Samples. ---- */

/* World frame; of a tier in f32 as it was rounded. */
typedef struct samples_seen {
    int32_t *object; /* SHD_NOTHING where nothing is hit */
    double *position[3], *normal[3], *view[3];
} samples_seen;

typedef struct sampled {
    shd_request *request;
    size_t count; /* region's pixels times samples, row by row */
    samples_seen seen;
    double (*radiance)[3]; /* [count]; 0 where nothing is hit */
} sampled;

/* Samples `first` to `end` of the hits, which see one object. */
static inline void light_samples(const shd_plan *plan, const shd_lighting *lighting,
                                 const shd_hits *hits, size_t first, size_t end, sampled *s) {
    enum { MOST = 64 };
    const size_t count = end - first;
    assert_true(count <= MOST);
    const shd_plan_object *object = &plan->objects[hits->object[first]];
    const shd_plan_material *material = &plan->materials[object->material];
    static double sums64[3 * 17][MOST];
    static float sums32[3 * 17][MOST + SHD_LANES];
    double *rows64[3 * 17];
    float *rows32[3 * 17];
    assert_true(material->lobe_count <= 16);
    for (int k = 0; k < 3 * 17; k++) rows64[k] = sums64[k], rows32[k] = sums32[k];
    if (plan->tier == SHD_EXACT) {
        shd_points64 points = {.count = count};
        for (int c = 0; c < 3; c++) {
            points.position[c] = hits->position[c] + first;
            points.normal[c] = hits->normal[c] + first;
            points.view[c] = hits->view[c] + first;
        }
        shd_light_sums64(lighting, material, object->lights, object->light_count, &points, rows64,
                         rows64 + 3);
    } else {
        shd_points32 points = {.count = count};
        for (int c = 0; c < 3; c++) {
            points.position[c] = hits->position32[c] + first;
            points.low[c] = hits->low32[c] ? hits->low32[c] + first : NULL;
            points.normal[c] = hits->normal32[c] + first;
            points.mirror[c] = hits->mirror32[c] + first;
        }
        shd_light_sums32(lighting, material, object->lights, object->light_count, &points, rows32,
                         rows32 + 3, NULL);
        for (size_t k = 0; k < 3 * (1 + material->lobe_count); k++)
            for (size_t i = 0; i < count; i++) sums64[k][i] = (double)sums32[k][i];
    }
    for (size_t i = 0; i < count; i++)
        for (size_t c = 0; c < 3; c++) {
            const size_t at = plan->grey_lights ? 0 : c;
            double value = material->constant[c];
            if (material->has_diffuse) value += material->diffuse[c] * sums64[at][i];
            for (size_t k = 0; k < material->lobe_count; k++)
                value += material->lobes[k].specular[c] * sums64[3 + 3 * k + at][i];
            s->radiance[hits->shot[first + i]][c] = value;
        }
}

/* Where hit i is, as doubles in the world's frame. */
static inline void place_sample(const shd_plan *plan, const shd_hits *hits, size_t i, sampled *s) {
    const size_t to = hits->shot[i];
    s->seen.object[to] = hits->object[i];
    const double origin[3] = {plan->origin.x, plan->origin.y, plan->origin.z};
    double facing = 0;
    for (int c = 0; c < 3; c++) {
        if (plan->tier == SHD_EXACT) {
            s->seen.position[c][to] = hits->position[c][i];
            s->seen.normal[c][to] = hits->normal[c][i];
            s->seen.view[c][to] = hits->view[c][i];
            continue;
        }
        double p = (double)hits->position32[c][i];
        if (hits->low32[c]) p += (double)hits->low32[c][i];
        s->seen.position[c][to] = origin[c] + p / plan->scale;
        s->seen.normal[c][to] = (double)hits->normal32[c][i];
        facing += (double)hits->normal32[c][i] * (double)hits->mirror32[c][i];
    }
    /* V is mirrored W. */
    for (int c = 0; plan->tier != SHD_EXACT && c < 3; c++)
        s->seen.view[c][to] =
            2 * facing * (double)hits->normal32[c][i] - (double)hits->mirror32[c][i];
}

/* Scenes without flat or gouraud objects. */
static inline sampled samples_of(shd_engine *engine, const char *json) {
    sampled s = {.request = read_scene(engine, json)};
    shd_sight *sight = plan_and_see(s.request);
    const shd_plan *plan = s.request->rendering.plan;
    const shd_raster *raster = &plan->scene->raster;
    shd_arena *arena = s.request->rendering.arena;
    const size_t samples = (size_t)raster->samples;
    s.count = (size_t)raster->w * (size_t)raster->h * samples;
    int32_t *x = shd_arena_alloc(arena, s.count, sizeof *x),
            *y = shd_arena_alloc(arena, s.count, sizeof *y);
    uint8_t *sample = shd_arena_alloc(arena, s.count, sizeof *sample);
    uint32_t *every = shd_arena_alloc(arena, plan->scene->object_count, sizeof *every);
    s.seen.object = shd_arena_alloc(arena, s.count, sizeof *s.seen.object);
    for (int c = 0; c < 3; c++) {
        s.seen.position[c] = shd_arena_zalloc(arena, s.count, sizeof(double));
        s.seen.normal[c] = shd_arena_zalloc(arena, s.count, sizeof(double));
        s.seen.view[c] = shd_arena_zalloc(arena, s.count, sizeof(double));
        assert_true(s.seen.position[c] && s.seen.normal[c] && s.seen.view[c]);
    }
    s.radiance = shd_arena_zalloc(arena, s.count, sizeof *s.radiance);
    shd_lighting *lighting = shd_lighting_new(plan, NULL, arena);
    shd_hits hits = new_hits(plan, s.count + SHD_LANES, arena);
    assert_true(x && y && sample && every && s.seen.object && s.radiance && lighting);
    for (size_t i = 0; i < s.count; i++) {
        const size_t pixel = i / samples;
        x[i] = raster->x + (int)(pixel % (size_t)raster->w);
        y[i] = raster->y + (int)(pixel / (size_t)raster->w);
        sample[i] = (uint8_t)(i % samples);
        s.seen.object[i] = SHD_NOTHING;
    }
    for (size_t o = 0; o < plan->scene->object_count; o++) every[o] = (uint32_t)o;
    shd_sight_shoot(sight, every, plan->scene->object_count, &(shd_shots){s.count, x, y, sample},
                    &hits);
    shd_hits_pad(&hits);

    for (size_t i = 0; i < hits.count;) {
        size_t end = i;
        for (; end < hits.count && end - i < 64 && hits.object[end] == hits.object[i]; end++)
            place_sample(plan, &hits, end, &s);
        light_samples(plan, lighting, &hits, i, end, &s);
        i = end;
    }
    return s;
}

static inline void drop_sampled(sampled *s) {
    shd_request_drop(s->request);
}

/* N.V at a sample. */
static inline double facing_of(const sampled *s, size_t i) {
    double sum = 0;
    for (int c = 0; c < 3; c++) sum += s->seen.normal[c][i] * s->seen.view[c][i];
    return sum;
}

static inline double largest_of(const sampled *s) {
    double largest = 0;
    for (size_t i = 0; i < s->count; i++)
        for (int c = 0; c < 3; c++) largest = fmax(largest, fabs(s->radiance[i][c]));
    return largest;
}

/* The largest difference of two pictures' samples over the largest value of the first, where
 * both see the same object with N.V of at least `facing`: at silhouettes a rounding error of the
 * ray moves the normal by its square root. `strays`, unless NULL, gets the number of samples that
 * see different objects. */
static inline double sample_difference(const sampled *a, const sampled *b, double facing,
                                       size_t *strays) {
    assert_int_equal(a->count, b->count);
    double most = 0;
    size_t different = 0;
    for (size_t i = 0; i < a->count; i++) {
        if (a->seen.object[i] != b->seen.object[i]) {
            different++;
            continue;
        }
        if (a->seen.object[i] == SHD_NOTHING || facing_of(a, i) < facing) continue;
        for (int c = 0; c < 3; c++) most = fmax(most, fabs(a->radiance[i][c] - b->radiance[i][c]));
    }
    if (strays)
        *strays = different;
    else
        assert_int_equal(different, 0);
    double largest = largest_of(a);
    assert_true(largest > 0); /* an all black picture proves nothing */
    return most / largest;
}

/* ---- Files. ---- */

typedef struct file {
    unsigned char *data;
    size_t size;
} file;

/* A status other than SHD_OK leaves the file empty. */
static inline shd_status try_png_of(shd_engine *engine, const char *json, file *out) {
    *out = (file){NULL, 0};
    shd_request *request = NULL;
    shd_error error;
    shd_status status = shd_request_new(engine, &request, &error);
    if (status != SHD_OK) return status;
    status = shd_request_read(request, json, strlen(json), SHD_PNG);
    if (status == SHD_OK) status = shd_request_render(request, NULL, &error);
    if (status == SHD_OK) {
        size_t count;
        out->size = shd_request_pictures(request, &count)[0].size;
        out->data = shd_request_take(request, 0);
    }
    shd_request_drop(request);
    return status;
}

static inline file png_of(shd_engine *engine, const char *json) {
    file out;
    shd_status status = try_png_of(engine, json, &out);
    if (status != SHD_OK) drop_sampled(&(sampled){.request = read_scene(engine, json)});
    assert_int_equal(status, SHD_OK);
    assert_true(out.size > 0);
    return out;
}

static inline bool same_file(file a, file b) {
    return a.size == b.size && !memcmp(a.data, b.data, a.size);
}

/* Renders both texts, frees them, and says whether the files are the same. */
static inline bool same_png(shd_engine *engine, char *one, char *other) {
    file a = png_of(engine, one), b = png_of(engine, other);
    bool same = same_file(a, b);
    free(a.data);
    free(b.data);
    free(one);
    free(other);
    return same;
}

#endif
