#include "bound/light/clusters.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

enum {
    LEAF = 4,  /* lights that are not divided further */
    FALLS = 8, /* kinds of attenuation that are kept apart; more are mixed in the last one */
    /* Directional, constant and attenuated lights err otherwise. */
    CLASSES = 2 + FALLS
};

/* Clusters are as wide as this times their distance at most. With a third of it, bounds of 10,000
 * lamps among 10,000 spheres were no more than 1e-4 tighter. */
static const double WIDEST = 2;

/* Of what holds several objects, so many radii count as width: bounds are then what they would be
 * by each object for itself, to one percent. */
static const double ROOMY = 4;

typedef struct key {
    double at;
    uint32_t light;
} key;

typedef struct builder {
    const shd_plan *plan;
    const shd_hues *hues;
    const double *beside;
    shd_clusters *out;
    key *keys;                          /* [light_count] */
    const shd_plan_light *falls[FALLS]; /* one of each kind */
    size_t fall_count;
} builder;

static bool falls_alike(const shd_plan_light *x, const shd_plan_light *y) {
    return x->a == y->a && x->b == y->b && x->c == y->c && x->min_distance == y->min_distance;
}

static size_t class_of(builder *b, const shd_plan_light *light) {
    if (light->directional) return 0;
    if (!light->attenuated) return 1;
    size_t fall = 0;
    while (fall < b->fall_count && !falls_alike(b->falls[fall], light)) fall++;
    if (fall == b->fall_count && fall < FALLS) b->falls[b->fall_count++] = light;
    return 2 + (fall < FALLS ? fall : FALLS - 1);
}

static double along(shd_vec3 v, int axis) {
    return axis == 0 ? v.x : axis == 1 ? v.y : v.z;
}

/* ---- Building. ---- */

static shd_cluster gather_lights(const builder *b, uint32_t first, uint32_t end) {
    const shd_plan *plan = b->plan;
    const uint32_t *lights = b->out->lights;
    const shd_plan_light *one = &plan->lights[lights[first]];
    shd_cluster c = {.low = {INFINITY, INFINITY, INFINITY},
                     .high = {-INFINITY, -INFINITY, -INFINITY},
                     .beside = INFINITY,
                     .a = INFINITY,
                     .b = INFINITY,
                     .c = INFINITY,
                     .min_distance = INFINITY,
                     .hue = b->hues->of_light[lights[first]],
                     .first = first,
                     .end = end,
                     .directional = one->directional,
                     .attenuated = one->attenuated};
    for (uint32_t i = first; i < end; i++) {
        const shd_plan_light *light = &plan->lights[lights[i]];
        c.strength += b->hues->strength[lights[i]] * light->gain;
        c.beside = shd_smaller(c.beside, b->beside[lights[i]]);
        c.a = shd_smaller(c.a, light->a);
        c.b = shd_smaller(c.b, light->b);
        c.c = shd_smaller(c.c, light->c);
        c.min_distance = shd_smaller(c.min_distance, light->min_distance);
        if (light->directional) continue;
        c.low = shd_vec3_min(c.low, light->position);
        c.high = shd_vec3_max(c.high, light->position);
        const double away = shd_plan_length(shd_sub(light->position, plan->origin));
        c.away = shd_larger(c.away, away);
    }
    c.strength *= 1 + SHD_PIECE_MARGIN; /* for the sum's own rounding */
    if (!c.directional) c.width = shd_plan_length(shd_sub(c.high, c.low));
    return c;
}

static int compare_keys(const void *x, const void *y) {
    const key *a = x, *b = y;
    if (a->at != b->at) return a->at < b->at ? -1 : 1;
    return a->light < b->light ? -1 : 1;
}

/* Divides lights at their mean along the box's longest side, or in halves if that would leave few
 * on one side. Returns where the second part begins. */
