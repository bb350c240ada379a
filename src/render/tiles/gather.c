#include "render/tiles/gather.h"

#include <assert.h>
#include <math.h>
#include <string.h>

#include "render/tiles/film.h"
#include "render/tiles/radiance.h"

/* Finds the fragment of each of the run's hits, its pixel's, counted from the run's first one.
 * Fills cells and coverages from `at` on. Returns how many fragments there are. */
static size_t place_hits(shd_tile_scratch *s, shd_run run, size_t at, int samples) {
    uint16_t *cells = s->fragments.cell + at;
    float *coverage = s->coverage + at;
    size_t count = 0;
    for (uint32_t i = run.first; i < run.first + run.count; i++) {
        const uint16_t cell = s->cell[i];
        uint16_t fragment = s->fragment_of[cell];
        if (fragment == SHD_NO_FRAGMENT) {
            fragment = s->fragment_of[cell] = (uint16_t)count;
            cells[count] = cell;
            coverage[count++] = 0;
        }
        coverage[fragment] += s->alpha ? s->alpha[i] : 1;
        s->place[i] = fragment;
    }
    for (size_t k = 0; k < count; k++) {
        s->whole &= coverage[k] == (float)samples;
        coverage[k] /= (float)samples;
        s->fragment_of[cells[k]] = SHD_NO_FRAGMENT;
    }
    return count;
}

/* Whether no light takes any away. */
static bool all_add(const shd_plan *plan, int32_t group) {
    const shd_plan_group *of = &plan->groups[group];
    for (size_t k = 0; k < of->light_count; k++) {
        const double *color = plan->lights[of->lights[k]].color;
        if (color[0] < 0 || color[1] < 0 || color[2] < 0) return false;
    }
    return true;
}

/* The means of a chunk's bundles by centers that they share. Some weights are below 0, but no mean
 * is below `least`. */
static void average_centers(const shd_scenery *scenery, const shd_tile_scratch *s,
                            const shd_chunk *c, const float *values, double least, float *out) {
    double plane[SHD_CENTERS_SIDE][SHD_CENTERS_SIDE];
    shd_centers_spread(&s->centers, values, plane);
    for (size_t b = 0; b < c->count; b++) {
        const shd_bundle *bundle = &c->bundles[b];
        const shd_rule *rule = &s->rules[bundle->rule - 1];
        const int from = SHD_FRINGE - rule->rim, row = bundle->corner / SHD_TILE + from,
                  column = bundle->corner % SHD_TILE + from;
        const shd_lattice lattice = {bundle->pixels, SHD_CENTERS_SIDE, rule->rim, rule->weight,
                                     least};
        scenery->paint->filter(&plane[row][column], &lattice, out);
        out += bundle->count;
    }
}

/* The means of samples of a chunk's bundles, if all of their rays hit. */
static void average_bundles(const shd_scenery *scenery, const shd_chunk *c, const float *values,
                            float *out) {
    const int samples = (int)c->samples;
    for (size_t b = 0; b < c->count; b++) {
        const size_t pixels = c->bundles[b].count;
        if (c->rule)
            scenery->paint->weigh(values, pixels, c->rule->weight, c->rule->count, out);
        else
            scenery->paint->average(values, pixels, samples, out);
        values += pixels * c->samples;
        out += pixels;
    }
}

void shd_add_fragments(const shd_scenery *scenery, shd_tile_scratch *s, const shd_chunk *chunk) {
    const shd_plan *plan = scenery->plan;
    const int samples = (int)chunk->samples;
    const size_t pixels = chunk->pixels;
    shd_fragments *f = &s->fragments;
    for (size_t r = 0; r < s->run_count; r++) {
        const shd_run run = s->runs[r];
        const size_t at = f->count;
        const bool full = run.count == chunk->shots && !s->alpha,
                   shared = chunk->rule && chunk->rule->rim;
        size_t count = pixels;
        if (chunk->rule && !full) continue; /* cancelled: rays are missing */
        if (full) {
            memcpy(f->cell + at, s->pixels + chunk->bundles[0].first, pixels * sizeof *f->cell);
            scenery->paint->fill(s->coverage + at, pixels, 1);
        } else {
            count = place_hits(s, run, at, samples);
        }
        assert(at + count <= f->capacity);
        const size_t terms = shd_terms_of(plan, run.group);
        const int channels = shd_channels_of(plan, run.group);
        const double least = shared && all_add(plan, run.group) ? 0 : -INFINITY;
        for (size_t p = 0; p < plan->plane_count && !shd_is_cancelled(plan->cancelled); p++) {
            if (p && run.group != SHD_RADIANCE && plan->planes[p].kind != SHD_LAYER_LIGHT)
                continue; /* it shares the sums of plane 0 */
            for (size_t t = 0; t < terms; t++)
                for (int c = 0; c < channels; c++) {
                    const size_t k = shd_sum_of(plan, p, t, c);
                    const float *values = s->sums[k] + run.first;
                    float *out = f->sums[k] + at;
                    if (shared)
                        average_centers(scenery, s, chunk, values, least, out);
                    else if (full)
                        average_bundles(scenery, chunk, values, out);
                    else
                        scenery->paint->gather(values, s->place + run.first, run.count, count,
                                               samples, out);
                }
        }
        f->runs[f->run_count++] = (shd_run){run.group, (uint32_t)at, (uint32_t)count};
        f->count += count;
    }
}
