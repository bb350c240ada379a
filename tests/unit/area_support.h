/* Lights with a shape for the tests of shade/area.h, and integrals that know nothing of boundaries:
 * Gauss-Legendre points in long double all over the shape, cut where the integrand has a kink. The
 * including file includes cmocka. */
#ifndef SHD_TEST_AREA_SUPPORT_H
#define SHD_TEST_AREA_SUPPORT_H

#include "shade/area.h"
#include "unit/shade_support.h"

typedef long double real;

/* ---- The reference. ---- */

enum { NODES = 20 };
static real nodes[NODES], weights[NODES];

static inline int make_nodes(void **state) {
    (void)state;
    for (int i = 0; i < NODES; i++) {
        real x = cosl((real)SHD_PI * ((real)i + 0.75L) / (NODES + 0.5L)), slope = 1;
        for (int step = 0; step < 30; step++) {
            real p = 1, before = 0;
            for (int k = 0; k < NODES; k++) {
                const real next = ((2 * k + 1) * x * p - k * before) / (k + 1);
                before = p;
                p = next;
            }
            slope = NODES * (before - x * p) / (1 - x * x);
            x -= p / slope;
        }
        nodes[i] = x;
        weights[i] = 2 / ((1 - x * x) * slope * slope);
    }
    return 0;
}

typedef struct problem {
    const shd_light *light;
    shd_surface at;
    real exponent; /* of the lobe; -1: the diffuse term */
} problem;

static inline real dot_real(const real a[3], shd_vec3 b) {
    return a[0] * (real)b.x + a[1] * (real)b.y + a[2] * (real)b.z;
}

