#include "render/tiles/facets.h"

#include "shade/split32.h"

enum { BLOCK = 64 };

typedef struct facet_job {
    const shd_plan *plan;
    const atomic_bool *cancelled;
    const shd_lighting *lighting;
    const shd_paint_kernel *paint;
    const shd_facets *facets;
    const shd_plan_material *material;
    const uint32_t *every; /* light */
    float *radiance;
    struct facet_scratch {
        float **arrays; /* [1 + max_lobes][3] of [BLOCK] */
        double **exact; /* or these */
        shd_paint_term *terms;
        size_t *term_of;
        shd_stopwatch watch;
    } * scratch; /* [slot] */
} facet_job;

static void light_points(const facet_job *l, size_t first, size_t count, const uint32_t *which,
                         size_t lights, const struct facet_scratch *s) {
    const shd_plan *plan = l->plan;
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
        const shd_points64 points = {
            count, {d[0], d[1], d[2]}, {d[3], d[4], d[5]}, {d[6], d[7], d[8]}};
        shd_light_sums64(l->lighting, l->material, which, lights, &points, s->exact, s->exact + 3);
        return;
    }
    shd_points32 points = {
        count, {f[0], f[1], f[2]}, {NULL, NULL, NULL}, {f[6], f[7], f[8]}, {f[9], f[10], f[11]}};
    for (int c = 0; plan->split_positions && c < 3; c++) points.low[c] = f[3 + c];
    shd_light_sums32(l->lighting, l->material, which, lights, &points, s->arrays, s->arrays + 3,
                     edges);
    for (size_t i = 0; i < count; i++) {
        if (!edges[i]) continue;
        const shd_points64 point = {1,
                                    {&d[0][i], &d[1][i], &d[2][i]},
                                    {&d[3][i], &d[4][i], &d[5][i]},
                                    {&d[6][i], &d[7][i], &d[8][i]}};
        shd_light_again(l->lighting, l->material, which, lights, &point, &(uint32_t){(uint32_t)i},
                        s->arrays, s->arrays + 3);
    }
}

static void mix_plane(const facet_job *l, const struct facet_scratch *s, size_t plane, size_t first,
                      size_t count) {
    const shd_plan *plan = l->plan;
    float constant[3], mixed[3][BLOCK], *const to[3] = {mixed[0], mixed[1], mixed[2]};
    if (plan->tier == SHD_EXACT) {
        shd_mix_exact(plan, l->material, plane, s->exact, count, to);
    } else {
        const size_t terms =
            shd_plane_terms(plan, l->material, plane, constant, s->terms, s->term_of);
        for (size_t k = 0; k < terms; k++)
            for (int c = 0; c < 3; c++)
                s->terms[k].sums[c] =
                    s->arrays[3 * s->term_of[k] + (size_t)(plan->grey_lights ? 0 : c)];
        l->paint->mix(constant, NULL, s->terms, terms, count, to);
    }
    float *out = l->radiance + 3 * (first * plan->plane_count + plane);
    for (size_t i = 0; i < count; i++, out += 3 * plan->plane_count)
        for (int c = 0; c < 3; c++) out[c] = mixed[c][i];
}

static void light_block(void *context, size_t index, unsigned slot) {
    const facet_job *l = context;
    if (shd_is_cancelled(l->cancelled)) return;
    const shd_plan *plan = l->plan;
    struct facet_scratch *s = &l->scratch[slot];
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
}

static bool make_scratch(const shd_plan *plan, shd_arena *arena, struct facet_scratch *out) {
    const size_t terms = 1 + plan->max_lobes;
    shd_scratch memory = {.arena = arena};
    out->arrays = shd_scratch_rows32(&memory, 3 * terms, BLOCK);
    out->exact = shd_scratch_rows64(&memory, 3 * terms, BLOCK);
    out->terms = shd_scratch_take(&memory, terms, sizeof *out->terms);
    out->term_of = shd_scratch_take(&memory, terms, sizeof *out->term_of);
    return !memory.full;
}

bool shd_facets_light(shd_rendering *r, const shd_sight *sight, const shd_lighting *lighting,
                      const shd_paint_kernel *paint, shd_facet_light *out) {
    const shd_plan *plan = r->plan;
    const shd_scene *scene = plan->scene;
    shd_arena *arena = r->arena;
    shd_pool *pool = r->engine->pool;
    const unsigned slots = shd_pool_slots(pool);
    *out = (shd_facet_light){
        .radiance = shd_arena_zalloc(arena, scene->object_count, sizeof *out->radiance)};
    if (!out->radiance) return false;
    facet_job l = {.plan = plan, .cancelled = r->cancelled, .lighting = lighting, .paint = paint};
    for (size_t o = 0; o < scene->object_count; o++) {
        l.facets = shd_sight_facets(sight, o);
        if (!l.facets) continue;
        if (!out->any) {
            uint32_t *every = shd_arena_alloc(arena, plan->light_count, sizeof *every);
            l.scratch = shd_arena_zalloc(arena, slots, sizeof *l.scratch);
            if (!every || !l.scratch) return false;
            for (size_t j = 0; j < plan->light_count; j++) every[j] = (uint32_t)j;
            for (unsigned i = 0; i < slots; i++)
                if (!make_scratch(plan, arena, &l.scratch[i])) return false;
            l.every = every;
            out->any = true;
        }
        l.material = &plan->materials[scene->objects[o].material];
        l.radiance = shd_arena_alloc(arena, 3 * plan->plane_count * l.facets->point_count,
                                     sizeof *l.radiance);
        if (!l.radiance) return false;
        out->radiance[o] = l.radiance;
        shd_pool_for(pool, (l.facets->point_count + BLOCK - 1) / BLOCK, light_block, &l);
    }
    for (unsigned i = 0; l.scratch && i < slots; i++)
        shd_times_add(&r->times, &l.scratch[i].watch.times);
    return true;
}
