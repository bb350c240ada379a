/* A smooth function's mean over samples whose mean is the center differs from its value there by
 * half of its second derivative, at most, times the mean of squared distances (Taylor). Second
 * derivatives of a light's weights are carried through their formulas by the product rule, from
 * those of points, normals and views (plan/bend.h). With ' the derivative along any unit step, and
 * of unit vectors:
 *
 *     X = light - P:  |X|' <= |P'|,  |X|'' <= |P''| + |P'|^2 / |X|
 *     L = X / |X|:    |L'| <= |P'| / |X|,  |L''| <= |P''| / |X| + 1.5 (|P'| / |X|)^2
 *     W = 2 (N.V) N - V, a mirror image of V: |W'| <= 2 |N'| + |V'|
 *                     |W''| <= 4 |N''| + 4 |N'| |V'| + 4 (|N'| + |V'|) |N'| + |V''|
 *     A.B:            |(A.B)'| <= (|A'| + |B'|) sin(A, B),
 *                     |(A.B)''| <= |A''| + 2 |A'| |B'| + |B''|
 *     s^n, 0 <= s:    n s^(n - 1) s',  n s^(n - 1) s'' + n (n - 1) s^(n - 2) s'^2
 *
 * Where N.L changes its sign, x+ of a smooth x has a kink: the mean of x+ is no more above that
 * of the mean x than half of the mean of |x - its mean|. A highlight ends there, all of which then
 * counts. So it does at rims of cones, and where an exponent is too small for a second derivative:
 * weights are not negative, so that no mean is farther off than the most of them. */
#include "bound/light/means.h"

/* More than rounding does. */
static const double SLACK = 1 + 1e-6;

/* A function that is not negative: its most in the block, and the most of its derivatives. */
typedef struct smooth {
    double most, first, second;
} smooth;

static smooth times(smooth a, smooth b) {
    return (smooth){a.most * b.most, a.first * b.most + a.most * b.first,
                    a.second * b.most + 2 * a.first * b.first + a.most * b.second};
}

/* How light comes in. */
typedef struct incidence {
    shd_vec3 way;  /* unit: toward the light, at the block's middle */
    double turned; /* no direction in the block is farther from it */
    shd_slopes ways;
    smooth fall;  /* the attenuation */
    double least; /* of it */
} incidence;

/* exp(-x) <= (1 + x / 64)^-64 for x >= 0: no function of a library that others may have otherwise.
 */
static double most_exp(double x) {
    double power = 1 / (1 + x * 0x1p-6);
    for (int i = 0; i < 6; i++) power *= power;
    return power;
}

/* The attenuation at distances in [near, far]. False: it has a kink there. */
static bool bend_fall(const shd_plan_light *light, double near, double far, shd_slopes distance,
                      smooth *out) {
    *out = (smooth){light->gain, 0, 0};
    if (!light->attenuated) return true;
    out->most = shd_attenuation(light, near);
    if (far <= light->min_distance) return true;
    if (near < light->min_distance) return false;
    const double inverse = 1 / (light->a + near * (light->b + near * light->c)),
                 rise = light->b + 2 * light->c * far, rate = rise * inverse,
                 first = light->gain * inverse * rate,
                 second = light->gain * inverse * (2 * rate * rate + 2 * light->c * inverse);
    out->first = first * distance.first;
    out->second = second * distance.first * distance.first + first * distance.second;
    return true;
}

/* False: it may not be smooth. Then only what does not tell of derivatives is known; the most of
 * the attenuation is infinite if nothing is. */
static bool find_incidence(const shd_plan_light *light, const shd_bend *bend, incidence *out) {
    *out = (incidence){.way = light->toward, .fall = {INFINITY, 0, 0}};
    if (light->directional) {
        out->fall.most = out->least = light->gain;
        return true;
    }
    const shd_vec3 x = shd_sub(light->position, bend->point);
    const double away = shd_length(x), moved = bend->points.first * bend->reach,
                 near = away - moved;
    if (!(near > 0.25 * away)) return false;
    const double first = bend->points.first / near;
    out->way = shd_scale(x, 1 / away);
    out->turned = moved / near;
    out->ways = (shd_slopes){first, bend->points.second / near + 1.5 * first * first};
    const shd_slopes distance = {bend->points.first,
                                 bend->points.second + first * bend->points.first};
    out->least = shd_attenuation(light, away + moved);
    return bend_fall(light, near, away + moved, distance, &out->fall);
}

/* Where the block is in a cone: all within what a penumbra begins at (1), all beyond (-1), or
 * elsewhere (0). */
static int side_of_rim(const shd_plan_light *light, const incidence *in) {
    const double chord = shd_length(shd_add(light->axis, in->way)), apart = in->turned + 1e-5,
                 low = shd_larger(chord - apart, 0), high = chord + apart;
    if (low * low / 2 > light->outer) return -1;
    return high * high / 2 < light->inner && light->exponent == 0 ? 1 : 0;
}

/* (A.B)+ of unit vectors whose chord is `chord` at the block's middle, and elsewhere off that by up
 * to `turned`. */
static smooth cosine_of(double chord, double turned, shd_slopes a, shd_slopes b) {
    const double low = shd_larger(chord - turned, 0), most = 1 - low * low / 2,
                 sine = shd_smaller(chord + turned, 1);
    return (smooth){shd_larger(most, 0), (a.first + b.first) * sine,
                    a.second + 2 * a.first * b.first + b.second};
}

/* What of a light's weights the block has. */
typedef struct lighting {
    incidence in;
    double facing, turned; /* N.L at the block's middle, and what it is off that */
    bool is_smooth, turns; /* N.L changes its sign, or may */
} lighting;

