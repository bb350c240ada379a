#include "render/tiles/shots.h"

#include <assert.h>
#include <string.h>

#include "bound/light/means.h"
#include "render/tiles/flat.h"
#include "render/tiles/ruled.h"
#include "shade/sketch.h"
#include "sight/bend.h"

/* The row's pixels from `left` up to `right`. */
static size_t list_row(shd_tile_scratch *s, size_t count, int y, int left, int right) {
    const int cell = y * SHD_TILE + left;
    if (right - left == SHD_BLOCK_SIDE) { /* almost always: the store of one vector */
        for (int i = 0; i < SHD_BLOCK_SIDE; i++)
            s->pixels[count + (size_t)i] = (uint16_t)(cell + i);
        return count + SHD_BLOCK_SIDE;
    }
    for (int i = 0; i < right - left; i++) s->pixels[count++] = (uint16_t)(cell + i);
    return count;
}

static int lesser_of(int a, int b) {
    return a < b ? a : b;
}

static int greater_of(int a, int b) {
    return a > b ? a : b;
}

/* Those of a block's pixels, as bits, that are in the tile. */
static uint64_t within_tile(shd_tile tile, int x, int y) {
    const int left = greater_of(tile.x % SHD_TILE - x, 0),
              top = greater_of(tile.y % SHD_TILE - y, 0),
              right = lesser_of(tile.x % SHD_TILE + tile.w - x, SHD_BLOCK_SIDE),
              bottom = lesser_of(tile.y % SHD_TILE + tile.h - y, SHD_BLOCK_SIDE);
    if (left >= right || top >= bottom) return 0;
    const uint64_t row = (uint64_t)(SHD_ROW >> (SHD_BLOCK_SIDE - (right - left)) << left),
                   first = ~(uint64_t)0 << top * SHD_BLOCK_SIDE,
                   last = ~(uint64_t)0 >> (SHD_BLOCK_SIDE - bottom) * SHD_BLOCK_SIDE;
    return row * 0x0101010101010101u & first & last;
}

/* Lists those pixels of a block that are in the tile, all of them with so many samples. NULL: there
 * are none. */
static shd_bundle *add_pixels(shd_tile tile, size_t block, uint64_t pixels, size_t samples,
                              shd_tile_scratch *s) {
    const int across = s->survey.across, x = (int)block % across * SHD_BLOCK_SIDE,
              y = (int)block / across * SHD_BLOCK_SIDE;
    const shd_bundle *last = s->bundle_count ? &s->bundles[s->bundle_count - 1] : NULL;
    const size_t first = last ? (size_t)last->first + last->count : 0;
    size_t count = first;
    pixels &= within_tile(tile, x, y);
    if (!pixels) return NULL;
    for (int row = 0; row < SHD_BLOCK_SIDE; row++) {
        uint64_t some = pixels >> row * SHD_BLOCK_SIDE & SHD_ROW;
        const int cell = (y + row) * SHD_TILE + x;
        if (some == SHD_ROW)
            count = list_row(s, count, y + row, x, x + SHD_BLOCK_SIDE);
        else
            for (; some; some &= some - 1)
                s->pixels[count++] = (uint16_t)(cell + __builtin_ctzll(some));
    }
    shd_bundle *b = &s->bundles[s->bundle_count++];
    *b = (shd_bundle){.first = (uint16_t)first,
                      .count = (uint16_t)(count - first),
                      .samples = (uint16_t)samples,
                      .corner = (uint16_t)(y * SHD_TILE + x),
                      .pixels = pixels,
                      .block = &s->survey.blocks[block]};
    return b;
}

/* Whether one thing, and the same, may be seen in both blocks. */
static bool see_the_same(const shd_survey *survey, const shd_block *a, const shd_block *b) {
    return a->count == 1 && b->count == 1 && a->next >= survey->candidate_count &&
           b->next >= survey->candidate_count &&
           survey->candidates[a->first] == survey->candidates[b->first];
}

/* The block that is the k-th one if those of a quad, of two by two, follow each other. */
static size_t block_in_quads(const shd_survey *survey, size_t k) {
    const size_t across = (size_t)survey->across, quads = across / 2, quad = k / 4;
    return (2 * (quad / quads) + (k / 2 & 1)) * across + 2 * (quad % quads) + (k & 1);
}

/* Whether all pixels of these blocks may take one sample at their centers, which is within
 * plan->mean_room of the mean of all. */
