#include "render/tiles/traced.h"

#include <string.h>

#include "bound/light/extended.h"
#include "render/tiles/facets.h"
#include "render/tiles/radiance.h"
#include "render/tiles/textured.h"
#include "render/tiles/tinted.h"
#include "shade/exact.h"
#include "trace/bounce.h"
#include "trace/shadows.h"

typedef struct shd_traced {
    shd_shadows shadows; /* if the scene has any */
    bool shaded;
    bool bounces; /* some object is no end of a ray */
    shd_bouncing bouncing;
} shd_traced;

/* ---- The local model where rays end. ---- */

/* What patterns of a surface are to the beam that meets it: s->beam. */
static void weigh_met(const shd_scenery *scenery, const shd_surface *at, const shd_meeting *met,
                      double width, shd_tile_scratch *s) {
    const shd_beam beam = {at->object,
                           at->triangle,
                           at->position,
                           shd_met_place(scenery->traced->bouncing.caster, met).own,
                           shd_scale(at->view, -1),
                           width};
    shd_textured_weigh_beam(scenery, at->material->textures, &beam, s);
}

/* The radiance of a faceted object: as the camera has it, with highlights where it sees them. */
static void light_facets(const shd_scenery *scenery, const shd_facets *facets,
                         const shd_meeting *met, double out[3]) {
    const size_t values = 3 * scenery->plan->plane_count;
    const uint32_t *corner = facets->corners + 3 * (size_t)met->triangle;
    const float *radiance = scenery->facets[met->object], *a = radiance + values * corner[0],
                *b = radiance + values * corner[1], *c = radiance + values * corner[2];
    const double u = met->u, v = met->v, w = 1 - u - v;
    for (int k = 0; k < 3; k++) out[k] = w * (double)a[k] + u * (double)b[k] + v * (double)c[k];
}

/* The radiance of a light's visible shape. Its material has that of the side that the camera sees,
 * and a mirror may see the other one. */
static bool shines_at(const shd_light *light, const shd_surface *at) {
    return light->type == SHD_LIGHT_SPHERE || shd_dot(at->view, light->direction) > 0;
}

static void light_emitter(const shd_light *light, const shd_surface *at, double out[3]) {
    const bool shines = shines_at(light, at);
    for (int c = 0; c < 3; c++)
        out[c] = shines ? light->color[c] * (SHD_PI / shd_light_area(light)) : 0;
}

static void light_point(const void *context, void *scratch, const shd_surface *at,
                        const shd_meeting *met, double width, double (*into)[3]) {
    const shd_scenery *scenery = context;
    double *out = *into;
    shd_tile_scratch *s = scratch;
    const shd_facets *facets = shd_sight_facets(scenery->sight, at->object);
    const shd_light *emitter = scenery->plan->scene->objects[at->object].emitter;
    if (emitter) {
        light_emitter(emitter, at, out);
        return;
    }
    if (facets && at->material->textures) {
        weigh_met(scenery, at, met, width, s);
        shd_facets_meet(scenery, met, s, out);
        return;
    }
    if (facets) {
        light_facets(scenery, facets, met, out);
        return;
    }
    const shd_plan_object *object = &scenery->plan->objects[at->object];
    const int32_t index = (int32_t)at->object;
    shd_points64 point = {.count = 1,
                          .position = {&at->position.x, &at->position.y, &at->position.z},
                          .normal = {&at->normal.x, &at->normal.y, &at->normal.z},
                          .view = {&at->view.x, &at->view.y, &at->view.z},
                          .object = &index,
                          .triangle = &at->triangle,
                          .sharp = at->sharp,
                          .sharp_at = at->sharp_at};
    float mixed[3], *const to[3] = {&mixed[0], &mixed[1], &mixed[2]};
    const shd_plan_slot *slot = shd_facet_slot(at->material);
    double reflected[3], *const rows[3] = {&reflected[0], &reflected[1], &reflected[2]};
    if (at->material->textures) weigh_met(scenery, at, met, width, s);
    if (slot) {
        shd_textured_facets(at->material, slot, s->beam, 1, rows);
        point.facets = (const double *const *)rows;
    }
    shd_sum_exactly(scenery->lighting, scenery->plan, at->material, object->lights,
                    object->light_count, &point, s->exact);
    shd_mix_exact(scenery->plan, at->material, 0, s->exact, (const double *const *)s->beam, 1, to);
    for (int c = 0; c < 3; c++) out[c] = (double)mixed[c];
}

