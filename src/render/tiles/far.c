/* Bunches are looked at from their tree's root down to where they are far enough, or behind all
 * normals. What is too near is left to be lit light by light, at a part of the patch perhaps. */
#include "render/tiles/far.h"

#include <string.h>

#include "bound/light/pieces.h"
#include "bound/light/weakest.h"
#include "shade/quick.h"

/* Of the room: of bunches, of all lights of a patch that has parts, of those of others, and of all
 * with what highlights of dull lights add. The rest is for lights that are dropped. */
static const double BUNCH_SHARE = 0.15, FAR_SHARE[SHD_AFAR_LEVELS] = {0.3, 0.6, 0.85}, SHARE = 0.95;

enum {
    BUNCHES = 400,    /* that the room of bunches is meant for */
    BUNCH_PAYS = 160, /* points times lights that cost as much as a bunch of lights */
    ALONE_PAYS = 250  /* points that cost as much as looking at a light that is in no bunch */
};

typedef struct seeker {
    const shd_plan *plan;
    const shd_bunches *bunches;
    const shd_plan_material *material;
    const shd_patch *patch;
    shd_piece piece;
    double radius; /* the patch's */
    size_t points;
    double limit;          /* the most that a bunch may leave out */
    const shd_afar *whole; /* or NULL */
    bool parts;            /* parts of the patch are looked at later */
    shd_afar_scratch *scratch;
    shd_afar *out;
    size_t place_count; /* of single lights to look at, in scratch->places */
    /* In scratch->taken, bunches from the front, and places of single lights after them. */
    size_t taken_bunches, taken_lights;
    shd_far_patch lanes; /* the same for kernels */
    double before;       /* what `whole` has spent */
    double spent;
    shd_far_sums taken, all; /* of lights that are taken, and of all */
} seeker;

/* What a light in no bunch does at the patch. */
typedef struct look {
    bool behind; /* exactly nothing */
    shd_far_sums sums;
    double rest; /* as in shd_far_look */
    bool told;
} look;

/* ---- Looking. ---- */

/* Whether no point is near a spot's rim, so that its light is that of a point. */
static bool is_within_cone(const shd_plan_light *spot, const shd_lit *lit) {
    static const double CLEAR = 1e-5;
    return spot->exponent == 0 && 1 - lit->axis_low <= spot->inner - CLEAR;
}

/* Whether it shines alike to all points, and nothing that is below 0. */
static bool is_plain(const shd_plan_light *light, const shd_lit *lit) {
    return !light->shape && !light->environment && (!light->spot || is_within_cone(light, lit)) &&
           light->color[0] >= 0 && light->color[1] >= 0 && light->color[2] >= 0;
}

/* The most that is left out of N.E. */
static double rest_of(const seeker *s, const shd_plan_light *light) {
    static const double NEAREST = 1e-30, FARTHEST = 1e30;
    if (light->directional)
        return shd_far_rest(light, 1, s->radius, s->out->far.degree) * (1 + SHD_PIECE_MARGIN);
    const double distance = shd_plan_length(shd_sub(light->position, s->patch->center));
    if (!(distance > NEAREST && distance < FARTHEST)) return INFINITY;
    return shd_far_rest(light, distance, s->radius, s->out->far.degree) *
           shd_attenuation(light, distance) * (1 + SHD_PIECE_MARGIN);
}

static look look_at(seeker *s, const shd_plan_light *light) {
    static const double CLEAR = 1e-4;
    const shd_far_patch *p = &s->lanes;
    look l = {.rest = 0};
    shd_lit lit;
    l.behind = !shd_piece_lit(s->plan->scene, &s->piece, light, 0, &lit);
    if (l.behind) return l;
    const double certain = lit.factor_low * lit.facing_low,
                 whole = lit.factor_high * lit.facing_high;
    const bool clear = lit.facing_low > CLEAR && is_plain(light, &lit);
    double off = clear ? rest_of(s, light) : INFINITY;
    l.told = off < INFINITY && off <= whole;
    off = shd_smaller(off, whole);
    double lobes[3] = {0, 0, 0};
    for (size_t k = 0; k < p->lobe_count; k++) {
        const double power = shd_shine_most(lit.shine_high, p->shininess[k]) * lit.factor_high;
        for (int c = 0; c < 3; c++) lobes[c] += p->specular[k][c] * power;
    }
    for (int c = 0; c < 3; c++) {
        const double color = fabs(light->color[c]);
        l.sums.most = shd_larger(l.sums.most, color * whole);
        l.sums.least[c] = clear ? light->color[c] * certain : 0;
        l.rest = shd_larger(l.rest, color * (p->diffuse[c] * off + lobes[c]));
    }
    return l;
}

