#include "plan/bundles.h"

#include <stdlib.h>

#include "plan/morton.h"

/* A light that has a place, and where on a curve through all of them that is. */
typedef struct placed {
    shd_vec3 at;
    uint32_t light, key;
} placed;

static int compare_places(const void *x, const void *y) {
    const placed *a = x, *b = y;
    if (a->key != b->key) return a->key < b->key ? -1 : 1;
    return a->light < b->light ? -1 : a->light > b->light;
}

static void sort_places(placed *lights, size_t count) {
    shd_vec3 low = {INFINITY, INFINITY, INFINITY}, high = {-INFINITY, -INFINITY, -INFINITY};
    for (size_t i = 0; i < count; i++) {
        low = shd_vec3_min(low, lights[i].at);
        high = shd_vec3_max(high, lights[i].at);
    }
    const shd_vec3 size = shd_sub(high, low);
    for (size_t i = 0; i < count; i++) lights[i].key = shd_morton(lights[i].at, low, size);
    qsort(lights, count, sizeof *lights, compare_places);
}

static void bundle_places(const placed *lights, size_t first, size_t count, shd_bundles *out) {
    shd_bundle *b = &out->list[out->count++];
    *b = (shd_bundle){
        .low = lights[first].at, .high = lights[first].at, .first = first, .count = count};
    for (size_t i = first; i < first + count; i++) {
        b->low = shd_vec3_min(b->low, lights[i].at);
        b->high = shd_vec3_max(b->high, lights[i].at);
        b->away = shd_larger(b->away, shd_length_at_most(lights[i].at));
    }
    b->middle = shd_madd(shd_scale(b->low, 0.5), b->high, 0.5);
    b->half = shd_scale(shd_sub(b->high, b->low), 0.5 * (1 + 1e-9));
    if (count > SHD_TOGETHER) {
        const size_t some = (count / SHD_TOGETHER + 1) / 2 * SHD_TOGETHER;
        bundle_places(lights, first, some, out);
        bundle_places(lights, first + some, count - some, out);
    }
    b->next = out->count;
}

/* False: memory. */
static bool new_rows(shd_rows *r, size_t count, shd_arena *arena) {
    const size_t most = count + SHD_TOGETHER;
    *r = (shd_rows){.x = shd_arena_zalloc(arena, most, sizeof *r->x),
                    .y = shd_arena_zalloc(arena, most, sizeof *r->y),
                    .z = shd_arena_zalloc(arena, most, sizeof *r->z),
                    .lights = shd_arena_alloc(arena, count, sizeof *r->lights)};
    return r->x && r->y && r->z && r->lights;
}

static void add_row(shd_rows *r, shd_vec3 at, size_t light) {
    r->x[r->count] = at.x;
    r->y[r->count] = at.y;
    r->z[r->count] = at.z;
    r->lights[r->count++] = (uint32_t)light;
}

bool shd_bundles_need(const shd_plan *plan, shd_arena *arena, shd_bundles *out) {
    if (out->list) return true;
    const size_t all = plan->light_count;
    size_t count = 0;
    placed *lights = shd_arena_alloc(arena, all, sizeof *lights);
    out->list = shd_arena_alloc(arena, 2 * (all / SHD_TOGETHER + 1), sizeof *out->list);
    for (size_t j = 0; lights && j < all; j++)
        if (!plan->lights[j].directional)
            lights[count++] = (placed){.at = plan->lights[j].position, .light = (uint32_t)j};
    if (!lights || !out->list || !new_rows(&out->placed, count, arena) ||
        !new_rows(&out->far, all - count, arena))
        return false;
    for (size_t j = 0; j < all; j++)
        if (plan->lights[j].directional) add_row(&out->far, plan->lights[j].toward, j);
    if (count > SHD_TOGETHER) sort_places(lights, count);
    if (count) bundle_places(lights, 0, count, out);
    for (size_t i = 0; i < count; i++) add_row(&out->placed, lights[i].at, lights[i].light);
    return true;
}
