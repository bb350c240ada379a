#include "plan/bunches.h"

#include <assert.h>
#include <stdlib.h>

#include "plan/parts.h"

enum { LEAF = 8 /* lights that are not divided further */ };

typedef struct key {
    double at;
    uint32_t light;
} key;

typedef struct builder {
    const shd_plan *plan;
    shd_bunches *out;
    key *keys; /* [light_count] */
    size_t fall_count;
} builder;

static bool falls_alike(const shd_plan_light *x, const shd_plan_light *y) {
    if (x->attenuated != y->attenuated) return false;
    return !x->attenuated ||
           (x->a == y->a && x->b == y->b && x->c == y->c && x->min_distance == y->min_distance);
}

/* The light's kind of attenuation; SHD_FALLS: it is in no tree. */
static size_t fall_of(builder *b, const shd_plan_light *light) {
    shd_plan_light *falls = b->out->falls;
    if (light->directional || light->spot || light->shape || light->environment ||
        !(light->color[0] >= 0 && light->color[1] >= 0 && light->color[2] >= 0))
        return SHD_FALLS;
    size_t fall = 0;
    while (fall < b->fall_count && !falls_alike(&falls[fall], light)) fall++;
    if (fall == SHD_FALLS) return fall;
    if (fall == b->fall_count) falls[b->fall_count++] = *light;
    falls[fall].gain = shd_larger(falls[fall].gain, light->gain);
    return fall;
}

void shd_moments(shd_vec3 s, double m[SHD_BUNCH_MOMENTS]) {
    m[0] = 1;
    for (int g = 1; g < 6; g++) {
        const double *from = m + shd_monomials_below(g - 1);
        double *out = m + shd_monomials_below(g);
        for (int r = 0; r < g; r++)
            for (int z = 0; z <= r; z++)
                out[shd_monomial(r, z)] = from[shd_monomial(r, z)] * s.x / (g - r);
        for (int z = 0; z < g; z++)
            out[shd_monomial(g, z)] = from[shd_monomial(g - 1, z)] * s.y / (g - z);
        out[shd_monomial(g, g)] = from[shd_monomial(g - 1, g - 1)] * s.z / g;
    }
}

/* How many channels of moments differ. */
static int channels_of(const builder *b) {
    return b->plan->grey_lights ? 1 : 3;
}

static shd_bunch gather_lights(const builder *b, uint32_t first, uint32_t end, uint32_t fall) {
    const shd_plan *plan = b->plan;
    const uint32_t *lights = b->out->lights;
    shd_vec3 low = {INFINITY, INFINITY, INFINITY}, high = {-INFINITY, -INFINITY, -INFINITY};
    shd_bunch bunch = {.first = first, .end = end, .fall = fall};
    for (uint32_t i = first; i < end; i++) {
        low = shd_vec3_min(low, plan->lights[lights[i]].position);
        high = shd_vec3_max(high, plan->lights[lights[i]].position);
    }
    bunch.center = shd_madd(shd_scale(low, 0.5), high, 0.5);
    for (uint32_t i = first; i < end; i++) {
        const shd_plan_light *light = &plan->lights[lights[i]];
        const shd_vec3 s = shd_sub(bunch.center, light->position);
        const double share = light->gain / b->out->falls[fall].gain;
        for (int c = 0; c < 3; c++)
            bunch.strength[c] += light->color[c] * share * (1 + SHD_PIECE_MARGIN);
        bunch.radius = shd_larger(bunch.radius, shd_plan_length(s) * (1 + SHD_PIECE_MARGIN));
    }
    return bunch;
}

/* The moments of a leaf, light by light. */
static void add_lights(const builder *b, shd_bunch *to) {
    for (uint32_t i = to->first; i < to->end; i++) {
        const shd_plan_light *light = &b->plan->lights[b->out->lights[i]];
        const double share = light->gain / b->out->falls[to->fall].gain;
        double m[SHD_BUNCH_MOMENTS];
        shd_moments(shd_sub(to->center, light->position), m);
        for (int c = 0; c < channels_of(b); c++)
            for (int k = 0; k < SHD_BUNCH_MOMENTS; k++)
                to->moments[c][k] += light->color[c] * share * m[k];
    }
}

