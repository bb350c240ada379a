#include "render/tiles/tile_scratch.h"

#include "plan/textures.h"
#include "render/tiles/smooth.h"
#include "sight/bend.h"
#include "trace/bounce.h"

/* A chunk's pixels are a multiple of it: so many rays of the same sample are cast faster. */
enum { BESIDE = 64 };

size_t shd_pixels_at_once(size_t samples) {
    return SHD_CHUNK / samples / BESIDE * BESIDE;
}

static bool has_facet_slots(const shd_plan *plan) {
    for (size_t m = 0; m < shd_all_materials(plan); m++)
        if (shd_facet_slot(&plan->materials[m])) return true;
    return false;
}

/* A chunk's shots, what they hit, and the sums of light there. Kernels read whole vectors from
 * wherever a run begins. */
static void lay_out_chunk(const shd_plan *plan, shd_scratch *memory, shd_tile_scratch *s) {
    const size_t classes = plan->group_count + 1, length = SHD_CHUNK + SHD_LANES,
                 rows = shd_sum_of(plan, 1, 0, 0);
    s->x = shd_scratch_take(memory, SHD_CHUNK, sizeof *s->x);
    s->y = shd_scratch_take(memory, SHD_CHUNK, sizeof *s->y);
    s->sample = shd_scratch_take(memory, SHD_CHUNK, sizeof *s->sample);
    s->shot_cell = shd_scratch_take(memory, SHD_CHUNK, sizeof *s->shot_cell);
    s->cell = shd_scratch_take(memory, SHD_CHUNK, sizeof *s->cell);
    s->order = shd_scratch_take(memory, SHD_CHUNK, sizeof *s->order);
    s->place = shd_scratch_take(memory, SHD_CHUNK, sizeof *s->place);
    s->starts = shd_scratch_take(memory, classes + 1, sizeof *s->starts);
    s->which = shd_scratch_take(memory, plan->light_count, sizeof *s->which);
    if (plan->bunches) shd_afar_lay_out(plan, length, memory, &s->afar);
    s->run_capacity = classes < SHD_CHUNK ? classes : SHD_CHUNK;
    s->runs = shd_scratch_take(memory, s->run_capacity, sizeof *s->runs);
    if (plan->tier == SHD_EXACT)
        s->exact = shd_scratch_rows64(memory, rows + (plan->textured ? 3 : 0), length);
    if (plan->textured) s->weights = shd_scratch_rows64(memory, plan->max_fields, length);
    if (plan->textured && plan->scene->trace.depth) {
        for (int k = 0; k < 3; k++)
            if (plan->rayed[k]) s->shares[k] = shd_scratch_rows64(memory, 3, length);
        s->beam = shd_scratch_rows64(memory, plan->max_fields, 1);
    }
    if (plan->antialiased || plan->bumped || plan->glossed)
        s->sharp = shd_scratch_rows64(memory, 2 * plan->max_lobes + 3, length);
    if (plan->textured && has_facet_slots(plan)) s->facets = shd_scratch_rows64(memory, 3, length);
    s->smooth = shd_smooth_lay_out(plan, length, memory);
    s->sums = shd_scratch_rows32(memory, shd_sum_of(plan, plan->plane_count, 0, 0), length);
    s->outs = shd_scratch_take(memory, rows, sizeof *s->outs);
    if (plan->scene->transparent && plan->scene->trace.depth)
        s->alpha = shd_scratch_take(memory, length, sizeof *s->alpha);
    if (plan->scene->trace.depth)
        s->room = shd_scratch_take(memory, shd_bounce_room(plan), sizeof *s->room);
    if (plan->wants[SHD_LAYER_BOUND] && plan->scene->trace.depth)
        s->stray = shd_scratch_take(memory, SHD_TILE_PIXELS, sizeof *s->stray);
    shd_hits_lay_out(plan, length, memory, &s->hits);
    shd_hits_lay_out(plan, length, memory, &s->sorted);
    if (plan->tier == SHD_EXACT) return;
    shd_plan exact = *plan;
    exact.tier = SHD_EXACT;
    s->edges = shd_scratch_take(memory, length, sizeof *s->edges);
    shd_hits_lay_out(&exact, SHD_LANES, memory, &s->again);
}

/* A pixel has at most as many fragments as samples, and as groups and one more for facets. */
static void lay_out_fragments(const shd_plan *plan, size_t samples, shd_scratch *memory,
                              shd_tile_scratch *s) {
    const size_t classes = plan->group_count + 1;
    shd_fragments *f = &s->fragments;
    f->capacity = SHD_TILE_PIXELS * (samples < classes ? samples : classes);
    f->cell = shd_scratch_take(memory, f->capacity, sizeof *f->cell);
    s->coverage = shd_scratch_take(memory, f->capacity, sizeof *s->coverage);
    f->sums = shd_scratch_rows32(memory, shd_sum_of(plan, plan->plane_count, 0, 0),
                                 f->capacity + SHD_LANES);
    const size_t
        step = shd_pixels_at_once(samples),
        all = (SHD_TILE_PIXELS + step - 1) / step,
        /* And one of what takes one sample, and of each part of a block that takes nodes. */
        chunks = all + shd_plan_is_thin(plan) + (s->rule_count ? SHD_BUNDLES : 0);
    f->runs = shd_scratch_take(memory, chunks * s->run_capacity, sizeof *f->runs);
}

shd_tile_scratch *shd_tile_scratch_lay_out(const shd_plan *plan, shd_scratch *memory) {
    const size_t samples = (size_t)plan->scene->raster.samples;
    shd_tile_scratch counted, *made = shd_scratch_take(memory, 1, sizeof *made),
                              *s = made ? made : &counted;
    *s = (shd_tile_scratch){0};
    for (size_t i = 0; i < SHD_TILE_PIXELS; i++) s->fragment_of[i] = SHD_NO_FRAGMENT;
    shd_survey_lay_out(plan->scene->object_count, SHD_TILE, SHD_TILE, memory, &s->survey);
    s->pixels = shd_scratch_take(memory, SHD_TILE_PIXELS, sizeof *s->pixels);
    if (!plan->bunches) s->rule_count = shd_plan_rules(plan, plan->tier);
    lay_out_chunk(plan, memory, s);
    if (samples > 1)
        lay_out_fragments(plan, samples, memory, s);
    else /* samples are fragments */
        s->fragments = (shd_fragments){
            .capacity = SHD_CHUNK, .cell = s->cell, .sums = s->sums, .runs = s->runs};
    if (samples == 1) s->coverage = s->alpha;
    if (shd_plan_is_thin(plan)) s->spread = shd_spread_of((int)samples);
    for (int c = 0; plan->sketched && c < 3; c++)
        s->sketch[c] = shd_scratch_take(memory, SHD_TILE_PIXELS, sizeof *s->sketch[c]);
    if (made && s->rule_count) shd_rules_of((int)samples, s->rules);
    return made;
}