static uint32_t divide_lights(builder *b, const shd_cluster *c) {
    uint32_t *lights = b->out->lights;
    const uint32_t count = c->end - c->first;
    const shd_vec3 size = shd_sub(c->high, c->low);
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    double sum = 0;
    for (uint32_t i = 0; i < count; i++) {
        const uint32_t light = lights[c->first + i];
        b->keys[i] = (key){along(b->plan->lights[light].position, axis), light};
        sum += b->keys[i].at;
    }
    uint32_t below = 0, above = count;
    for (uint32_t i = 0; i < count; i++)
        if (b->keys[i].at < sum / count)
            lights[c->first + below++] = b->keys[i].light;
        else
            lights[c->first + --above] = b->keys[i].light;
    if (below >= count / 4 && count - below >= count / 4) return c->first + below;
    qsort(b->keys, count, sizeof *b->keys, compare_keys);
    for (uint32_t i = 0; i < count; i++) lights[c->first + i] = b->keys[i].light;
    return c->first + count / 2;
}

/* Divides clusters until leaves are left, from the first one on: parts are put behind all. */
static bool divide_clusters(builder *b) {
    shd_clusters *out = b->out;
    for (size_t i = 0; i < out->count; i++) {
        if (shd_is_cancelled(b->plan->cancelled)) return false;
        shd_cluster *c = &out->list[i];
        /* Those in one place are as near as any of them. */
        if (c->directional || c->end - c->first <= LEAF || !shd_is_finite(c->low) ||
            !shd_is_finite(c->high) || !(shd_max_abs(shd_sub(c->high, c->low)) > 0))
            continue;
        const uint32_t middle = divide_lights(b, c);
        c->parts = (uint32_t)out->count;
        out->list[out->count++] = gather_lights(b, c->first, middle);
        out->list[out->count++] = gather_lights(b, middle, c->end);
    }
    return true;
}

/* Sorts lights by hue and class, a root for each. */
static bool plant_roots(builder *b, shd_arena *arena) {
    const shd_plan *plan = b->plan;
    shd_clusters *out = b->out;
    const size_t kinds = CLASSES * b->hues->count;
    uint32_t *starts = shd_arena_zalloc(arena, kinds + 1, sizeof *starts);
    if (!starts) return false;
    for (int pass = 0; pass < 2; pass++) {
        for (uint32_t j = 0; j < plan->light_count; j++) {
            const shd_plan_light *light = &plan->lights[j];
            const size_t kind = CLASSES * b->hues->of_light[j] + class_of(b, light);
            if (light->spot) {
                if (pass) out->alone[out->alone_count++] = j;
            } else if (pass) {
                out->lights[starts[kind]++] = j;
            } else {
                starts[kind + 1]++;
            }
        }
        for (size_t k = 0; pass == 0 && k < kinds; k++) starts[k + 1] += starts[k];
    }
    uint32_t first = 0; /* each start has moved on to the next one */
    for (size_t k = 0; k < kinds; k++) {
        if (starts[k] > first) out->list[out->count++] = gather_lights(b, first, starts[k]);
        first = starts[k];
    }
    out->roots = out->count;
    return true;
}

bool shd_clusters_new(const shd_plan *plan, const shd_hues *hues, const double *beside,
                      shd_arena *arena, shd_clusters *out) {
    const size_t lights = plan->light_count, most = 2 * lights; /* each leaf has one or more */
    *out = (shd_clusters){.list = shd_arena_alloc(arena, most, sizeof *out->list),
                          .lights = shd_arena_alloc(arena, lights, sizeof *out->lights),
                          .alone = shd_arena_alloc(arena, lights, sizeof *out->alone),
                          .near = shd_arena_alloc(arena, most, sizeof *out->near),
                          .near_alone = shd_arena_alloc(arena, lights, sizeof *out->near_alone),
                          .cut = shd_arena_alloc(arena, most, sizeof *out->cut),
                          .single = shd_arena_alloc(arena, lights, sizeof *out->single)};
    builder b = {.plan = plan,
                 .hues = hues,
                 .beside = beside,
                 .out = out,
                 .keys = shd_arena_alloc(arena, lights, sizeof *b.keys)};
    if (!out->list || !out->lights || !out->alone || !out->near || !out->near_alone || !out->cut ||
        !out->single || !b.keys || !plant_roots(&b, arena) || !divide_clusters(&b))
        return false;
    assert(out->count <= most);
    for (size_t r = 0; r < out->roots; r++) out->near[out->near_count++] = (uint32_t)r;
    memcpy(out->near_alone, out->alone, out->alone_count * sizeof *out->alone);
    out->near_alone_count = out->alone_count;
    return true;
}