static bool is_central(const shd_scenery *scenery, const shd_bend *bend,
                       const shd_tile_scratch *s) {
    const shd_plan *plan = scenery->plan;
    return plan->scene->raster.samples == 1 ||
           (shd_plan_is_thin(plan) &&
            shd_mean_is_central(plan, bend, &s->spread, &plan->mean_room));
}

/* A block's first pixel. */
static float *first_of(const shd_tile_scratch *s, size_t block, int c) {
    const size_t across = (size_t)s->survey.across;
    return s->sketch[c] + (block / across * SHD_TILE + block % across) * SHD_SKETCH_SIDE;
}

/* Draws those of rays->blocks^2 blocks, from that one on, of which all pixels may be sketched. */
static void sketch_blocks(const shd_scenery *scenery, size_t block, const shd_bend *bend,
                          const shd_block_rays *rays, shd_tile_scratch *s) {
    const size_t across = (size_t)s->survey.across, side = (size_t)rays->blocks;
    bool drawn[SHD_BLOCKS];
    float *rgb[3];
    for (int c = 0; c < 3; c++) rgb[c] = first_of(s, block, c);
    if (!shd_sketch_blocks(scenery->lighting, bend, rays, SHD_TILE, rgb, drawn)) return;
    for (size_t k = 0; k < side * side; k++)
        s->sketched |= (uint32_t)drawn[k] << (block + k / side * across + k % side);
}

/* Sketches a quad of blocks by the middle of the quad: to tell of one takes as long as to light
 * much of it. */
static void sketch_quad(const shd_scenery *scenery, size_t block, shd_tile_scratch *s) {
    enum { SIDE = 2 };
    shd_bend bend;
    shd_block_rays rays;
    if (s->survey.blocks[block].count &&
        shd_sight_bend(scenery->sight, &s->survey, block, SIDE, &bend, &rays) &&
        is_central(scenery, &bend, s))
        sketch_blocks(scenery, block, &bend, &rays, s);
}

/* Whether the background is one color. */
static bool is_plain_behind(const shd_scene *scene) {
    return !scene->transparent && !scene->backdrop;
}

/* Sketches a block past a ball's rim. */
static bool sketch_rim(const shd_scenery *scenery, size_t block, shd_tile_scratch *s) {
    const shd_scene *scene = scenery->plan->scene;
    shd_rim rim;
    shd_block_rays rays;
    if (!is_plain_behind(scene) || !shd_sight_rim(scenery->sight, &s->survey, block, &rim, &rays))
        return false;
    float beyond[3], *rgb[3];
    for (int c = 0; c < 3; c++) {
        beyond[c] = (float)scene->background[c];
        rgb[c] = first_of(s, block, c);
    }
    if (!shd_sketch_rim(scenery->lighting, &rim, &rays, beyond, SHD_TILE, rgb)) return false;
    s->sketched |= (uint32_t)1 << block;
    return true;
}

typedef enum look { LOOK_AT_ALL, LOOK_ONCE, LOOK_DONE } look;

/* Looks at a block by draft's ways. */
static look look_lightly(const shd_scenery *scenery, size_t block, shd_tile_scratch *s) {
    const shd_plan *plan = scenery->plan;
    const bool one = plan->scene->raster.samples == 1;
    shd_bend bend;
    shd_block_rays rays;
    if (plan->sketched && shd_draw_flat(scenery, block, s)) return LOOK_DONE;
    if (one && shd_sight_has_small_balls(scenery->sight, &s->survey, block)) return LOOK_AT_ALL;
    if (!shd_sight_bend(scenery->sight, &s->survey, block, 1, &bend, &rays))
        return shd_sight_misses(scenery->sight, &s->survey, block) ||
                       (one && plan->sketched && sketch_rim(scenery, block, s))
                   ? LOOK_DONE
                   : LOOK_AT_ALL;
    if (plan->materials[plan->objects[bend.object].material].textures ||
        !is_central(scenery, &bend, s))
        return LOOK_AT_ALL;
    if (plan->sketched) sketch_blocks(scenery, block, &bend, &rays, s);
    if (one && plan->sketched && !(s->sketched >> block & 1)) sketch_rim(scenery, block, s);
    return s->sketched >> block & 1 ? LOOK_DONE : one ? LOOK_AT_ALL : LOOK_ONCE;
}

