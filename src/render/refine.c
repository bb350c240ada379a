#include "render/refine.h"

#include <math.h>
#include <string.h>

#include "render/tile_scratch.h"

struct shd_refining {
    const shd_refine_kernel *kernel;
    float weights[9]; /* of the nine centres, for the pattern's mean */
    int32_t *object;  /* [SHD_GRID_CELLS], as are these: */
    float *place[3], *normal[3], *mirror[3];
    float **sums; /* [term][channel] */
    size_t sum_count;
    const float **used; /* those of them that the tile's runs have, */
    float *absolute;    /* and what second differences of each may be */
    int used_count;
    float *memory;
    size_t memory_size;
    int32_t settled[SHD_TILE_PIXELS]; /* a row's verdicts at its first pixel */
};

/* The mean over the pattern of the Lagrange polynomials of -1, 0 and 1, in both directions. */
static void find_weights(int samples, float weights[9]) {
    double sum[9] = {0};
    for (int i = 0; i < samples; i++) {
        double x, y;
        shd_sample_offset(i, samples, &x, &y);
        x -= 0.5;
        y -= 0.5;
        const double across[3] = {x * (x - 1) / 2, 1 - x * x, x * (x + 1) / 2},
                     down[3] = {y * (y - 1) / 2, 1 - y * y, y * (y + 1) / 2};
        for (int k = 0; k < 9; k++) sum[k] += across[k % 3] * down[k / 3];
    }
    for (int k = 0; k < 9; k++) weights[k] = (float)(sum[k] / samples);
}

uint64_t shd_refining_size(const shd_plan *plan) {
    const uint64_t sums = shd_sum_of(plan, 1, 0, 0);
    return sizeof(shd_refining) + (10 + sums) * SHD_GRID_CELLS * sizeof(float) +
           sums * (2 * sizeof(float *) + sizeof(float)) + (uint64_t)5 * 64;
}

shd_refining *shd_refining_new(const shd_plan *plan, shd_arena *arena) {
    static const shd_refine_kernel *const kernels[SHD_ISA_COUNT] = SHD_VARIANTS(shd_refine_kernel);
    shd_refining *r = shd_arena_zalloc(arena, 1, sizeof *r);
    if (!r) return NULL;
    r->kernel = kernels[plan->isa];
    find_weights(plan->scene->raster.samples, r->weights);
    r->sum_count = shd_sum_of(plan, 1, 0, 0);
    r->memory_size = (9 + r->sum_count) * SHD_GRID_CELLS;
    r->memory = shd_arena_alloc(arena, r->memory_size, sizeof *r->memory);
    r->object = shd_arena_alloc(arena, SHD_GRID_CELLS, sizeof *r->object);
    r->sums = shd_arena_alloc(arena, r->sum_count, sizeof *r->sums);
    r->absolute = shd_arena_alloc(arena, r->sum_count, sizeof *r->absolute);
    r->used = shd_arena_alloc(arena, r->sum_count, sizeof *r->used);
    if (!r->memory || !r->object || !r->sums || !r->absolute || !r->used) return NULL;
    float *next = r->memory;
    for (int c = 0; c < 3; c++, next += SHD_GRID_CELLS) r->place[c] = next;
    for (int c = 0; c < 3; c++, next += SHD_GRID_CELLS) r->normal[c] = next;
    for (int c = 0; c < 3; c++, next += SHD_GRID_CELLS) r->mirror[c] = next;
    for (size_t k = 0; k < r->sum_count; k++, next += SHD_GRID_CELLS) r->sums[k] = next;
    return r;
}

/* Rays through the centres of the tile's pixels and of those around them, where there may be
 * something to see. */
static size_t make_shots(shd_tile tile, shd_tile_scratch *s) {
    const int left = tile.x / SHD_TILE * SHD_TILE - 1, top = tile.y / SHD_TILE * SHD_TILE - 1;
    const int right = tile.x + tile.w + 1;
    size_t shots = 0;
    for (int y = tile.y - 1; y <= tile.y + tile.h; y++)
        for (int x = tile.x - 1, end; x < right; x = end) {
            end = shd_tile_block_end(s, x, right);
            if (!shd_tile_block(s, x, y)->count) continue;
            const int cell = (y - top) * SHD_GRID + (x - left), count = end - x;
            for (int i = 0; i < count; i++) {
                s->x[shots + (size_t)i] = x + i;
                s->y[shots + (size_t)i] = y;
                s->shot_cell[shots + (size_t)i] = (uint16_t)(cell + i);
            }
            shots += (size_t)count;
        }
    return shots;
}

/* Where stretches of hits of neighboring cells begin; their end is added. Returns their number. */
static size_t find_stretches(const uint16_t *cell, size_t count, uint32_t *first) {
    size_t stretches = 0;
    for (size_t i = 0; i < count; i++)
        if (i == 0 || cell[i] != cell[i - 1] + 1) first[stretches++] = (uint32_t)i;
    first[stretches] = (uint32_t)count;
    return stretches;
}

