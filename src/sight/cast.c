#include <assert.h>

#include "sight/item.h"

enum { GROUP = 16 };

/* Lists the arrays of hits, each with whether it is wanted. */
#define ARRAYS(each)                                                                               \
    each(shot, true);                                                                              \
    each(object, true);                                                                            \
    for (int c = 0; c < 3; c++) {                                                                  \
        each(position32[c], fast);                                                                 \
        each(normal32[c], fast);                                                                   \
        each(mirror32[c], fast);                                                                   \
        each(low32[c], low);                                                                       \
        each(world32[c], world);                                                                   \
        each(position[c], !fast);                                                                  \
        each(normal[c], !fast);                                                                    \
        each(view[c], !fast);                                                                      \
    }                                                                                              \
    each(depth, data);                                                                             \
    each(triangle, faceted);                                                                       \
    each(u, faceted);                                                                              \
    each(v, faceted);

void shd_hits_lay_out(const shd_plan *plan, size_t capacity, shd_scratch *memory, shd_hits *out) {
    const bool fast = plan->tier != SHD_EXACT;
    const bool *wants = plan->wants;
    const bool low = fast && plan->split_positions;
    const bool world = fast && wants[SHD_LAYER_POSITION];
    const bool data = wants[SHD_LAYER_NORMAL] || wants[SHD_LAYER_POSITION] ||
                      wants[SHD_LAYER_DEPTH] || wants[SHD_LAYER_OBJECT];
    /* These ask for meshes' triangles, too. */
    const bool faceted =
        shd_is_traced(plan->scene) || plan->charted || plan->bent_meshes || plan->faceted;
    *out = (shd_hits){.capacity = (capacity + GROUP - 1) / GROUP * GROUP};
#define TAKE(array, wanted)                                                                        \
    if (wanted) out->array = shd_scratch_take(memory, out->capacity, sizeof *out->array)
    ARRAYS(TAKE)
#undef TAKE
}

void shd_hits_pad(shd_hits *hits) {
#define PAD(array, wanted)                                                                         \
    if (hits->array)                                                                               \
        for (size_t k = 0; k < GROUP - 1; k++) hits->array[count + k] = hits->array[count - 1]
    const size_t count = hits->count;
    if (!count) return;
    assert(hits->capacity - count >= GROUP - 1);
    ARRAYS(PAD)
#undef PAD
}

static shd_shoot_function *const VARIANTS[SHD_ISA_COUNT] = SHD_VARIANTS(shd_shoot);

size_t shd_sight_shoot(const shd_sight *sight, const uint32_t *candidates, size_t candidate_count,
                       const shd_shots *shots, shd_hits *out) {
    const shd_targets all = {candidates, candidate_count, INFINITY, false};
    const size_t before = out->count;
    assert(out->capacity - before >= shots->count);
    VARIANTS[sight->plan->isa](sight, &all, shots, 0, out);
    return out->count - before;
}

size_t shd_sight_shoot_block(const shd_sight *sight, shd_survey *survey, size_t block,
                             const shd_shots *shots, shd_hits *out) {
    const shd_block *b = &survey->blocks[block];
    const size_t before = out->count;
    assert(out->capacity - before >= shots->count);
    for (size_t first = 0; first < shots->count && !shd_is_cancelled(sight->cancelled);) {
        shd_targets known = {survey->candidates + b->first, b->count, INFINITY, true};
        if (b->next < survey->candidate_count)
            known.beyond = (double)sight->seen[survey->candidates[b->next]].nearest;
        first = VARIANTS[sight->plan->isa](sight, &known, shots, first, out);
        if (first < shots->count) shd_survey_further(sight, survey, block);
    }
    return out->count - before;
}
