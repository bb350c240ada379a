#include "trace/shadows.h"

#include <string.h>

#include "base/clock.h"
#include "base/cpu.h"
#include "shade/beam.h"
#include "trace/aims.h"

/* Surfaces that a ray may cross. More are not there but by rounding. */
enum { MOST_CROSSED = 4096 };

typedef struct shadow_map {
    const shd_plan *plan;
    const shd_caster *caster;
    size_t channels;
    const bool *solid, *convex; /* [object] */
    bool varies;                /* some opacity is a texture */
    shd_occlusion occlusion;
    shd_aim_pattern pattern;
} shadow_map;

/* What may be in the way: no list means all objects. The visible shape of the light itself is not.
 */
typedef struct in_the_way {
    const uint32_t *list;
    size_t count;
    const struct shd_light *shape; /* the light's, or NULL */
} in_the_way;

/* All of the light arrives. */
static void share_all(const shadow_map *map, double *share) {
    share[0] = share[1] = share[2] = 1;
    for (size_t c = 3; c < map->channels; c++) share[c] = 1;
}

/* Multiplies the share by what is let through where the beam meets an object. False: nothing is. */
static bool dim(const shadow_map *map, const shd_beam *at, double *share) {
    double scratch[SHD_BINS_MOST];
    const double *opacity = shd_opacity_at(map->plan, at, scratch);
    bool any = false;
    for (size_t c = 0; c < map->channels; c++) {
        share[c] *= 1 - opacity[c];
        any |= share[c] != 0;
    }
    return any;
}

/* Multiplies the share by what the surfaces on the way leave. `width`: of the ray's beam. */
static void follow_ray(const shadow_map *map, shd_ray ray, in_the_way way, double width,
                       double *share) {
    for (int crossed = 0; crossed < MOST_CROSSED; crossed++) {
        shd_meeting m;
        if (shd_is_cancelled_at(map->plan->cancelled, (size_t)crossed)) return;
        if (!shd_cast_ray(map->caster, &ray, way.list, way.count, map->solid, &m)) return;
        const struct shd_light *emitter = map->plan->scene->objects[m.object].emitter;
        const bool itself = emitter && emitter == way.shape;
        if (map->solid[m.object]) {
            memset(share, 0, map->channels * sizeof *share);
            return;
        }
        const shd_met_at place = shd_met_place(map->caster, &m);
        const shd_beam beam = {m.object,  m.triangle,    place.position,
                               place.own, ray.direction, width};
        if (!itself && !dim(map, &beam, share)) {
            memset(share, 0, map->channels * sizeof *share);
            return;
        }
        ray.origin = place.position;
        ray.far -= m.t;
        ray.start = (shd_start){(int32_t)m.object, m.triangle, place.own};
    }
}

/* The surface's own normal, on the side that is lit. */
static shd_vec3 own_normal(const shadow_map *map, const shd_surface *at) {
    const shd_vec3 own = shd_own_normal(map->caster, at->object, at->triangle);
    if (own.x == 0 && own.y == 0 && own.z == 0) return shd_flat_normal(at);
    const bool turned = !at->material->front_only && shd_dot(own, at->view) < 0;
    return turned ? shd_scale(own, -1) : own;
}

/* That of a pixel, if the camera saw the point: shadows are as sharp as it could show them. */
static double width_at(const shd_scene *scene, shd_vec3 position) {
    return shd_beam_width(scene, shd_length(shd_sub(position, scene->camera.position)));
}

/* The share of light that comes along `toward` from the distance `far`. */
static void find_share(const shadow_map *map, const shd_surface *at, shd_vec3 own, shd_vec3 toward,
                       double far, in_the_way way, double *share) {
    share_all(map, share);
    const double width = map->varies ? width_at(map->plan->scene, at->position) : 0;
    const shd_beam beam = {at->object, at->triangle, at->position, own, toward, width};
    if (!(shd_dot(own, toward) > 0) && !dim(map, &beam, share)) return;
    const shd_ray ray = {at->position, toward, far, {(int32_t)at->object, at->triangle, own}};
    follow_ray(map, ray, way, width, share);
}

/* ---- Lights with a shape. ---- */

