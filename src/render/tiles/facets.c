#include "render/tiles/facets.h"

#include <string.h>

#include "render/tiles/mapped.h"
#include "render/tiles/radiance.h"
#include "render/tiles/textured.h"
#include "shade/split32.h"

enum { BLOCK = 64 };

typedef struct facet_scratch {
    float **arrays; /* [1 + max_lobes][3] of [BLOCK] */
    double **exact; /* or these */
    shd_paint_term *terms;
    size_t *term_of;
    shd_vec3 *normals; /* [BLOCK]: of a block's points, as a map has turned them */
    double **sharp;    /* their rows of shd_points64.sharp; NULL: nobody asks */
    shd_stopwatch watch;
    double shadowed; /* seconds of rays to lights, within the stage */
} facet_scratch;

typedef struct facet_job {
    const shd_scenery *scenery;
    const shd_facets *facets;
    const shd_plan_material *material;
    const shd_mapped_facets *mapped; /* of its map or its exponents; NULL: it has neither */
    int32_t object;
    const uint32_t *every; /* light */
    float *radiance;       /* or, of a material with patterns: */
    double *lit;
    facet_scratch *scratch; /* [slot]; NULL until there is something to light */
} facet_job;

/* Turns the normals of a block's points by the map, if there is one, and finds their highlights. */
static void turn_points(const facet_job *l, size_t first, size_t count, facet_scratch *s) {
    const shd_plan_material *m = l->material;
    for (size_t i = 0; i < count; i++) {
        const shd_vec3 n = l->facets->normals[first + i];
        const double own[3] = {n.x, n.y, n.z};
        const shd_bump bump = shd_mapped_point(l->mapped, first + i);
        s->normals[i] = bump.normal;
        for (size_t k = 0; k < m->lobe_count; k++) {
            const shd_sharpness lobe =
                shd_toksvig(m->model, shd_mapped_gloss(l->mapped, first + i, k), bump.length);
            s->sharp[2 * k][i] = lobe.shininess;
            s->sharp[2 * k + 1][i] = lobe.share;
        }
        for (size_t c = 0; c < 3; c++) s->sharp[2 * m->lobe_count + c][i] = own[c];
    }
    for (size_t r = 0; r < 2 * m->lobe_count + 3; r++)
        for (size_t i = count; i < BLOCK; i++) s->sharp[r][i] = s->sharp[r][count - 1];
}

static void light_exactly(const facet_job *l, size_t first, size_t count, const uint32_t *which,
                          size_t lights, double d[9][BLOCK], facet_scratch *s) {
    const uint32_t *triangles = l->facets->triangles;
    int32_t objects[BLOCK];
    for (size_t i = 0; i < BLOCK; i++) objects[i] = l->object;
    const shd_points64 points = {.count = count,
                                 .position = {d[0], d[1], d[2]},
                                 .normal = {d[3], d[4], d[5]},
                                 .view = {d[6], d[7], d[8]},
                                 .object = objects,
                                 .triangle = triangles ? triangles + first : NULL,
                                 .shadowed = &s->shadowed,
                                 .sharp = l->mapped ? (const double *const *)s->sharp : NULL};
    shd_sum_exactly(l->scenery->lighting, l->scenery->plan, l->material, which, lights, &points,
                    s->exact);
}

