#include "render/tiles/film.h"

#include <assert.h>
#include <float.h>
#include <string.h>

#include "bound/shown/shown.h"
#include "render/tiles/facets.h"
#include "render/tiles/radiance.h"
#include "render/tiles/sky.h"
#include "render/tiles/traced.h"
#include "shade/sketch.h"

/* One thread's working memory. */
typedef struct film_scratch {
    shd_tile_scratch *tile;
    shd_paint_term *terms;
    size_t *term_of;
    float *mixed[3];                               /* radiance of a run */
    _Alignas(64) float pixels[3][SHD_TILE_PIXELS]; /* of a plane */
    _Alignas(64) float cover[SHD_TILE_PIXELS];
    shd_stopwatch watch;
    uint64_t saturated, clipped;
} film_scratch;

/* What all threads share. */
typedef struct film_job {
    const shd_rendering *rendering;
    shd_scenery scenery;
    const shd_render_options *options;
    shd_film *film;
    uint8_t background[16 * SHD_TILE]; /* samples of a row through which nothing is seen */
    uint64_t background_clipped;       /* of a pixel's samples */
    shd_pixel_bound bound;             /* if the film has a layer of it */
    pthread_mutex_t mutex;             /* guards the arena while threads run */
    film_scratch **slots;
    atomic_bool failed; /* memory ran out */
    atomic_size_t done; /* tiles */
} film_job;

uint64_t shd_saturate(float *values, size_t count, float least, float largest) {
    /* Almost always there is nothing to do. A loop without branches finds that out quickly. */
    unsigned outside = 0;
    for (size_t i = 0; i < count; i++) {
        unsigned low = values[i] >= least ? 0 : 1, high = values[i] <= largest ? 0 : 1;
        outside |= low | high;
    }
    if (!outside) return 0;
    uint64_t changed = 0;
    for (size_t i = 0; i < count; i++) {
        float v = values[i];
        if (v >= least && v <= largest) continue;
        values[i] = v > largest ? largest : v < least ? least : 0;
        changed++;
    }
    return changed;
}

/* NULL if it is only counted, or the arena is full. `looks`: tiles are cast and lit. */
static film_scratch *lay_out_scratch(const shd_plan *plan, bool looks, shd_scratch *memory) {
    const size_t terms = plan->max_terms;
    film_scratch counted, *made = shd_scratch_take(memory, 1, sizeof *made),
                          *s = made ? made : &counted;
    *s = (film_scratch){.tile = looks ? shd_tile_scratch_lay_out(plan, memory) : NULL};
    s->terms = shd_scratch_take(memory, terms, sizeof *s->terms);
    s->term_of = shd_scratch_take(memory, terms, sizeof *s->term_of);
    for (int c = 0; c < 3; c++)
        s->mixed[c] = shd_scratch_take(memory, SHD_CHUNK, sizeof *s->mixed[c]);
    return made;
}

uint64_t shd_film_scratch_size(const shd_plan *plan) {
    shd_scratch counted = {.arena = NULL};
    lay_out_scratch(plan, true, &counted);
    return counted.bytes;
}

/* The scratch of a slot, made when the slot first works. NULL: the arena is full. */
static film_scratch *get_scratch(film_job *j, unsigned slot) {
    film_scratch *s = j->slots[slot];
    if (!s) {
        pthread_mutex_lock(&j->mutex);
        shd_scratch memory = {.arena = j->rendering->arena};
        s = lay_out_scratch(j->scenery.plan, j->scenery.sight, &memory);
        pthread_mutex_unlock(&j->mutex);
        assert(memory.full || memory.bytes <= shd_film_scratch_size(j->scenery.plan));
        j->slots[slot] = s = memory.full ? NULL : s;
    }
    if (!s) atomic_store(&j->failed, true);
    return s;
}

static bool is_stopped(const film_job *j) {
    return atomic_load(&j->failed) || shd_is_cancelled(j->rendering->cancelled);
}

/* ---- From fragments to the pixels of a tile. ---- */

