/* Casting: batches of rays through the kernel of the plan's instruction set. */
#include "base/cpu.h"
#include "sight/batch.h"

static const shd_cast_kernel *kernel_of(const shd_sight *sight) {
    static const shd_cast_kernel *const kernels[SHD_ISA_COUNT] = SHD_VARIANTS(shd_cast_kernel);
    return kernels[sight->plan->isa];
}

void shd_item_place(const shd_item *it, uint32_t triangle, double u, double v, shd_vec3 *point,
                    shd_vec3 *normal) {
    const shd_triangles *tri = &it->triangles;
    const double weight[3] = {1 - u - v, u, v};
    *point = *normal = (shd_vec3){0, 0, 0};
    for (int k = 0; k < 3; k++)
        *point = shd_madd(*point, shd_triangle_corner(tri, triangle, k), weight[k]);
    if (it->smooth) {
        for (int k = 0; k < 3; k++) {
            const double *n = tri->normals + 3 * (size_t)tri->indices[3 * triangle + (size_t)k];
            shd_vec3 unit = {n[0], n[1], n[2]};
            shd_normalize(unit, &unit);
            *normal = shd_madd(*normal, unit, weight[k]);
        }
    }
    if (!(shd_max_abs(*normal) > 0)) *normal = shd_triangle_normal(tri, triangle);
    shd_normalize(*normal, normal);
}

/* ---- Hits. ---- */

enum { GROUP = 16 };

bool shd_hits_new(const shd_plan *plan, size_t capacity, shd_arena *arena, shd_hits *out) {
    const shd_scene *scene = plan->scene;
    const bool fast = plan->tier != SHD_EXACT, *wants = plan->wants;
    bool faceted = false;
    for (size_t i = 0; i < scene->object_count; i++)
        faceted = faceted || scene->objects[i].interpolation != SHD_PHONG;
    const bool world = fast && wants[SHD_LAYER_POSITION];
    const bool depth = wants[SHD_LAYER_NORMAL] || wants[SHD_LAYER_POSITION] ||
                       wants[SHD_LAYER_DEPTH] || wants[SHD_LAYER_OBJECT];
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
        size_t hits = kernel->cast(sight, candidates, candidate_count, shots, first, wants, &stage);
        if (hits) kernel->append(&stage, hits, first, out);
    }
    return out->count - before;
}

/* ---- All samples of a tile. ---- */

struct shd_cast_scratch {
    uint32_t *candidates;
};

shd_cast_scratch *shd_cast_scratch_new(const shd_sight *sight, shd_arena *arena) {
    shd_cast_scratch *scratch = shd_arena_alloc(arena, 1, sizeof *scratch);
    if (!scratch) return NULL;
    scratch->candidates = shd_arena_alloc(arena, sight->count, sizeof *scratch->candidates);
    return scratch->candidates ? scratch : NULL;
}

bool shd_gbuffer_new(size_t count, shd_arena *arena, shd_gbuffer *out) {
    double *values = shd_arena_alloc(arena, 12 * count, sizeof *values);
    int32_t *object = shd_arena_alloc(arena, count, sizeof *object);
    uint32_t *triangle = shd_arena_alloc(arena, count, sizeof *triangle);
    if (!values || !object || !triangle) return false;
    *out = (shd_gbuffer){.depth = values + 9 * count,
                         .u = values + 10 * count,
                         .v = values + 11 * count,
                         .object = object,
                         .triangle = triangle};
    for (int c = 0; c < 3; c++) {
        out->position[c] = values + (size_t)c * count;
        out->normal[c] = values + (size_t)(3 + c) * count;
        out->view[c] = values + (size_t)(6 + c) * count;
    }
    return true;
}

static void store(const shd_stage *s, size_t first, size_t count, shd_gbuffer *out) {
    for (int c = 0; c < 3; c++) {
        memcpy(out->position[c] + first, s->position[c], count * sizeof(double));
        memcpy(out->normal[c] + first, s->normal[c], count * sizeof(double));
        memcpy(out->view[c] + first, s->view[c], count * sizeof(double));
    }
    memcpy(out->depth + first, s->depth, count * sizeof(double));
    memcpy(out->triangle + first, s->triangle, count * sizeof(uint32_t));
    memcpy(out->u + first, s->u, count * sizeof(double));
    memcpy(out->v + first, s->v, count * sizeof(double));
    for (size_t i = 0; i < count; i++) out->object[first + i] = (int32_t)s->object[i];
}

size_t shd_sight_cast(const shd_sight *sight, shd_tile tile, shd_cast_scratch *scratch,
                      shd_gbuffer *out) {
    const shd_cast_kernel *kernel = kernel_of(sight);
    const int samples = sight->plan->scene->raster.samples;
    const shd_wants wants = {.depth = true};
    out->count = (size_t)tile.w * (size_t)tile.h * (size_t)samples;
    size_t count = shd_sight_candidates(sight, tile, scratch->candidates), hits = 0;
    int32_t xs[SHD_RAYS], ys[SHD_RAYS];
    uint8_t sample[SHD_RAYS];
    int x = tile.x, y = tile.y, n = 0;
    shd_stage stage = {.t = {0}};
    for (size_t first = 0; first < out->count; first += SHD_RAYS) {
        const size_t used = out->count - first < SHD_RAYS ? out->count - first : SHD_RAYS;
        for (size_t i = 0; i < used; i++) {
            xs[i] = x;
            ys[i] = y;
            sample[i] = (uint8_t)n;
            if (++n < samples) continue;
            n = 0;
            if (++x < tile.x + tile.w) continue;
            x = tile.x;
            y++;
        }
        const shd_shots shots = {used, xs, ys, sample};
        if (count)
            hits += kernel->cast(sight, scratch->candidates, count, &shots, 0, wants, &stage);
        for (size_t i = 0; !count && i < SHD_RAYS; i++) stage.object[i] = SHD_NOTHING;
        store(&stage, first, used, out);
    }
    return hits;
}
