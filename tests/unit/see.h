/* All that is seen through the centres of a small picture's pixels, in any variant. */
#ifndef SHD_TEST_SEE_H
#define SHD_TEST_SEE_H

#include "property/pieces.h"

enum { SIDE = 64, ALL = SIDE * SIDE };

typedef struct seen {
    shd_request *request;
    shd_sight *sight;
    shd_hits hits;
} seen;

/* Leaves the arena's next bytes as another request might have: what is not set is then no zero. */
static inline void see_soiled(shd_arena *arena) {
    enum { BYTES = 1 << 16 };
    const shd_arena_mark mark = shd_arena_mark_here(arena);
    void *bytes = shd_arena_alloc(arena, BYTES, 1);
    assert_non_null(bytes);
    memset(bytes, 0x5a, BYTES);
    shd_arena_return(arena, mark);
}

/* Through all pixels' centres, row by row or block by block. Hits have their pixels' numbers, row
 * by row, in place of the shots'. */
static inline seen see_in_order(shd_engine *engine, const char *json, shd_isa isa, bool blocks) {
    static int32_t x[ALL], y[ALL];
    static uint8_t sample[ALL];
    uint32_t objects[8] = {0, 1, 2, 3, 4, 5, 6, 7};
    seen s = {.request = read_scene(engine, json)};
    shd_error error = {.status = SHD_OK};
    shd_arena *arena = s.request->rendering.arena;
    const shd_status planned =
        shd_plan_make(s.request->scene, isa, NULL, NULL, arena, &s.request->rendering.plan, &error);
    see_soiled(arena);
    if (planned || shd_sight_new(s.request->rendering.plan, NULL, arena, &s.sight, &error))
        fail_msg("%s: %s", error.path, error.text);
    s.hits = new_hits(s.request->rendering.plan, ALL, arena);
    for (int i = 0; i < ALL; i++) {
        x[i] = blocks ? i / 64 % 8 * 8 + i % 8 : i % SIDE;
        y[i] = blocks ? i / 512 * 8 + i % 64 / 8 : i / SIDE;
        sample[i] = 0;
    }
    const shd_shots shots = {ALL, x, y, sample};
    assert_true(s.request->scene->object_count <= 8);
    shd_sight_shoot(s.sight, objects, s.request->scene->object_count, &shots, &s.hits);
    for (size_t i = 0; i < s.hits.count; i++) {
        const uint32_t shot = s.hits.shot[i];
        s.hits.shot[i] = (uint32_t)(y[shot] * SIDE + x[shot]);
    }
    return s;
}

static inline seen see(shd_engine *engine, const char *json, shd_isa isa) {
    return see_in_order(engine, json, isa, false);
}

/* As bundles of other shapes than rows. */
static inline seen see_by_blocks(shd_engine *engine, const char *json, shd_isa isa) {
    return see_in_order(engine, json, isa, true);
}

static inline void drop_seen(seen *s) {
    shd_request_drop(s->request);
}

#define PICTURE "\"image\": {\"width\": 64, \"height\": 64, \"samples\": 1}, \"lights\": []"
#define EXACT   ", \"accuracy\": {\"tier\": \"exact\"}"

/* Goes on to the next variant that this machine has; false: there is none. */
static inline bool every_variant(shd_isa *isa) {
    while (*isa < SHD_ISA_COUNT && !shd_cpu_has(*isa)) (*isa)++;
    return *isa < SHD_ISA_COUNT;
}

#endif
