/* One light on points, by the reference and by every kernel this machine has, for the tests of
 * shade/. The including file includes cmocka. */
#ifndef SHD_TEST_SHADE_SUPPORT_H
#define SHD_TEST_SHADE_SUPPORT_H

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "shade/exact.h"
#include "shade/lighting.h"

/* 113 bits by gcc on x86-64, where `long double` has 64; there are others where it has 113. */
#if __has_include(<quadmath.h>)
#include <quadmath.h>
typedef __float128 wide;
enum { WIDE_BITS = 113 };
#define wide_sqrt  sqrtq
#define wide_exp   expq
#define wide_log1p log1pq
#else
typedef long double wide;
enum { WIDE_BITS = LDBL_MANT_DIG };
#define wide_sqrt  sqrtl
#define wide_exp   expl
#define wide_log1p log1pl
#endif

typedef struct pair {
    double diffuse, specular;
} pair;

typedef struct kernel {
    char name[32];
    bool reference; /* the scalar f64 one */
    shd_tier tier;
    shd_isa isa;
} kernel;

enum { MOST_KERNELS = 1 + 2 * SHD_ISA_COUNT };

/* The reference, and every variant of every tier that this machine has. */
static inline size_t find_kernels(kernel out[MOST_KERNELS]) {
    size_t n = 0;
    out[n++] = (kernel){"reference", true, SHD_EXACT, SHD_PORTABLE};
    for (shd_tier tier = SHD_STANDARD; tier <= SHD_EXACT; tier++) {
        for (shd_isa isa = SHD_PORTABLE; isa < SHD_ISA_COUNT; isa++) {
            if (!shd_cpu_has(isa)) continue;
            out[n] = (kernel){"", false, tier, isa};
            snprintf(out[n].name, sizeof out[n].name, "%s %s", shd_tier_names[tier],
                     shd_isa_name(isa));
            n++;
        }
    }
    return n;
}

enum { MOST_POINTS = 4096 };

/* Points in the world's frame and, narrowed, in the plan's. */
typedef struct points {
    size_t count;
    double position[3][MOST_POINTS], normal[3][MOST_POINTS], view[3][MOST_POINTS];
    float position32[3][MOST_POINTS], low[3][MOST_POINTS], normal32[3][MOST_POINTS],
        mirror32[3][MOST_POINTS];
} points;

static inline void set_lane(double v[3][MOST_POINTS], size_t lane, shd_vec3 value) {
    v[0][lane] = value.x;
    v[1][lane] = value.y;
    v[2][lane] = value.z;
}

static inline shd_vec3 lane_of(double v[3][MOST_POINTS], size_t lane) {
    return (shd_vec3){v[0][lane], v[1][lane], v[2][lane]};
}

static inline void set_point(points *to, size_t i, shd_vec3 p, shd_vec3 n, shd_vec3 v) {
    set_lane(to->position, i, p);
    set_lane(to->normal, i, n);
    set_lane(to->view, i, v);
}

/* Narrows all points, up to whole SHD_LANES, which repeat the last. */
static inline void narrow_points(points *to, const shd_plan *plan) {
    for (size_t i = 0; i % SHD_LANES || i < to->count; i++) {
        size_t from = i < to->count ? i : to->count - 1;
        set_point(to, i, lane_of(to->position, from), lane_of(to->normal, from),
                  lane_of(to->view, from));
        shd_vec3 p = lane_of(to->position, i), n = lane_of(to->normal, i), v = lane_of(to->view, i);
        shd_vec3 m = shd_sub(shd_scale(n, 2 * shd_dot(n, v)), v);
        p = shd_scale(shd_sub(p, plan->origin), plan->scale);
        const double at[3] = {p.x, p.y, p.z}, mirror[3] = {m.x, m.y, m.z};
        for (int c = 0; c < 3; c++) {
            volatile float high = (float)at[c]; /* or GCC 12 takes at[c] for it */
            to->position32[c][i] = high;
            to->low[c][i] = (float)(at[c] - (double)high);
            to->normal32[c][i] = (float)to->normal[c][i];
            to->mirror32[c][i] = (float)mirror[c];
        }
    }
}

typedef struct sums_of {
    double diffuse[3][MOST_POINTS], specular[3 * 16][MOST_POINTS];
} sums_of;

static inline shd_points64 world_points(const points *at) {
    shd_points64 p = {.count = at->count};
    for (int c = 0; c < 3; c++) {
        p.position[c] = at->position[c];
        p.normal[c] = at->normal[c];
        p.view[c] = at->view[c];
    }
    return p;
}

