/* Bunches are looked at from their tree's root down to where they are far enough, or behind all
 * normals. What is too near is left to be lit light by light, at a part of the patch perhaps. */
#include "render/tiles/far.h"

#include <string.h>

#include "bound/light/pieces.h"
#include "bound/light/weakest.h"

/* Of the room: of bunches, of all lights of a patch that has parts, and of all. The rest is for
 * lights that are dropped. */
static const double BUNCH_SHARE = 0.4, WHOLE_SHARE = 0.7, SHARE = 0.95;

enum {
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
    shd_plan_light falls[SHD_FALLS]; /* as in the bunches, at places that are looked at */
    double rate;           /* the most that may be left out of a light, as a share of it */
    const shd_afar *whole; /* or NULL */
    shd_afar_scratch *scratch;
    shd_afar *out;
    size_t place_count; /* of single lights to look at, in scratch->places */
    /* In scratch->taken, bunches from the front, and places of single lights after them. */
    size_t taken_bunches, taken_lights;
    shd_far_patch lanes; /* the same for kernels */
    double before;       /* what `whole` has spent */
    double spent, taken_least[3], least[3];
    double taken_most, most; /* diffuse light of all lights, in the brightest channel, at most */
} seeker;

/* What a light does at the patch, or all lights in a ball around its place. */
typedef struct look {
    bool behind;     /* exactly nothing */
    double least[3]; /* diffuse light, at all points; 0 if it may be behind some of them */
    double rest;     /* what of the color is left out if it is taken; infinite: it may not be */
    double shown;    /* what its light adds to the color, about */
    double most;     /* diffuse light in any channel */
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
static double rest_of(const seeker *s, const shd_plan_light *light, double radius) {
    static const double NEAREST = 1e-30, FARTHEST = 1e30;
    if (light->directional) return shd_far_rest(light, 1, s->radius) * (1 + SHD_PIECE_MARGIN);
    const double distance = shd_plan_length(shd_sub(light->position, s->patch->center));
    if (!(distance > NEAREST && distance < FARTHEST)) return INFINITY;
    return shd_far_rest(light, distance, s->radius + radius) * shd_attenuation(light, distance) *
           (1 + SHD_PIECE_MARGIN);
}

/* `light` stands for all lights within `radius` of it, whose colors are `strength` together, over
 * its own gain. */
static look look_at(seeker *s, const shd_plan_light *light, double radius,
                    const double strength[3]) {
    static const double CLEAR = 1e-4;
    const shd_plan_material *material = s->material;
    look l = {.rest = INFINITY};
    shd_lit lit;
    s->piece.radius = s->radius + radius;
    l.behind = !shd_piece_lit(s->plan->scene, &s->piece, light, 0, &lit);
    if (l.behind) return l;
    for (int c = 0; c < 3; c++)
        l.most = shd_larger(l.most, fabs(strength[c]) * lit.factor_high * lit.facing_high);
    if (!(lit.facing_low > CLEAR) || !is_plain(light, &lit)) return l;
    const double certain = lit.factor_low * lit.facing_low, rest = rest_of(s, light, radius);
    for (int c = 0; c < 3; c++) l.least[c] = strength[c] * certain;
    if (!(rest < INFINITY)) return l;
    double shone[3] = {0, 0, 0};
    for (size_t k = 0; k < material->lobe_count; k++) {
        const shd_plan_lobe *lobe = &material->lobes[k];
        const double power = shd_shine_most(lit.shine_high, lobe->shininess) * lit.factor_high;
        for (int c = 0; c < 3; c++) shone[c] += fabs(lobe->specular[c]) * power;
    }
    const double about = 0.5 * (certain + lit.factor_high * lit.facing_high);
    l.rest = 0;
    for (int c = 0; c < 3; c++) {
        const double kd = fabs(material->diffuse[c]);
        l.rest = shd_larger(l.rest, strength[c] * (kd * rest + shone[c]));
        l.shown = shd_larger(l.shown, strength[c] * kd * about);
    }
    return l;
}

static look look_at_bunch(seeker *s, const shd_bunch *bunch) {
    shd_plan_light *as = &s->falls[bunch->fall];
    as->position = bunch->center;
    return look_at(s, as, bunch->radius, bunch->strength);
}

/* What may be left out of each channel: see weakest.h. Sums are rounded to f32 once more by each of
 * two polynomials. That is a part of what is seen, or of the most that may be. */
static double room_of(const shd_plan *plan, const shd_plan_material *material,
                      const double light[3], double most) {
    static const double ROUNDING = 0x1p-22, OWN = 1e-3 /* errors of the picture */;
    double least = INFINITY, brightest = 0;
    for (int c = 0; c < 3; c++) {
        least = shd_smaller(least, material->constant[c] + material->diffuse[c] * light[c]);
        brightest = shd_larger(brightest, fabs(material->diffuse[c]));
    }
    if (!(plan->drop_relative > ROUNDING))
        return shd_larger(plan->drop_tolerance - ROUNDING * brightest * most, 0);
    return plan->drop_tolerance +
           (plan->drop_relative - ROUNDING) * (1 - OWN) * shd_larger(least, 0);
}

/* ---- Taking. ---- */

static void take(seeker *s, const look *l) {
    s->spent += l->rest;
    s->taken_most += l->most;
    for (int c = 0; c < 3; c++) s->taken_least[c] += l->least[c];
}

static void count_light(seeker *s, const look *l) {
    s->most += l->most;
    for (int c = 0; c < 3; c++) s->least[c] += l->least[c];
}

static void visit_bunch(seeker *s, uint32_t index) {
    const shd_bunch *bunch = &s->bunches->list[index];
    if (!bunch->parts) { /* its lights are looked at together */
        for (uint32_t i = bunch->first; i < bunch->end; i++)
            s->scratch->places[s->place_count++] = i;
        return;
    }
    const look l = look_at_bunch(s, bunch);
    if (l.behind) return;
    if (s->points * (bunch->end - bunch->first) >= BUNCH_PAYS && l.rest <= s->rate * l.shown) {
        count_light(s, &l);
        take(s, &l);
        s->scratch->taken[s->taken_bunches++] = index;
        return;
    }
    visit_bunch(s, bunch->parts);
    visit_bunch(s, bunch->parts + 1);
}

/* Takes bunches of which all leave no more of themselves out than a share, and finds what is left
 * to be looked at. */
static void visit_bunches(seeker *s) {
    s->place_count = s->taken_bunches = 0;
    s->spent = 0;
    s->taken_most = s->most = s->whole ? s->whole->most : 0;
    for (int c = 0; c < 3; c++)
        s->taken_least[c] = s->least[c] = s->whole ? s->whole->certain[c] : 0;
    for (size_t r = 0; r < s->bunches->roots && !s->whole; r++) visit_bunch(s, (uint32_t)r);
}

static look look_of(const seeker *s, const shd_far_look *from, uint32_t place) {
    look l = {.rest = from->rest, .most = from->most};
    for (int c = 0; c < 3; c++) l.least[c] = s->bunches->rows[8 + c][place] * from->certain;
    return l;
}

/* Lights of steps below `full` are taken, and as many of that one as `left` lets. */
typedef struct filling {
    double room, left;
    int full;
} filling;

static filling fill_room(const shd_far_look *looks, size_t count, double room) {
    filling f = {.room = room, .left = room * (1 - 1e-9)}; /* for the sums' own rounding */
    double sums[SHD_STRENGTH_STEPS] = {0};
    for (size_t i = 0; i < count && room > 0; i++) {
        const int step =
            looks[i].behind ? SHD_STRENGTH_STEPS : shd_strength_step(looks[i].rest, room);
        if (step < SHD_STRENGTH_STEPS) sums[step] += looks[i].rest;
    }
    for (; f.full < SHD_STRENGTH_STEPS && sums[f.full] <= f.left; f.full++) f.left -= sums[f.full];
    return f;
}

static bool fits(filling *f, double rest) {
    if (!(f->room > 0)) return false;
    const int step = shd_strength_step(rest, f->room);
    if (step == SHD_STRENGTH_STEPS || step > f->full) return false;
    if (step < f->full) return true;
    if (!(rest <= f->left)) return false;
    f->left -= rest;
    return true;
}

/* Takes the single lights that leave out least, as long as all that is left out is within a share
 * of the room. */
static void visit_lights(seeker *s, double share) {
    const uint32_t *places = s->whole ? s->whole->open : s->scratch->places;
    const size_t count = s->whole ? s->whole->open_count : s->place_count;
    uint32_t *const taken = s->scratch->taken + s->taken_bunches;
    shd_far_look *looks = s->scratch->looks;
    shd_far_kernel_of(s->plan->isa)->look(s->bunches, &s->lanes, places, count, looks);
    for (size_t i = 0; i < count; i++) {
        if (looks[i].behind) continue;
        const look l = look_of(s, &looks[i], places[i]);
        count_light(s, &l);
    }
    s->out->room = room_of(s->plan, s->material, s->least, s->most);
    if (s->whole) s->out->room = shd_larger(s->out->room, s->whole->room);
    filling f = fill_room(looks, count, share * s->out->room - s->before - s->spent);
    s->taken_lights = s->out->open_count = 0;
    for (size_t i = 0; i < count; i++) {
        if (looks[i].behind) continue;
        if (fits(&f, looks[i].rest)) {
            const look l = look_of(s, &looks[i], places[i]);
            take(s, &l);
            taken[s->taken_lights++] = places[i];
        } else {
            s->out->open[s->out->open_count++] = places[i];
        }
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
        if (s->points >= ALONE_PAYS) l = look_at(s, light, 0, light->color);
        if (l.behind) continue;
        if (s->before + s->spent + l.rest <= share * s->out->room) {
            take(s, &l);
            shd_far_add(light, &s->out->far);
        } else {
            s->out->alone[s->out->alone_count++] = lights[i];
        }
    }
}

static shd_far_patch lanes_of(const seeker *s) {
    const shd_plan_material *material = s->material;
    shd_far_patch p = {.center = s->piece.center,
                       .axis = s->piece.axis,
                       .mirror = s->piece.mirror,
                       .radius = s->radius,
                       .spread = s->piece.spread,
                       .glitter = s->piece.glitter,
                       .lobe_count = material->lobe_count};
    for (int c = 0; c < 3; c++) p.diffuse[c] = fabs(material->diffuse[c]);
    for (size_t k = 0; k < p.lobe_count; k++) {
        p.shininess[k] = material->lobes[k].shininess;
        for (int c = 0; c < 3; c++) p.specular[k][c] = fabs(material->lobes[k].specular[c]);
    }
    return p;
}

void shd_afar_find(const shd_plan *plan, const shd_plan_material *material, const shd_patch *patch,
                   size_t points, const shd_afar *whole, shd_afar_scratch *scratch, shd_afar *out) {
    enum { TRIES = 4, WHOLE_POINTS = 256 };
    static const double FIRST = 0.02; /* the share that is tried if none is known */
    const shd_bunches *bunches = plan->bunches;
    seeker s = {.plan = plan,
                .bunches = bunches,
                .material = material,
                .patch = patch,
                .piece = shd_piece_of(plan->scene, patch),
                .radius = patch->radius,
                .points = points,
                .rate = plan->drop_relative > 0 ? 2 * plan->drop_relative : FIRST,
                .whole = whole,
                .scratch = scratch,
                .out = out};
    memcpy(s.falls, bunches->falls, sizeof s.falls);
    s.lanes = lanes_of(&s);
    out->far = (shd_far){.center = patch->center, .channels = plan->grey_lights ? 1 : 3};
    s.before = whole ? whole->spent : 0;
    for (int t = 0; t < TRIES; t++) {
        visit_bunches(&s);
        const double most = BUNCH_SHARE * room_of(plan, material, s.least, s.most);
        if (s.spent <= most) break;
        s.rate *= t + 2 < TRIES && most > 0 ? 0.8 * most / s.spent : 0;
    }
    const double share = points >= WHOLE_POINTS && !whole ? WHOLE_SHARE : SHARE;
    visit_lights(&s, share);
    visit_alone(&s, share);
    out->spent = s.before + s.spent;
    out->most = s.taken_most;
    memcpy(out->certain, s.taken_least, sizeof out->certain);
    for (size_t i = 0; i < s.taken_bunches; i++)
        shd_far_add_bunch(bunches, &bunches->list[scratch->taken[i]], &out->far);
    shd_far_kernel_of(plan->isa)->add(bunches, scratch->taken + s.taken_bunches, s.taken_lights,
                                      &out->far);
}

size_t shd_afar_list(const shd_plan *plan, const shd_afar *afar, const uint32_t *lights,
                     size_t count, shd_afar_scratch *scratch, uint32_t *out) {
    uint64_t *bits = scratch->bits;
    memset(bits, 0, (plan->light_count + 63) / 64 * sizeof *bits);
    for (size_t i = 0; i < afar->open_count; i++) {
        const uint32_t light = plan->bunches->lights[afar->open[i]];
        bits[light / 64] |= UINT64_C(1) << light % 64;
    }
    for (size_t i = 0; i < afar->alone_count; i++)
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
    out->alone = shd_scratch_take(memory, plan->bunches->alone_count, sizeof *out->alone);
}

void shd_afar_lay_out(const shd_plan *plan, shd_scratch *memory, shd_afar_scratch *out) {
    const size_t lights = plan->light_count;
    lay_out_open(plan, memory, &out->whole);
    lay_out_open(plan, memory, &out->part);
    out->places = shd_scratch_take(memory, lights, sizeof *out->places);
    out->taken = shd_scratch_take(memory, lights, sizeof *out->taken);
    out->looks = shd_scratch_take(memory, lights, sizeof *out->looks);
    out->bits = shd_scratch_take(memory, (lights + 63) / 64, sizeof *out->bits);
}