/* Adds a run's radiance to a plane: straight into its pixels if they follow each other. */
static void paint_run(const film_job *j, film_scratch *s, const shd_fragments *f, shd_run run,
                      size_t plane, bool whole) {
    const shd_plan *plan = j->scenery.plan;
    float constant[3] = {0, 0, 0}, *const pixels[3] = {s->pixels[0], s->pixels[1], s->pixels[2]};
    size_t terms = 1, sums_plane = plane;
    if (run.group == SHD_RADIANCE) {
        s->terms[0] = (shd_paint_term){.color = {1, 1, 1}};
        s->term_of[0] = 0;
    } else {
        terms = shd_plane_terms(plan, &plan->materials[plan->groups[run.group].material], plane,
                                constant, s->terms, s->term_of);
        if (plan->planes[plane].kind != SHD_LAYER_LIGHT) sums_plane = 0;
    }
    const bool grey = shd_channels_of(plan, run.group) == 1;
    for (uint32_t done = 0; done < run.count; done += SHD_CHUNK) {
        const size_t at = run.first + done,
                     count = run.count - done < SHD_CHUNK ? run.count - done : SHD_CHUNK;
        const uint16_t *cell = f->cell + at;
        for (size_t k = 0; k < terms; k++)
            for (int c = 0; c < 3; c++)
                s->terms[k].sums[c] =
                    f->sums[shd_sum_of(plan, sums_plane, s->term_of[k], grey ? 0 : c)] + at;
        const float *coverage = f->coverage ? f->coverage + at : NULL;
        const bool straight = whole && shd_is_span(cell, count);
        float *out[3];
        for (int c = 0; c < 3; c++) out[c] = straight ? pixels[c] + cell[0] : s->mixed[c];
        j->scenery.paint->mix(constant, coverage, s->terms, terms, count, out);
        if (whole && !straight)
            j->scenery.paint->scatter((const float *const *)s->mixed, cell, count, pixels);
        for (int c = 0; c < 3 && !whole; c++) {
            float *restrict to = pixels[c];
            const float *restrict mixed = s->mixed[c];
            for (size_t i = 0; i < count; i++) to[cell[i]] += mixed[i];
        }
    }
}

/* Lays the beauty, which is multiplied by its coverage, over a background that is seen through, and
 * makes alpha of the coverage. A pixel that sees nothing else has the background's color to the
 * bit, in whichever tile it lies. */
static void lay_over(film_scratch *s, const shd_scene *scene) {
    const float alpha = (float)scene->background_alpha;
    for (size_t i = 0; i < SHD_TILE_PIXELS; i++) {
        const float share = s->cover[i], rest = (1 - share) * alpha, whole = share + rest;
        for (int c = 0; c < 3; c++) {
            const float background = (float)scene->background[c];
            s->pixels[c][i] =
                share > 0 ? (s->pixels[c][i] + rest * background) / whole : background;
        }
        s->cover[i] = share > 0 ? whole : alpha;
    }
}

/* Makes a plane's pixels from all runs. The beauty is laid over its background. */
static void paint_plane(const film_job *j, film_scratch *s, const shd_fragments *f, shd_tile tile,
                        size_t plane) {
    const shd_plan *plan = j->scenery.plan;
    const shd_scene *scene = plan->scene;
    const bool whole = !f->coverage, over = plane == 0 && !scene->transparent;
    const bool hidden = whole && f->count == SHD_TILE_PIXELS; /* nothing shows through */
    for (int c = 0; c < 3 && !hidden; c++)
        j->scenery.paint->fill(s->pixels[c], SHD_TILE_PIXELS,
                               whole && over ? (float)scene->background[c] : 0);
    for (size_t r = 0; r < f->run_count; r++) paint_run(j, s, f, f->runs[r], plane, whole);
    if (plane == 0 && scene->transparent && scene->background_alpha > 0) {
        lay_over(s, scene);
        return;
    }
    if (over && scene->backdrop && !hidden) shd_sky_add(scene, tile, s->cover, s->pixels);
    if (whole) return;
    for (int c = 0; c < 3; c++) {
        if (over && scene->background[c] != 0)
            j->scenery.paint->fill_rest(s->pixels[c], s->cover, (float)scene->background[c],
                                        SHD_TILE_PIXELS);
        if (plane == 0 && scene->transparent)
            j->scenery.paint->divide(s->pixels[c], s->cover, SHD_TILE_PIXELS);
    }
}