static void light_points(const facet_job *l, size_t first, size_t count, const uint32_t *which,
                         size_t lights, facet_scratch *s) {
    const shd_plan *plan = l->scenery->plan;
    const shd_lighting *lighting = l->scenery->lighting;
    const shd_facets *facets = l->facets;
    const shd_vec3 *normals = l->mapped ? s->normals : facets->normals + first;
    _Alignas(64) double d[9][BLOCK];
    _Alignas(64) float f[12][BLOCK];
    uint8_t edges[BLOCK + SHD_LANES] = {0};
    const double origin[3] = {plan->origin.x, plan->origin.y, plan->origin.z};
    for (size_t i = 0; i < BLOCK; i++) {
        const size_t at = i < count ? i : count - 1;
        const shd_vec3 p = facets->positions[first + at], n = normals[at],
                       v = facets->views[first + at];
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
        light_exactly(l, first, count, which, lights, d, s);
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

/* Numbers of a point in a plane of an object whose material has patterns. */
static size_t lit_size(const shd_plan_material *material) {
    const size_t terms = 1 + material->lobe_count, parts = material->textures->part_count;
    return 3 + 3 * terms * (parts ? parts - 1 : 1);
}

/* The first row of sums that patterns multiply: of a spectral scene, behind those of low colors. */
static size_t first_sum(const shd_plan_material *material) {
    return material->textures->part_count ? 3 * (1 + material->lobe_count) : 0;
}

static size_t channels_of(const shd_plan *plan) {
    return plan->grey_lights ? 1 : 3;
}

/* Keeps what patterns multiply at the points; mixed[channel]: what they add to. */
static void keep_lit(const facet_job *l, const facet_scratch *s, size_t plane, size_t first,
                     size_t count, float *const mixed[3]) {
    const shd_plan *plan = l->scenery->plan;
    const size_t size = lit_size(l->material), channels = channels_of(plan);
    const bool exact = plan->tier == SHD_EXACT;
    double *const *sums = s->exact + first_sum(l->material);
    double *out = l->lit + size * (first * plan->plane_count + plane);
    for (size_t i = 0; i < count; i++, out += size * plan->plane_count) {
        memset(out, 0, size * sizeof *out);
        for (int c = 0; exact && c < 3; c++) out[c] = (double)mixed[c][i];
        for (size_t k = 3; k < size; k++)
            if (k % 3 < channels) out[k] = exact ? sums[k - 3][i] : (double)s->arrays[k - 3][i];
    }
}

static void mix_plane(const facet_job *l, const facet_scratch *s, size_t plane, size_t first,
                      size_t count) {
    const shd_plan *plan = l->scenery->plan;
    float constant[3], mixed[3][BLOCK], *const to[3] = {mixed[0], mixed[1], mixed[2]};
    if (l->lit) {
        if (plan->tier == SHD_EXACT)
            shd_mix_exact(plan, l->material->textures->low, plane, s->exact, NULL, count, to);
        keep_lit(l, s, plane, first, count, to);
        return;
    }
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
    if (l->mapped) turn_points(l, first, count, s);
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
        if (!plan->bumped && !plan->glossed) continue;
        s->normals = shd_scratch_take(&memory, BLOCK, sizeof *s->normals);
        s->sharp = shd_scratch_rows64(&memory, 2 * plan->max_lobes + 3, BLOCK);
    }
    return !memory.full;
}

/* False: the arena is full. */
static bool take_room(const shd_plan *plan, size_t object, shd_arena *arena, facet_job *l) {
    const size_t points = l->facets->point_count, planes = plan->plane_count;
    l->radiance = NULL;
    l->lit = NULL;
    if (plan->groups[plan->objects[object].group].faceted)
        l->lit = shd_arena_alloc(arena, points, lit_size(l->material) * planes * sizeof *l->lit);
    else
        l->radiance = shd_arena_alloc(arena, 3 * planes * points, sizeof *l->radiance);
    return l->lit || l->radiance;
}

bool shd_facets_light(shd_rendering *r, shd_scenery *scenery) {
    const shd_plan *plan = r->plan;
    const size_t objects = plan->scene->object_count;
    shd_arena *arena = r->arena;
    shd_pool *pool = r->engine->pool;
    const unsigned slots = shd_pool_slots(pool);
    scenery->facets = shd_arena_zalloc(arena, objects, sizeof *scenery->facets);
    if (plan->textured) scenery->lit = shd_arena_zalloc(arena, objects, sizeof *scenery->lit);
    scenery->classes = shd_arena_alloc(arena, objects, sizeof *scenery->classes);
    if (!scenery->facets || !scenery->classes || (plan->textured && !scenery->lit)) return false;
    shd_mapped_facets mapped;
    facet_job l = {.scenery = scenery};
    for (size_t o = 0; o < objects; o++) {
        scenery->classes[o] = (uint32_t)plan->objects[o].group;
        l.facets = shd_sight_facets(scenery->sight, o);
        if (!l.facets) continue;
        if (!l.scratch && !make_scratch(plan, arena, slots, &l)) return false;
        l.object = (int32_t)o;
        l.material = &plan->materials[plan->scene->objects[o].material];
        l.mapped = l.material->normal || l.material->gloss ? &mapped : NULL;
        if (l.mapped && !shd_mapped_facets_make(plan, scenery->sight, o, arena, &mapped))
            return false;
        if (!take_room(plan, o, arena, &l)) return false;
        scenery->facets[o] = l.radiance;
        if (l.lit) scenery->lit[o] = l.lit;
        if (l.radiance) scenery->classes[o] = (uint32_t)plan->group_count;
        shd_pool_for(pool, (l.facets->point_count + BLOCK - 1) / BLOCK, light_block, &l);
    }
    for (unsigned i = 0; l.scratch && i < slots; i++)
        shd_times_add(&r->times, &l.scratch[i].watch.times);
    return true;
}

/* ---- What is seen of them. ---- */

void shd_facets_interpolate(const shd_scenery *scenery, const shd_hits *hits, shd_run run,
                            float *const *sums) {
    const shd_plan *plan = scenery->plan;
    const size_t planes = plan->plane_count, values = 3 * planes;
    for (size_t i = run.first; i < run.first + run.count; i++) {
        const size_t object = (size_t)hits->object[i];
        const shd_facets *facets = shd_sight_facets(scenery->sight, object);
        const uint32_t *corner = facets->corners + 3 * (size_t)hits->triangle[i];
        const float *radiance = scenery->facets[object];
        const float *a = radiance + values * corner[0], *b = radiance + values * corner[1],
                    *c = radiance + values * corner[2];
        const double u = hits->u[i], v = hits->v[i], w = 1 - u - v;
        const bool flat = corner[0] == corner[1] && corner[0] == corner[2];
        for (size_t p = 0; p < planes; p++)
            for (int k = 0; k < 3; k++) {
                const size_t at = 3 * p + (size_t)k;
                double mixed = w * (double)a[at] + u * (double)b[at] + v * (double)c[at];
                sums[shd_sum_of(plan, p, 0, k)][i] = flat ? a[at] : (float)mixed;
            }
    }
}

/* The light at a place of a triangle: the corners' numbers, [lit_size] each, in a plane. */
typedef struct lit_place {
    const double *corner[3];
    double u, v;
    bool flat;
} lit_place;

static lit_place find_lit(const shd_scenery *scenery, size_t object, uint32_t triangle, double u,
                          double v, size_t size, size_t plane) {
    const size_t planes = scenery->plan->plane_count;
    const uint32_t *corner =
        shd_sight_facets(scenery->sight, object)->corners + 3 * (size_t)triangle;
    lit_place out = {.u = u, .v = v, .flat = corner[0] == corner[1] && corner[0] == corner[2]};
    for (int k = 0; k < 3; k++)
        out.corner[k] = scenery->lit[object] + size * (corner[k] * planes + plane);
    return out;
}

static double lit_at(const lit_place *p, size_t k) {
    const double w = 1 - p->u - p->v;
    if (p->flat) return p->corner[0][k];
    return w * p->corner[0][k] + p->u * p->corner[1][k] + p->v * p->corner[2][k];
}

/* The same for a run, from place 0 on of rows: of what patterns add to, or of what they multiply.
 */
static void gather_lit(const shd_scenery *scenery, const shd_hits *hits, shd_run run, size_t plane,
                       size_t first, size_t end, double *const *out) {
    const shd_plan *plan = scenery->plan;
    const shd_plan_material *material = &plan->materials[plan->groups[run.group].material];
    for (size_t i = 0; i < run.count; i++) {
        const size_t at = run.first + i;
        const lit_place place = find_lit(scenery, (size_t)hits->object[at], hits->triangle[at],
                                         hits->u[at], hits->v[at], lit_size(material), plane);
        for (size_t k = first; k < end; k++) out[k - first][i] = lit_at(&place, k);
    }
}

/* As gather_lit, in f32. */
static void sum_narrowly(const shd_scenery *scenery, const shd_hits *hits, shd_run run,
                         const shd_plan_material *material, size_t plane, shd_tile_scratch *s) {
    const shd_plan *plan = scenery->plan;
    const size_t size = lit_size(material), channels = channels_of(plan);
    float *const *sums = s->sums + shd_sum_of(plan, plane, 0, 0);
    for (size_t i = run.first; i < run.first + run.count; i++) {
        const lit_place place = find_lit(scenery, (size_t)hits->object[i], hits->triangle[i],
                                         hits->u[i], hits->v[i], size, plane);
        for (size_t k = 3; k < size; k++)
            if (k % 3 < channels) sums[k - 3][i] = (float)lit_at(&place, k);
    }
    shd_textured_sums(scenery, material, plane, run.first, run.count, s);
}

void shd_facets_sum(const shd_scenery *scenery, const shd_hits *hits, shd_run run,
                    shd_tile_scratch *s) {
    const shd_plan *plan = scenery->plan;
    const shd_plan_material *material = &plan->materials[plan->groups[run.group].material];
    const size_t size = lit_size(material);
    const bool exact = plan->tier == SHD_EXACT;
    double **low = exact ? s->exact + shd_sum_of(plan, 1, 0, 0) : NULL,
           **sums = exact ? s->exact + first_sum(material) : NULL;
    for (size_t p = 0; p < plan->plane_count; p++) {
        const bool own = p == 0 || plan->planes[p].kind == SHD_LAYER_LIGHT;
        if (low) {
            gather_lit(scenery, hits, run, p, 0, 3, low);
            gather_lit(scenery, hits, run, own ? p : 0, 3, size, sums);
            shd_add_slots(plan, material, p, s->exact, (const double *const *)s->weights, run.count,
                          low);
            for (int c = 0; c < 3; c++) {
                float *out = s->sums[shd_sum_of(plan, p, 0, c)] + run.first;
                for (size_t i = 0; i < run.count; i++) out[i] = (float)low[c][i];
            }
        } else if (own) {
            sum_narrowly(scenery, hits, run, material, p, s);
        }
    }
}

void shd_facets_meet(const shd_scenery *scenery, const shd_meeting *met, const shd_tile_scratch *s,
                     double out[3]) {
    const shd_plan *plan = scenery->plan;
    const shd_plan_material *material = &plan->materials[plan->objects[met->object].material];
    const size_t size = lit_size(material);
    double **low = s->exact + shd_sum_of(plan, 1, 0, 0), **sums = s->exact + first_sum(material);
    lit_place place = find_lit(scenery, met->object, met->triangle, met->u, met->v, size, 0);
    place.flat = false; /* to the bit as what has no patterns (traced.c) */
    for (size_t k = 0; k < size; k++) *(k < 3 ? low[k] : sums[k - 3]) = lit_at(&place, k);
    shd_add_slots(plan, material, 0, s->exact, (const double *const *)s->beam, 1, low);
    for (int c = 0; c < 3; c++) out[c] = low[c][0];
}