/* The sums over all lights of the plan, or those of `which`, by its tier and variant. */
static inline void sum_by(const shd_plan *plan, const shd_plan_material *material,
                          const uint32_t *which, size_t n, const points *at, bool split,
                          sums_of *out) {
    shd_arena *arena = shd_arena_new((size_t)1 << 24);
    const shd_lighting *lighting = shd_lighting_new(plan, NULL, arena);
    assert_non_null(lighting);
    static _Alignas(64) float rows[3 * 17][MOST_POINTS];
    float *D[3 * 17];
    double *D64[3 * 17];
    for (size_t k = 0; k < 3 * 17; k++) {
        D[k] = rows[k];
        D64[k] = k < 3 ? out->diffuse[k] : out->specular[k - 3];
    }
    shd_points32 narrow = {.count = at->count};
    for (int c = 0; c < 3; c++) {
        narrow.position[c] = at->position32[c];
        narrow.low[c] = split ? at->low[c] : NULL;
        narrow.normal[c] = at->normal32[c];
        narrow.mirror[c] = at->mirror32[c];
    }
    const shd_points64 exact = world_points(at);
    if (plan->tier == SHD_EXACT)
        shd_light_sums64(lighting, material, which, n, &exact, D64, D64 + 3);
    else
        shd_light_sums32(lighting, material, which, n, &narrow, D, D + 3, NULL);
    for (size_t k = 0; plan->tier != SHD_EXACT && k < 3 * (1 + material->lobe_count); k++)
        for (size_t i = 0; i < at->count; i++) D64[k][i] = (double)rows[k][i];
    shd_arena_drop(arena);
}

/* Lights and one material with one lobe, as a plan. */
typedef struct stage {
    shd_scene scene;
    shd_plan_lobe lobe;
    shd_plan_material material;
    shd_plan plan;
} stage;

static inline void set_stage(stage *s, const kernel *k, double scale, const shd_plan_light *lights,
                             size_t count, double shininess) {
    memset(s, 0, sizeof *s);
    s->scene.light_count = count;
    s->scene.material_count = 1;
    s->lobe = (shd_plan_lobe){{1, 1, 1}, shininess};
    s->material = (shd_plan_material){.lobes = &s->lobe, .lobe_count = 1};
    s->plan = (shd_plan){.scene = &s->scene,
                         .tier = k->tier,
                         .isa = k->isa,
                         .lights = lights,
                         .light_count = count,
                         .materials = &s->material,
                         .grey_lights = true,
                         .scale = scale};
}

/* One white light on all points. */
static inline void weigh_points(const kernel *k, double scale, const shd_plan_light *light,
                                double shininess, points *at, bool split, double *diffuse,
                                double *specular) {
    stage s;
    set_stage(&s, k, scale, light, 1, shininess);
    if (k->reference) {
        for (size_t i = 0; i < at->count; i++) {
            shd_vec3 n = lane_of(at->normal, i), v = lane_of(at->view, i);
            shd_vec3 m = shd_sub(shd_scale(n, 2 * shd_dot(n, v)), v);
            double factor, off;
            diffuse[i] = shd_weigh_light(light, lane_of(at->position, i), n, m, &factor, &off);
            specular[i] = shd_weigh_lobe(shininess, factor, off);
        }
        return;
    }
    static sums_of out;
    static const uint32_t which[1] = {0};
    narrow_points(at, &s.plan);
    sum_by(&s.plan, &s.material, which, 1, at, split, &out);
    for (size_t i = 0; i < at->count; i++) {
        diffuse[i] = out.diffuse[0][i];
        specular[i] = out.specular[0][i];
    }
}

/* The formula as it is written, without tricks but for the power, which 113 bits can stand:
 * (R.V)+^ns with R = 2(N.L)N - L. No spot. */
static inline pair exact_weights(const shd_plan_light *light, double shininess, shd_vec3 p,
                                 shd_vec3 n, shd_vec3 v) {
    wide l[3] = {(wide)light->position.x - (wide)p.x, (wide)light->position.y - (wide)p.y,
                 (wide)light->position.z - (wide)p.z};
    if (light->directional)
        l[0] = (wide)light->toward.x, l[1] = (wide)light->toward.y, l[2] = (wide)light->toward.z;
    wide nq[3] = {(wide)n.x, (wide)n.y, (wide)n.z}, vq[3] = {(wide)v.x, (wide)v.y, (wide)v.z};
    wide dd = 0, nl = 0, rv = 0, nn = 0, vv = 0;
    for (int c = 0; c < 3; c++) dd += l[c] * l[c], nn += nq[c] * nq[c], vv += vq[c] * vq[c];
    wide d = wide_sqrt(dd);
    for (int c = 0; c < 3; c++) {
        l[c] /= d;
        nq[c] /= wide_sqrt(nn);
        vq[c] /= wide_sqrt(vv);
    }
    for (int c = 0; c < 3; c++) nl += nq[c] * l[c];
    for (int c = 0; c < 3; c++) rv += (2 * nl * nq[c] - l[c]) * vq[c];
    wide f = (wide)light->gain;
    if (!light->directional) f /= (wide)light->a + (wide)light->b * d + (wide)light->c * d * d;
    if (nl <= 0) return (pair){0, 0};
    if (rv <= 0) return (pair){(double)(f * nl), 0};
    wide power = rv >= 1 ? 1 : wide_exp((wide)shininess * wide_log1p(rv - 1));
    return (pair){(double)(f * nl), (double)(f * power)};
}

static inline double uniform(void) {
    return rand() / (RAND_MAX + 1.0);
}

static inline shd_vec3 random_unit(void) {
    shd_vec3 v;
    do {
        v = (shd_vec3){2 * uniform() - 1, 2 * uniform() - 1, 2 * uniform() - 1};
    } while (shd_dot(v, v) > 1 || !shd_normalize(v, &v));
    return v;
}

static inline shd_plan_light point_light(shd_vec3 position) {
    return (shd_plan_light){.position = position, .a = 1, .gain = 1, .color = {1, 1, 1}};
}

#endif