enum { ALL_SKETCHED = (1 << SHD_BLOCKS) - 1 };

/* Whether all of a tile's pixels are. */
static bool is_all_sketched(const shd_tile_scratch *t) {
    return t && t->sketched == ALL_SKETCHED;
}

/* Copies the blocks that are drawn over the beauty. */
static void lay_sketch(const shd_tile_scratch *t, bool transparent, film_scratch *s) {
    enum { SIDE = SHD_SKETCH_SIDE, ACROSS = SHD_TILE / SIDE };
    if (!transparent && is_all_sketched(t)) {
        for (int c = 0; c < 3; c++) memcpy(s->pixels[c], t->sketch[c], sizeof s->pixels[c]);
        return;
    }
    for (uint32_t left = t->sketched; left; left &= left - 1) {
        const size_t block = (size_t)__builtin_ctz(left);
        size_t at = (block / ACROSS * SHD_TILE + block % ACROSS) * SIDE;
        for (size_t y = 0; y < SIDE; y++, at += SHD_TILE) {
            for (int c = 0; c < 3; c++)
                memcpy(s->pixels[c] + at, t->sketch[c] + at, SIDE * sizeof(float));
            for (size_t x = 0; transparent && x < SIDE; x++) s->cover[at + x] = 1;
        }
    }
}

/* ---- From pixels to the film. ---- */

/* The index of a pixel of the raster in its tile's planes. */
static size_t place_in_scratch(int x, int y) {
    return (size_t)(y % SHD_TILE) * SHD_TILE + (size_t)(x % SHD_TILE);
}

/* The same in the film. */
static size_t place_in_film(const film_job *j, int x, int y) {
    const shd_raster *raster = &j->scenery.plan->scene->raster;
    return (size_t)(y - raster->y) * (size_t)raster->w + (size_t)(x - raster->x);
}

/* `channels`: 3, or 4 with alpha. */
static inline void store_floats(const film_job *j, film_scratch *s, shd_tile tile, float *to,
                                size_t channels) {
    const bool transparent = j->scenery.plan->scene->transparent;
    for (int y = tile.y; y < tile.y + tile.h; y++) {
        const size_t from = place_in_scratch(tile.x, y);
        float *out = to + channels * place_in_film(j, tile.x, y);
        for (size_t x = 0; x < (size_t)tile.w; x++) {
            for (size_t c = 0; c < 3; c++) out[channels * x + c] = s->pixels[c][from + x];
            if (channels == 4) out[4 * x + 3] = transparent ? s->cover[from + x] : 1;
        }
        s->saturated += shd_saturate(out, channels * (size_t)tile.w, -FLT_MAX, FLT_MAX);
    }
}

/* Rounded up: a bound that is told holds. */
static float bound_of(const film_job *j, const film_scratch *s, size_t cell) {
    const double rgb[3] = {(double)s->pixels[0][cell], (double)s->pixels[1][cell],
                           (double)s->pixels[2][cell]};
    double bound = shd_pixel_bound_at(&j->bound, rgb);
    const double seen = shd_traced_seen(j->scenery.traced); /* 0: no rays are followed */
    if (seen > 0 && s->tile && s->tile->stray)
        bound = shd_smaller(bound, seen + (double)s->tile->stray[cell]);
    const float told = (float)bound;
    return (double)told < bound ? nextafterf(told, INFINITY) : told;
}

/* The beauty is in s->pixels. */
static void store_bounds(const film_job *j, const film_scratch *s, const shd_fragments *f,
                         shd_tile tile) {
    bool hit[SHD_TILE_PIXELS] = {false};
    for (size_t i = 0; i < f->count; i++) hit[f->cell[i]] = true;
    const float nothing = nextafterf((float)j->bound.background, INFINITY);
    for (int y = tile.y; y < tile.y + tile.h; y++)
        for (int x = tile.x; x < tile.x + tile.w; x++) {
            const size_t cell = place_in_scratch(x, y);
            float *out = &j->film->bound[place_in_film(j, x, y)];
            *out = hit[cell] ? bound_of(j, s, cell) : j->bound.background > 0 ? nothing : 0;
        }
}

