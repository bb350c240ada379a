/* Let f be a light's weight along a line through a pixel's center, at a distance z. If f is
 * analytic for complex |z| < r, and no more than M from some constant there, its expansion's
 * coefficient k is no more than M / r^k (Cauchy), and what of f is of degree 8 and above is no more
 * than M (z / r)^8 / (1 - z / r). Two means that agree for degrees up to 2 are as far apart as they
 * are for the rest (plan/nodes.h).
 *
 * M follows from how far points, normals and views are from those of the pixel's center
 * (plan/moves.c). What these are is real, and known from how far they are, at most, from those of
 * the block's middle. Unit vectors stay that: A.A = 1 with the same sum of products. With ' for the
 * most that |A - A0| is, and 0 for the center, or for the middle:
 *
 *     X = light - P:  |X|' = P'. L = X / |X| is along L0 + e with L0.e = 0, |e| <= P' / (|X0| - P')
 *     distance:       its square is off by (2 |X0| + P') P'
 *     attenuation:    1 / q, q off by b |X|' + c (|X|^2)'
 *     N.L:            N' + L' + N' L'
 *     W = 2 (N.V) N - V: of N - N0 what is along N0 is -(N - N0)^2 / 2, so that W' is
 *                     2 N' + N'^2 (2 c + 2 s + c N') + V' (1 + 4 N' + 2 N'^2), c and s of N0, V0
 *     1 - L.W = (L - W)^2 / 2:  L - W changes by g = L' + W' (most_shine)
 *     s^n:            exp(n ln |s|), if no s is 0
 *
 * At rims of cones and where distances are held, f is not analytic. Where N.L changes its sign, f
 * is that of (N.L)+, on the one side, and 0 on the other: all this is true of the pixels all of
 * whose samples and nodes are on one side (sets.h).
 */
#include "bound/light/rules.h"

#include "bound/light/sets.h"

/* More than rounding does. */
static const double SLACK = 1 + 1e-6;

/* exp(x), or more (means.c). Infinite from 32 on. */
static double most_exp(double x) {
    if (!(x < 32)) return INFINITY;
    double power = 1 / (1 - x * 0x1p-6);
    for (int i = 0; i < 6; i++) power *= power;
    return power;
}

/* A light as it comes to the block's middle, and the most that it is at pixels' centers. */
typedef struct incidence {
    const shd_plan_light *light;
    shd_vec3 way;                   /* unit: toward the light */
    double away, nearest, farthest; /* the distance, and the range of it */
    double fall, fall_most;         /* the attenuation */
    bool held;                      /* at that, because the distance is */
    double facing, facing_most;     /* N.L */
} incidence;

/* How much of it changes. */
typedef struct change {
    bool known;
    double way, fall, facing, distance;
} change;

static bool find_change(const incidence *in, const shd_moves *moves, change *out) {
    const shd_plan_light *light = in->light;
    *out = (change){true, 0, 0, moves->normal, 0};
    if (light->directional) return true;
    const double point = moves->point, low = in->nearest, tangent = point / (low - point);
    if (!(point < 0.4 * low)) return false;
    const double shorter = 1 / sqrt(1 - tangent * tangent), square = (2 * low + point) * point,
                 at = low * low;
    if (!(square < 0.999 * at)) return false;
    out->way = sqrt(tangent * shorter * (tangent * shorter) + (shorter - 1) * (shorter - 1));
    out->facing = moves->normal + out->way + moves->normal * out->way;
    out->distance = square / (low + sqrt(at - square));
    if (!light->attenuated || in->held) return true;
    const double q = light->a + low * (light->b + low * light->c),
                 by = light->b * out->distance + light->c * (2 * in->farthest + point) * point;
    if (!(by < 0.999 * q)) return false;
    out->fall = in->fall_most * by / (q - by);
    return true;
}

static change change_of(const incidence *in, const shd_moves *moves) {
    change out;
    out.known = find_change(in, moves, &out);
    return out;
}

enum { SETS = 4 }; /* lights that may set in a block */