static double err_diffuse(const lighting *l, const shd_bend *bend,
                          const shd_pattern_spread *spread) {
    const double chord = sqrt(shd_larger(2 - 2 * l->facing, 0)),
                 all = l->in.fall.most * shd_smaller(l->facing + l->turned, 1);
    if (!l->is_smooth) return all;
    smooth cosine = cosine_of(chord, l->turned, l->in.ways, bend->normals);
    cosine.most = shd_larger(shd_smaller(l->facing + l->turned, 1), l->turned - l->facing);
    const smooth product = times(l->in.fall, cosine);
    double error = product.second / 2 * spread->square;
    /* Of o a sample's distance, o^2 is 1/2 at most, and the mean of o^4 half of that of o^2. */
    if (l->turns)
        error +=
            (product.first * sqrt(spread->along) + product.second / 2 * sqrt(spread->square / 2)) /
            2;
    return shd_smaller(all, error);
}

/* `chord`: between L and W at the block's middle. */
static double err_lobe(const lighting *l, double exponent, double chord, shd_slopes mirrors,
                       const shd_bend *bend, const shd_pattern_spread *spread) {
    const double turned = l->in.turned + mirrors.first * bend->reach,
                 low = shd_larger(chord - turned, 0), x = low * low / 2;
    const smooth shine = cosine_of(chord, turned, l->in.ways, mirrors);
    if (!(shine.most > 0)) return 0;
    const double n = exponent, most = most_exp(n * x), all = l->in.fall.most * most;
    if (!l->is_smooth || l->turns || n < 2) return all;
    /* s^n <= exp(-n (1 - s)) */
    const double slope = n * most_exp((n - 1) * x), curve = n * (n - 1) * most_exp((n - 2) * x);
    const smooth power = {most, slope * shine.first,
                          slope * shine.second + curve * shine.first * shine.first};
    return shd_smaller(all, times(l->in.fall, power).second / 2 * spread->square);
}

/* Of light in each channel: what it may be off, and the least of it in the block. */
typedef struct channels {
    double err[3], low[3];
} channels;

/* Adds a light's part. The least of its highlights is taken for none. */
static void add_light(const shd_plan_material *material, const shd_plan_light *light,
                      const shd_bend *bend, shd_vec3 mirror, shd_slopes mirrors,
                      const shd_pattern_spread *spread, channels *sum) {
    lighting l;
    l.is_smooth = find_incidence(light, bend, &l.in);
    if (!isfinite(l.in.fall.most)) {
        for (int c = 0; c < 3; c++) sum->err[c] = INFINITY;
        return;
    }
    const int side = light->spot ? side_of_rim(light, &l.in) : 1;
    l.facing = shd_dot(bend->normal, l.in.way);
    l.turned = l.in.turned + bend->normals.first * bend->reach + 1e-9;
    if (side < 0 || l.facing + l.turned <= 0) return;
    l.is_smooth = l.is_smooth && side == 1;
    l.turns = !(l.facing > l.turned);
    const double diffuse = material->has_diffuse ? err_diffuse(&l, bend, spread) : 0,
                 chord = shd_length(shd_sub(l.in.way, mirror));
    double weight[3];
    for (int c = 0; c < 3; c++) weight[c] = fabs(material->diffuse[c]) * diffuse;
    for (size_t k = 0; k < material->lobe_count; k++) {
        const shd_plan_lobe *lobe = &material->lobes[k];
        const double error = err_lobe(&l, lobe->shininess, chord, mirrors, bend, spread);
        for (int c = 0; c < 3; c++) weight[c] += fabs(lobe->specular[c]) * error;
    }
    const double least = l.is_smooth ? l.in.least * shd_larger(l.facing - l.turned, 0) : 0;
    for (int c = 0; c < 3; c++) {
        sum->err[c] += fabs(light->color[c]) * weight[c];
        sum->low[c] += light->color[c] * material->diffuse[c] * least;
    }
}

bool shd_mean_is_central(const shd_plan *plan, const shd_bend *bend,
                         const shd_pattern_spread *spread, const shd_mean_room *room) {
    const shd_plan_group *group = &plan->groups[plan->objects[bend->object].group];
    const shd_plan_material *material = &plan->materials[group->material];
    const shd_vec3 n = bend->normal, v = bend->view,
                   mirror = shd_sub(shd_scale(n, 2 * shd_dot(n, v)), v);
    const double n1 = bend->normals.first, v1 = bend->views.first;
    const shd_slopes mirrors = {2 * n1 + v1, 4 * (bend->normals.second + n1 * v1 + (n1 + v1) * n1) +
                                                 bend->views.second};
    channels sum = {{0, 0, 0}, {0, 0, 0}};
    bool some[3]; /* nothing takes light away from `low` */
    for (int c = 0; c < 3; c++) {
        sum.low[c] = material->constant[c];
        some[c] = material->constant[c] >= 0 && material->diffuse[c] >= 0;
        for (size_t k = 0; k < material->lobe_count; k++)
            some[c] = some[c] && material->lobes[k].specular[c] >= 0;
    }
    for (size_t k = 0; k < group->light_count; k++) {
        const shd_plan_light *light = &plan->lights[group->lights[k]];
        add_light(material, light, bend, mirror, mirrors, spread, &sum);
        for (int c = 0; c < 3; c++) some[c] = some[c] && light->color[c] >= 0;
    }
    for (int c = 0; c < 3; c++) {
        const double low = some[c] ? sum.low[c] / SLACK : 0;
        /* Not-a-number does not fit either. */
        if (!(sum.err[c] * SLACK <= room->absolute + room->relative * low)) return false;
    }
    return true;
}