static unsigned char *samples_of(const film_job *j, shd_tile tile) {
    const shd_film *film = j->film;
    const size_t size = (size_t)film->layout.count * film->layout.bytes;
    return film->samples + size * place_in_film(j, tile.x, tile.y);
}

static void store_background(const film_job *j, film_scratch *s, shd_tile tile) {
    const shd_film *film = j->film;
    const size_t size = (size_t)film->layout.count * film->layout.bytes, width = (size_t)tile.w;
    unsigned char *out = samples_of(j, tile);
    for (int y = 0; y < tile.h; y++, out += size * (size_t)film->width)
        memcpy(out, j->background, size * width);
    s->clipped += j->background_clipped * width * (size_t)tile.h;
}

/* Of the tile's planes, which may be changed. */
static void store_codes(const film_job *j, film_scratch *s, shd_tile tile, float *const planes[3]) {
    const shd_film *film = j->film;
    const size_t width = (size_t)tile.w;
    const size_t first = place_in_scratch(tile.x, tile.y);
    size_t count = (size_t)tile.h * SHD_TILE;
    float *const pixels[3] = {planes[0] + first, planes[1] + first, planes[2] + first};
    if (width < SHD_TILE) { /* at the region's edges: makes the rows follow each other */
        for (int c = 0; c < 3; c++)
            for (size_t y = 1; y < (size_t)tile.h; y++)
                memmove(pixels[c] + y * width, pixels[c] + y * SHD_TILE, width * sizeof(float));
        count = width * (size_t)tile.h;
    }
    const shd_encoded counts = shd_color_encode_planes(
        film->codes, j->scenery.plan->isa, (const float *const *)pixels, NULL, count,
        film->layout.source, film->layout.count, width, (size_t)film->width, samples_of(j, tile));
    s->saturated += counts.beyond;
    s->clipped += counts.clipped;
}

/* The part of the region's tile `index` that lies in a rectangle. */
static shd_tile tile_within(const shd_raster *raster, size_t index, shd_tile bounds) {
    const size_t across = shd_tiles_across(raster);
    const int x = (raster->x / SHD_TILE + (int)(index % across)) * SHD_TILE,
              y = (raster->y / SHD_TILE + (int)(index / across)) * SHD_TILE;
    const int x0 = x > bounds.x ? x : bounds.x, y0 = y > bounds.y ? y : bounds.y;
    const int right = bounds.x + bounds.w, bottom = bounds.y + bounds.h;
    const int x1 = x + SHD_TILE < right ? x + SHD_TILE : right,
              y1 = y + SHD_TILE < bottom ? y + SHD_TILE : bottom;
    return (shd_tile){x0, y0, x1 - x0, y1 - y0};
}

static const shd_fragments *find_fragments(const film_job *j, film_scratch *s, size_t index,
                                           shd_tile tile) {
    const shd_recall *recall = &j->scenery.recall;
    if (recall->light) return shd_record_get(recall->light, index);
    const shd_plan *plan = j->scenery.plan;
    const shd_raster *raster = &plan->scene->raster;
    /* Which lights are left out within a tolerance depends on all that the whole tile shows. */
    if (plan->drop_tolerance > 0)
        tile = tile_within(raster, index, (shd_tile){0, 0, raster->width, raster->height});
    const shd_fragments *f = shd_tile_look(&j->scenery, index, tile, s->tile, j->film, &s->watch);
    if (recall->keep_light) {
        shd_keep_fragments(recall->keep_light, index, plan, f);
        shd_begin(&s->watch); /* keeping is no part of shading */
    }
    return f;
}