/* What is known of a block. */
typedef struct block {
    const shd_analytic *a;
    const shd_rule *rules;
    struct disc {
        bool made, known;
        shd_moves moves;
        double turned; /* what mirrored views are off by */
    } discs[SHD_DISCS];
    shd_vec3 mirror;     /* W */
    double near_turned;  /* what that is off by in the block, */
    double turned;       /* and up to centers beside it */
    double cosine, sine; /* of N and V, the most */
    double room;
    unsigned fits;   /* the rules that serve for what has been looked at, as bits */
    size_t disc[2];  /* that served diffuse weights last, or may, and lobes */
    unsigned shared; /* the rules whose nodes are beside the block, too */
    struct {
        const shd_plan_light *light;
        unsigned rules; /* for some of whose nodes it does */
    } sets[SETS];       /* lights that set in the block, or beside it */
    size_t set_count;
} block;

static double mirror_moves(const block *b, const shd_moves *m) {
    const double n = m->normal, nn = n * n, aside = n + b->sine * nn, shear = n + sqrt(1 + nn);
    return 2 * sqrt(aside * aside + nn * nn) + nn * n * (b->cosine + b->sine) + nn * nn / 2 +
           m->view * shear * shear;
}

/* The most that ln |L.W| is in these places, where |L - W| is some chord of [least, most] at the
 * center and changes by g at most. Infinite: L.W may be 0. With x + i y for what changes, p = |L -
 * W
 * + x| and q = |y|, (L - W)^2 = z has the real part p^2 - q^2, and its imaginary part is 2 p q or
 * less, so that
 *     |L.W|^2 = |1 - z / 2|^2 <= 1 + h,  h = q^2 - p^2 + (p^2 + q^2)^2 / 4
 * h falls with p, p^2 + q^2 < 2, and p is no less than chord - |x|. So the least chord has the most
 * of it, and at g (ln |1 - z / 2| is subharmonic). With |x| = k g, where h is quadratic in k, p is
 * half of the chord there, or more. */
static double most_shine(double least, double most, double g) {
    const double far = (most + g) * (most + g), chord = least, square = chord * chord, gg = g * g,
                 k = chord * (2 - square - gg), all = 2 * g * (2 - square),
                 x = k < all ? k / all * g : g, p = chord - x, pp = p * p, qq = gg - x * x,
                 sum = pp + qq, h = qq - pp + sum * sum / 4;
    if (!(far < 1.99)) return INFINITY;
    return h < 0 ? (h - h * h / 2) / 2 : h / 2;
}

/* The most that a lobe is in these places, over the attenuation. Infinite: it is not analytic.
 * `chord` is that of the middle, and off by up to `off`. */
static double lobe_most(double turned, const change *c, double exponent, double chord, double off) {
    return most_exp(exponent *
                    most_shine(shd_larger(chord - off, 0), chord + off, (c->way + turned) * SLACK));
}

/* The same of real places, where it need not be analytic. */
static double lobe_near(double turned, const change *c, double exponent, double chord) {
    const double g = c->way + turned, x = (chord + g / 2) * g * SLACK - chord * chord / 2;
    return x > -1 ? most_exp(exponent * x) : 0;
}

/* A light, and how it changes through the block, up to centers beside it, and in the discs. */
typedef struct changes {
    incidence in;
    change near, around, in_disc[SHD_DISCS];
    unsigned made; /* discs, as bits */
} changes;

static const struct disc *disc_of(block *b, size_t k) {
    struct disc *disc = &b->discs[k];
    if (disc->made) return disc;
    double radius = SHD_DISC_LEAST;
    for (size_t i = 0; i < k; i++) radius *= SHD_DISC_STEP;
    disc->made = true;
    disc->known = shd_move(&b->a->worst, radius, &disc->moves);
    if (disc->known) disc->turned = mirror_moves(b, &disc->moves);
    return disc;
}

/* A light's diffuse weight (`exponent` < 0) or lobe, and what is known of it. */
typedef struct weight {
    double exponent, chord, off; /* lobe_most */
    double most[SHD_DISCS];      /* how far it is from that at the center, in these discs */
    unsigned made;               /* of these, as bits */
} weight;

