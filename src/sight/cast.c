/* Casting: batches of rays through the kernel of the plan's instruction set. */
#include "base/cpu.h"
#include "sight/batch.h"

static const shd_cast_kernel *cast_kernel_of(const shd_sight *sight) {
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

void shd_hits_lay_out(const shd_plan *plan, size_t capacity, shd_scratch *memory, shd_hits *out) {
    const bool fast = plan->tier != SHD_EXACT;
    const bool faceted = has_facets(plan->scene), depth = has_data(plan);
    const bool world = fast && plan->wants[SHD_LAYER_POSITION];
    *out = (shd_hits){.capacity = (capacity + GROUP - 1) / GROUP * GROUP};
#define TAKE(array, wanted)                                                                        \
    if (wanted) out->array = shd_scratch_take(memory, out->capacity, sizeof *out->array)
    TAKE(shot, true);
    TAKE(object, true);
    for (int c = 0; c < 3; c++) {
        TAKE(position32[c], fast);
        TAKE(normal32[c], fast);
        TAKE(mirror32[c], fast);
        TAKE(low32[c], fast && plan->split_positions);
        TAKE(world32[c], world);
        TAKE(position[c], !fast);
        TAKE(normal[c], !fast);
        TAKE(view[c], !fast);
    }
    TAKE(depth, depth);
    TAKE(triangle, faceted);
    TAKE(u, faceted);
    TAKE(v, faceted);
#undef TAKE
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
    const shd_cast_kernel *kernel = cast_kernel_of(sight);
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
