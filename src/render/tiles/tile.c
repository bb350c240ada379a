#include "render/tiles/tile.h"

#include <string.h>

#include "bound/light/weakest.h"
#include "render/tiles/bent.h"
#include "render/tiles/facets.h"
#include "render/tiles/far.h"
#include "render/tiles/film.h"
#include "render/tiles/gather.h"
#include "render/tiles/patch.h"
#include "render/tiles/radiance.h"
#include "render/tiles/runs.h"
#include "render/tiles/shots.h"
#include "render/tiles/smooth.h"
#include "render/tiles/textured.h"
#include "render/tiles/traced.h"
#include "shade/quick.h"

/* ---- Light on what was hit. ---- */

/* Hits that follow each other and see one material, and the lights that they are lit by. */
typedef struct lit_run {
    const shd_hits *hits;
    size_t first, count;
    const shd_plan_material *material;
    const uint32_t *which; /* [lights]: in plan->lights */
    size_t lights;
    const shd_known *known; /* of the hits; NULL: nothing is */
    bool quick;             /* shd_is_quick */
} lit_run;

static shd_points64 points64_of(const shd_hits *hits, size_t first, size_t count) {
    shd_points64 points = {.count = count,
                           .object = hits->object + first,
                           .triangle = hits->triangle ? hits->triangle + first : NULL};
    for (int c = 0; c < 3; c++) {
        points.position[c] = hits->position[c] + first;
        points.normal[c] = hits->normal[c] + first;
        points.view[c] = hits->view[c] + first;
    }
    return points;
}

/* Casts and lights the run's hits on edges, which are few, again in f64: s->edges. */
static void light_edges(const shd_scenery *scenery, const lit_run *l, shd_tile_scratch *s) {
    const int32_t *objects = l->hits->object + l->first;
    int32_t x[SHD_LANES], y[SHD_LANES];
    uint8_t sample[SHD_LANES];
    uint32_t at[SHD_LANES];
    const uint8_t *edge = memchr(s->edges, 1, l->count), *end = s->edges + l->count;
    while (edge) {
        const uint32_t object = (uint32_t)objects[edge - s->edges];
        size_t n = 0; /* of one object */
        for (; edge && n < SHD_LANES; n++) {
            const uint32_t i = (uint32_t)(edge - s->edges), shot = l->hits->shot[l->first + i];
            if ((uint32_t)objects[i] != object) break;
            at[n] = i;
            x[n] = s->x[shot];
            y[n] = s->y[shot];
            sample[n] = s->sample[shot];
            edge = memchr(edge + 1, 1, (size_t)(end - edge - 1));
        }
        const shd_shots shots = {n, x, y, sample};
        s->again.count = 0;
        if (shd_sight_shoot(scenery->sight, &object, 1, &shots, &s->again) != n)
            return; /* cancelled */
        const shd_points64 points = points64_of(&s->again, 0, n);
        shd_light_again(scenery->lighting, l->material, l->which, l->lights, &points, at,
                        l->material->has_diffuse ? s->outs : NULL, s->outs + 3);
    }
}

/* Adds the diffuse light of lights whose highlights are left out. */
static void add_dull(const shd_scenery *scenery, const lit_run *l, const shd_points32 *points,
                     shd_tile_scratch *s) {
    const int channels = scenery->plan->grey_lights ? 1 : 3;
    if (l->quick) {
        shd_light_quick32(scenery->lighting, l->material, s->afar.dull, s->afar.dull_count, points,
                          s->outs, NULL, NULL);
        return;
    }
    shd_light_dull32(scenery->lighting, l->material, s->afar.dull, s->afar.dull_count, points,
                     s->afar.rows);
    for (int c = 0; c < channels; c++)
        for (size_t i = 0; i < l->count; i++) s->outs[c][i] += s->afar.rows[c][i];
}