/* Adds a part's moments: with w from its center to the whole's, a light that is s beside the former
 * is s + w beside the latter, and monomials over factorials of a sum are sums of products of those
 * of its parts. */
static void add_part(const builder *b, const shd_bunch *part, shd_bunch *to) {
    double way[SHD_BUNCH_MOMENTS];
    shd_moments(shd_sub(to->center, part->center), way);
    for (int c = 0; c < channels_of(b); c++)
#pragma GCC unroll 6
        for (int from = 0; from < 6; from++)
#pragma GCC unroll 6
            for (int g = 0; from + g < 6; g++)
#pragma GCC unroll 6
                for (int r = 0; r <= g; r++)
#pragma GCC unroll 6
                    for (int z = 0; z <= r; z++)
#pragma GCC unroll 6
                        for (int q = 0; q <= from; q++)
#pragma GCC unroll 6
                            for (int k = 0; k <= q; k++)
                                to->moments[c][shd_monomials_below(from + g) +
                                               shd_monomial(q + r, k + z)] +=
                                    way[shd_monomials_below(g) + shd_monomial(r, z)] *
                                    part->moments[c]
                                                 [shd_monomials_below(from) + shd_monomial(q, k)];
}

/* Parts follow what they are parts of, so that the last ones are known first. False: memory. */
static bool find_moments(const builder *b, shd_arena *arena) {
    const size_t channels = (size_t)channels_of(b);
    double(*moments)[SHD_BUNCH_MOMENTS] =
        shd_arena_zalloc(arena, b->out->count, channels * sizeof *moments);
    if (!moments) return false;
    for (size_t i = b->out->count; i-- > 0;) {
        shd_bunch *bunch = &b->out->list[i];
        bunch->moments = moments + i * channels;
        if (bunch->parts) {
            add_part(b, &b->out->list[bunch->parts], bunch);
            add_part(b, &b->out->list[bunch->parts + 1], bunch);
        } else {
            add_lights(b, bunch);
        }
    }
    return true;
}

static int compare_keys(const void *x, const void *y) {
    const key *a = x, *b = y;
    if (a->at != b->at) return a->at < b->at ? -1 : 1;
    return a->light < b->light ? -1 : 1;
}

/* Lets keys before the `middle` be no further along than those from there on (Hoare). Lights may be
 * listed such that each round tells of a few only: what some rounds leave is sorted (Musser). */
static void select_keys(key *keys, int count, int middle) {
    enum { ROUNDS = 40 };
    for (int low = 0, high = count - 1, round = 0; low < high; round++) {
        if (round == ROUNDS) {
            qsort(keys + low, (size_t)(high - low + 1), sizeof *keys, compare_keys);
            return;
        }
        const key pivot = keys[low + (high - low) / 2];
        int i = low, j = high;
        while (i <= j) {
            while (compare_keys(&keys[i], &pivot) < 0) i++;
            while (compare_keys(&pivot, &keys[j]) < 0) j--;
            if (i > j) break;
            const key one = keys[i];
            keys[i++] = keys[j];
            keys[j--] = one;
        }
        if (middle > j && middle < i) return;
        if (middle <= j)
            high = j;
        else
            low = i;
    }
}

static double along(shd_vec3 v, int axis) {
    return axis == 0 ? v.x : axis == 1 ? v.y : v.z;
}

/* Halves the lights along the longest side of their box. Returns where the second part begins. */
static uint32_t divide_lights(builder *b, const shd_bunch *bunch) {
    uint32_t *lights = b->out->lights + bunch->first;
    const uint32_t count = bunch->end - bunch->first;
    shd_vec3 size = {0, 0, 0};
    for (uint32_t i = 0; i < count; i++) {
        const shd_vec3 s = shd_sub(b->plan->lights[lights[i]].position, bunch->center);
        size.x = shd_larger(size.x, fabs(s.x));
        size.y = shd_larger(size.y, fabs(s.y));
        size.z = shd_larger(size.z, fabs(s.z));
    }
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    for (uint32_t i = 0; i < count; i++)
        b->keys[i] = (key){along(b->plan->lights[lights[i]].position, axis), lights[i]};
    if (count > 2 * LEAF) /* parts of it are divided again */
        select_keys(b->keys, (int)count, (int)count / 2);
    else
        qsort(b->keys, count, sizeof *b->keys, compare_keys);
    for (uint32_t i = 0; i < count; i++) lights[i] = b->keys[i].light;
    return bunch->first + count / 2;
}