static void render_tile(void *context, size_t index, unsigned slot) {
    film_job *j = context;
    if (is_stopped(j)) return;
    film_scratch *s = get_scratch(j, slot);
    if (!s) return;
    const shd_raster *raster = &j->scenery.plan->scene->raster;
    const shd_tile tile =
        tile_within(raster, index, (shd_tile){raster->x, raster->y, raster->w, raster->h});
    shd_stopwatch *watch = &s->watch;
    shd_begin(watch);
    const shd_fragments *f = find_fragments(j, s, index, tile);

    const shd_scene *scene = j->scenery.plan->scene;
    const uint32_t sketched = s->tile ? s->tile->sketched : 0;
    if (j->film->codes && !f->count && !scene->backdrop && !sketched) {
        store_background(j, s, tile);
    } else {
        const bool all = sketched && is_all_sketched(s->tile),
                   straight = all && j->film->codes && !j->film->bound && !scene->transparent;
        float *const painted[3] = {s->pixels[0], s->pixels[1], s->pixels[2]};
        if (f->coverage || scene->transparent || scene->backdrop) {
            memset(s->cover, 0, sizeof s->cover);
            for (size_t i = 0; i < f->count; i++)
                s->cover[f->cell[i]] += f->coverage ? f->coverage[i] : 1;
        }
        for (size_t p = 0; p < j->scenery.plan->plane_count && !is_stopped(j); p++) {
            if (!all) paint_plane(j, s, f, tile, p);
            if (sketched && !straight) lay_sketch(s->tile, scene->transparent, s);
            if (p)
                store_floats(j, s, tile, j->film->planes[p], 3);
            else if (j->film->rgba)
                store_floats(j, s, tile, j->film->rgba, 4);
            if (!p && j->film->bound) store_bounds(j, s, f, tile);
        }
        shd_end(watch, &watch->times.shade);
        if (j->film->codes) store_codes(j, s, tile, straight ? s->tile->sketch : painted);
    }
    shd_end(watch, &watch->times.color);
    atomic_fetch_add(&j->rendering->engine->tiles[is_stopped(j) ? 1 : 0], 1);

    if (!j->options || !j->options->progress) return; /* counting waits until the tile is stored */
    const double done = (double)(atomic_fetch_add(&j->done, 1) + 1);
    if (slot == 0) j->options->progress(j->options->context, done / (double)shd_tile_count(raster));
}

/* ---- The film. ---- */

/* film->planes has room for the planes, or is NULL. */
static void lay_out_film(size_t pixels, size_t plane_count, const bool *wants, shd_scratch *memory,
                         shd_film *film) {
    if (!film->codes) film->rgba = shd_scratch_take(memory, pixels, 4 * sizeof(float));
    for (size_t p = 1; p < plane_count; p++) {
        float *plane = shd_scratch_take(memory, pixels, 3 * sizeof(float));
        if (film->planes) film->planes[p] = plane;
    }
    if (wants[SHD_LAYER_NORMAL]) film->normal = shd_scratch_take(memory, pixels, 3 * sizeof(float));
    if (wants[SHD_LAYER_POSITION])
        film->position = shd_scratch_take(memory, pixels, 3 * sizeof(float));
    if (wants[SHD_LAYER_DEPTH]) film->depth = shd_scratch_take(memory, pixels, sizeof(float));
    if (wants[SHD_LAYER_BOUND]) film->bound = shd_scratch_take(memory, pixels, sizeof(float));
    if (wants[SHD_LAYER_OBJECT]) film->object = shd_scratch_take(memory, pixels, sizeof(float));
}

uint64_t shd_film_size(const shd_raster *raster, size_t plane_count,
                       const bool wants[SHD_LAYER_KINDS]) {
    shd_scratch counted = {.arena = NULL};
    shd_film film = {.planes = NULL};
    lay_out_film((size_t)raster->w * (size_t)raster->h, plane_count, wants, &counted, &film);
    return counted.bytes;
}

