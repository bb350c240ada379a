#include "plan/textures.h"

#include <string.h>

#include "plan/parts.h"

typedef struct making {
    const shd_plan *plan;
    const shd_ambience *ambient;
    shd_plan_slot *slots;
    shd_pattern *patterns;
    shd_plan_textures *out;
} making;

static bool is_negative(const double color[3]) {
    return color[0] < 0 || color[1] < 0 || color[2] < 0;
}

/* In bins what is ambient is not a product of colors, and terms have their colors in the sums. */
static void spread_slot(const making *m, const shd_texture *texture, shd_plan_slot *slot,
                        double low[3]) {
    const shd_bins *bins = m->plan->bins;
    double reflectance[SHD_BINS_MOST];
    for (size_t part = 0; part <= 3; part++) {
        double *out = part ? slot->rises[part - 1] : low;
        shd_texture_part(texture, part, out);
        if (slot->of == SHD_SLOT_TERM)
            out[0] = out[1] = out[2] = 1;
        else if (slot->of == SHD_SLOT_AMBIENT) {
            shd_bins_lift(bins, out, reflectance);
            shd_bins_mix(bins->count, reflectance, (const double(*)[3])m->ambient->bins, out);
        }
    }
}

/* Adds the pattern unless it is there, and finds it and its fields. */
static size_t take_pattern(making *m, const shd_pattern *pattern, size_t fields[3]) {
    shd_plan_textures *out = m->out;
    size_t p = 0, field = 0;
    for (; p < out->pattern_count && !shd_same_pattern(&m->patterns[p], pattern); p++)
        field += (size_t)shd_pattern_fields(&m->patterns[p]);
    const size_t count = (size_t)shd_pattern_fields(pattern);
    if (p == out->pattern_count) {
        m->patterns[out->pattern_count++] = *pattern;
        out->field_count += count;
    }
    for (size_t c = 0; c < 3; c++) fields[c] = field + (count == 3 ? c : 0);
    return p;
}

/* Adds a slot unless it is black, and sets the low color: times `by`, or 1 if that is NULL. */
static void add_slot(making *m, const shd_texture *texture, shd_slot_of of, size_t term,
                     const double *by, double low[3]) {
    shd_plan_slot *slot = &m->slots[m->out->slot_count];
    shd_plan_textures *out = m->out;
    double high[3], ends[2][3];
    for (int c = 0; c < 3; c++) {
        low[c] = texture->low[c] * (by ? by[c] : 1);
        high[c] = texture->high[c] * (by ? by[c] : 1);
    }
    *slot = (shd_plan_slot){.of = of, .term = term, .name = texture->name};
    for (int c = 0; c < 3; c++) slot->rise[c] = high[c] - low[c];
    const int fields = shd_pattern_fields(&texture->pattern);
    slot->pattern = take_pattern(m, &texture->pattern, slot->field);
    shd_texture_ends(texture, ends);
    for (int c = 0; c < 3 && by; c++) ends[0][c] *= by[c], ends[1][c] *= by[c];
    out->hued = out->hued || fields == 3;
    out->grey = out->grey && fields == 1 && shd_is_grey(low) && shd_is_grey(high);
    out->negative = out->negative || is_negative(ends[0]) || is_negative(ends[1]);
    out->slot_count++;
    if (!m->plan->bins) return;
    spread_slot(m, texture, slot, low);
    if (out->part_count < 1 + (size_t)fields) out->part_count = 1 + (size_t)fields;
}

/* Lobes that are black are not among the plan's. */
static void add_lobes(making *m, const shd_material *from, const shd_plan_material *material,
                      shd_plan_lobe *low) {
    size_t at = 0;
    for (size_t i = 0; i < from->lobe_count && at < material->lobe_count; i++) {
        if (shd_is_black(from->lobes[i].specular)) continue;
        const shd_texture *texture = from->lobe_textures ? from->lobe_textures[i] : NULL;
        low[at] = material->lobes[at];
        if (texture) add_slot(m, texture, SHD_SLOT_TERM, 1 + at, NULL, low[at].specular);
        at++;
    }
}

/* False: memory. */
static bool add_fresnel(making *m, const shd_material *from, const shd_plan_material *material,
                        shd_arena *arena) {
    const shd_texture *texture = from->fresnel.f0_texture;
    if (!texture || !material->lobe_count) return true;
    shd_plan_slot *slot = shd_arena_zalloc(arena, 1, sizeof *slot);
    if (!slot) return false;
    slot->name = texture->name;
    slot->pattern = take_pattern(m, &texture->pattern, slot->field);
    memcpy(m->out->f0[0], texture->low, sizeof texture->low);
    memcpy(m->out->f0[1], texture->high, sizeof texture->high);
    m->out->fresnel = slot;
    return true;
}