/* Lights a run for a plane and those that share its sums: s->sums. */
static void sum_lights(const shd_scenery *scenery, const lit_run *l, size_t plane,
                       shd_tile_scratch *s) {
    const shd_plan *plan = scenery->plan;
    for (size_t t = 0; t < 1 + l->material->lobe_count; t++)
        for (int c = 0; c < 3; c++)
            s->outs[3 * t + (size_t)c] = s->sums[shd_sum_of(plan, plane, t, c)] + l->first;
    shd_points32 points = {.count = l->count};
    for (int c = 0; c < 3; c++) {
        points.position[c] = l->hits->position32[c] + l->first;
        points.low[c] = plan->split_positions ? l->hits->low32[c] + l->first : NULL;
        points.normal[c] = l->hits->normal32[c] + l->first;
        points.mirror[c] = l->hits->mirror32[c] + l->first;
    }
    memset(s->edges, 0, l->count);
    float *const *diffuse = l->material->has_diffuse ? s->outs : NULL;
    if (l->quick)
        shd_light_lamps32(scenery->lighting, l->material,
                          l->lights < plan->light_count ? l->which : NULL, l->lights, &points,
                          s->outs, s->outs + 3, s->edges, s->afar.parted);
    else
        shd_light_sums32(scenery->lighting, l->material, l->which, l->lights, &points, diffuse,
                         s->outs + 3, s->edges);
    light_edges(scenery, l, s);
    if (plane == 0 && s->afar.dull_count) add_dull(scenery, l, &points, s);
    if (plane == 0 && s->far && s->far->lights)
        shd_far_kernel_of(plan->isa)->light(plan, s->far, l->count, points.position, points.low,
                                            points.normal, s->outs);
    if (l->material->textures)
        shd_textured_sums(scenery, l->material, plane, l->first, l->count, s);
}

/* The same. The exact tier's sums do not leave f64: they become a run of radiance, plane by plane.
 */
static void light_exactly(const shd_scenery *scenery, const lit_run *l, size_t plane,
                          shd_tile_scratch *s) {
    const shd_plan *plan = scenery->plan;
    shd_points64 points = points64_of(l->hits, l->first, l->count);
    points.shadowed = &s->shadowed;
    points.known = l->known;
    points.known_at = l->first;
    if (l->material->pointwise) {
        points.sharp = (const double *const *)s->sharp;
        points.sharp_at = l->first;
    }
    const shd_plan_slot *facets = shd_facet_slot(l->material);
    if (facets) {
        shd_textured_facets(l->material, facets, s->weights, l->count, s->facets);
        points.facets = (const double *const *)s->facets;
    }
    const bool light = plan->planes[plane].kind == SHD_LAYER_LIGHT;
    shd_sum_exactly(scenery->lighting, plan, l->material, l->which, l->lights, &points, s->exact);
    for (size_t p = plane; p < plan->plane_count; p++) {
        if (light ? p > plane : plan->planes[p].kind == SHD_LAYER_LIGHT) continue;
        float *out[3];
        for (int c = 0; c < 3; c++) out[c] = s->sums[shd_sum_of(plan, p, 0, c)] + l->first;
        shd_mix_exact(plan, l->material, p, s->exact, (const double *const *)s->weights, l->count,
                      out);
    }
}

/* Leaves out lights that do not reach the run's points, or are too weak. */
static void cull_lights(const shd_scenery *scenery, lit_run *l, shd_tile_scratch *s) {
    enum {
        FEW = 2 /* lights that cost less than looking at the points */,
        LOOK = 24 /* quick sums at points that cost less than looking at each light */
    };
    const shd_plan *plan = scenery->plan;
    if (plan->tier == SHD_EXACT || l->lights <= FEW) return;
    if (l->quick && l->count < LOOK) return;
    const shd_patch patch = shd_patch_of(scenery, l->hits, l->first, l->count);
    const size_t object = (size_t)l->hits->object[l->first];
    const size_t count = shd_plan_cull(plan, &patch, l->which, l->lights, s->which);
    const double share = l->quick ? 1 - SHD_QUICK_SHARE : 1,
                 room = share *
                        shd_patch_room(plan, object, &patch, plan->drop_tolerance, s->which, count);
    l->lights = shd_drop_weakest(plan, object, &patch, room, s->which, count);
    l->which = s->which;
}

/* Leaves out what is lit from afar, and then the same. */
static void cull_open(const shd_scenery *scenery, const shd_patch *patch, const shd_afar *afar,
                      lit_run *l, shd_tile_scratch *s) {
    enum { MANY = 128 }; /* points that make it pay to look at each light */
    const shd_plan *plan = scenery->plan;
    const size_t object = (size_t)l->hits->object[l->first];
    s->afar.dull_count =
        shd_afar_list(plan, afar, true, l->which, l->lights, &s->afar, s->afar.dull);
    l->lights = shd_afar_list(plan, afar, false, l->which, l->lights, &s->afar, s->which);
    l->which = s->which;
    if (l->count < MANY) return;
    l->lights = shd_plan_cull(plan, patch, s->which, l->lights, s->which);
    l->lights = shd_drop_weakest(plan, object, patch, shd_afar_left(afar), s->which, l->lights);
}