/* What may be left out of each channel, weighed: see weakest.h. Sums are rounded to f32 once more
 * by each of two polynomials. That is a part of what is seen, or of the most that may be. */
static double room_of(const seeker *s, const shd_far_sums *light) {
    static const double ROUNDING = 0x1p-22, OWN = 1e-3 /* errors of the picture */;
    const shd_plan *plan = s->plan;
    const bool relative = plan->drop_relative > ROUNDING;
    double room = INFINITY;
    for (int c = 0; c < 3; c++) {
        const double kd = s->material->diffuse[c],
                     seen = s->material->constant[c] + kd * light->least[c],
                     own = relative ? (plan->drop_relative * (1 - SHD_QUICK_SHARE) - ROUNDING) *
                                          (1 - OWN) * shd_larger(seen, 0)
                                    : -ROUNDING * fabs(kd) * light->most;
        room = shd_smaller(room, s->out->weight[c] * (plan->drop_tolerance + own));
    }
    return shd_larger(room, 0);
}

/* ---- Taking. ---- */

static void add_sums(const shd_far_sums *from, shd_far_sums *to) {
    to->most += from->most;
    for (int c = 0; c < 3; c++) to->least[c] += from->least[c];
}

/* The cut through the trees. */
typedef struct cutting {
    size_t taken; /* in scratch->cut */
    size_t count; /* in scratch->now, which are looked at next */
} cutting;

/* Lets parts of a bunch be looked at, or its lights. */
static void divide_bunch(seeker *s, uint32_t index, uint32_t *to, size_t *count) {
    const shd_bunch *bunch = &s->bunches->list[index];
    if (bunch->parts) {
        to[(*count)++] = bunch->parts;
        to[(*count)++] = bunch->parts + 1;
        return;
    }
    for (uint32_t i = bunch->first; i < bunch->end; i++)
        s->scratch->bits[i / 64] |= UINT64_C(1) << i % 64;
}

static shd_afar_bunch judge_bunch(const seeker *s, uint32_t index, const shd_far_look *from) {
    const shd_bunch *bunch = &s->bunches->list[index];
    shd_afar_bunch b = {.index = index, .told = from->told, .rest = from->rest};
    double brightest = 0;
    for (int c = 0; c < 3; c++) {
        const double color = bunch->strength[c];
        b.sums.least[c] = color * from->certain;
        brightest = shd_larger(brightest, color);
    }
    b.sums.most = brightest * from->most;
    return b;
}

/* Looks at what is listed, and at parts of it, down to what may be taken, or is behind. */
static void cut_bunches(seeker *s, cutting *c) {
    shd_afar_scratch *scratch = s->scratch;
    const shd_far_kernel *kernel = shd_far_kernel_of(s->plan->isa);
    while (c->count) {
        size_t next = 0;
        kernel->look_at_bunches(s->bunches, &s->lanes, scratch->now, c->count, scratch->looks);
        for (size_t i = 0; i < c->count; i++) {
            const uint32_t index = scratch->now[i];
            const shd_bunch *bunch = &s->bunches->list[index];
            if (scratch->looks[i].behind) continue;
            const shd_afar_bunch b = judge_bunch(s, index, &scratch->looks[i]);
            if (s->points * (bunch->end - bunch->first) >= BUNCH_PAYS && b.rest <= s->limit)
                scratch->cut[c->taken++] = b;
            else
                divide_bunch(s, index, scratch->next, &next);
        }
        uint32_t *const now = scratch->now;
        scratch->now = scratch->next;
        scratch->next = now;
        c->count = next;
    }
}

/* Divides what is taken and leaves more of itself out than is let now. */
static void sift_bunches(seeker *s, cutting *c) {
    size_t kept = 0;
    for (size_t i = 0; i < c->taken; i++) {
        const shd_afar_bunch b = s->scratch->cut[i];
        if (b.rest <= s->limit)
            s->scratch->cut[kept++] = b;
        else
            divide_bunch(s, b.index, s->scratch->now, &c->count);
    }
    c->taken = kept;
}

static void list_places(seeker *s) {
    s->place_count = 0;
    for (uint32_t w = 0; w < (s->bunches->light_count + 63) / 64; w++)
        for (uint64_t left = s->scratch->bits[w]; left; left &= left - 1)
            s->scratch->places[s->place_count++] = 64 * w + (uint32_t)__builtin_ctzll(left);
}