/* The blocks of a tile that are drawn already, or take one sample a pixel, or rules. */
typedef struct block_kinds {
    size_t count; /* of all of these */
    bool drawn[SHD_BLOCKS], center[SHD_BLOCKS];
    shd_block_rules rules[SHD_BLOCKS];
} block_kinds;

/* Draws blocks of a whole tile through which nothing is seen if all others are sketched, so that no
 * pixel of it is left. */
static void fill_open_blocks(const shd_scenery *scenery, const block_kinds *kinds,
                             shd_tile_scratch *s) {
    const shd_scene *scene = scenery->plan->scene;
    const uint32_t all = (1 << SHD_BLOCKS) - 1;
    uint32_t open = 0;
    if (s->survey.across * s->survey.down < SHD_BLOCKS) return;
    for (size_t block = 0; block < SHD_BLOCKS; block++)
        if (!s->survey.blocks[block].count || kinds->drawn[block]) open |= (uint32_t)1 << block;
    open &= ~s->sketched;
    if (!open || (open | s->sketched) != all || !is_plain_behind(scene)) return;
    for (uint32_t left = open; left; left &= left - 1)
        for (int c = 0; c < 3; c++) {
            float *at = first_of(s, (size_t)__builtin_ctz(left), c);
            for (int y = 0; y < SHD_SKETCH_SIDE; y++)
                for (int x = 0; x < SHD_SKETCH_SIDE; x++)
                    at[y * SHD_TILE + x] = (float)scene->background[c];
        }
    s->sketched = all;
}

static void find_kinds(const shd_scenery *scenery, shd_tile_scratch *s, block_kinds *out) {
    const size_t blocks = (size_t)s->survey.across * (size_t)s->survey.down;
    const bool draft = shd_plan_is_draft(scenery->plan);
    *out = (block_kinds){0};
    for (size_t block = 0; block < blocks; block++) out->rules[block].all = ~(uint64_t)0;
    if (!draft && !s->rule_count) return;
    for (size_t k = 0; scenery->plan->sketched && k < blocks; k += 4)
        sketch_quad(scenery, block_in_quads(&s->survey, k), s);
    for (size_t block = 0; block < blocks; block++) {
        if (!s->survey.blocks[block].count) continue;
        const look how = s->sketched >> block & 1 ? LOOK_DONE
                         : draft                  ? look_lightly(scenery, block, s)
                                                  : LOOK_AT_ALL;
        out->drawn[block] = how == LOOK_DONE;
        out->center[block] = how == LOOK_ONCE;
        if (how == LOOK_AT_ALL && s->rule_count)
            shd_find_block_rules(scenery, block, s, &out->rules[block]);
        out->count += how != LOOK_AT_ALL || out->rules[block].all != ~(uint64_t)0;
    }
    if (scenery->plan->sketched) fill_open_blocks(scenery, out, s);
}

/* Joins the last bundle to the one before it, whose pixels it follows, if they may be cast as one:
 * whole batches of rays are cheaper (sight/batch.h). */
static void join_last(shd_tile_scratch *s) {
    shd_bundle *last = &s->bundles[s->bundle_count - 1], *before = last - 1;
    if (s->bundle_count < 2 || before->samples != last->samples || before->rule != last->rule ||
        before->inside != last->inside ||
        before->count + (size_t)last->count > shd_pixels_at_once(last->samples))
        return;
    const bool known = last->rule || last->inside;
    if (known ? before->object != last->object
              : !see_the_same(&s->survey, before->block, last->block))
        return;
    before->count = (uint16_t)(before->count + last->count);
    s->bundle_count--;
}

/* Lists the blocks' pixels that take rules: of the same nodes, or of centers that are shared. */
static void add_ruled(shd_tile tile, const block_kinds *kinds, size_t rule, shd_tile_scratch *s) {
    const size_t blocks = (size_t)s->survey.across * (size_t)s->survey.down;
    const bool shared = s->rules[rule].rim;
    for (size_t block = 0; block < blocks; block++)
        for (size_t k = 0; k < kinds->rules[block].count; k++) {
            const shd_ruled *of = &kinds->rules[block].ruled[k];
            if (shared ? !s->rules[of->rule - 1].rim : of->rule != rule + 1) continue;
            shd_bundle *b =
                add_pixels(tile, block, of->pixels, shared ? 1 : s->rules[rule].count, s);
            if (!b) continue;
            b->rule = of->rule;
            b->object = of->object;
            if (!shared) join_last(s);
        }
}