static void find_mean(const shadow_map *map, const struct shd_light *light, const shd_surface *at,
                      shd_vec3 own, in_the_way way, double *out) {
    static shd_aim_function *const aim_at[SHD_ISA_COUNT] = SHD_VARIANTS(shd_aim);
    const size_t samples = map->pattern.count;
    const shd_aim aim = shd_aim_at(light, at->position, at->normal);
    shd_aim_function *const find_aims =
        shd_aim_is_held(&aim) ? aim_at[map->plan->isa] : shd_aim_singly;
    double all = 0, sum[SHD_BINS_MOST], share[SHD_BINS_MOST];
    shd_aims aims;
    memset(sum, 0, map->channels * sizeof *sum);
    for (size_t i = 0; i < samples; i++) {
        const size_t k = i % SHD_AIMS_MOST, left = samples - i;
        if (shd_is_cancelled_at(map->plan->cancelled, i)) break;
        if (!k)
            find_aims(&aim, &map->pattern, i, left < SHD_AIMS_MOST ? left : SHD_AIMS_MOST, &aims);
        const double weight = aims.weight[k];
        if (!(weight > 0)) continue;
        const shd_vec3 toward = {aims.toward[0][k], aims.toward[1][k], aims.toward[2][k]};
        find_share(map, at, own, toward, aims.far[k], way, share);
        all += weight;
        for (size_t c = 0; c < map->channels; c++) sum[c] += weight * share[c];
    }
    for (size_t c = 0; c < map->channels; c++) out[c] = all > 0 ? sum[c] / all : 1;
}

/* ---- The hook. ---- */

/* What may be in the way to any point of an object. */
static in_the_way find_way(const shadow_map *map, const shd_plan_light *light, size_t object) {
    const shd_plan *plan = map->plan;
    const in_the_way any = {NULL, 0, light->shape};
    if (!map->occlusion.pairs) return any;
    const size_t j = (size_t)(light - plan->lights);
    const shd_occluders *o = &map->occlusion.pairs[object * plan->light_count + j];
    if (o->count == (uint32_t)SHD_OCCLUDERS_ANY) return any;
    return (in_the_way){map->occlusion.list + o->first, o->count, light->shape};
}

static void share_behind(const shadow_map *map, const shd_plan_light *light, const shd_surface *at,
                         in_the_way way, double *out) {
    share_all(map, out);
    if (light->environment) return;     /* it casts none */
    if (way.list && !way.count) return; /* a flat surface is no fold */
    const shd_vec3 own = own_normal(map, at);
    if (light->shape) {
        find_mean(map, light->shape, at, own, way, out);
    } else if (light->directional) {
        find_share(map, at, own, light->toward, INFINITY, way, out);
    } else {
        const shd_vec3 path = shd_sub(light->position, at->position);
        shd_vec3 toward = {0, 0, 0};
        if (shd_normalize(path, &toward))
            find_share(map, at, own, toward, shd_length(path), way, out);
    }
}

static void share_light(const void *context, const shd_plan_light *light, const shd_surface *at,
                        double *out) {
    const shadow_map *map = context;
    share_behind(map, light, at, find_way(map, light, at->object), out);
}

/* ---- Of many points. ---- */

/* Looking is worth it for so many points. */
enum { WORTH_LOOKING = 4 };

static void gather_crowd(const void *context, shd_crowd *crowd) {
    const shadow_map *map = context;
    const size_t object = crowd->at[0].object;
    shd_vec3 low = crowd->at[0].position, high = low;
    crowd->outward = 0;
    if (crowd->count < WORTH_LOOKING) return;
    for (size_t i = 1; i < crowd->count; i++) {
        low = shd_vec3_min(crowd->at[i].position, low);
        high = shd_vec3_max(crowd->at[i].position, high);
    }
    const shd_vec3 half = shd_scale(shd_sub(high, low), 0.5);
    crowd->around = (shd_ball){shd_add(low, half), shd_length(half)};
    for (size_t i = 0; map->convex[object] && i < crowd->count; i++) {
        const shd_surface *at = &crowd->at[i];
        if (shd_is_outside(map->caster, object, at->position, at->normal))
            crowd->outward |= UINT64_C(1) << i;
    }
}

