/* Let f be a light's weight along a line through a pixel's center, at a distance z. If f is
 * analytic for complex |z| < r, and no more than M from some constant there, its expansion's
 * coefficient k is no more than M / r^k (Cauchy), and what of f is of degree 6 and above is no more
 * than M (z / r)^6 / (1 - z / r). Two means that agree for degrees up to 2 are as far apart as they
 * are for the rest (plan/nodes.h).
 *
 * M follows from how far points, normals and views are from those of the block's middle
 * (sight/expand.c). Unit vectors stay that: A.A = 1 with the same sum of products. With ' for the
 * most that |A - A0| is, and 0 for the middle:
 *
 *     X = light - P:  |X|' = P'. L = X / |X| is along L0 + e with L0.e = 0, |e| <= P' / (|X0| - P')
 *     distance:       its square is off by (2 |X0| + P') P'
 *     attenuation:    1 / q, q off by b |X|' + c (|X|^2)'
 *     N.L:            N' + L' + N' L'
 *     W = 2 (N.V) N - V: of N - N0 what is along N0 is -(N - N0)^2 / 2, so that W' is
 *                     2 N' + N'^2 (2 c + 2 s + c N') + V' (1 + 4 N' + 2 N'^2), c and s of N0, V0
 *     1 - L.W = (L - W)^2 / 2:  |L0 - W0| g + g^2 / 2, g = L' + W'
 *     s^n:            |s|^n <= exp(-n (1 - |s|)), if no s is 0
 *
 * Where N.L may change its sign, at rims of cones and where distances are held, f is not analytic.
 */
#include "bound/light/rules.h"

/* More than rounding does. */
static const double SLACK = 1 + 1e-6;

/* exp(x), or more (means.c). Infinite from 32 on. */
static double most_exp(double x) {
    if (!(x < 32)) return INFINITY;
    double power = 1 / (1 - x * 0x1p-6);
    for (int i = 0; i < 6; i++) power *= power;
    return power;
}

/* A light as it comes to the block's middle. */
typedef struct incidence {
    const shd_plan_light *light;
    shd_vec3 way;  /* unit: toward the light */
    double away;   /* the distance */
    double fall;   /* the attenuation */
    bool held;     /* at that, because the distance is */
    double facing; /* N.L */
} incidence;

/* How much of it changes. */
typedef struct change {
    double way, fall, facing, distance;
} change;

/* False: nothing is known. */
static bool change_of(const incidence *in, const shd_moves *moves, change *out) {
    const shd_plan_light *light = in->light;
    *out = (change){0, 0, moves->normal, 0};
    if (light->directional) return true;
    const double point = moves->point, tangent = point / (in->away - point);
    if (!(point < 0.4 * in->away)) return false;
    const double shorter = 1 / sqrt(1 - tangent * tangent), square = (2 * in->away + point) * point,
                 at = in->away * in->away;
    if (!(square < 0.999 * at)) return false;
    out->way = sqrt(tangent * shorter * (tangent * shorter) + (shorter - 1) * (shorter - 1));
    out->facing = moves->normal + out->way + moves->normal * out->way;
    out->distance = square / (in->away + sqrt(at - square));
    if (!light->attenuated || in->held) return true;
    const double q = light->a + in->away * (light->b + in->away * light->c),
                 by = light->b * out->distance + light->c * square;
    if (!(by < 0.999 * q)) return false;
    out->fall = in->fall * by / (q - by);
    return true;
}

/* What is known of a block. */
typedef struct block {
    const shd_analytic *a;
    double shares[SHD_RULES][SHD_DISCS]; /* of M, that the two means may be apart */
    size_t count;                        /* of rules */
    shd_vec3 mirror;                     /* W */
    double cosine, sine;                 /* of N and V */
    double room;
    size_t rule; /* the first one that serves for what has been looked at */
    size_t disc; /* that served last */
} block;

static double mirror_moves(const block *b, const shd_moves *m) {
    const double n = m->normal, nn = n * n;
    return 2 * n + nn * (2 * b->cosine + 2 * b->sine + b->cosine * n) +
           m->view * (1 + 4 * n + 2 * nn);
}

/* How far L.W is from what it is at the middle, where |L - W| is `chord`. */
static double shine_moves(const block *b, const shd_moves *moves, const change *c, double chord) {
    const double g = c->way + mirror_moves(b, moves);
    return (chord + g / 2) * g * SLACK;
}

/* The most that a lobe is in these places, over the attenuation. Infinite: it is not analytic. */
static double lobe_most(const block *b, const shd_moves *moves, const change *c, double exponent,
                        double chord) {
    const double by = shine_moves(b, moves, c, chord), low = chord * chord / 2;
    return by < 0.999 * (1 - low) ? most_exp(exponent * (by - low)) : (double)INFINITY;
}

/* The same of real places, where it need not be analytic. */
static double lobe_near(const block *b, const change *c, double exponent, double chord) {
    const double x = shine_moves(b, &b->a->near, c, chord) - chord * chord / 2;
    return x > -1 ? most_exp(exponent * x) : 0;
}

