#include "shade/exact.h"

#include "shade/packed.h"

/* |a + b|^2 / 2 of unit vectors: 1 + a.b without its cancellation near a = -b. */
static double half_chord(shd_vec3 a, shd_vec3 b) {
    shd_vec3 chord = shd_add(a, b);
    return shd_dot(chord, chord) / 2;
}

static double spot_factor(const shd_plan_light *light, shd_vec3 toward) {
    double q = half_chord(light->axis, toward); /* 1 - cos t */
    double factor = shd_penumbra(light, q);
    if (factor > 0 && light->exponent > 0) factor *= q < 1 ? exp(light->exponent * log1p(-q)) : 0;
    return factor;
}

double shd_arriving(const shd_plan_light *light, shd_vec3 position, shd_vec3 *toward) {
    *toward = light->toward;
    double f = light->gain;
    if (!light->directional) {
        shd_vec3 path = shd_sub(light->position, position);
        if (!shd_normalize(path, toward)) return 0; /* on the surface: no direction */
        f = shd_attenuation(light, shd_length(path));
    }
    return light->spot ? f * spot_factor(light, *toward) : f;
}

double shd_weigh_light(const shd_plan_light *light, shd_vec3 position, shd_vec3 normal,
                       shd_vec3 mirror, double *factor, double *off) {
    *factor = 0;
    *off = 1;
    shd_vec3 toward;
    const double f = shd_arriving(light, position, &toward);
    if (!(f > 0)) return 0;
    double facing = shd_dot(normal, toward);
    if (!(facing > 0)) return 0; /* the light is behind: neither term */
    *factor = f;
    *off = half_chord(toward, shd_scale(mirror, -1));
    return f * facing;
}

double shd_weigh_lobe(double shininess, double factor, double off) {
    return off < 1 ? factor * exp(shininess * log1p(-off)) : 0;
}

bool shd_is_behind_face(const shd_wide_light *light, shd_vec3 p, shd_vec3 normal) {
    for (uint32_t k = 0; k < light->sheet_count; k++) {
        const shd_packed_sheet *s = &light->sheets[k];
        const shd_vec3 n = {s->normal[0], s->normal[1], s->normal[2]};
        const double sign = shd_dot(n, normal) < 0 ? -1 : 1;
        const shd_vec3 off = shd_madd(normal, n, -sign);
        const double place = fabs(p.x) + fabs(p.y) + fabs(p.z);
        if (shd_dot(off, off) < s->same_normal &&
            fabs(shd_dot(n, p) - s->offset) < place * s->same_place + s->slack)
            return !(sign * s->height > 0);
    }
    return false;
}
