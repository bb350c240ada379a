#include "render/tiles/flat.h"

#include "shade/sketch.h"
#include "sight/faces.h"

enum { SIDE = SHD_SKETCH_SIDE };

/* Draws a sample of all pixels. What is not hit shows the background. False: it may not be
 * sketched. `any`: the pixels that were hit, in any sample. */
static bool draw_sample(const shd_scenery *scenery, size_t block, int sample,
                        const shd_tile_scratch *s, size_t stride, float *const rgb[3],
                        uint64_t *any) {
    const shd_scene *scene = scenery->plan->scene;
    shd_block_faces faces;
    if (!shd_sight_faces(scenery->sight, &s->survey, block, sample, &faces)) return false;
    if (~faces.hit && (scene->transparent || scene->backdrop)) return false;
    if (faces.count && !shd_sketch_faces(scenery->lighting, &faces, stride, rgb)) return false;
    for (uint64_t left = ~faces.hit; left; left &= left - 1) {
        const size_t i = (size_t)__builtin_ctzll(left), at = i / SIDE * stride + i % SIDE;
        for (int c = 0; c < 3; c++) rgb[c][at] = (float)scene->background[c];
    }
    *any |= faces.hit;
    return true;
}

/* The mean of all samples. */
static bool draw_samples(const shd_scenery *scenery, size_t block, int samples,
                         const shd_tile_scratch *s, float *const rgb[3], uint64_t *any) {
    const float share = 1 / (float)samples;
    float sums[3][SHD_SKETCH_PIXELS] = {{0}},
          rows[3][SHD_SKETCH_PIXELS], *const sample[3] = {rows[0], rows[1], rows[2]};
    for (int k = 0; k < samples; k++) {
        if (!draw_sample(scenery, block, k, s, SIDE, sample, any)) return false;
        for (int c = 0; c < 3; c++)
            for (int i = 0; i < SHD_SKETCH_PIXELS; i++) sums[c][i] += rows[c][i];
    }
    for (int c = 0; c < 3; c++)
        for (size_t y = 0; y < SIDE; y++)
            for (size_t x = 0; x < SIDE; x++)
                rgb[c][y * SHD_TILE + x] = sums[c][y * SIDE + x] * share;
    return true;
}

bool shd_draw_flat(const shd_scenery *scenery, size_t block, shd_tile_scratch *s) {
    const size_t across = (size_t)s->survey.across,
                 first = (block / across * SHD_TILE + block % across) * SIDE;
    const int samples = scenery->plan->scene->raster.samples;
    float *const rgb[3] = {s->sketch[0] + first, s->sketch[1] + first, s->sketch[2] + first};
    uint64_t any = 0;
    if (!(samples == 1 ? draw_sample(scenery, block, 0, s, SHD_TILE, rgb, &any)
                       : draw_samples(scenery, block, samples, s, rgb, &any)))
        return false;
    s->sketched |= (uint32_t)(any != 0) << block;
    return true;
}