/* What may be in the way to a crowd. Its object itself comes last; *alone: nothing else does. */
static in_the_way narrow_way(const shadow_map *map, const shd_plan_light *light,
                             const shd_crowd *crowd, uint32_t list[SHD_OCCLUDERS_MOST + 1],
                             bool *alone) {
    const size_t object = crowd->at[0].object;
    const in_the_way way = find_way(map, light, object);
    size_t count = 0;
    *alone = false;
    if (crowd->count < WORTH_LOOKING) return way;
    if (way.list) {
        for (size_t k = 0; k < way.count; k++)
            if (way.list[k] != object &&
                shd_may_object_hide(map->plan, crowd->around, light, way.list[k]))
                list[count++] = way.list[k];
    } else {
        count =
            shd_list_between(map->caster, crowd->around, light, object, list, SHD_OCCLUDERS_MOST);
        if (count > SHD_OCCLUDERS_MOST) return way;
    }
    *alone = count == 0;
    if (shd_shades_itself(map->plan, object)) list[count++] = (uint32_t)object;
    return (in_the_way){list, count, light->shape};
}

/* Whether all of a light is before a convex surface, by more than what rounding may do to it: a ray
 * to it leaves the object, and does not meet it again. */
static bool is_before(const shd_plan_light *light, const shd_surface *at) {
    static const double BY = 1e-9;
    if (light->directional) return shd_dot(at->normal, light->toward) > BY;
    const shd_vec3 path = shd_sub(light->position, at->position);
    const double reach = light->shape ? shd_light_reach(light->shape) : 0;
    return shd_dot(at->normal, path) - reach > BY * (shd_max_abs(path) + reach);
}

static void share_crowd(const void *context, const shd_plan_light *light, const shd_crowd *crowd,
                        const uint8_t *which, size_t n, double *out) {
    const shadow_map *map = context;
    const double began = crowd->seconds ? shd_now() : 0;
    uint32_t list[SHD_OCCLUDERS_MOST + 1];
    bool alone;
    if (light->environment) { /* it casts none */
        for (size_t i = 0; i < n; i++) share_all(map, out + i * map->channels);
        return;
    }
    const in_the_way way = narrow_way(map, light, crowd, list, &alone);
    for (size_t i = 0; i < n && !shd_is_cancelled_at(map->plan->cancelled, i); i++) {
        const shd_surface *at = &crowd->at[which[i]];
        double *share = out + i * map->channels;
        if (alone && (crowd->outward >> which[i] & 1) && is_before(light, at))
            share_all(map, share);
        else
            share_behind(map, light, at, way, share);
    }
    if (crowd->seconds) *crowd->seconds += shd_now() - began;
}

const bool *shd_solid_objects(const shd_plan *plan, shd_arena *arena) {
    const size_t count = plan->scene->object_count;
    bool *solid = shd_arena_alloc(arena, count, sizeof *solid);
    for (size_t i = 0; solid && i < count; i++) {
        const shd_coefficients k = shd_coefficients_of(plan, i);
        solid[i] = shd_is_all(k.opacity, k.count, 1) &&
                   !plan->scene->objects[i].emitter; /* its own light passes */
    }
    return solid;
}

static const bool *find_convex(const shd_plan *plan, const shd_caster *caster, shd_arena *arena) {
    const size_t count = plan->scene->object_count;
    bool *convex = shd_arena_alloc(arena, count, sizeof *convex);
    /* By the normal that is lit, which a map turns. */
    for (size_t i = 0; convex && i < count; i++)
        convex[i] = !plan->materials[plan->objects[i].material].normal && shd_is_convex(caster, i);
    return convex;
}

bool shd_shadows_make(const shd_plan *plan, const shd_caster *caster, shd_arena *arena,
                      shd_shadows *out) {
    shadow_map *map = shd_arena_alloc(arena, 1, sizeof *map);
    if (!map) return false;
    *map = (shadow_map){.plan = plan,
                        .caster = caster,
                        .channels = shd_ray_channels(plan),
                        .varies = plan->textured,
                        .solid = shd_solid_objects(plan, arena),
                        .convex = find_convex(plan, caster, arena)};
    if (!map->solid || !map->convex ||
        !shd_aim_pattern_make((size_t)plan->scene->trace.shadow_samples, arena, &map->pattern) ||
        !shd_find_occlusion(plan, arena, &map->occlusion))
        return false;
    *out = (shd_shadows){map, share_light, gather_crowd, share_crowd};
    return true;
}