/* Takes bunches of which all leave no more of themselves out than a share, the largest one that
 * the room has for them, and finds what is left to be looked at. */
static void visit_bunches(seeker *s) {
    enum { TRIES = 8 };
    const shd_far_sums none = {{0, 0, 0}, 0};
    cutting c = {.taken = 0};
    s->place_count = s->taken_bunches = 0;
    s->spent = 0;
    s->taken = s->all = s->whole ? s->whole->sums : none;
    if (s->whole) return;
    s->limit = BUNCH_SHARE * room_of(s, &s->taken) / BUNCHES;
    memset(s->scratch->bits, 0, (s->plan->light_count + 63) / 64 * sizeof *s->scratch->bits);
    for (; c.count < s->bunches->roots; c.count++) s->scratch->now[c.count] = (uint32_t)c.count;
    for (int t = 0;; t++) {
        cut_bunches(s, &c);
        s->taken = none;
        s->spent = 0;
        for (size_t i = 0; i < c.taken; i++) {
            add_sums(&s->scratch->cut[i].sums, &s->taken);
            s->spent += s->scratch->cut[i].rest;
        }
        const double most = BUNCH_SHARE * room_of(s, &s->taken);
        if (s->spent <= most) break;
        s->limit *= t + 2 < TRIES && most > 0 ? shd_smaller(0.7, 0.9 * most / s->spent) : 0;
        sift_bunches(s, &c);
    }
    s->all = s->taken;
    list_places(s);
    for (size_t i = 0; i < c.taken; i++)
        if (s->scratch->cut[i].told)
            s->scratch->taken[s->taken_bunches++] = s->scratch->cut[i].index;
}

/* Lights of steps below `full` are taken, and as many of that one as `left` lets. */
typedef struct filling {
    double left;
    int full;
} filling;

/* Sets the lights' steps, too. */
static filling fill_room(const shd_far_look *looks, size_t count, double room, uint8_t *steps) {
    filling f = {.left = room * (1 - 1e-9)}; /* for the sums' own rounding */
    double sums[SHD_STRENGTH_STEPS + 1] = {0};
    for (size_t i = 0; i < count; i++) {
        steps[i] = (uint8_t)(room > 0 && !looks[i].behind ? shd_strength_step(looks[i].rest, room)
                                                          : SHD_STRENGTH_STEPS);
        sums[steps[i]] += looks[i].rest;
    }
    for (; f.full < SHD_STRENGTH_STEPS && sums[f.full] <= f.left; f.full++) f.left -= sums[f.full];
    return f;
}

static bool fits(filling *f, double rest, int step) {
    if (step < f->full) return true;
    if (step > f->full || step == SHD_STRENGTH_STEPS || !(rest <= f->left)) return false;
    f->left -= rest;
    return true;
}

static void add_taken(seeker *s, const shd_far_look *from, uint32_t place) {
    double brightest = 0;
    for (int c = 0; c < 3; c++) {
        const double color = s->bunches->rows[place].color[c];
        s->taken.least[c] += color * from->certain;
        brightest = shd_larger(brightest, color);
    }
    s->taken.most += brightest * from->most;
}

/* Takes the single lights that leave out least, as long as all that is left out is within a share
 * of the room. */
static void visit_lights(seeker *s, double share) {
    const uint32_t *places = s->whole ? s->whole->open : s->scratch->places;
    const size_t count = s->whole ? s->whole->open_count : s->place_count;
    uint32_t *const taken = s->scratch->taken + s->taken_bunches;
    shd_far_look *looks = s->scratch->looks;
    uint8_t *steps = s->scratch->steps;
    shd_far_kernel_of(s->plan->isa)->look(s->bunches, &s->lanes, places, count, looks, &s->all);
    s->out->room = room_of(s, &s->all);
    if (s->whole) s->out->room = shd_larger(s->out->room, s->whole->room);
    filling f = fill_room(looks, count, share * s->out->room - s->before - s->spent, steps);
    s->taken_lights = s->out->open_count = s->out->dull_count = 0;
    for (size_t i = 0; i < count; i++) {
        const shd_far_look *l = &looks[i];
        if (l->behind) continue;
        if (!fits(&f, l->rest, steps[i])) {
            s->scratch->gleam[s->out->open_count] = l->gleam;
            s->out->open[s->out->open_count++] = places[i];
            continue;
        }
        s->spent += l->rest;
        if (l->told) taken[s->taken_lights++] = places[i];
        if (s->parts) add_taken(s, l, places[i]);
    }
}