/* The same in bins. What is kept of faceted objects is a color, which is lifted as light. */
static void light_tinted(const void *context, void *scratch, const shd_surface *at,
                         const shd_meeting *met, double width, double (*out)[3]) {
    const shd_scenery *scenery = context;
    const shd_plan *plan = scenery->plan;
    const shd_light *emitter = plan->scene->objects[at->object].emitter;
    const shd_facets *facets = shd_sight_facets(scenery->sight, at->object);
    shd_tile_scratch *s = scratch;
    if (at->material->textures) weigh_met(scenery, at, met, width, s);
    memset(out, 0, plan->bins->count * sizeof *out);
    if (emitter) {
        if (shines_at(emitter, at)) shd_light_in_bins(plan, emitter, out);
        const double by = SHD_PI / shd_light_area(emitter);
        for (size_t b = 0; b < plan->bins->count; b++)
            for (int c = 0; c < 3; c++) out[b][c] *= by;
    } else if (facets) {
        double color[3];
        if (at->material->textures)
            shd_facets_meet(scenery, met, s, color);
        else
            light_facets(scenery, facets, met, color);
        shd_bins_add_lifted(plan->bins, color, out);
    } else {
        shd_tinted_plane(scenery, at, 0, s->beam, out);
    }
}

bool shd_traced_make(const shd_plan *plan, const shd_sight *sight, shd_arena *arena,
                     shd_scenery *scenery) {
    const shd_trace *trace = &plan->scene->trace;
    if (!shd_is_traced(plan->scene)) return true;
    const shd_caster *caster = shd_caster_new(sight, arena);
    shd_traced *traced = shd_arena_zalloc(arena, 1, sizeof *traced);
    if (!caster || !traced) return false;
    scenery->traced = traced;
    traced->shaded = trace->shadows;
    if (traced->shaded && !shd_shadows_make(plan, caster, arena, &traced->shadows)) return false;
    if (!trace->depth) return true;
    const bool *bounces = shd_bouncing_objects(plan, arena);
    for (size_t i = 0; bounces && i < plan->scene->object_count; i++) traced->bounces |= bounces[i];
    const shd_strays *strays = traced->bounces ? shd_find_strays(plan, arena) : NULL;
    if (traced->bounces && !strays) return false;
    void (*const local)(const void *, void *, const shd_surface *, const shd_meeting *, double,
                        double(*)[3]) = plan->tinted ? light_tinted : light_point;
    traced->bouncing = (shd_bouncing){plan, caster, {scenery, local}, bounces, strays};
    return bounces;
}

double shd_traced_seen(const shd_traced *traced) {
    return traced && traced->bounces ? traced->bouncing.strays->seen : 0;
}

const shd_shadows *shd_traced_shadows(const shd_traced *traced) {
    return traced && traced->shaded ? &traced->shadows : NULL;
}

/* ---- What was hit. ---- */

static shd_vec3 lane_of(double *const v[3], size_t i) {
    return (shd_vec3){v[0][i], v[1][i], v[2][i]};
}

static shd_surface surface_of(const shd_plan *plan, const shd_hits *hits, size_t i,
                              const shd_tile_scratch *s) {
    const size_t object = (size_t)hits->object[i];
    shd_surface at = {.position = lane_of(hits->position, i),
                      .normal = lane_of(hits->normal, i),
                      .view = lane_of(hits->view, i),
                      .material = &plan->materials[plan->objects[object].material],
                      .object = object,
                      .triangle = hits->triangle[i]};
    if (at.material->pointwise && plan->scene->objects[object].interpolation == SHD_PHONG) {
        at.sharp = (const double *const *)s->sharp;
        at.sharp_at = i;
    }
    at.mirror = shd_sub(shd_scale(at.normal, 2 * shd_dot(at.normal, at.view)), at.view);
    return at;
}

/* The mean share of the lights before the surface. 1: there are none. */
static void find_shadow(const shd_scenery *scenery, const shd_surface *at, double out[3]) {
    const shd_plan *plan = scenery->plan;
    const shd_shadows *shadows = &scenery->traced->shadows;
    const shd_plan_object *object = &plan->objects[at->object];
    const size_t channels = shd_ray_channels(plan);
    double sum[SHD_BINS_MOST], share[SHD_BINS_MOST], factor, off;
    size_t count = 0;
    memset(sum, 0, channels * sizeof *sum);
    for (size_t j = 0; j < object->light_count && !shd_is_cancelled(plan->cancelled); j++) {
        const shd_plan_light *light = &plan->lights[object->lights[j]];
        if (light->environment) continue; /* nothing stops it */
        shd_weigh_light(light, at->position, at->normal, at->mirror, &factor, &off);
        if (!(factor > 0) && !light->shape) continue;
        shadows->share(shadows->context, light, at, share);
        for (size_t c = 0; c < channels; c++) sum[c] += share[c];
        count++;
    }
    if (plan->tinted && count)
        shd_bins_mix(channels, sum, (const double(*)[3])plan->bins->white, sum);
    for (int c = 0; c < 3; c++) out[c] = count ? sum[c] / (double)count : 1;
}