/* Lists the pixels that take all samples, of blocks all of whose rays hit something, or of the
 * others: means of what all hit are made at once (gather.c). */
static void add_all(shd_tile tile, const block_kinds *kinds, bool inside, bool in_quads,
                    size_t samples, shd_tile_scratch *s) {
    const size_t blocks = (size_t)s->survey.across * (size_t)s->survey.down;
    for (size_t k = 0; k < blocks; k++) {
        const size_t block = in_quads ? block_in_quads(&s->survey, k) : k;
        if (!s->survey.blocks[block].count || kinds->rules[block].inside != inside ||
            kinds->drawn[block] || kinds->center[block])
            continue;
        shd_bundle *b = add_pixels(tile, block, kinds->rules[block].all, samples, s);
        if (!b) continue;
        b->inside = inside;
        b->object = kinds->rules[block].object;
        if (s->rule_count) join_last(s);
    }
}

/* Lists all pixels of blocks where something may be seen, block by block, so that a bundle's rays
 * are near to each other: quad by quad, if lights are told for these (light_from_afar). */
static void list_blocks(const shd_scenery *scenery, shd_tile tile, const block_kinds *kinds,
                        shd_tile_scratch *s) {
    const size_t blocks = (size_t)s->survey.across * (size_t)s->survey.down,
                 samples = (size_t)scenery->plan->scene->raster.samples;
    const bool in_quads = scenery->plan->bunches;
    s->bundle_count = 0;
    for (size_t k = 0; k < blocks; k++) {
        const size_t block = in_quads ? block_in_quads(&s->survey, k) : k;
        if (kinds->center[block]) add_pixels(tile, block, ~(uint64_t)0, 1, s);
    }
    for (size_t rule = s->rule_count ? SHD_FRINGE - 1 : 0; rule < s->rule_count; rule++)
        add_ruled(tile, kinds, rule, s); /* from the last one of those that share centers on */
    add_all(tile, kinds, true, in_quads, samples, s);
    add_all(tile, kinds, false, in_quads, samples, s);
}

/* Lists the same pixels row by row, as pictures have them. */
static void list_rows(shd_tile tile, shd_tile_scratch *s, size_t samples) {
    const int left = tile.x % SHD_TILE, right = left + tile.w, top = tile.y % SHD_TILE;
    size_t count = 0;
    for (int y = top; y < top + tile.h; y++)
        for (int x = left, beside; x < right; x = beside) {
            beside = lesser_of((x / SHD_BLOCK_SIDE + 1) * SHD_BLOCK_SIDE, right);
            if (s->survey.blocks[y / SHD_BLOCK_SIDE * s->survey.across + x / SHD_BLOCK_SIDE].count)
                count = list_row(s, count, y, x, beside);
        }
    s->bundle_count = 0;
    for (size_t first = 0, step = shd_pixels_at_once(samples); first < count; first += step)
        s->bundles[s->bundle_count++] =
            (shd_bundle){.first = (uint16_t)first,
                         .count = (uint16_t)(count - first < step ? count - first : step),
                         .samples = (uint16_t)samples};
}

void shd_list_pixels(const shd_scenery *scenery, shd_tile tile, shd_tile_scratch *s) {
    const shd_plan *plan = scenery->plan;
    const size_t samples = (size_t)plan->scene->raster.samples;
    block_kinds kinds;
    find_kinds(scenery, s, &kinds);
    if (s->survey.even && !kinds.count && !plan->bunches)
        list_rows(tile, s, samples);
    else
        list_blocks(scenery, tile, &kinds, s);
}

/* ---- Chunks. ---- */

/* Makes sample `from` of all pixels of a bundle, then the next one, and so on: a sample's rays
 * lie beside each other, and so do the values that make the means of neighboring pixels. */
static void make_shots(shd_tile tile, const uint16_t *cells, size_t pixels, size_t samples,
                       size_t from, size_t at, shd_tile_scratch *s) {
    const int left = tile.x / SHD_TILE * SHD_TILE, top = tile.y / SHD_TILE * SHD_TILE;
    assert(at + pixels * samples <= SHD_CHUNK);
    for (size_t i = 0; i < pixels; i++) {
        s->shot_cell[at + i] = cells[i];
        s->x[at + i] = left + cells[i] % SHD_TILE;
        s->y[at + i] = top + cells[i] / SHD_TILE;
    }
    memset(s->sample + at, (int)from, pixels * sizeof *s->sample);
    for (size_t k = 1; k < samples; k++) {
        const size_t to = at + k * pixels;
        memcpy(s->shot_cell + to, s->shot_cell + at, pixels * sizeof *s->shot_cell);
        memcpy(s->x + to, s->x + at, pixels * sizeof *s->x);
        memcpy(s->y + to, s->y + at, pixels * sizeof *s->y);
        memset(s->sample + to, (int)(from + k), pixels * sizeof *s->sample);
    }
}