/* Infinite: it is not known. */
static double most_in_disc(block *b, changes *l, weight *w, size_t at) {
    if (w->made >> at & 1) return w->most[at];
    const struct disc *disc = disc_of(b, at);
    change *c = &l->in_disc[at];
    w->made |= 1u << at;
    w->most[at] = INFINITY;
    if (!disc->known) return INFINITY;
    if (!(l->made >> at & 1)) *c = change_of(&l->in, &disc->moves);
    l->made |= 1u << at;
    if (!c->known) return INFINITY;
    const double fall = l->in.fall_most + c->fall;
    return w->most[at] = w->exponent < 0
                             ? fall * c->facing + l->in.facing_most * c->fall
                             : fall * lobe_most(disc->turned, c, w->exponent, w->chord, w->off);
}

/* Whether it fits by a rule and one of the discs, from the one that served last down or up, as long
 * as it comes closer to that. */
static bool fits_by(block *b, changes *l, weight *w, const shd_rule *rule, double room) {
    size_t *last = &b->disc[w->exponent >= 0];
    const size_t from = *last;
    double least = most_in_disc(b, l, w, from) * rule->share[from] * SLACK;
    if (least <= room) return true;
    for (int way = -1; way <= 1; way += 2)
        for (size_t at = from + (size_t)way; at < SHD_DISCS; at += (size_t)way) {
            const double value = most_in_disc(b, l, w, at) * rule->share[at] * SLACK;
            if (value <= room) {
                *last = at;
                return true;
            }
            if (!(value < least) && (way > 0 || value < INFINITY)) break;
            least = value;
        }
    return false;
}

/* Whether the weight fits by some of the rules that are left. */
static bool fits(block *b, changes *l, double exponent, double chord, double room) {
    weight w = {.exponent = exponent, .chord = chord};
    w.off = (l->near.way + b->near_turned) * SLACK;
    for (unsigned left = b->fits; left; left &= left - 1) {
        const int rule = __builtin_ctz(left);
        if (!fits_by(b, l, &w, &b->rules[rule], room)) b->fits &= ~(1u << rule);
    }
    return b->fits;
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
    in.nearest = in.farthest = in.away;
    in.fall_most = in.fall;
    in.facing = in.facing_most = shd_dot(a->normal, in.way);
    return in;
}

/* Where the places of a block are to a light. */
typedef enum side { BEHIND, BEFORE, SETS_THERE, UNKNOWN } side;

static side side_of(const incidence *in, const change *near) {
    if (!near->known) return UNKNOWN;
    const int rim = side_of_rim(in->light, in->way, near->way);
    const double apart = near->facing + 1e-9;
    if (rim < 0 || in->facing + apart <= 0) return BEHIND; /* it adds nothing */
    return rim == 0 ? UNKNOWN : in->facing <= apart ? SETS_THERE : BEFORE;
}

/* Whether all distances are held, or none. */
static bool is_held(const incidence *in, const change *near, bool *held) {
    const double hold = in->light->min_distance;
    *held = in->light->attenuated && in->away - near->distance < hold;
    return !*held || in->away + near->distance <= hold;
}

/* Notes that a light sets where nodes of these rules are, or takes the rules away. */
static void add_set(block *b, const shd_plan_light *light, unsigned rules) {
    if (b->set_count == SETS) {
        b->fits &= ~rules;
        return;
    }
    b->sets[b->set_count].light = light;
    b->sets[b->set_count++].rules = rules;
}

/* Takes rules away of whose nodes it is not known where they are to a light, and finds what is
 * known of the others'. Whether it lights some of them. */
static bool look_at(block *b, const shd_plan_light *light, changes *out) {
    incidence *in = &out->in;
    *in = incidence_of(light, b->a);
    out->near = change_of(in, &b->a->near);
    out->made = 0;
    out->around = change_of(in, &b->a->around);
    const side own = side_of(in, &out->near), beside = side_of(in, &out->around);
    const bool lit = own == BEFORE || own == SETS_THERE;
    bool held = false, held_around;
    if (!(in->fall < SHD_LARGEST_FALL) || own == UNKNOWN ||
        (lit && !is_held(in, &out->near, &held)))
        b->fits = 0;
    if ((beside != own && beside != SETS_THERE) ||
        (lit && (!is_held(in, &out->around, &held_around) || held_around != held)))
        b->fits &= ~b->shared;
    if (own == SETS_THERE)
        add_set(b, light, ~0u);
    else if (beside == SETS_THERE)
        add_set(b, light, b->shared);
    in->held = held;
    if (held) out->near.fall = out->around.fall = 0;
    in->nearest -= out->near.distance;
    in->farthest += out->near.distance;
    in->fall_most += out->near.fall;
    in->facing_most = fabs(in->facing) + out->near.facing;
    return lit;
}