/* Data layers begin with the values of pixels that hit nothing. False: the arena is full. */
static bool make_film(film_job *j) {
    const shd_plan *plan = j->scenery.plan;
    const shd_paint_kernel *paint = j->scenery.paint;
    shd_film *film = j->film;
    const size_t pixels = (size_t)film->width * (size_t)film->height;
    shd_scratch memory = {.arena = j->rendering->arena};
    film->planes = shd_arena_zalloc(memory.arena, plan->plane_count, sizeof *film->planes);
    if (!film->planes) return false;
    lay_out_film(pixels, plan->plane_count, plan->wants, &memory, film);
    if (memory.full) return false;
    if (film->normal) paint->fill(film->normal, 3 * pixels, 0);
    if (film->position) paint->fill(film->position, 3 * pixels, 0);
    if (film->depth) paint->fill(film->depth, pixels, INFINITY);
    if (film->object) paint->fill(film->object, pixels, -1);
    if (film->bound && !shd_pixel_bound_make(plan, memory.arena, &j->bound)) return false;
    j->scenery.data = film->normal || film->position || film->depth || film->object;
    return true;
}

static void find_background(film_job *j) {
    const shd_film *film = j->film;
    if (!film->codes) return;
    float rgb[3][SHD_TILE];
    for (int c = 0; c < 3; c++)
        for (int x = 0; x < SHD_TILE; x++) rgb[c][x] = (float)j->scenery.plan->scene->background[c];
    const shd_encoded counts = shd_color_encode_planes(
        film->codes, j->scenery.plan->isa, (const float *const[3]){rgb[0], rgb[1], rgb[2]}, NULL,
        SHD_TILE, film->layout.source, film->layout.count, SHD_TILE, SHD_TILE, j->background);
    j->background_clipped = counts.clipped / SHD_TILE;
}

static void add_traced(shd_rendering *r, const shd_scenery *scenery, const shd_tile_scratch *s) {
    if (!s) return;
    r->rays += s->rays;
    r->cut = shd_larger(s->cut, r->cut);
    if (s->rays) r->ray_error = shd_larger(r->ray_error, shd_traced_seen(scenery->traced) + s->off);
}

shd_status shd_film_render(shd_rendering *r, const shd_sight *sight, const shd_recall *recall,
                           const shd_render_options *options, shd_film *film, shd_error *error) {
    static const shd_paint_kernel *const kernels[SHD_ISA_COUNT] = SHD_VARIANTS(shd_paint_kernel);
    const shd_plan *plan = r->plan;
    const shd_raster *raster = &plan->scene->raster;
    const unsigned slots = shd_pool_slots(r->engine->pool);
    film->width = raster->w;
    film->height = raster->h;

    film_job j = {.rendering = r,
                  .scenery = {.plan = plan, .sight = sight, .paint = kernels[plan->isa]},
                  .options = options,
                  .film = film,
                  .slots = shd_arena_zalloc(r->arena, slots, sizeof *j.slots)};
    if (recall) j.scenery.recall = *recall;
    assert(sight || j.scenery.recall.light);
    const bool ready = shd_traced_make(plan, sight, r->arena, &j.scenery);
    const shd_shadows *shadows = shd_traced_shadows(j.scenery.traced);
    j.scenery.lighting = shd_lighting_new(plan, shadows, r->arena);
    pthread_mutex_init(&j.mutex, NULL);
    if (!ready || !j.slots || !j.scenery.lighting || !make_film(&j) ||
        (sight && !shd_facets_light(r, &j.scenery))) {
        atomic_store(&j.failed, true);
    } else {
        find_background(&j);
        shd_pool_for(r->engine->pool, shd_tile_count(raster), render_tile, &j);
    }
    pthread_mutex_destroy(&j.mutex);

    for (unsigned i = 0; j.slots && i < slots; i++) {
        if (!j.slots[i]) continue;
        shd_times_add(&r->times, &j.slots[i]->watch.times);
        r->saturated += j.slots[i]->saturated;
        r->clipped += j.slots[i]->clipped;
        add_traced(r, &j.scenery, j.slots[i]->tile);
    }
    /* A cancellation ends what is made here before tiles, too. */
    if (shd_is_cancelled(r->cancelled)) return shd_rendering_cancelled(error);
    return atomic_load(&j.failed) ? shd_rendering_full(r, "picture", error) : SHD_OK;
}
