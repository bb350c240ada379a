#include "render/tiles/ruled.h"

#include "bound/light/rules.h"

enum { MOST_RULES = SHD_RULED / SHD_QUARTERS }; /* of a part of a block */

/* Whether a proof is worth its while. Of few samples it saves so little that it costs as much where
 * it seldom succeeds: where highlights on a ball are narrow, as pixels see them. */
static bool is_worth_a_look(const shd_analytic *a, const shd_plan_material *material,
                            size_t rule_count) {
    static const double LEAST_WIDTH = 9; /* pixels, of what falls by exp(-1 / 2) */
    const shd_strike *m = &a->strike;
    if (rule_count > SHD_FRINGE || !m->ball) return true;
    const double turn = 2 * (m->orthographic ? m->pace / m->size : m->pace * m->along);
    for (size_t k = 0; k < material->lobe_count; k++)
        if (material->lobes[k].shininess * turn * turn * LEAST_WIDTH * LEAST_WIDTH > 1)
            return false;
    return true;
}

/* Chooses, of the pixels that are left, those for which a rule saves the most samples. Of centers
 * that neighbors share there is one and a half for each pixel. */
static bool choose_rule(const shd_tile_scratch *s, const uint64_t *pixels, int samples,
                        uint64_t left, shd_ruled *out) {
    double most = 0;
    for (size_t r = 0; r < s->rule_count; r++) {
        const uint64_t some = pixels[r] & left;
        if (!some) continue;
        const double each = s->rules[r].rim ? 1.5 : (double)s->rules[r].count,
                     saved = (samples - each) * __builtin_popcountll(some);
        if (!(saved > most)) continue;
        most = saved;
        out->rule = (uint16_t)(r + 1);
        out->pixels = some;
    }
    return most > 0;
}

/* The pixels of a quarter as those of its block. */
static uint64_t in_block(int part, uint64_t pixels) {
    enum { SIDE = SHD_BLOCK_SIDE / 2 };
    if (part == SHD_WHOLE) return pixels;
    uint64_t out = 0;
    for (int row = 0; row < SIDE; row++)
        out |= (pixels >> row * SIDE & SHD_ROW >> SIDE) << row * SHD_BLOCK_SIDE;
    return out << ((part & 1) * SIDE + (part >> 1) * SIDE * SHD_BLOCK_SIDE);
}

/* Adds a rule to those of a block, or pixels to the last one. */
static void add_rule(const shd_ruled *of, shd_block_rules *out) {
    shd_ruled *last = out->count ? &out->ruled[out->count - 1] : NULL;
    out->all &= ~of->pixels;
    if (last && last->rule == of->rule && last->object == of->object)
        last->pixels |= of->pixels;
    else
        out->ruled[out->count++] = *of;
}

/* Finds the rules that pixels of a part of a block may take, and of which object. Whether there are
 * any. */
static bool find_fits(const shd_scenery *scenery, size_t block, int part, const shd_tile_scratch *s,
                      shd_block_rules *out) {
    const shd_plan *plan = scenery->plan;
    shd_analytic a;
    uint64_t pixels[SHD_RULES], left = ~(uint64_t)0;
    if (!shd_sight_expand(scenery->sight, &s->survey, block, part, &a)) return false;
    const shd_plan_material *material = &plan->materials[plan->objects[a.object].material];
    if (material->textures) return false;
    if (part == SHD_WHOLE) {
        out->inside = true;
        out->object = (uint32_t)a.object;
    }
    if (!is_worth_a_look(&a, material, s->rule_count) ||
        !shd_find_rules(plan, &a, s->rules, s->rule_count, 1, pixels))
        return false;
    for (int k = 0; k < MOST_RULES; k++) {
        shd_ruled of = {.object = (uint32_t)a.object};
        if (!choose_rule(s, pixels, plan->scene->raster.samples, left, &of)) break;
        left &= ~of.pixels;
        of.pixels = in_block(part, of.pixels);
        add_rule(&of, out);
    }
    return true;
}

/* Finds which rules quarters of a block may take, and which of its other pixels need no rays. */
static void find_parts(const shd_scenery *scenery, size_t block, const shd_tile_scratch *s,
                       shd_block_rules *out) {
    if (!out->inside) out->all = shd_sight_pixels(scenery->sight, &s->survey, block);
    if (scenery->plan->scene->raster.samples < SHD_FINE) return;
    for (int part = 0; part < SHD_QUARTERS; part++)
        if (in_block(part, 0xffff) & out->all) find_fits(scenery, block, part, s, out);
}

void shd_find_block_rules(const shd_scenery *scenery, size_t block, const shd_tile_scratch *s,
                          shd_block_rules *out) {
    if (s->survey.blocks[block].count > SHD_SEEN_MOST) return;
    if (find_fits(scenery, block, SHD_WHOLE, s, out)) return;
    if (!out->inside || scenery->plan->scene->raster.samples >= SHD_FINE)
        find_parts(scenery, block, s, out);
}