/* Takes those rules away by which some of a light's weights do not fit. Where all of a lobe is too
 * little to tell, means of it are, too. */
static void fit_light(block *b, changes *l, const shd_plan_material *material) {
    const double room = b->room * (l->in.fall - l->near.fall),
                 chord = shd_length(shd_sub(l->in.way, b->mirror));
    const change *beside = l->around.known ? &l->around : &l->near;
    if (material->has_diffuse && !fits(b, l, -1, 0, room * shd_nodes_room(0))) return;
    for (size_t k = 0; k < material->lobe_count; k++) {
        const double exponent = material->lobes[k].shininess,
                     all = (l->in.fall + beside->fall) *
                           lobe_near(b->turned, beside, exponent, chord) * SHD_NODES_SPREAD,
                     some = room * shd_nodes_room(exponent);
        if (!(all <= some) && !fits(b, l, exponent, chord, some)) return;
    }
}

static void set_block(const shd_analytic *a, const shd_rule *rules, size_t count, double room,
                      block *b) {
    *b = (block){.a = a, .rules = rules, .room = room, .disc = {8, 6}};
    const double cosine = shd_dot(a->normal, a->view),
                 off = a->near.normal + a->near.view + a->near.normal * a->near.view;
    b->mirror = shd_sub(shd_scale(a->normal, 2 * cosine), a->view);
    b->cosine = shd_smaller(cosine + off, 1);
    b->sine = shd_smaller(sqrt(shd_larger(1 - cosine * cosine, 0)) + off, 1);
    b->near_turned = mirror_moves(b, &a->near);
    b->turned = mirror_moves(b, &a->around);
    b->fits = (1u << count) - 1;
    for (size_t r = 0; r < count; r++) b->shared |= rules[r].rim ? 1u << r : 0;
}

/* Tells the pixels that may take the rules that are left. */
static bool find_pixels(const block *b, size_t count, uint64_t *pixels) {
    const int bits = b->a->side * b->a->side;
    const uint64_t all =
        bits < SHD_BLOCK_SIDE * SHD_BLOCK_SIDE ? ((uint64_t)1 << bits) - 1 : ~(uint64_t)0;
    uint64_t any = 0;
    for (size_t r = 0; r < count; r++) pixels[r] = b->fits >> r & 1 ? all : 0;
    for (size_t k = 0; k < b->set_count && b->fits; k++) {
        shd_setting set;
        const bool known = shd_find_setting(b->a, b->sets[k].light, &set);
        double reach = -1;
        uint64_t off = 0; /* what is off the light's setting by `reach` */
        for (size_t r = 0; r < count; r++) {
            if (!pixels[r] || !(b->sets[k].rules >> r & 1)) continue;
            if (known && b->rules[r].reach != reach)
                off = shd_off_setting(&set, reach = b->rules[r].reach);
            pixels[r] &= off;
        }
    }
    for (size_t r = 0; r < count; r++) any |= pixels[r];
    return any;
}

bool shd_find_rules(const shd_plan *plan, const shd_analytic *a, const shd_rule *rules,
                    size_t count, double room, uint64_t *pixels) {
    const shd_plan_group *group = &plan->groups[plan->objects[a->object].group];
    block b;
    set_block(a, rules, count, room, &b);
    for (size_t k = 0; k < group->light_count && b.fits; k++) {
        changes light;
        if (look_at(&b, &plan->lights[group->lights[k]], &light))
            fit_light(&b, &light, &plan->materials[group->material]);
    }
    return find_pixels(&b, count, pixels);
}