/* Which quad of blocks a bundle is in. */
static size_t quad_of(const shd_survey *survey, const shd_bundle *bundle) {
    const size_t block = (size_t)(bundle->block - survey->blocks), across = (size_t)survey->across;
    return block / across / 2 * across + block % across / 2;
}

/* How many hits from the run's `at` on are of the same bundle, or of bundles of the same quad of
 * blocks. Their shots follow each other. */
static size_t part_of(const lit_run *l, size_t at, const shd_chunk *c, bool quad,
                      const shd_survey *survey) {
    const uint32_t *shots = l->hits->shot + l->first;
    size_t end = 0, count = 0, b = 0;
    for (; b < c->count && shots[at] >= end; b++)
        end += (size_t)c->bundles[b].count * c->bundles[b].samples;
    for (const size_t first = quad_of(survey, &c->bundles[b - 1]);
         quad && b < c->count && quad_of(survey, &c->bundles[b]) == first; b++)
        end += (size_t)c->bundles[b].count * c->bundles[b].samples;
    while (at + count < l->count && shots[at + count] < end) count++;
    return count;
}

/* Lights what no further part of is looked at. */
static void light_rest(const shd_scenery *scenery, const lit_run *l, const shd_patch *patch,
                       const shd_afar *found, shd_tile_scratch *s) {
    lit_run rest = *l;
    cull_open(scenery, patch, found, &rest, s);
    s->far = &found->far;
    sum_lights(scenery, &rest, 0, s);
    s->far = NULL;
    s->afar.dull_count = 0;
}

/* The last level that is looked at: sums that are quick and without highlights cost less than
 * looking at each light for a block. */
static int last_level(const lit_run *l) {
    return l->quick && !l->material->lobe_count ? SHD_AFAR_LEVELS - 2 : SHD_AFAR_LEVELS - 1;
}

/* Whether the parts of a run are so small, as of many little balls, that lights are summed for few
 * points at once: that costs more than what a part could leave out. */
static bool has_thin_parts(const lit_run *l, const shd_chunk *chunk, bool quads,
                           const shd_survey *survey) {
    enum { THIN = 16 };
    size_t parts = 0;
    for (size_t at = 0; at < l->count; parts++) at += part_of(l, at, chunk, quads, survey);
    return l->count < parts * THIN;
}

/* Lights a run for plane 0 by bunches of lights that are far from all of it, or from quads of
 * blocks of it, or from blocks: what a block leaves out depends on what its tile shows, and on
 * nothing else. A few points of which nothing is found yet are lit by all, which is as fast as
 * looking at each light. `whole`: what was found of what it is part of, or NULL. */
static void light_from_afar(const shd_scenery *scenery, const lit_run *l, const shd_chunk *chunk,
                            int level, const shd_afar *whole, shd_tile_scratch *s) {
    enum { FEW = 24 /* lights */, ALONE = 32, SMALL = 256 /* points */ };
    static const double BENT = 0.9;
    static const size_t least[SHD_AFAR_LEVELS] = {256, 128, 1}; /* points that it pays for */
    const shd_plan *plan = scenery->plan;
    const bool quads = level + 2 < SHD_AFAR_LEVELS,
               last = level == last_level(l) || has_thin_parts(l, chunk, quads, &s->survey);
    const bool pays = l->count >= least[level], small = !whole && l->quick && l->count <= SMALL;
    if (last && !whole && (!pays || l->count < ALONE)) {
        sum_lights(scenery, l, 0, s);
        return;
    }
    shd_afar *found = &s->afar.levels[level];
    if (small || pays || last) {
        const shd_patch patch = shd_patch_of(scenery, l->hits, l->first, l->count);
        if (small && patch.cos_spread < BENT) {
            sum_lights(scenery, l, 0, s);
            return;
        }
        if (pays && (last || patch.cos_spread > 0)) {
            shd_afar_find(plan, l->material, &patch, l->count, level, last, whole, &s->afar, found);
            whole = found;
        }
        if (last || (pays && whole && whole->open_count + whole->alone_count <= FEW)) {
            light_rest(scenery, l, &patch, whole, s);
            return;
        }
    }
    for (size_t at = 0; at < l->count && !shd_is_cancelled(plan->cancelled);) {
        lit_run part = *l;
        part.first += at;
        at += part.count = part_of(l, at, chunk, quads, &s->survey);
        light_from_afar(scenery, &part, chunk, level + 1, whole, s);
    }
}

