#include "render/tiles/runs.h"

#include <assert.h>
#include <string.h>

/* Copies the hits in the order of `order`. */
static void sort_hits(const shd_hits *from, const uint32_t *order, shd_hits *to) {
    const size_t count = to->count = from->count;
#define SORT(array)                                                                                \
    for (size_t i = 0; from->array && i < count; i++) to->array[i] = from->array[order[i]]
#define SORT_VECTORS(array)                                                                        \
    for (size_t i = 0; from->array[0] && i < count; i++)                                           \
        for (int c = 0; c < 3; c++) to->array[c][i] = from->array[c][order[i]]
    SORT_VECTORS(position32);
    SORT_VECTORS(normal32);
    SORT_VECTORS(mirror32);
    SORT_VECTORS(low32);
    SORT_VECTORS(position);
    SORT_VECTORS(normal);
    SORT_VECTORS(view);
    SORT(object);
    SORT(shot);
    SORT(depth);
    SORT(triangle);
    SORT(u);
    SORT(v);
#undef SORT_VECTORS
#undef SORT
    shd_hits_pad(to);
}

static void add_run(const shd_scenery *scenery, shd_tile_scratch *s, size_t class, uint32_t first,
                    uint32_t count) {
    const int32_t group = class == scenery->plan->group_count ? SHD_RADIANCE : (int32_t) class;
    assert(s->run_count < s->run_capacity);
    s->runs[s->run_count++] = (shd_run){group, first, count};
}

const shd_hits *shd_make_runs(const shd_scenery *scenery, const shd_hits *hits,
                              shd_tile_scratch *s) {
    const size_t classes = scenery->plan->group_count + 1;
    s->run_count = 0;
    if (!hits->count) return hits;
    const uint32_t *const class_of = scenery->classes;
    bool alike = shd_is_one_object(hits);
    if (!alike) {
        memset(s->starts, 0, (classes + 1) * sizeof *s->starts);
        for (size_t i = 0; i < hits->count; i++) s->starts[class_of[hits->object[i]] + 1]++;
        alike = s->starts[class_of[hits->object[0]] + 1] == hits->count;
    }
    if (alike) {
        add_run(scenery, s, class_of[hits->object[0]], 0, (uint32_t)hits->count);
        return hits;
    }
    for (size_t k = 0; k < classes; k++) {
        const uint32_t count = s->starts[k + 1];
        s->starts[k + 1] += s->starts[k];
        if (count) add_run(scenery, s, k, s->starts[k], count);
    }
    for (size_t i = 0; i < hits->count; i++)
        s->order[s->starts[class_of[hits->object[i]]]++] = (uint32_t)i;
    sort_hits(hits, s->order, &s->sorted);
    return &s->sorted;
}