/* Sorts lights by how they fall off, a root for each kind. False: memory. */
static bool plant_roots(builder *b, shd_arena *arena) {
    const shd_plan *plan = b->plan;
    shd_bunches *out = b->out;
    uint8_t *falls = shd_arena_alloc(arena, plan->light_count, sizeof *falls);
    if (!falls) return false;
    for (size_t j = 0; j < plan->light_count; j++) falls[j] = (uint8_t)fall_of(b, &plan->lights[j]);
    uint32_t at = 0;
    for (size_t fall = 0; fall <= b->fall_count; fall++) {
        const size_t kind = fall < b->fall_count ? fall : SHD_FALLS;
        const uint32_t first = at;
        for (uint32_t j = 0; j < plan->light_count; j++) {
            if (falls[j] != kind) continue;
            if (kind == SHD_FALLS)
                out->lights[at + out->alone_count++] = j;
            else
                out->lights[at++] = j;
        }
        if (at > first) out->list[out->count++] = gather_lights(b, first, at, (uint32_t)kind);
    }
    out->roots = out->count;
    out->light_count = at;
    out->alone = out->lights + at;
    return true;
}

static shd_bunch_row row_of(const shd_plan_light *l, shd_vec3 at, const double color[3],
                            double radius) {
    const bool falls = l->attenuated;
    return (shd_bunch_row){.position = at,
                           .gain = l->gain,
                           .color = {color[0], color[1], color[2]},
                           .radius = radius,
                           .a = falls ? l->a : 1,
                           .b = falls ? l->b : 0,
                           .c = falls ? l->c : 0,
                           .least = falls ? l->min_distance : 0};
}

static bool fill_rows(const shd_plan *plan, shd_arena *arena, shd_bunches *out) {
    out->rows = shd_arena_alloc(arena, plan->light_count, sizeof *out->rows);
    out->wholes = shd_arena_alloc(arena, out->count, sizeof *out->wholes);
    if (!out->rows || !out->wholes) return false;
    for (size_t i = 0; i < out->light_count; i++) {
        const shd_plan_light *l = &plan->lights[out->lights[i]];
        out->rows[i] = row_of(l, l->position, l->color, 0);
    }
    for (size_t i = 0; i < out->count; i++) {
        const shd_bunch *bunch = &out->list[i];
        out->wholes[i] =
            row_of(&out->falls[bunch->fall], bunch->center, bunch->strength, bunch->radius);
    }
    return true;
}

bool shd_bunches_new(const shd_plan *plan, shd_arena *arena, const shd_bunches **out) {
    const size_t lights = plan->light_count,
                 most = lights / 2 + 2 * SHD_FALLS; /* leaves have 4 or more, or are roots */
    shd_bunches *made = shd_arena_zalloc(arena, 1, sizeof *made);
    if (!made) return false;
    made->list = shd_arena_alloc(arena, most, sizeof *made->list);
    made->lights = shd_arena_alloc(arena, lights, sizeof *made->lights);
    builder b = {.plan = plan, .out = made, .keys = shd_arena_alloc(arena, lights, sizeof *b.keys)};
    if (!made->list || !made->lights || !b.keys || !plant_roots(&b, arena)) return false;
    for (size_t i = 0; i < made->count; i++) {
        if (shd_is_cancelled(plan->cancelled)) return false;
        shd_bunch *bunch = &made->list[i];
        if (bunch->end - bunch->first <= LEAF) {
            made->leaves++;
            continue;
        }
        assert(made->count + 2 <= most);
        const uint32_t middle = divide_lights(&b, bunch);
        bunch->parts = (uint32_t)made->count;
        made->list[made->count++] = gather_lights(&b, bunch->first, middle, bunch->fall);
        made->list[made->count++] = gather_lights(&b, middle, bunch->end, bunch->fall);
    }
    if (!find_moments(&b, arena) || !fill_rows(plan, arena, made)) return false;
    *out = made;
    return true;
}