/* Lights that are in no bunch are added at once. They take what is left. */
static void visit_alone(seeker *s, double share) {
    const uint32_t *lights = s->whole ? s->whole->alone : s->bunches->alone;
    const size_t count = s->whole ? s->whole->alone_count : s->bunches->alone_count;
    s->out->alone_count = 0;
    for (size_t i = 0; i < count; i++) {
        const shd_plan_light *light = &s->plan->lights[lights[i]];
        look l = {.rest = INFINITY};
        if (s->points >= ALONE_PAYS) l = look_at(s, light);
        if (l.behind) continue;
        if (s->before + s->spent + l.rest <= share * s->out->room) {
            add_sums(&l.sums, &s->taken);
            s->spent += l.rest;
            if (l.told) shd_far_add(light, &s->out->far);
        } else {
            s->out->alone[s->out->alone_count++] = lights[i];
        }
    }
}

/* Parts lights that are left by whether their highlights may be left out, an equal share of what is
 * left of the room for each. */
static void part_dull(seeker *s) {
    shd_afar *out = s->out;
    const double left = SHARE * out->room - s->before - s->spent,
                 most = out->open_count ? left / (double)out->open_count : 0;
    size_t kept = 0;
    for (size_t i = 0; i < out->open_count; i++) {
        const double gleam = s->scratch->gleam[i];
        if (gleam <= most) {
            s->spent += gleam;
            out->dull[out->dull_count++] = out->open[i];
        } else {
            out->open[kept++] = out->open[i];
        }
    }
    out->open_count = kept;
}

static shd_far_patch lanes_of(const seeker *s) {
    const shd_plan_material *material = s->material;
    shd_far_patch p = {.center = s->piece.center,
                       .axis = s->piece.axis,
                       .mirror = s->piece.mirror,
                       .radius = s->radius,
                       .spread = s->piece.spread,
                       .glitter = s->piece.glitter,
                       .lobe_count = material->lobe_count,
                       .degree = s->out->far.degree};
    const double *weight = s->out->weight;
    for (int c = 0; c < 3; c++) p.diffuse[c] = fabs(material->diffuse[c]) * weight[c];
    for (size_t k = 0; k < p.lobe_count; k++) {
        p.shininess[k] = material->lobes[k].shininess;
        for (int c = 0; c < 3; c++)
            p.specular[k][c] = fabs(material->lobes[k].specular[c]) * weight[c];
    }
    return p;
}

/* What channels are weighed by, so that none has less room than another one, if light is about what
 * all bunches send to the patch from where they are. Any weights would do. */
static void weigh_channels(const seeker *s, double weight[3]) {
    static const double MOST = 1e100;
    double light[3] = {0, 0, 0};
    for (size_t r = 0; r < s->bunches->roots; r++) {
        const shd_bunch *bunch = &s->bunches->list[r];
        const double away = shd_plan_length(shd_sub(bunch->center, s->patch->center)),
                     fall = shd_attenuation(&s->bunches->falls[bunch->fall],
                                            shd_larger(away, 0.5 * bunch->radius));
        for (int c = 0; c < 3; c++) light[c] += 0.25 * fall * bunch->strength[c];
    }
    for (int c = 0; c < 3; c++) {
        const double seen = s->material->constant[c] + s->material->diffuse[c] * light[c],
                     room = s->plan->drop_tolerance + s->plan->drop_relative * shd_larger(seen, 0);
        weight[c] = room > 1 / MOST && room < MOST ? 1 / room : 1;
    }
}

/* Of how many lights of each channel polynomials of a high degree pay, which tell more of them. */
enum { MANY = 512 };

static int degree_of(const shd_bunches *bunches, int channels, int level) {
    static const int few[SHD_AFAR_LEVELS] = {4, 3, 3}, many[SHD_AFAR_LEVELS] = {6, 6, 4};
    return (bunches->light_count >= MANY * (size_t)channels ? many : few)[level];
}