/* The most of a pixel's samples, rounded up. */
static void note_stray(const shd_bounced *b, float *most) {
    const float error = b->edge ? INFINITY : nextafterf((float)b->error, INFINITY);
    if (!(error <= *most)) *most = error;
}

/* What a surface with textures makes of rays at hit i. */
static shd_coefficients coefficients_of_hit(const shd_plan *plan, const shd_surface *at, size_t i,
                                            const shd_tile_scratch *s, shd_ray_rows rows) {
    const shd_plan_textures *textures = at->material->textures;
    shd_coefficients out = shd_coefficients_of(plan, at->object);
    for (int k = 0; k < SHD_RAY_COEFFICIENTS; k++)
        for (size_t c = 0; textures->rays[k].texture && c < out.count; c++)
            rows[k][c] = s->shares[k][plan->tinted ? 0 : c][i]; /* one number in spectral scenes */
    shd_take_rows(textures, rows, &out);
    return out;
}

/* Follows the rays from hit i. */
static void bounce_hit(const shd_scenery *scenery, const shd_surface *at, size_t i,
                       shd_tile_scratch *s) {
    const shd_plan *plan = scenery->plan;
    double local[SHD_BINS_MOST][3];
    shd_surface seen = *at;
    shd_ray_rows rows;
    shd_coefficients own;
    if (at->material->textures && at->material->textures->rayed) {
        own = coefficients_of_hit(plan, at, i, s, rows);
        seen.rays = &own;
    }
    for (int c = 0; c < 3; c++) local[0][c] = (double)s->sums[shd_sum_of(plan, 0, 0, c)][i];
    if (plan->tinted) shd_tinted_hit(scenery, at, s, i, 0, local);
    const shd_bounced b =
        shd_bounce(&scenery->traced->bouncing, s, s->room, &seen, (const double(*)[3])local);
    s->rays += b.rays;
    s->cut = shd_larger(b.cut, s->cut);
    if (b.edge)
        s->lost++;
    else
        s->off = shd_larger(b.error, s->off);
    if (s->stray) note_stray(&b, &s->stray[s->cell[i]]);
    if (s->alpha) s->alpha[i] = (float)b.alpha;
    if (plan->tinted) {
        shd_tinted_planes(scenery, &seen, s, i, b.radiance, local);
        return;
    }
    const double *opacity = seen.rays ? seen.rays->opacity : at->material->from->opacity;
    for (size_t p = 0; p < plan->plane_count; p++)
        for (int c = 0; c < 3; c++) {
            float *value = &s->sums[shd_sum_of(plan, p, 0, c)][i];
            if (plan->planes[p].kind == SHD_LAYER_BEAUTY)
                *value = (float)b.radiance[c];
            else if (plan->planes[p].kind == SHD_LAYER_BOUNCE)
                *value = (float)(b.radiance[c] - opacity[c] * local[0][c]);
            else
                *value = (float)(opacity[c] * (double)*value);
        }
}

static void store_shadow(const shd_scenery *scenery, const shd_surface *at, size_t i,
                         shd_tile_scratch *s) {
    const shd_plan *plan = scenery->plan;
    double share[3];
    find_shadow(scenery, at, share);
    for (size_t p = 0; p < plan->plane_count; p++)
        for (int c = 0; plan->planes[p].kind == SHD_LAYER_SHADOW && c < 3; c++)
            s->sums[shd_sum_of(plan, p, 0, c)][i] = (float)share[c];
}

void shd_trace_hits(const shd_scenery *scenery, const shd_hits *hits, shd_tile_scratch *s,
                    shd_stopwatch *watch) {
    const shd_plan *plan = scenery->plan;
    const shd_traced *traced = scenery->traced;
    const bool shadows = plan->wants[SHD_LAYER_SHADOW];
    for (size_t i = 0; s->alpha && i < hits->count; i++) s->alpha[i] = 1;
    if (!shadows && !traced->bounces) return;
    shd_end(watch, &watch->times.shade);
    for (size_t i = 0; traced->bounces && i < hits->count; i++) {
        if (shd_is_cancelled(plan->cancelled)) return;
        if (!traced->bouncing.bounces[hits->object[i]]) continue;
        const shd_surface at = surface_of(plan, hits, i, s);
        if (plan->tinted && at.material->textures)
            shd_textured_weigh(scenery, at.material->textures, hits, i, 1, s);
        bounce_hit(scenery, &at, i, s);
    }
    if (traced->bounces) shd_end(watch, &watch->times.trace);
    for (size_t i = 0; shadows && i < hits->count; i++) {
        if (shd_is_cancelled(plan->cancelled)) return;
        const shd_surface at = surface_of(plan, hits, i, s);
        store_shadow(scenery, &at, i, s);
    }
    if (shadows) shd_end(watch, &watch->times.shadow);
}