/* Whether lights may be lit from afar. Room is a share of light, of which a pattern may show less.
 */
static bool is_for_bunches(const shd_plan *plan, const lit_run *l) {
    enum { FEW = 16 }; /* points that are lit as fast */
    return plan->bunches && l->count >= FEW && l->lights >= SHD_BUNCHES_LEAST &&
           l->material->has_diffuse && !l->material->textures &&
           l->material->lobe_count <= SHD_FAR_LOBES;
}

/* What is known of environments' light before points are lit. */
static const shd_known *know_lights(const shd_scenery *scenery, const lit_run *l,
                                    const shd_tile_scratch *s) {
    const shd_smooth_run run = {l->hits, l->first, l->count, l->material, l->which, l->lights};
    return shd_smooth_know(scenery, &run, s);
}

static const shd_hits *light_hits(const shd_scenery *scenery, const shd_chunk *chunk,
                                  shd_tile_scratch *s) {
    const shd_plan *plan = scenery->plan;
    const shd_hits *hits = shd_make_runs(scenery, s->now, s);
    void (*const light_run)(const shd_scenery *, const lit_run *, size_t, shd_tile_scratch *) =
        plan->tier == SHD_EXACT ? light_exactly : sum_lights;
    if (hits->count && hits == s->now && hits->shot[hits->count - 1] == hits->count - 1)
        memcpy(s->cell, s->shot_cell, hits->count * sizeof *s->cell); /* every shot hit */
    else
        for (size_t i = 0; i < hits->count; i++) s->cell[i] = s->shot_cell[hits->shot[i]];
    for (size_t r = 0; r < s->run_count && !shd_is_cancelled(plan->cancelled); r++) {
        const shd_run run = s->runs[r];
        if (run.group == SHD_RADIANCE) {
            shd_facets_interpolate(scenery, hits, run, s->sums);
            continue;
        }
        const shd_plan_group *group = &plan->groups[run.group];
        lit_run l = {.hits = hits,
                     .first = run.first,
                     .count = run.count,
                     .material = &plan->materials[group->material],
                     .which = group->lights,
                     .lights = group->light_count};
        if (l.material->textures)
            shd_textured_weigh(scenery, l.material->textures, hits, l.first, l.count, s);
        if (group->faceted) {
            shd_facets_sum(scenery, hits, run, s);
            if (plan->tier == SHD_EXACT) s->runs[r].group = SHD_RADIANCE;
            continue;
        }
        if (l.material->pointwise) shd_bent_sharpen(scenery, l.material, hits, l.first, l.count, s);
        if (s->smooth) l.known = know_lights(scenery, &l, s);
        l.quick = plan->bunches && l.material->has_diffuse && !l.material->textures &&
                  shd_is_quick(scenery->lighting, l.material);
        if (is_for_bunches(plan, &l)) {
            light_from_afar(scenery, &l, chunk, 0, NULL, s);
        } else {
            cull_lights(scenery, &l, s);
            light_run(scenery, &l, 0, s);
        }
        uint32_t light;
        l.which = &light;
        l.quick = false;
        for (size_t p = 1; p < plan->plane_count; p++) {
            if (plan->planes[p].kind != SHD_LAYER_LIGHT) continue;
            l.lights = shd_plan_find_light(plan, plan->planes[p].light, &light) ? 1 : 0;
            light_run(scenery, &l, p, s);
        }
        if (plan->tier == SHD_EXACT) s->runs[r].group = SHD_RADIANCE;
    }
    return hits;
}

/* ---- Samples. ---- */

/* Data layers hold the sample of a pixel that is nearest to the camera. Averages would be places
 * and directions that are nowhere on the surface. */
