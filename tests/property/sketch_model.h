/* Phong's model in longer floats, which shares nothing with the kernels, and how far off sketches
 * are proven to be (shade/sketch.c). */
#ifndef SHD_TEST_SKETCH_MODEL_H
#define SHD_TEST_SKETCH_MODEL_H

#include "property/pieces.h"

typedef long double real;
typedef struct vec {
    real x, y, z;
} vec;

static inline vec of(shd_vec3 v) {
    return (vec){v.x, v.y, v.z};
}
static inline vec madd(vec a, vec b, real s) {
    return (vec){a.x + s * b.x, a.y + s * b.y, a.z + s * b.z};
}
static inline real dot(vec a, vec b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
static inline vec unit(vec a) {
    return madd((vec){0, 0, 0}, a, 1 / sqrtl(dot(a, a)));
}

typedef struct spot {
    vec point, normal, view;
} spot;

/* The color, and what errs by: the units of directions and of all else that are proven. */
static inline void shade(const shd_plan *plan, bool ellipsoid, const spot *at, real color[3],
                         real room[3]) {
    const real U = 0x1p-24L, FACING = ellipsoid ? 150 : 112, DIRECTION = ellipsoid ? 460 : 312,
               RELATIVE = ellipsoid ? 42 : 70;
    const shd_plan_material *m = &plan->materials[plan->groups[0].material];
    const vec mirror =
        madd(madd((vec){0, 0, 0}, at->normal, 2 * dot(at->normal, at->view)), at->view, -1);
    for (int c = 0; c < 3; c++) {
        color[c] = m->constant[c];
        room[c] = 4 * U * color[c];
    }
    for (size_t j = 0; j < plan->light_count; j++) {
        const shd_plan_light *l = &plan->lights[j];
        const vec path = l->directional ? of(l->toward) : madd(of(l->position), at->point, -1);
        const real d = sqrtl(dot(path, path)), facing = dot(path, at->normal) / d,
                   fall = l->attenuated ? l->gain / (l->a + d * (l->b + d * l->c)) : l->gain;
        const vec apart = madd(madd((vec){0, 0, 0}, path, 1 / d), mirror, -1);
        const real shine = 1 - dot(apart, apart) / 2;
        for (int c = 0; c < 3; c++) {
            const real strength = fall * l->color[c];
            if (facing > -FACING * U) room[c] += strength * m->diffuse[c] * FACING * U;
            if (!(facing > 0)) continue;
            color[c] += strength * m->diffuse[c] * facing;
            room[c] += strength * m->diffuse[c] * facing * (RELATIVE + 8) * U;
            for (size_t k = 0; k < m->lobe_count; k++) {
                const real n = m->lobes[k].shininess, power = shine > 0 ? powl(shine, n) : 0,
                           crest = fmaxl(shine, 0) + DIRECTION * U, /* near it, the slope is more */
                    slope = n * powl(fminl(crest, 1), n - 1);
                color[c] += strength * m->lobes[k].specular[c] * power;
                room[c] += strength * m->lobes[k].specular[c] *
                           (slope * DIRECTION * U * (sqrtl(dot(apart, apart)) + DIRECTION * U) +
                            (RELATIVE + 16) * U * power + 1e-7L);
            }
        }
    }
}

/* Of a kind that is sketched, `away` or more from the origin. */
static inline void write_light(FILE *out, uint64_t *random, double away) {
    const int kind = below(random, 3);
    shd_vec3 from = random_direction(random);
    from.z = fabs(from.z) + uniform(random, -0.2, 0.5);
    if (kind == 0) {
        fputs("{\"type\": \"directional\", ", out);
        write_vector(out, "direction", shd_scale(from, -1));
    } else {
        const double d = away * pow(10, uniform(random, 0.05, 2));
        fputs("{\"type\": \"point\", ", out);
        write_vector(out, "position", shd_scale(from, d));
        if (kind == 2)
            fprintf(out, ", \"attenuation\": [%.17g, %.17g, %.17g]", uniform(random, 0, 1),
                    uniform(random, 0.1, 1) / d, uniform(random, 0, 1) / (d * d));
    }
    fprintf(out, ", \"color\": [%.17g, 1, 0.1]}", uniform(random, 0, 1));
}

#endif