/* What comes from the element of the plane at x, y: the integrand over area. */
static inline real element(const problem *q, real x, real y) {
    const shd_light *l = q->light;
    const real from[3] = {(real)l->position.x - (real)q->at.position.x,
                          (real)l->position.y - (real)q->at.position.y,
                          (real)l->position.z - (real)q->at.position.z};
    real p[3] = {from[0] + x * (real)l->across.x + y * (real)l->up.x,
                 from[1] + x * (real)l->across.y + y * (real)l->up.y,
                 from[2] + x * (real)l->across.z + y * (real)l->up.z};
    const real d = sqrtl(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
    const real shine = -dot_real(p, l->direction) / d, facing = dot_real(p, q->at.normal) / d;
    if (!(shine > 0) || !(facing > 0)) return 0;
    if (q->exponent < 0) return facing * shine / (d * d);
    const real z = dot_real(p, q->at.mirror) / d;
    return z > 0 ? powl(z > 1 ? 1 : z, q->exponent) * shine / (d * d) : 0;
}

/* Where along y the half-plane of a direction ends, at this x. */
static inline real end_of(const problem *q, shd_vec3 n, real x) {
    const shd_light *l = q->light;
    const shd_vec3 path = shd_sub(l->position, q->at.position);
    return -((real)shd_dot(n, path) + x * (real)shd_dot(n, l->across)) / (real)shd_dot(n, l->up);
}

static inline int compare_real(const void *a, const void *b) {
    const real x = *(const real *)a, y = *(const real *)b;
    return x < y ? -1 : x > y;
}

/* The cubic between cuts makes roots at its ends smooth, which powers below 1 have there. */
static inline real column(const problem *q, real x, real low, real high, int parts) {
    real cuts[4] = {low, end_of(q, q->at.normal, x), end_of(q, q->at.mirror, x), high}, sum = 0;
    for (int i = 1; i < 3; i++)
        if (!(cuts[i] > low))
            cuts[i] = low;
        else if (cuts[i] > high)
            cuts[i] = high;
    qsort(cuts, 4, sizeof *cuts, compare_real);
    for (int i = 0; i < 3; i++)
        for (int part = 0; part < parts && cuts[i + 1] > cuts[i]; part++)
            for (int k = 0; k < NODES; k++) {
                const real s = (2 * part + 1 + nodes[k]) / (2 * parts), all = cuts[i + 1] - cuts[i];
                sum += all * 6 * s * (1 - s) * weights[k] / (2 * parts) *
                       element(q, x, cuts[i] + all * s * s * (3 - 2 * s));
            }
    return sum;
}

/* The integral over a rectangle or a disc, cut along `across` where a horizon crosses its border or
 * the other horizon. A disc's x is r sin(a). */
static inline double integrate_flat(const problem *q, int parts) {
    const shd_light *l = q->light;
    const bool disc = l->type == SHD_LIGHT_DISC;
    const real half = disc ? (real)SHD_PI / 2 : (real)l->size[0] / 2;
    enum { CUTS = 12 };
    real cuts[CUTS] = {-half, half}, sum = 0;
    int count = 2;
    const shd_vec3 n[2] = {q->at.normal, q->at.mirror};
    const shd_vec3 path = shd_sub(l->position, q->at.position);
    real line[2][3];
    for (int i = 0; i < 2; i++) {
        line[i][0] = (real)shd_dot(n[i], path);
        line[i][1] = (real)shd_dot(n[i], l->across);
        line[i][2] = (real)shd_dot(n[i], l->up);
        const real k = line[i][0], a = line[i][1], b = line[i][2];
        if (disc) {
            const real swing = (real)l->radius * sqrtl(a * a + b * b);
            for (int s = -1; s <= 1 && fabsl(k) < swing; s += 2) {
                const real angle = atan2l(b, a) + (real)s * acosl(-k / swing);
                cuts[count++] = asinl(cosl(angle));
            }
        } else {
            for (int s = -1; s <= 1; s += 2)
                cuts[count++] = -(k + b * (real)s * (real)l->size[1] / 2) / a;
        }
    }
    const real det = line[0][1] * line[1][2] - line[1][1] * line[0][2];
    const real cross = (line[0][2] * line[1][0] - line[1][2] * line[0][0]) / det;
    cuts[count++] = disc ? asinl(fmaxl(-1, fminl(1, cross / (real)l->radius))) : cross;
    for (int i = 0; i < count; i++)
        if (!(cuts[i] > -half))
            cuts[i] = -half;
        else if (cuts[i] > half)
            cuts[i] = half;
    qsort(cuts, (size_t)count, sizeof *cuts, compare_real);
    for (int i = 0; i + 1 < count; i++)
        for (int part = 0; part < parts && cuts[i + 1] > cuts[i]; part++) {
            const real span = (cuts[i + 1] - cuts[i]) / (2 * parts);
            for (int k = 0; k < NODES; k++) {
                const real a = cuts[i] + span * (2 * part + 1 + nodes[k]), r = (real)l->radius;
                sum +=
                    span * weights[k] *
                    (disc ? r * cosl(a) * column(q, r * sinl(a), -r * cosl(a), r * cosl(a), parts)
                          : column(q, a, -(real)l->size[1] / 2, (real)l->size[1] / 2, parts));
            }
        }
    return (double)(sum / (real)shd_light_area(l));
}

/* The integral over the cone of directions to a sphere. No horizon may cut it. */
static inline double integrate_sphere(const problem *q, int parts) {
    shd_vec3 c = {0, 0, 0}, a = c, b;
    const shd_vec3 path = shd_sub(q->light->position, q->at.position);
    shd_normalize(path, &c);
    shd_normalize(shd_cross(c, fabs(c.x) < 0.5 ? (shd_vec3){1, 0, 0} : (shd_vec3){0, 1, 0}), &a);
    b = shd_cross(c, a);
    const real span = asinl((real)q->light->radius / (real)shd_length(path));
    const int turns = 16 * parts;
    real sum = 0;
    for (int part = 0; part < parts; part++)
        for (int k = 0; k < NODES; k++) {
            const real t = span * (2 * part + 1 + nodes[k]) / (2 * parts);
            for (int j = 0; j < 4 * turns; j++) { /* equal steps are exact around a circle */
                const real f = (real)SHD_PI * ((real)j + 0.5L) / (2 * turns);
                const real s = sinl(t), u = cosl(t), v = s * cosl(f), w = s * sinl(f);
                const real p[3] = {u * (real)c.x + v * (real)a.x + w * (real)b.x,
                                   u * (real)c.y + v * (real)a.y + w * (real)b.y,
                                   u * (real)c.z + v * (real)a.z + w * (real)b.z};
                const real facing = dot_real(p, q->at.normal), z = dot_real(p, q->at.mirror);
                const real value = q->exponent < 0 ? facing : z > 0 ? powl(z, q->exponent) : 0;
                sum += span / (2 * parts) * weights[k] * s * value * (real)SHD_PI / (2 * turns);
            }
        }
    return (double)(sum / (real)shd_light_area(q->light));
}

/* ---- What is tested. ---- */

static inline shd_light shape_light(shd_light_type type, shd_vec3 position, shd_vec3 direction) {
    shd_light l = {.type = type,
                   .position = position,
                   .color = {1, 1, 1},
                   .size = {2, 1},
                   .radius = 0.75,
                   .attenuation = {0, 0, 1}};
    shd_normalize(direction, &l.direction);
    shd_vec3 aside = fabs(l.direction.y) < 0.9 ? (shd_vec3){0, 1, 0} : (shd_vec3){0.3, 0, 1};
    shd_normalize(shd_cross(aside, l.direction), &l.across);
    l.up = shd_cross(l.direction, l.across);
    return l;
}

static inline shd_surface surface_at(shd_vec3 position, shd_vec3 normal, shd_vec3 view,
                                     const shd_plan_material *material) {
    shd_surface at = {.position = position, .material = material};
    shd_normalize(normal, &at.normal);
    shd_normalize(view, &at.view);
    at.mirror = shd_sub(shd_scale(at.normal, 2 * shd_dot(at.normal, at.view)), at.view);
    return at;
}

typedef struct weighed {
    bool lit;
    double diffuse, lobe, error;
} weighed;

static inline weighed weigh_shape(const shd_light *light, shd_surface at, double exponent) {
    const shd_plan_lobe lobe = {{1, 1, 1}, exponent};
    const shd_plan_material material = {.lobes = &lobe, .lobe_count = 1};
    weighed out = {0};
    at.material = &material;
    out.lit = shd_area_weigh(light, &at, 0, &out.diffuse, &out.lobe, &out.error);
    if (!out.lit) out = (weighed){0};
    return out;
}

static const double exponents[] = {0, 1, 2, 3, 10, 31, 32, 7.3, 0.5, 96, 97, 400.5};

static const shd_vec3 zero = {0, 0, 0}, up = {0, 1, 0}, down = {0, -1, 0};

#endif