/* Copies a value (of float or int32_t) of each hit to its cell. */
static void spread(const void *values, const uint16_t *cell, const uint32_t *first,
                   size_t stretches, void *grid) {
    const size_t size = sizeof(float);
    for (size_t k = 0; k < stretches; k++)
        memcpy((char *)grid + size * cell[first[k]], (const char *)values + size * first[k],
               size * (first[k + 1] - first[k]));
}

static void fill_grid(const shd_scenery *scenery, const shd_tile_scratch *s, const shd_hits *hits,
                      shd_refining *r) {
    const shd_plan *plan = scenery->plan;
    for (size_t i = 0; i < SHD_GRID_CELLS; i++) r->object[i] = SHD_NOTHING;
    if (hits->count < SHD_GRID * SHD_GRID || s->run_count > 1)
        memset(r->memory, 0, r->memory_size * sizeof *r->memory);
    for (size_t k = 0; k < s->run_count; k++) {
        const shd_run run = s->runs[k];
        if (run.group == SHD_RADIANCE) continue; /* their light bends at every edge */
        const uint16_t *cell = s->cell + run.first;
        const size_t stretches = find_stretches(cell, run.count, s->first);
        spread(hits->object + run.first, cell, s->first, stretches, r->object);
        for (int c = 0; c < 3; c++) {
            spread(hits->position32[c] + run.first, cell, s->first, stretches, r->place[c]);
            spread(hits->normal32[c] + run.first, cell, s->first, stretches, r->normal[c]);
            spread(hits->mirror32[c] + run.first, cell, s->first, stretches, r->mirror[c]);
        }
        for (size_t t = 0; t < shd_terms_of(plan, run.group); t++)
            for (int c = 0; c < shd_channels_of(plan, run.group); c++) {
                const size_t sum = shd_sum_of(plan, 0, t, c);
                spread(s->sums[sum] + run.first, cell, s->first, stretches, r->sums[sum]);
            }
    }
}

/* How fine light may be: from the distance of the closest lights to the tile's surfaces. */
static void find_details(const shd_plan *plan, const shd_paint_kernel *paint, const shd_hits *hits,
                         shd_centres *out) {
    float least[3], most[3], sum[3];
    paint->bound((const float *const *)hits->position32, (const float *const *)hits->normal32,
                 hits->count, least, most, sum);
    double low[3], high[3];
    for (int c = 0; c < 3; c++) {
        low[c] = (double)least[c];
        high[c] = (double)most[c];
    }
    double reach = 0, footprint = 0;
    for (size_t j = 0; j < plan->light_count; j++) {
        const shd_plan_light *light = &plan->lights[j];
        if (light->directional) continue;
        const shd_vec3 at = shd_scale(shd_sub(light->position, plan->origin), plan->scale);
        const double xyz[3] = {at.x, at.y, at.z};
        double square = 0;
        for (int c = 0; c < 3; c++) {
            double d = fmax(fmax(low[c] - xyz[c], xyz[c] - high[c]), 0);
            square += d * d;
        }
        const double inverse = 1 / sqrt(square);
        double detail = 4;
        if (light->spot) {
            /* outer = 1 - cos(angle) */
            const double sine = sqrt(fmax(light->outer * (2 - light->outer), 0));
            if (light->outer < 1) detail = fmax(detail, 3 / sine);
            detail = fmax(detail, sqrt(light->exponent));
        }
        reach = fmax(reach, inverse);
        footprint = fmax(footprint, detail * inverse);
    }
    out->reach = (float)reach;
    out->footprint = (float)footprint;
}

/* A sum's share of the tolerance, as for the largest coefficient that has as many binary digits
 * before its point: verdicts stay while a color changes a little, so that sums can be kept. */
float shd_refine_coefficient(const double color[3]) {
    double largest = fmax(fabs(color[0]), fmax(fabs(color[1]), fabs(color[2])));
    return largest > 0 ? (float)ldexp(1, ilogb(largest) + 1) : 1;
}

/* What second differences of each sum may be: an error is at most half of them, and the terms
 * share the tolerance. */
static void find_limits(const shd_plan *plan, const shd_tile_scratch *s, shd_centres *out) {
    shd_refining *r = s->refining;
    float shininess = 0;
    r->used_count = 0;
    for (size_t t = 0; t < 1 + plan->max_lobes; t++) {
        float absolute = INFINITY;
        for (size_t i = 0; i < s->run_count; i++) {
            if (s->runs[i].group == SHD_RADIANCE) continue;
            const shd_plan_material *material =
                &plan->materials[plan->groups[s->runs[i].group].material];
            if (t > material->lobe_count || (t == 0 && !material->has_diffuse)) continue;
            const float most =
                shd_refine_coefficient(t ? material->lobes[t - 1].specular : material->diffuse);
            absolute = fminf(absolute, 2 * (float)plan->sampling_absolute /
                                           (most * (float)(1 + material->lobe_count)));
            if (t) shininess = fmaxf(shininess, (float)material->lobes[t - 1].shininess);
        }
        if (absolute == INFINITY) continue;
        for (int c = 0; c < (plan->grey_lights ? 1 : 3); c++) {
            r->used[r->used_count] = r->sums[shd_sum_of(plan, 0, t, c)];
            r->absolute[r->used_count++] = absolute;
        }
    }
    out->sums = r->used;
    out->absolute = r->absolute;
    out->relative = 2 * (float)plan->sampling_relative;
    out->sum_count = r->used_count;
    out->shininess = shininess;
}