static void follow_rays(const shd_material *from, shd_plan_textures *out) {
    const shd_texture *textures[SHD_RAY_COEFFICIENTS] = {
        [SHD_RAY_OPACITY] = from->opacity_texture,
        [SHD_RAY_REFLECTION] = from->reflection_texture,
        [SHD_RAY_TRANSMISSION] = from->transmission_texture};
    for (int k = 0; k < SHD_RAY_COEFFICIENTS; k++) {
        out->rays[k].texture = textures[k];
        out->rayed = out->rayed || textures[k];
    }
    for (int c = 0; c < 3; c++) {
        out->rays[SHD_RAY_OPACITY].most[c] = 1;
        out->rays[SHD_RAY_REFLECTION].most[c] = from->reflection[c];
        out->rays[SHD_RAY_TRANSMISSION].most[c] = from->transmission[c];
    }
}

bool shd_plan_textures_make(const shd_plan *plan, const shd_ambience *ambient, size_t parts,
                            shd_arena *arena, shd_plan_material *material) {
    const shd_material *from = material->from;
    if (!shd_is_textured(from)) return true;
    const size_t most = 4 + material->lobe_count;
    making m = {.plan = plan,
                .ambient = ambient,
                .slots = shd_arena_alloc(arena, most, sizeof *m.slots),
                .patterns = shd_arena_alloc(arena, most, sizeof *m.patterns),
                .out = shd_arena_zalloc(arena, 1, sizeof *m.out)};
    shd_plan_material *low = shd_arena_alloc(arena, 1, sizeof *low);
    shd_plan_lobe *lobes = shd_arena_alloc(arena, material->lobe_count, sizeof *lobes);
    if (!m.slots || !m.patterns || !m.out || !low || !lobes ||
        !add_fresnel(&m, from, material, arena))
        return false;
    *low = *material;
    m.out->grey = true;
    if (from->emissive_texture && material->has_emissive)
        add_slot(&m, from->emissive_texture, SHD_SLOT_EMISSIVE, 0, NULL, low->emissive);
    if (from->ambient_texture && material->has_ambient)
        add_slot(&m, from->ambient_texture, SHD_SLOT_AMBIENT, 0, ambient->rgb, low->ambient);
    if (from->diffuse_texture && material->has_diffuse)
        add_slot(&m, from->diffuse_texture, SHD_SLOT_TERM, 0, NULL, low->diffuse);
    add_lobes(&m, from, material, lobes);
    m.out->negative = m.out->negative || is_negative(low->emissive) || is_negative(low->ambient);
    low->lobes = lobes;
    m.out->parts = parts;
    m.out->low = low;
    m.out->slots = m.slots;
    m.out->patterns = m.patterns;
    follow_rays(from, m.out);
    if (m.out->slot_count || m.out->rayed || m.out->fresnel) material->textures = m.out;
    return true;
}

/* ---- Parts. ---- */

/* A term's reflectance in a part: of a color that is no texture, all is in the low part. */
static void reflect_part(const shd_bins *bins, const shd_texture *texture, size_t part,
                         const double *own, double *out) {
    double color[3];
    if (texture) {
        shd_texture_part(texture, part, color);
        shd_bins_lift(bins, color, out);
        return;
    }
    for (size_t b = 0; b < bins->count; b++) out[b] = part == 0 ? own[b] : 0;
}

bool shd_plan_part(const shd_plan *plan, const shd_ambience *ambient, size_t part, shd_arena *arena,
                   const shd_plan_material *material, shd_plan_material *out) {
    const shd_material *from = material->from;
    const shd_bins *bins = plan->bins;
    double *rows = shd_arena_alloc(arena, material->bin_count, sizeof *rows);
    if (!rows || shd_is_cancelled(plan->cancelled)) return false;
    *out = *material;
    out->textures = NULL;
    out->bins = rows;
    reflect_part(bins, from->diffuse_texture, part, material->bins, rows);
    for (size_t i = 0, k = 0; i < from->lobe_count; i++) {
        if (shd_is_black(from->lobes[i].specular)) continue;
        const shd_texture *texture = from->lobe_textures ? from->lobe_textures[i] : NULL;
        k++;
        reflect_part(bins, texture, part, material->bins + k * bins->count, rows + k * bins->count);
    }
    return shd_plan_part_tint(plan, ambient, part, arena, material, out);
}
