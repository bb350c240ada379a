/* Casting: batches of rays through the kernel of the plan's instruction set. */
#include "base/cpu.h"
#include "sight/batch.h"

static const shd_cast_kernel *kernel_of(const shd_sight *sight) {
    static const shd_cast_kernel *const kernels[SHD_ISA_COUNT] = SHD_VARIANTS(shd_cast_kernel);
    return kernels[sight->plan->isa];
}

/* ---- Hits. ---- */

enum { GROUP = 16 };

static bool has_facets(const shd_scene *scene) {
    bool faceted = false;
    for (size_t i = 0; i < scene->object_count; i++)
        faceted = faceted || scene->objects[i].interpolation != SHD_PHONG;
    return faceted;
}

static bool has_data(const shd_plan *plan) {
    const bool *wants = plan->wants;
    return wants[SHD_LAYER_NORMAL] || wants[SHD_LAYER_POSITION] || wants[SHD_LAYER_DEPTH] ||
           wants[SHD_LAYER_OBJECT];
}

size_t shd_hit_size(const shd_plan *plan) {
    const bool fast = plan->tier != SHD_EXACT, world = fast && plan->wants[SHD_LAYER_POSITION];
    const size_t floats = 9 + (plan->split_positions ? 3 : 0) + (world ? 3 : 0);
    const size_t geometry = fast ? floats * sizeof(float) : 9 * sizeof(double);
    return 2 * sizeof(uint32_t) + geometry + (has_data(plan) ? sizeof(double) : 0) +
           (has_facets(plan->scene) ? sizeof(uint32_t) + 2 * sizeof(double) : 0);
}

bool shd_hits_new(const shd_plan *plan, size_t capacity, shd_arena *arena, shd_hits *out) {
    const bool fast = plan->tier != SHD_EXACT;
    const bool faceted = has_facets(plan->scene), depth = has_data(plan);
    const bool world = fast && plan->wants[SHD_LAYER_POSITION];
    shd_hits hits = {.capacity = (capacity + GROUP - 1) / GROUP * GROUP};
    bool made = true;
#define NEW(array, wanted)                                                                         \
    if (wanted) made = (array = shd_arena_alloc(arena, hits.capacity, sizeof *(array))) && made
    NEW(hits.shot, true);
    NEW(hits.object, true);
    for (int c = 0; c < 3; c++) {
        NEW(hits.position32[c], fast);
        NEW(hits.normal32[c], fast);
        NEW(hits.mirror32[c], fast);
        NEW(hits.low32[c], fast && plan->split_positions);
        NEW(hits.world32[c], world);
        NEW(hits.position[c], !fast);
        NEW(hits.normal[c], !fast);
        NEW(hits.view[c], !fast);
    }
    NEW(hits.depth, depth);
    NEW(hits.triangle, faceted);
    NEW(hits.u, faceted);
    NEW(hits.v, faceted);
#undef NEW
    if (made) *out = hits;
    return made;
}

#define PAD(array)                                                                                 \
    if (array)                                                                                     \
        for (size_t k = hits->count; k % GROUP; k++) (array)[k] = (array)[hits->count - 1]

void shd_hits_pad(shd_hits *hits) {
    if (!hits->count) return;
    PAD(hits->shot);
    PAD(hits->object);
    for (int c = 0; c < 3; c++) {
        PAD(hits->position32[c]);
        PAD(hits->normal32[c]);
        PAD(hits->mirror32[c]);
        PAD(hits->low32[c]);
        PAD(hits->world32[c]);
        PAD(hits->position[c]);
        PAD(hits->normal[c]);
        PAD(hits->view[c]);
    }
    PAD(hits->depth);
    PAD(hits->triangle);
    PAD(hits->u);
    PAD(hits->v);
}

size_t shd_sight_shoot(const shd_sight *sight, const uint32_t *candidates, size_t candidate_count,
                       const shd_shots *shots, shd_hits *out) {
    const shd_cast_kernel *kernel = kernel_of(sight);
    const shd_wants wants = {.fast = out->position32[0],
                             .low = out->low32[0],
                             .world = out->world32[0],
                             .depth = out->depth};
    const size_t before = out->count;
    if (!candidate_count) return 0;
    shd_stage stage;
    for (size_t first = 0; first < shots->count; first += SHD_RAYS) {
        if (shd_is_cancelled(sight->cancelled)) break;
        size_t hits = kernel->cast(sight, candidates, candidate_count, shots, first, wants, &stage);
        if (hits) kernel->append(&stage, hits, first, out);
    }
    return out->count - before;
}