static void store_data(const shd_scenery *scenery, const shd_hits *hits, const shd_tile_scratch *s,
                       const shd_film *film, shd_tile tile) {
    const shd_raster *raster = &scenery->plan->scene->raster;
    const int left = tile.x / SHD_TILE * SHD_TILE, top = tile.y / SHD_TILE * SHD_TILE;
    uint32_t nearest[SHD_TILE_PIXELS]; /* a hit, plus one */
    memset(nearest, 0, sizeof nearest);
    for (size_t i = 0; i < hits->count; i++) {
        uint32_t *at = &nearest[s->shot_cell[hits->shot[i]]];
        if (!*at || hits->depth[i] < hits->depth[*at - 1]) *at = (uint32_t)i + 1;
    }
    for (int cell = 0; cell < SHD_TILE_PIXELS; cell++) {
        const int x = left + cell % SHD_TILE - raster->x, y = top + cell / SHD_TILE - raster->y;
        if (!nearest[cell] || x < 0 || y < 0 || x >= film->width || y >= film->height) continue;
        const size_t hit = nearest[cell] - 1;
        const size_t pixel = (size_t)y * (size_t)film->width + (size_t)x;
        for (int c = 0; c < 3; c++) {
            if (film->normal)
                film->normal[3 * pixel + (size_t)c] =
                    hits->normal[c] ? (float)hits->normal[c][hit] : hits->normal32[c][hit];
            if (film->position)
                film->position[3 * pixel + (size_t)c] =
                    hits->position[c] ? (float)hits->position[c][hit] : hits->world32[c][hit];
        }
        if (film->depth) film->depth[pixel] = (float)hits->depth[hit];
        if (film->object) film->object[pixel] = (float)hits->object[hit];
    }
}

/* Casts a chunk's shots, or recalls what they hit if the tile's next known cast was of the same
 * rays. Sets s->now and ends the stage. */
static void cast_shots(const shd_scenery *scenery, shd_tile_scratch *s, const shd_chunk *c,
                       shd_stopwatch *watch) {
    const size_t shots = c->shots;
    const shd_kept_cast *cast = s->recalled;
    if (cast) s->recalled = cast->next;
    if (cast && cast->shots == shots &&
        !memcmp(cast->shot_cell, s->shot_cell, shots * sizeof *s->shot_cell)) {
        shd_recall_cast(cast, &s->hits, &s->kept);
        s->now = &s->kept;
    } else {
        shd_shoot_chunk(scenery, c, s);
        if (scenery->recall.keep_geometry)
            shd_keep_cast(scenery->recall.keep_geometry, s->tile, scenery->plan, s->shot_cell,
                          shots, &s->hits);
    }
    shd_end(watch, &watch->times.visibility);
}

static void sample_pixels(const shd_scenery *scenery, shd_tile tile, shd_tile_scratch *s,
                          const shd_film *film, shd_stopwatch *watch) {
    const size_t samples = (size_t)scenery->plan->scene->raster.samples;
    for (size_t done = 0; done < s->bundle_count;) {
        const shd_chunk c = shd_make_chunk(tile, s, done, samples);
        cast_shots(scenery, s, &c, watch);
        const bool turned = scenery->plan->bumped; /* normals are complete once they are lit */
        if (scenery->data && !turned) store_data(scenery, s->now, s, film, tile);
        const shd_hits *hits = light_hits(scenery, &c, s);
        if (scenery->data && turned) store_data(scenery, hits, s, film, tile);
        if (scenery->traced) shd_trace_hits(scenery, hits, s, watch);
        if (samples == 1) {
            s->fragments.count = hits->count;
            s->fragments.run_count = s->run_count;
            s->whole = !s->alpha;
        } else {
            shd_add_fragments(scenery, s, &c);
        }
        shd_end(watch, &watch->times.shade);
        done += c.count;
    }
}

const shd_fragments *shd_tile_look(const shd_scenery *scenery, size_t index, shd_tile tile,
                                   shd_tile_scratch *s, const shd_film *film,
                                   shd_stopwatch *watch) {
    const shd_record *known = scenery->recall.geometry;
    s->fragments.count = s->fragments.run_count = 0;
    s->whole = true;
    s->sketched = 0;
    shd_smooth_begin(s->smooth);
    if (s->stray) memset(s->stray, 0, SHD_TILE_PIXELS * sizeof *s->stray);
    s->tile = index;
    s->recalled = known ? shd_record_get(known, index) : NULL;
    /* The grid's whole cell, so that a region sees the same blocks as the whole picture. */
    const int left = tile.x / SHD_TILE * SHD_TILE, top = tile.y / SHD_TILE * SHD_TILE;
    shd_sight_survey(scenery->sight, (shd_tile){left, top, SHD_TILE, SHD_TILE}, &s->survey);
    if (s->survey.candidate_count) {
        if (scenery->plan->sketched) shd_end(watch, &watch->times.visibility);
        shd_list_pixels(scenery, tile, s);
        if (scenery->plan->sketched) shd_end(watch, &watch->times.shade);
        sample_pixels(scenery, tile, s, film, watch);
    } else {
        shd_end(watch, &watch->times.visibility);
    }
    shd_end_shadows(watch, &s->shadowed);
    s->fragments.coverage = s->whole ? NULL : s->coverage;
    return &s->fragments;
}