/* Verdicts, row by row; an object that is not alone in its block settles nothing there. */
static void judge_tile(shd_tile tile, shd_tile_scratch *s, const shd_centres *centres) {
    shd_refining *r = s->refining;
    for (int y = tile.y; y < tile.y + tile.h; y++) {
        const int gx = tile.x % SHD_TILE + 1, gy = y % SHD_TILE + 1;
        const int first = gy * SHD_GRID + gx;
        int32_t *settled = r->settled + (gy - 1) * SHD_TILE + gx - 1;
        r->kernel->judge(centres, first, tile.w, settled);
        for (int i = 0, end; i < tile.w; i = end) {
            end = shd_tile_block_end(s, tile.x + i, tile.x + tile.w) - tile.x;
            const int32_t convex = shd_tile_block(s, tile.x + i, y)->convex;
            for (int k = i; k < end; k++) settled[k] &= convex == r->object[first + k];
        }
    }
}

/* The settled pixels of a run become fragments. */
static void add_settled(const shd_scenery *scenery, shd_tile tile, shd_tile_scratch *s,
                        shd_run run) {
    const shd_plan *plan = scenery->plan;
    shd_refining *r = s->refining;
    shd_fragments *f = &s->fragments;
    const size_t begin = f->count;
    float row[SHD_GRID + SHD_LANES];
    for (int y = 0; y < tile.h; y++) {
        const int gx = tile.x % SHD_TILE + 1, gy = (tile.y + y) % SHD_TILE + 1;
        const int first = gy * SHD_GRID + gx;
        const int32_t *settled = r->settled + (gy - 1) * SHD_TILE + gx - 1;
        const size_t at = f->count;
        size_t count = 0;
        int32_t all = s->run_count == 1;
        for (int x = 0; x < tile.w; x++) all &= settled[x];
        for (int x = 0; x < tile.w; x++) {
            if (!all &&
                (!settled[x] || plan->objects[r->object[first + x]].group != (size_t)run.group))
                continue;
            f->cell[at + count] = (uint16_t)((gy - 1) * SHD_TILE + gx - 1 + x);
            f->coverage[at + count++] = 1;
        }
        if (!count) continue;
        for (size_t t = 0; t < shd_terms_of(plan, run.group); t++)
            for (int c = 0; c < shd_channels_of(plan, run.group); c++) {
                const size_t k = shd_sum_of(plan, 0, t, c);
                float *out = f->sums[k] + at;
                r->kernel->predict(r->sums[k], r->weights, first, tile.w, row);
                if (count == (size_t)tile.w) {
                    memcpy(out, row, count * sizeof *out);
                    continue;
                }
                for (size_t i = 0; i < count; i++)
                    out[i] = row[f->cell[at + i] % SHD_TILE - (gx - 1)];
            }
        f->count += count;
    }
    if (f->count > begin)
        f->runs[f->run_count++] =
            (shd_run){run.group, (uint32_t)begin, (uint32_t)(f->count - begin)};
}

size_t shd_refine(const shd_scenery *scenery, shd_tile tile, shd_tile_scratch *s,
                  shd_stopwatch *watch) {
    const shd_plan *plan = scenery->plan;
    shd_refining *r = s->refining;
    shd_tile_cast(scenery, s, make_shots(tile, s), s->centres, watch);
    const shd_hits *hits = shd_tile_light(scenery, s);
    memset(r->settled, 0, sizeof r->settled);
    if (hits->count) {
        fill_grid(scenery, s, hits, r);
        shd_centres centres = {.object = r->object};
        for (int c = 0; c < 3; c++) {
            centres.place[c] = r->place[c];
            centres.normal[c] = r->normal[c];
            centres.mirror[c] = r->mirror[c];
        }
        find_details(plan, scenery->paint, hits, &centres);
        find_limits(plan, s, &centres);
        judge_tile(tile, s, &centres);
    }
    for (size_t k = 0; k < s->run_count; k++)
        if (s->runs[k].group != SHD_RADIANCE) add_settled(scenery, tile, s, s->runs[k]);
    size_t count = 0;
    for (int y = tile.y; y < tile.y + tile.h; y++)
        for (int x = tile.x, end; x < tile.x + tile.w; x = end) {
            end = shd_tile_block_end(s, x, tile.x + tile.w);
            if (!shd_tile_block(s, x, y)->count) continue;
            const int cell = y % SHD_TILE * SHD_TILE + x % SHD_TILE;
            for (int i = cell; i < cell + end - x; i++) {
                s->pixels[count] = (uint16_t)i; /* stays if it is not settled */
                count += !r->settled[i];
            }
        }
    shd_end(watch, &watch->times.shade);
    return count;
}