/* Whether two bundles' rays may be cast together. */
static bool go_together(const shd_tile_scratch *s, const shd_bundle *a, const shd_bundle *b) {
    if (!a->rule || !b->rule)
        return a->rule == b->rule && a->samples == b->samples && a->inside == b->inside &&
               (!a->inside || a->object == b->object);
    const bool shared = s->rules[a->rule - 1].rim && s->rules[b->rule - 1].rim;
    return a->object == b->object && (shared || a->rule == b->rule);
}

/* Takes bundles that share centers, which all have room. */
static void share_centers(shd_tile tile, shd_tile_scratch *s, size_t first, size_t pattern,
                          shd_chunk *c) {
    const int left = tile.x / SHD_TILE * SHD_TILE, top = tile.y / SHD_TILE * SHD_TILE;
    static_assert(SHD_CENTERS_SIDE * SHD_CENTERS_SIDE <= SHD_CHUNK, "all have room");
    s->centers = (shd_centers){{0}};
    for (; first + c->count < s->bundle_count; c->count++) {
        const shd_bundle *next = &c->bundles[c->count];
        if (!go_together(s, c->bundles, next)) break;
        shd_centers_add(&s->centers, next->corner, next->pixels, s->rules[next->rule - 1].rim);
        c->pixels += next->count;
    }
    c->shots = shd_centers_list(&s->centers, left, top, s->x, s->y, s->shot_cell);
    memset(s->sample, (int)shd_center_sample(pattern), c->shots);
}

shd_chunk shd_make_chunk(shd_tile tile, shd_tile_scratch *s, size_t first, size_t pattern) {
    const shd_bundle *begin = &s->bundles[first];
    const size_t samples = begin->samples, most = shd_pixels_at_once(samples) * samples;
    size_t from = samples < pattern ? shd_center_sample(pattern) : 0;
    shd_chunk c = {.bundles = begin, .samples = samples};
    if (begin->rule) {
        c.rule = &s->rules[begin->rule - 1];
        from = shd_rule_sample(pattern, begin->rule - 1u);
    }
    if (c.rule && c.rule->rim) {
        share_centers(tile, s, first, pattern, &c);
        return c;
    }
    for (; first + c.count < s->bundle_count; c.count++) {
        const shd_bundle *next = &c.bundles[c.count];
        const size_t shots = (size_t)next->count * samples;
        if (!go_together(s, begin, next) || c.shots + shots > most) break;
        make_shots(tile, s->pixels + next->first, next->count, samples, from, c.shots, s);
        c.pixels += next->count;
        c.shots += shots;
    }
    return c;
}

void shd_shoot_chunk(const shd_scenery *scenery, const shd_chunk *c, shd_tile_scratch *s) {
    const uint32_t samples = (uint32_t)c->samples;
    shd_survey *survey = &s->survey;
    s->hits.count = 0;
    s->now = &s->hits;
    uint32_t first = 0;
    const bool known = c->rule || c->bundles->inside; /* one object is all that is seen */
    if (known) {
        const shd_shots all = {c->shots, s->x, s->y, s->sample};
        shd_sight_shoot(scenery->sight, &c->bundles->object, 1, &all, &s->hits);
    }
    for (size_t b = 0; b < c->count && !known; b++) {
        const uint32_t shots = c->bundles[b].count * samples;
        const shd_block *block = c->bundles[b].block;
        const size_t before = s->hits.count;
        const shd_shots part = {shots, s->x + first, s->y + first, s->sample + first};
        if (block)
            shd_sight_shoot_block(scenery->sight, survey, (size_t)(block - survey->blocks), &part,
                                  &s->hits);
        else
            shd_sight_shoot(scenery->sight, survey->candidates, survey->candidate_count, &part,
                            &s->hits);
        for (size_t i = before; i < s->hits.count; i++) s->hits.shot[i] += first;
        first += shots;
    }
    shd_hits_pad(&s->hits);
}