/* ---- Cuts. ---- */

static double beyond_of(double at, double low, double high) {
    return shd_larger(shd_larger(low - at, at - high), 0);
}

double shd_cluster_distance(const shd_cluster *c, const shd_cluster_target *to) {
    if (c->directional) return 0;
    const shd_vec3 center = to->center;
    const shd_vec3 out = {beyond_of(center.x, c->low.x, c->high.x),
                          beyond_of(center.y, c->low.y, c->high.y),
                          beyond_of(center.z, c->low.z, c->high.z)};
    const double distance = shd_plan_length(out) * (1 - SHD_PIECE_MARGIN);
    return shd_larger(distance - to->radius, to->seen ? c->beside : 0);
}

double shd_cluster_fall(const shd_cluster *c, double distance) {
    if (!c->attenuated) return 1;
    const double d = shd_larger(distance, c->min_distance);
    return 1 / (c->a + d * (c->b + d * c->c));
}

/* `wide`: how wide the cluster and the target are together. */
static bool is_far(const shd_cluster *c, const shd_cluster_target *target, double wide) {
    if (c->directional) return true;
    const double distance = shd_cluster_distance(c, target);
    return wide <= WIDEST * distance && shd_cluster_fall(c, distance) < INFINITY;
}

/* Clusters that are still to be looked at. */
enum { DEEP = 128 };

void shd_clusters_part(shd_clusters *clusters, const shd_cluster_target *target) {
    clusters->cut_count = clusters->near_count = 0;
    uint32_t stack[DEEP];
    for (size_t r = 0; r < clusters->roots; r++) {
        size_t depth = 0;
        stack[depth++] = (uint32_t)r;
        while (depth > 0) {
            const uint32_t at = stack[--depth];
            const shd_cluster *c = &clusters->list[at];
            if (is_far(c, target, c->width + ROOMY * target->radius)) {
                clusters->cut[clusters->cut_count++] = at;
            } else if (c->parts && depth + 2 <= DEEP && c->width > target->radius) {
                stack[depth++] = c->parts;
                stack[depth++] = c->parts + 1;
            } else {
                clusters->near[clusters->near_count++] = at;
            }
        }
    }
}

void shd_clusters_cut(shd_clusters *clusters, const shd_cluster_target *target) {
    clusters->cut_count = 0;
    clusters->single_count = clusters->near_alone_count;
    memcpy(clusters->single, clusters->near_alone,
           clusters->near_alone_count * sizeof *clusters->single);
    uint32_t stack[DEEP];
    for (size_t r = 0; r < clusters->near_count; r++) {
        size_t depth = 0;
        stack[depth++] = clusters->near[r];
        while (depth > 0) {
            const uint32_t at = stack[--depth];
            const shd_cluster *c = &clusters->list[at];
            if (is_far(c, target, c->width)) {
                clusters->cut[clusters->cut_count++] = at;
            } else if (c->parts && depth + 2 <= DEEP) {
                stack[depth++] = c->parts;
                stack[depth++] = c->parts + 1;
            } else {
                for (uint32_t i = c->first; i < c->end; i++)
                    clusters->single[clusters->single_count++] = clusters->lights[i];
            }
        }
    }
}

void shd_clusters_influence(const shd_plan *plan, const shd_hues *hues,
                            const shd_clusters *clusters, double *influences) {
    for (size_t i = 0; i < clusters->count; i++) {
        const shd_cluster *c = &clusters->list[i];
        for (int k = 0; c->parts && k < 2; k++) {
            shd_cluster *part = &clusters->list[c->parts + (uint32_t)k];
            part->most = shd_larger(part->most, c->most);
        }
        for (uint32_t l = c->first; !c->parts && l < c->end; l++) {
            const uint32_t j = clusters->lights[l];
            influences[j] =
                shd_larger(influences[j], c->most * hues->strength[j] * plan->lights[j].gain);
        }
    }
}
