#include "render/film.h"

#include <pthread.h>
#include <string.h>
#include <time.h>

#include "shade/shade.h"

/* One thread's working memory. */
typedef struct scratch {
    shd_cast_scratch *cast;
    shd_shader *shader;
    shd_gbuffer seen;
    double *radiance;              /* [plane][channel][sample of the tile] */
    double (*block)[3][SHD_BLOCK]; /* [plane]: what a block's shading gives */
    uint32_t *order;               /* samples that are shaded one by one, grouped by material */
    uint32_t *starts;              /* [material_count + 1] */
    shd_times times;
    uint64_t saturated;
} scratch;

/* What all threads share. */
typedef struct job {
    shd_request *request;
    const shd_plan *plan;
    const shd_sight *sight;
    const shd_render_options *options;
    shd_film *film;
    int tile_size, tiles_across;
    size_t tile_count;
    double **facet_radiance; /* [object]: NULL or [point][plane][channel] */
    size_t facet_object;     /* the one that shade_facet_block is at */
    bool faceted;            /* some object is */
    pthread_mutex_t mutex;   /* guards the arena and `slots` while threads run */
    scratch **slots;
    atomic_bool failed; /* memory ran out */
    atomic_size_t done; /* tiles */
} job;

double shd_thread_seconds(void) {
    struct timespec now;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static scratch *new_scratch(const job *j) {
    shd_arena *arena = j->request->arena;
    const shd_plan *plan = j->plan;
    size_t samples =
        (size_t)j->tile_size * (size_t)j->tile_size * (size_t)plan->scene->raster.samples;
    scratch *s = shd_arena_zalloc(arena, 1, sizeof *s);
    if (!s) return NULL;
    s->cast = shd_cast_scratch_new(j->sight, arena);
    s->shader = shd_shader_new(plan, arena);
    s->radiance = shd_arena_alloc(arena, plan->plane_count * 3 * samples, sizeof *s->radiance);
    s->block = shd_arena_zalloc(arena, plan->plane_count, sizeof *s->block);
    s->order = shd_arena_alloc(arena, samples, sizeof *s->order);
    s->starts = shd_arena_alloc(arena, plan->scene->material_count + 1, sizeof *s->starts);
    bool seen = shd_gbuffer_new(samples, arena, &s->seen);
    return s->cast && s->shader && s->radiance && s->block && s->order && s->starts && seen ? s
                                                                                            : NULL;
}

/* The scratch of a slot, made when the slot first works. NULL: the arena is full. */
static scratch *get_scratch(job *j, unsigned slot) {
    pthread_mutex_lock(&j->mutex);
    if (!j->slots[slot]) j->slots[slot] = new_scratch(j);
    scratch *s = j->slots[slot];
    pthread_mutex_unlock(&j->mutex);
    if (!s) atomic_store(&j->failed, true);
    return s;
}

static bool stopped(const job *j) {
    return atomic_load(&j->failed) ||
           atomic_load_explicit(&j->request->cancelled, memory_order_relaxed);
}

/* ---- Faceted objects: lit once a face or vertex, before any tile. ---- */

static void shade_facet_block(void *context, size_t index, unsigned slot) {
    job *j = context;
    if (stopped(j)) return;
    scratch *s = get_scratch(j, slot);
    if (!s) return;
    double began = shd_thread_seconds();
    const shd_scene *scene = j->plan->scene;
    const shd_facets *facets = shd_sight_facets(j->sight, j->facet_object);
    const shd_plan_material *material =
        &j->plan->materials[scene->objects[j->facet_object].material];
    size_t first = index * SHD_BLOCK, left = facets->point_count - first;
    shd_points points = {.count = left < SHD_BLOCK ? left : SHD_BLOCK};
    for (size_t i = 0; i < SHD_BLOCK; i++) {
        size_t from = first + (i < points.count ? i : points.count - 1);
        const shd_vec3 p = facets->positions[from], n = facets->normals[from],
                       v = facets->views[from];
        points.position[0][i] = p.x, points.position[1][i] = p.y, points.position[2][i] = p.z;
        points.normal[0][i] = n.x, points.normal[1][i] = n.y, points.normal[2][i] = n.z;
        points.view[0][i] = v.x, points.view[1][i] = v.y, points.view[2][i] = v.z;
    }
    shd_shade(s->shader, material, &points, s->block);
    const size_t planes = j->plan->plane_count;
    double *out = j->facet_radiance[j->facet_object] + 3 * planes * first;
    for (size_t i = 0; i < points.count; i++)
        for (size_t p = 0; p < planes; p++)
            for (int c = 0; c < 3; c++) *out++ = s->block[p][c][i];
    s->times.shade += shd_thread_seconds() - began;
}

static bool shade_facets(job *j) {
    const shd_scene *scene = j->plan->scene;
    for (size_t o = 0; o < scene->object_count; o++) {
        const shd_facets *facets = shd_sight_facets(j->sight, o);
        if (!facets) continue;
        pthread_mutex_lock(&j->mutex);
        j->facet_radiance[o] = shd_arena_alloc(
            j->request->arena, 3 * j->plan->plane_count * facets->point_count, sizeof(double));
        pthread_mutex_unlock(&j->mutex);
        if (!j->facet_radiance[o]) return false;
        j->faceted = true;
        j->facet_object = o;
        shd_pool_for(j->request->engine->pool, (facets->point_count + SHD_BLOCK - 1) / SHD_BLOCK,
                     shade_facet_block, j);
    }
    return true;
}

/* ---- A tile: cast, shade, filter. ---- */

/* Groups the samples that are shaded one by one by their material (a counting sort). */
static void group_by_material(const job *j, scratch *s) {
    const shd_scene *scene = j->plan->scene;
    memset(s->starts, 0, (scene->material_count + 1) * sizeof *s->starts);
    if (scene->material_count == 1 && !j->faceted) {
        uint32_t count = 0;
        for (size_t i = 0; i < s->seen.count; i++) {
            s->order[count] = (uint32_t)i; /* stays if it hit: no branch to mispredict */
            count += s->seen.object[i] != SHD_NOTHING;
        }
        s->starts[0] = count;
        return;
    }
    for (int pass = 0; pass < 2; pass++) {
        for (size_t i = 0; i < s->seen.count; i++) {
            int32_t object = s->seen.object[i];
            if (object == SHD_NOTHING || j->facet_radiance[object]) continue;
            size_t material = scene->objects[object].material;
            if (pass == 0)
                s->starts[material + 1]++;
            else
                s->order[s->starts[material]++] = (uint32_t)i;
        }
        if (pass == 1) break;
        for (size_t m = 1; m <= scene->material_count; m++) s->starts[m] += s->starts[m - 1];
    }
    /* The second pass moved each start to its group's end, the next one's start. */
}

/* Samples that follow each other are the usual case: then `order` need not be asked. */
static void gather(double out[3][SHD_BLOCK], double *const in[3], const uint32_t *order,
                   size_t count, bool run) {
    for (int c = 0; c < 3; c++) {
        if (run)
            memcpy(out[c], in[c] + order[0], count * sizeof **out);
        else
            for (size_t i = 0; i < count; i++) out[c][i] = in[c][order[i]];
        for (size_t i = count; i < SHD_BLOCK; i++) out[c][i] = out[c][count - 1];
    }
}

static void scatter(double *out, const double *in, const uint32_t *order, size_t count, bool run) {
    if (run)
        memcpy(out + order[0], in, count * sizeof *out);
    else
        for (size_t i = 0; i < count; i++) out[order[i]] = in[i];
}

static void shade_samples(const job *j, scratch *s) {
    const size_t planes = j->plan->plane_count, total = s->seen.count;
    group_by_material(j, s);
    size_t first = 0;
    for (size_t m = 0; m < j->plan->scene->material_count; m++) {
        for (size_t end = s->starts[m]; first < end;) {
            if (stopped(j)) return; /* ten thousand lights make a block long */
            const uint32_t *order = s->order + first;
            const size_t count = end - first < SHD_BLOCK ? end - first : SHD_BLOCK;
            const bool run = order[count - 1] - order[0] == count - 1;
            shd_points points; /* every lane is written: clearing 4.6 kB a block would show */
            points.count = count;
            gather(points.position, s->seen.position, order, count, run);
            gather(points.normal, s->seen.normal, order, count, run);
            gather(points.view, s->seen.view, order, count, run);
            shd_shade(s->shader, &j->plan->materials[m], &points, s->block);
            for (size_t p = 0; p < planes; p++)
                for (size_t c = 0; c < 3; c++)
                    scatter(s->radiance + (3 * p + c) * total, s->block[p][c], order, count, run);
            first += count;
        }
    }
}

static void interpolate_facets(const job *j, scratch *s) {
    const size_t values = 3 * j->plan->plane_count, total = s->seen.count;
    for (size_t i = 0; i < total; i++) {
        int32_t object = s->seen.object[i];
        if (object == SHD_NOTHING || !j->facet_radiance[object]) continue;
        const shd_facets *facets = shd_sight_facets(j->sight, (size_t)object);
        const uint32_t *corner = facets->corners + 3 * (size_t)s->seen.triangle[i];
        const double *radiance = j->facet_radiance[object];
        const double *a = radiance + values * corner[0], *b = radiance + values * corner[1],
                     *c = radiance + values * corner[2];
        double u = s->seen.u[i], v = s->seen.v[i];
        bool flat = corner[0] == corner[1] && corner[0] == corner[2];
        for (size_t k = 0; k < values; k++)
            s->radiance[k * total + i] = flat ? a[k] : (1 - u - v) * a[k] + u * b[k] + v * c[k];
    }
}

static void render_tile(void *context, size_t index, unsigned slot) {
    job *j = context;
    if (stopped(j)) return;
    scratch *s = get_scratch(j, slot);
    if (!s) return;
    const shd_raster *raster = &j->plan->scene->raster;
    int column = (int)(index % (size_t)j->tiles_across),
        row = (int)(index / (size_t)j->tiles_across);
    shd_tile tile = {column * j->tile_size, row * j->tile_size, j->tile_size, j->tile_size};
    if (tile.w > raster->w - tile.x) tile.w = raster->w - tile.x;
    if (tile.h > raster->h - tile.y) tile.h = raster->h - tile.y;
    tile.x += raster->x;
    tile.y += raster->y;

    double began = shd_thread_seconds();
    size_t hits = shd_sight_cast(j->sight, tile, s->cast, &s->seen);
    double cast = shd_thread_seconds();
    if (hits) {
        shade_samples(j, s);
        if (j->faceted) interpolate_facets(j, s);
    }
    s->saturated += shd_filter_tile(j->plan, &s->seen, s->radiance, tile, j->film);
    s->times.visibility += cast - began;
    s->times.shade += shd_thread_seconds() - cast;

    size_t done = atomic_fetch_add(&j->done, 1) + 1;
    if (slot == 0 && j->options && j->options->progress)
        j->options->progress(j->options->context, (double)done / (double)j->tile_count);
}

/* ---- The film. ---- */

static bool make_film(const shd_plan *plan, shd_arena *arena, shd_film *film) {
    size_t pixels = (size_t)film->width * (size_t)film->height;
    const bool *wants = plan->wants;
    film->rgba = shd_arena_alloc(arena, pixels, 4 * sizeof(float));
    film->planes = shd_arena_zalloc(arena, plan->plane_count, sizeof *film->planes);
    if (!film->rgba || !film->planes) return false;
    for (size_t p = 1; p < plan->plane_count; p++)
        if (!(film->planes[p] = shd_arena_alloc(arena, pixels, 3 * sizeof(float)))) return false;
    struct {
        bool wanted;
        float **at;
        size_t channels;
    } data[] = {{wants[SHD_LAYER_NORMAL], &film->normal, 3},
                {wants[SHD_LAYER_POSITION], &film->position, 3},
                {wants[SHD_LAYER_DEPTH], &film->depth, 1},
                {wants[SHD_LAYER_OBJECT], &film->object, 1}};
    for (size_t i = 0; i < sizeof data / sizeof data[0]; i++) {
        *data[i].at = data[i].wanted
                          ? shd_arena_alloc(arena, pixels, data[i].channels * sizeof(float))
                          : NULL;
        if (data[i].wanted && !*data[i].at) return false;
    }
    return true;
}

/* Samples of a tile: fewer where there are many objects, so that a tile of ten thousand tori is
 * done, and a cancelled picture ended, within seconds. */
static int tile_samples(size_t objects) {
    enum { FEWEST = 256, MANY_OBJECTS = 256 };
    size_t samples = objects > MANY_OBJECTS ? (size_t)SHD_TILE_SAMPLES * MANY_OBJECTS / objects
                                            : SHD_TILE_SAMPLES;
    return samples < FEWEST ? FEWEST : (int)samples;
}

shd_status shd_film_render(shd_request *request, const shd_sight *sight,
                           const shd_render_options *options, shd_film *film, shd_error *error) {
    const shd_plan *plan = request->plan;
    const shd_raster *raster = &plan->scene->raster;
    shd_arena *arena = request->arena;
    unsigned slots = shd_pool_slots(request->engine->pool);
    *film = (shd_film){.width = raster->w, .height = raster->h};

    job j = {.request = request,
             .plan = plan,
             .sight = sight,
             .options = options,
             .film = film,
             .tile_size = 1};
    const int most = tile_samples(plan->scene->object_count);
    while ((j.tile_size + 1) * (j.tile_size + 1) * raster->samples <= most) j.tile_size++;
    j.tiles_across = (raster->w + j.tile_size - 1) / j.tile_size;
    j.tile_count = (size_t)j.tiles_across * (size_t)((raster->h + j.tile_size - 1) / j.tile_size);
    j.slots = shd_arena_zalloc(arena, slots, sizeof *j.slots);
    j.facet_radiance = shd_arena_zalloc(arena, plan->scene->object_count, sizeof *j.facet_radiance);
    pthread_mutex_init(&j.mutex, NULL);
    if (!j.slots || !j.facet_radiance || !make_film(plan, arena, film) || !shade_facets(&j))
        atomic_store(&j.failed, true);
    else
        shd_pool_for(request->engine->pool, j.tile_count, render_tile, &j);
    pthread_mutex_destroy(&j.mutex);

    for (unsigned i = 0; j.slots && i < slots; i++) {
        if (!j.slots[i]) continue;
        request->times.visibility += j.slots[i]->times.visibility;
        request->times.shade += j.slots[i]->times.shade;
        request->saturated += j.slots[i]->saturated;
    }
    if (atomic_load(&j.failed))
        return shd_fail(error, SHD_MEMORY, "/image",
                        "the limit `memory` (%llu bytes) is reached by this picture",
                        (unsigned long long)request->engine->limits.memory);
    if (atomic_load(&request->cancelled))
        return shd_fail(error, SHD_CANCELLED, "", "the render was cancelled");
    return SHD_OK;
}
