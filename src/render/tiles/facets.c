#include "render/tiles/facets.h"

#include "render/tiles/radiance.h"
#include "shade/split32.h"

enum { BLOCK = 64 };

typedef struct facet_scratch {
    float **arrays; /* [1 + max_lobes][3] of [BLOCK] */
    double **exact; /* or these */
    shd_paint_term *terms;
    size_t *term_of;
    shd_stopwatch watch;
    double shadowed; /* seconds of rays to lights, within the stage */
} facet_scratch;

typedef struct facet_job {
    const shd_scenery *scenery;
    const shd_facets *facets;
    const shd_plan_material *material;
    int32_t object;
    const uint32_t *every; /* light */
    float *radiance;
    facet_scratch *scratch; /* [slot]; NULL until there is something to light */
} facet_job;

static void light_points(const facet_job *l, size_t first, size_t count, const uint32_t *which,
                         size_t lights, facet_scratch *s) {
    const shd_plan *plan = l->scenery->plan;
    const shd_lighting *lighting = l->scenery->lighting;
    const shd_facets *facets = l->facets;
    _Alignas(64) double d[9][BLOCK];
    _Alignas(64) float f[12][BLOCK];
    uint8_t edges[BLOCK + SHD_LANES] = {0};
    const double origin[3] = {plan->origin.x, plan->origin.y, plan->origin.z};
    for (size_t i = 0; i < BLOCK; i++) {
        const size_t from = first + (i < count ? i : count - 1);
        const shd_vec3 p = facets->positions[from], n = facets->normals[from],
                       v = facets->views[from];
        const shd_vec3 w = shd_sub(shd_scale(n, 2 * shd_dot(n, v)), v);
        const double values[9] = {p.x, p.y, p.z, n.x, n.y, n.z, v.x, v.y, v.z};
        const double mirror[3] = {w.x, w.y, w.z};
        for (int k = 0; k < 9; k++) d[k][i] = values[k];
        for (int c = 0; c < 3; c++) {
            shd_split32((values[c] - origin[c]) * plan->scale, &f[c][i], &f[3 + c][i]);
            f[6 + c][i] = (float)values[3 + c];
            f[9 + c][i] = (float)mirror[c];
        }
    }
    if (plan->tier == SHD_EXACT) {
        int32_t objects[BLOCK];
        for (size_t i = 0; i < BLOCK; i++) objects[i] = l->object;
        const shd_points64 points = {.count = count,
                                     .position = {d[0], d[1], d[2]},
                                     .normal = {d[3], d[4], d[5]},
                                     .view = {d[6], d[7], d[8]},
                                     .object = objects,
                                     .triangle =
                                         facets->triangles ? facets->triangles + first : NULL,
                                     .shadowed = &s->shadowed};
        shd_light_sums64(lighting, l->material, which, lights, &points, s->exact, s->exact + 3);
        return;
    }
    shd_points32 points = {
        count, {f[0], f[1], f[2]}, {NULL, NULL, NULL}, {f[6], f[7], f[8]}, {f[9], f[10], f[11]}};
    for (int c = 0; plan->split_positions && c < 3; c++) points.low[c] = f[3 + c];
    shd_light_sums32(lighting, l->material, which, lights, &points, s->arrays, s->arrays + 3,
                     edges);
    for (size_t i = 0; i < count; i++) {
        if (!edges[i]) continue;
        const shd_points64 point = {.count = 1,
                                    .position = {&d[0][i], &d[1][i], &d[2][i]},
                                    .normal = {&d[3][i], &d[4][i], &d[5][i]},
                                    .view = {&d[6][i], &d[7][i], &d[8][i]},
                                    .object = &l->object};
        shd_light_again(lighting, l->material, which, lights, &point, &(uint32_t){(uint32_t)i},
                        s->arrays, s->arrays + 3);
    }
}

