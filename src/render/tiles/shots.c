#include "render/tiles/shots.h"

#include <assert.h>
#include <string.h>

#include "bound/light/means.h"
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

/* Lists the block's pixels that are in the tile, all of them with so many samples. */
static void add_block(shd_tile tile, size_t block, size_t samples, shd_tile_scratch *s) {
    const int across = s->survey.across, left = tile.x % SHD_TILE, top = tile.y % SHD_TILE,
              x = (int)block % across * SHD_BLOCK_SIDE, y = (int)block / across * SHD_BLOCK_SIDE,
              x0 = greater_of(x, left), x1 = lesser_of(x + SHD_BLOCK_SIDE, left + tile.w),
              y0 = greater_of(y, top), y1 = lesser_of(y + SHD_BLOCK_SIDE, top + tile.h);
    const shd_bundle *last = s->bundle_count ? &s->bundles[s->bundle_count - 1] : NULL;
    const size_t first = last ? (size_t)last->first + last->count : 0;
    size_t count = first;
    if (x0 >= x1 || y0 >= y1) return;
    for (int row = y0; row < y1; row++) count = list_row(s, count, row, x0, x1);
    s->bundles[s->bundle_count++] = (shd_bundle){(uint16_t)first, (uint16_t)(count - first),
                                                 (uint16_t)samples, &s->survey.blocks[block]};
}

/* Whether one sample at the center of each of a block's pixels is within plan->mean_room of all. */
static bool is_smooth(const shd_scenery *scenery, size_t block, const shd_tile_scratch *s) {
    const shd_plan *plan = scenery->plan;
    shd_bend bend;
    return shd_sight_bend(scenery->sight, &s->survey, block, &bend) &&
           !plan->materials[plan->objects[bend.object].material].textures &&
           shd_mean_is_central(plan, &bend, &s->spread, &plan->mean_room);
}

/* The block that is the k-th one if those of a quad, of two by two, follow each other. */
static size_t block_in_quads(const shd_survey *survey, size_t k) {
    const size_t across = (size_t)survey->across, quads = across / 2, quad = k / 4;
    return (2 * (quad / quads) + (k / 2 & 1)) * across + 2 * (quad % quads) + (k & 1);
}

/* Lists all pixels of blocks where something may be seen, block by block, so that a bundle's rays
 * are near to each other: quad by quad, if lights are told for these (light_from_afar). */
static void list_blocks(const shd_scenery *scenery, shd_tile tile, size_t samples,
                        shd_tile_scratch *s) {
    const size_t blocks = (size_t)s->survey.across * (size_t)s->survey.down;
    size_t rest[SHD_BUNDLES], count = 0;
    s->bundle_count = 0;
    for (size_t k = 0; k < blocks; k++) {
        const size_t block = scenery->plan->bunches ? block_in_quads(&s->survey, k) : k;
        if (!s->survey.blocks[block].count) continue;
        if (shd_plan_is_draft(scenery->plan) && is_smooth(scenery, block, s))
            add_block(tile, block, 1, s);
        else
            rest[count++] = block;
    }
    for (size_t k = 0; k < count; k++) add_block(tile, rest[k], samples, s);
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
            (shd_bundle){(uint16_t)first, (uint16_t)(count - first < step ? count - first : step),
                         (uint16_t)samples, NULL};
}

void shd_list_pixels(const shd_scenery *scenery, shd_tile tile, shd_tile_scratch *s) {
    const shd_plan *plan = scenery->plan;
    const size_t samples = (size_t)plan->scene->raster.samples;
    if (s->survey.even && !shd_plan_is_draft(plan) && !plan->bunches)
        list_rows(tile, s, samples);
    else
        list_blocks(scenery, tile, samples, s);
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

shd_chunk shd_make_chunk(shd_tile tile, shd_tile_scratch *s, size_t first, size_t pattern) {
    const size_t samples = s->bundles[first].samples,
                 from = samples < pattern ? shd_center_sample(pattern) : 0;
    shd_chunk c = {s->bundles + first, 0, 0, samples};
    for (; first + c.count < s->bundle_count; c.count++) {
        const shd_bundle *next = &c.bundles[c.count];
        if (next->samples != samples || c.pixels + next->count > shd_pixels_at_once(samples)) break;
        make_shots(tile, s->pixels + next->first, next->count, samples, from, c.pixels * samples,
                   s);
        c.pixels += next->count;
    }
    return c;
}

void shd_shoot_chunk(const shd_scenery *scenery, const shd_chunk *c, shd_tile_scratch *s) {
    const uint32_t samples = (uint32_t)c->samples;
    shd_survey *survey = &s->survey;
    s->hits.count = 0;
    s->now = &s->hits;
    uint32_t first = 0;
    for (size_t b = 0; b < c->count; b++) {
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