/* Whether the light's diffuse weight (`exponent` < 0) or a lobe fits by one of the discs, and one
 * of the rules from b->rule on, to which that goes on. */
static bool fits(block *b, const incidence *in, double exponent, double chord, double room) {
    const size_t count = b->a->disc_count, last = b->disc;
    size_t best = b->count;
    for (size_t k = 0; k < count && best > b->rule; k++) {
        const size_t disc = (last + count - k) % count;
        const shd_moves *moves = &b->a->discs[disc];
        change c;
        if (!change_of(in, moves, &c)) continue;
        const double fall = in->fall + c.fall,
                     most = exponent < 0 ? fall * c.facing + in->facing * c.fall
                                         : fall * lobe_most(b, moves, &c, exponent, chord);
        size_t rule = b->rule;
        while (rule < b->count && !(most * b->shares[rule][disc] * SLACK <= room)) rule++;
        if (rule >= best) continue;
        best = rule;
        b->disc = disc;
    }
    b->rule = best;
    return best < b->count;
}

/* Where the block is in a cone: all within what a penumbra begins at (1), all beyond (-1), or
 * elsewhere (0). */
static int side_of_rim(const shd_plan_light *light, shd_vec3 way, double turned) {
    if (!light->spot) return 1;
    const double chord = shd_length(shd_add(light->axis, way)), apart = turned + 1e-5,
                 low = shd_larger(chord - apart, 0), high = chord + apart;
    if (low * low / 2 > light->outer) return -1;
    return high * high / 2 < light->inner && light->exponent == 0 ? 1 : 0;
}

static incidence incidence_of(const shd_plan_light *light, const shd_analytic *a) {
    incidence in = {.light = light, .way = light->toward, .fall = light->gain};
    if (!light->directional) {
        const shd_vec3 x = shd_sub(light->position, a->point);
        in.away = shd_length(x);
        in.way = shd_scale(x, 1 / in.away);
        in.fall = shd_attenuation(light, in.away);
    }
    in.facing = shd_dot(a->normal, in.way);
    return in;
}

/* Whether the light's weights all fit. */
static bool light_fits(block *b, const shd_plan_light *light, const shd_plan_material *material) {
    incidence in = incidence_of(light, b->a);
    change near;
    if (!(in.fall < SHD_LARGEST_FALL) || !change_of(&in, &b->a->near, &near)) return false;
    const int side = side_of_rim(light, in.way, near.way);
    const double apart = near.facing + 1e-9;
    if (side < 0 || in.facing + apart <= 0) return true; /* it adds nothing */
    if (side == 0 || in.facing <= apart) return false;
    if (light->attenuated && in.away - near.distance < light->min_distance) {
        if (in.away + near.distance > light->min_distance) return false;
        in.held = true;
        near.fall = 0;
    }
    const double room = b->room * (in.fall - near.fall),
                 chord = shd_length(shd_sub(in.way, b->mirror));
    if (material->has_diffuse && !fits(b, &in, -1, 0, room * shd_nodes_room(0))) return false;
    for (size_t k = 0; k < material->lobe_count; k++) {
        const double exponent = material->lobes[k].shininess,
                     all = (in.fall + near.fall) * lobe_near(b, &near, exponent, chord);
        const double some = room * shd_nodes_room(exponent);
        if (!(all <= some) && !fits(b, &in, exponent, chord, some)) return false;
    }
    return true;
}

/* What the means of a function may be apart, if it is within 1 of some constant in such a disc. */
static double share_of(const shd_rule *rule, double radius) {
    const double square = radius * radius, cube = square * radius;
    return rule->off[0] / cube + rule->off[1] / (square * square) + rule->off[2] / (square * cube) +
           rule->sixth / (cube * square * (radius - SHD_RULE_REACH));
}

size_t shd_find_rule(const shd_plan *plan, const shd_analytic *a, const shd_rule *rules,
                     size_t count, double room) {
    const shd_plan_group *group = &plan->groups[plan->objects[a->object].group];
    block b = {.a = a, .count = count, .room = room, .disc = a->disc_count - 1};
    b.cosine = shd_dot(a->normal, a->view);
    b.sine = sqrt(shd_larger(1 - b.cosine * b.cosine, 0));
    b.mirror = shd_sub(shd_scale(a->normal, 2 * b.cosine), a->view);
    double radius = SHD_DISC_LEAST;
    for (size_t k = 0; k < a->disc_count; k++) {
        double share = 0; /* what fits by a rule fits by all behind it */
        for (size_t r = count; r-- > 0;)
            b.shares[r][k] = share = shd_larger(share, share_of(&rules[r], radius));
        radius *= SHD_DISC_STEP;
    }
    for (size_t k = 0; k < group->light_count; k++)
        if (!light_fits(&b, &plan->lights[group->lights[k]], &plan->materials[group->material]))
            return count;
    return b.rule;
}