static void mix_plane(const facet_job *l, const facet_scratch *s, size_t plane, size_t first,
                      size_t count) {
    const shd_plan *plan = l->scenery->plan;
    float constant[3], mixed[3][BLOCK], *const to[3] = {mixed[0], mixed[1], mixed[2]};
    if (plan->tier == SHD_EXACT) {
        shd_mix_exact(plan, l->material, plane, s->exact, NULL, count, to);
    } else {
        const size_t terms =
            shd_plane_terms(plan, l->material, plane, constant, s->terms, s->term_of);
        for (size_t k = 0; k < terms; k++)
            for (int c = 0; c < 3; c++)
                s->terms[k].sums[c] =
                    s->arrays[3 * s->term_of[k] + (size_t)(plan->grey_lights ? 0 : c)];
        l->scenery->paint->mix(constant, NULL, s->terms, terms, count, to);
    }
    float *out = l->radiance + 3 * (first * plan->plane_count + plane);
    for (size_t i = 0; i < count; i++, out += 3 * plan->plane_count)
        for (int c = 0; c < 3; c++) out[c] = mixed[c][i];
}

static void light_block(void *context, size_t index, unsigned slot) {
    const facet_job *l = context;
    const shd_plan *plan = l->scenery->plan;
    if (shd_is_cancelled(plan->cancelled)) return;
    facet_scratch *s = &l->scratch[slot];
    const size_t first = index * BLOCK, left = l->facets->point_count - first,
                 count = left < BLOCK ? left : BLOCK;
    shd_begin(&s->watch);
    for (size_t p = 1; p < plan->plane_count; p++) {
        if (plan->planes[p].kind != SHD_LAYER_LIGHT) continue;
        uint32_t light;
        const size_t lights = shd_plan_find_light(plan, plan->planes[p].light, &light) ? 1 : 0;
        light_points(l, first, count, &light, lights, s);
        mix_plane(l, s, p, first, count);
    }
    light_points(l, first, count, l->every, plan->light_count, s);
    for (size_t p = 0; p < plan->plane_count; p++)
        if (plan->planes[p].kind != SHD_LAYER_LIGHT) mix_plane(l, s, p, first, count);
    shd_end(&s->watch, &s->watch.times.shade);
    shd_end_shadows(&s->watch, &s->shadowed);
}

/* False: the arena is full. */
static bool make_scratch(const shd_plan *plan, shd_arena *arena, unsigned slots, facet_job *l) {
    const size_t terms = plan->max_terms;
    uint32_t *every = shd_arena_alloc(arena, plan->light_count, sizeof *every);
    l->scratch = shd_arena_zalloc(arena, slots, sizeof *l->scratch);
    if (!every || !l->scratch) return false;
    for (size_t j = 0; j < plan->light_count; j++) every[j] = (uint32_t)j;
    l->every = every;
    shd_scratch memory = {.arena = arena};
    for (facet_scratch *s = l->scratch; s < l->scratch + slots; s++) {
        s->arrays = shd_scratch_rows32(&memory, 3 * terms, BLOCK);
        s->exact = shd_scratch_rows64(&memory, 3 * terms, BLOCK);
        s->terms = shd_scratch_take(&memory, terms, sizeof *s->terms);
        s->term_of = shd_scratch_take(&memory, terms, sizeof *s->term_of);
    }
    return !memory.full;
}

bool shd_facets_light(shd_rendering *r, shd_scenery *scenery) {
    const shd_plan *plan = r->plan;
    const size_t objects = plan->scene->object_count;
    shd_arena *arena = r->arena;
    shd_pool *pool = r->engine->pool;
    const unsigned slots = shd_pool_slots(pool);
    scenery->facets = shd_arena_zalloc(arena, objects, sizeof *scenery->facets);
    if (!scenery->facets) return false;
    facet_job l = {.scenery = scenery};
    for (size_t o = 0; o < objects; o++) {
        l.facets = shd_sight_facets(scenery->sight, o);
        if (!l.facets) continue;
        if (!l.scratch && !make_scratch(plan, arena, slots, &l)) return false;
        l.object = (int32_t)o;
        l.material = &plan->materials[plan->scene->objects[o].material];
        l.radiance = shd_arena_alloc(arena, 3 * plan->plane_count * l.facets->point_count,
                                     sizeof *l.radiance);
        if (!l.radiance) return false;
        scenery->facets[o] = l.radiance;
        shd_pool_for(pool, (l.facets->point_count + BLOCK - 1) / BLOCK, light_block, &l);
    }
    for (unsigned i = 0; l.scratch && i < slots; i++)
        shd_times_add(&r->times, &l.scratch[i].watch.times);
    return true;
}