void shd_afar_find(const shd_plan *plan, const shd_plan_material *material, const shd_patch *patch,
                   size_t points, int level, bool last, const shd_afar *whole,
                   shd_afar_scratch *scratch, shd_afar *out) {
    const shd_bunches *bunches = plan->bunches;
    seeker s = {.plan = plan,
                .bunches = bunches,
                .material = material,
                .patch = patch,
                .piece = shd_piece_of(plan->scene, patch),
                .radius = patch->radius,
                .points = points,
                .whole = whole,
                .parts = !last,
                .scratch = scratch,
                .out = out};
    out->far.center = patch->center;
    out->far.channels = plan->grey_lights ? 1 : 3;
    out->far.degree = degree_of(bunches, out->far.channels, level);
    out->far.lights = 0;
    memset(out->far.terms, 0, (size_t)out->far.channels * sizeof *out->far.terms);
    if (whole)
        memcpy(out->weight, whole->weight, sizeof out->weight);
    else
        weigh_channels(&s, out->weight);
    s.lanes = lanes_of(&s);
    s.before = whole ? whole->spent : 0;
    visit_bunches(&s);
    const double share = FAR_SHARE[last ? SHD_AFAR_LEVELS - 1 : level];
    visit_lights(&s, share);
    visit_alone(&s, share);
    if (!s.parts) part_dull(&s);
    out->spent = s.before + s.spent;
    out->sums = s.taken;
    const shd_far_kernel *kernel = shd_far_kernel_of(plan->isa);
    kernel->add_bunches(bunches, scratch->taken, s.taken_bunches, &out->far);
    kernel->add(bunches, scratch->taken + s.taken_bunches, s.taken_lights, &out->far);
    if (whole && whole->far.lights) shd_far_shift(&whole->far, &out->far);
}

double shd_afar_left(const shd_afar *afar) {
    const double *w = afar->weight;
    return (afar->room - afar->spent) / shd_larger(w[0], shd_larger(w[1], w[2]));
}

size_t shd_afar_list(const shd_plan *plan, const shd_afar *afar, bool dull, const uint32_t *lights,
                     size_t count, shd_afar_scratch *scratch, uint32_t *out) {
    uint64_t *bits = scratch->bits;
    const uint32_t *places = dull ? afar->dull : afar->open;
    const size_t place_count = dull ? afar->dull_count : afar->open_count,
                 alone_count = dull ? 0 : afar->alone_count;
    memset(bits, 0, (plan->light_count + 63) / 64 * sizeof *bits);
    for (size_t i = 0; i < place_count; i++) {
        const uint32_t light = plan->bunches->lights[places[i]];
        bits[light / 64] |= UINT64_C(1) << light % 64;
    }
    for (size_t i = 0; i < alone_count; i++)
        bits[afar->alone[i] / 64] |= UINT64_C(1) << afar->alone[i] % 64;
    size_t kept = 0;
    if (count == plan->light_count) {
        for (uint32_t w = 0; w < (count + 63) / 64; w++)
            for (uint64_t left = bits[w]; left; left &= left - 1)
                out[kept++] = 64 * w + (uint32_t)__builtin_ctzll(left);
        return kept;
    }
    for (size_t i = 0; i < count; i++)
        if (bits[lights[i] / 64] >> lights[i] % 64 & 1) out[kept++] = lights[i];
    return kept;
}

static void lay_out_open(const shd_plan *plan, shd_scratch *memory, shd_afar *out) {
    out->open = shd_scratch_take(memory, plan->bunches->light_count, sizeof *out->open);
    out->dull = shd_scratch_take(memory, plan->bunches->light_count, sizeof *out->dull);
    out->alone = shd_scratch_take(memory, plan->bunches->alone_count, sizeof *out->alone);
}

void shd_afar_lay_out(const shd_plan *plan, size_t points, shd_scratch *memory,
                      shd_afar_scratch *out) {
    out->rows = shd_scratch_rows32(memory, 3, points);
    const size_t lights = plan->light_count;
    for (int level = 0; level < SHD_AFAR_LEVELS; level++)
        lay_out_open(plan, memory, &out->levels[level]);
    out->places = shd_scratch_take(memory, lights, sizeof *out->places);
    out->taken = shd_scratch_take(memory, lights, sizeof *out->taken);
    out->gleam = shd_scratch_take(memory, lights, sizeof *out->gleam);
    out->cut = shd_scratch_take(memory, plan->bunches->count, sizeof *out->cut);
    out->now = shd_scratch_take(memory, plan->bunches->count, sizeof *out->now);
    out->next = shd_scratch_take(memory, plan->bunches->count, sizeof *out->next);
    out->dull = shd_scratch_take(memory, lights, sizeof *out->dull);
    out->parted = shd_scratch_take(memory, 2 * lights, sizeof *out->parted);
    out->steps = shd_scratch_take(memory, lights, sizeof *out->steps);
    out->looks = shd_scratch_take(memory, lights, sizeof *out->looks);
    out->bits = shd_scratch_take(memory, (lights + 63) / 64, sizeof *out->bits);
}
