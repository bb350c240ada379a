#include "render/tiles/shots.h"

#include <assert.h>
#include <string.h>

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

/* Lists all pixels of blocks where something may be seen, block by block, so that a bundle's rays
 * are near to each other. */
static void list_blocks(shd_tile tile, shd_tile_scratch *s) {
    const int left = tile.x % SHD_TILE, right = left + tile.w, top = tile.y % SHD_TILE,
              bottom = top + tile.h;
    size_t count = 0;
    s->bundle_count = 0;
    for (int y = top, below; y < bottom; y = below) {
        below = lesser_of((y / SHD_BLOCK_SIDE + 1) * SHD_BLOCK_SIDE, bottom);
        for (int x = left, beside; x < right; x = beside) {
            beside = lesser_of((x / SHD_BLOCK_SIDE + 1) * SHD_BLOCK_SIDE, right);
            const shd_block *block =
                &s->survey.blocks[y / SHD_BLOCK_SIDE * s->survey.across + x / SHD_BLOCK_SIDE];
            if (!block->count) continue;
            const size_t first = count;
            for (int row = y; row < below; row++) count = list_row(s, count, row, x, beside);
            s->bundles[s->bundle_count++] =
                (shd_bundle){(uint16_t)first, (uint16_t)(count - first), block};
        }
    }
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
        s->bundles[s->bundle_count++] = (shd_bundle){
            (uint16_t)first, (uint16_t)(count - first < step ? count - first : step), NULL};
}

void shd_list_pixels(shd_tile tile, size_t samples, bool blocks, shd_tile_scratch *s) {
    if (s->survey.even && !blocks)
        list_rows(tile, s, samples);
    else
        list_blocks(tile, s);
}

/* ---- Chunks. ---- */

/* Makes the first sample of all pixels of a bundle, then the second one, and so on: a sample's rays
 * lie beside each other, and so do the values that make the means of neighboring pixels. */
static void make_shots(shd_tile tile, const uint16_t *cells, size_t pixels, size_t samples,
                       size_t at, shd_tile_scratch *s) {
    const int left = tile.x / SHD_TILE * SHD_TILE, top = tile.y / SHD_TILE * SHD_TILE;
    assert(at + pixels * samples <= SHD_CHUNK);
    for (size_t i = 0; i < pixels; i++) {
        s->shot_cell[at + i] = cells[i];
        s->x[at + i] = left + cells[i] % SHD_TILE;
        s->y[at + i] = top + cells[i] / SHD_TILE;
    }
    memset(s->sample + at, 0, pixels * sizeof *s->sample);
    for (size_t k = 1; k < samples; k++) {
        const size_t to = at + k * pixels;
        memcpy(s->shot_cell + to, s->shot_cell + at, pixels * sizeof *s->shot_cell);
        memcpy(s->x + to, s->x + at, pixels * sizeof *s->x);
        memcpy(s->y + to, s->y + at, pixels * sizeof *s->y);
        memset(s->sample + to, (int)k, pixels * sizeof *s->sample);
    }
}

shd_chunk shd_make_chunk(shd_tile tile, shd_tile_scratch *s, size_t first, size_t samples) {
    shd_chunk c = {s->bundles + first, 0, 0};
    for (; first + c.count < s->bundle_count; c.count++) {
        const shd_bundle *next = &c.bundles[c.count];
        if (c.pixels + next->count > shd_pixels_at_once(samples)) break;
        make_shots(tile, s->pixels + next->first, next->count, samples, c.pixels * samples, s);
        c.pixels += next->count;
    }
    return c;
}

void shd_shoot_chunk(const shd_scenery *scenery, const shd_chunk *c, shd_tile_scratch *s) {
    const uint32_t samples = (uint32_t)scenery->plan->scene->raster.samples;
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
