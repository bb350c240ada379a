#include "render/tiles/patch.h"

#include <math.h>

shd_patch shd_patch_of(const shd_scenery *scenery, const shd_hits *hits, size_t first,
                       size_t count) {
    const shd_plan *plan = scenery->plan;
    const float *position[3], *normal[3];
    for (int c = 0; c < 3; c++) {
        position[c] = hits->position32[c] + first;
        normal[c] = hits->normal32[c] + first;
    }
    float low[3], high[3], sum[3];
    scenery->paint->bound(position, normal, count, low, high, sum);
    double center[3], square = 0;
    for (int c = 0; c < 3; c++) {
        /* The points are where they were before they were rounded to f32. */
        const double reach = fmax(fabs((double)low[c]), fabs((double)high[c])),
                     half = ((double)high[c] - (double)low[c]) / 2 + 0x1p-24 * reach;
        center[c] = ((double)low[c] + (double)high[c]) / 2;
        square += half * half;
    }
    const double world = 1 / plan->scale;
    shd_patch patch = {
        .center = shd_madd(plan->origin, (shd_vec3){center[0], center[1], center[2]}, world),
        .radius = sqrt(square) * world,
        .axis = {0, 0, 1},
        .cos_spread = -1};
    const shd_vec3 total = {(double)sum[0], (double)sum[1], (double)sum[2]};
    if (!shd_normalize(total, &patch.axis)) return patch;
    const float axis[3] = {(float)patch.axis.x, (float)patch.axis.y, (float)patch.axis.z};
    /* Normals, the axis and their product are each rounded to f32. */
    patch.cos_spread = (double)scenery->paint->spread(normal, axis, count) - 0x1p-21;
    return patch;
}
