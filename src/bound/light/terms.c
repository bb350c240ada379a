#include "bound/light/terms.h"

#include <string.h>

/* So many hues are compared with a light's color: if each light has its own, none is the same. */
enum { MOST_COMPARED = 16 };

/* Colors that differ by less than this are one hue. They err by far more. */
static const double SAME = 1e-12;

static double size_of_color(const double color[3]) {
    return fabs(color[0]) + fabs(color[1]) + fabs(color[2]);
}

static bool is_hue(const double hue[3], const double color[3], double strength) {
    for (int c = 0; c < 3; c++)
        if (!(fabs(fabs(color[c]) - strength * hue[c]) <= SAME * strength)) return false;
    return true;
}

static bool find_hues(const shd_plan *plan, shd_arena *arena, shd_hues *out) {
    const size_t lights = plan->light_count;
    *out = (shd_hues){.color = shd_arena_alloc(arena, lights, sizeof *out->color),
                      .of_light = shd_arena_alloc(arena, lights, sizeof *out->of_light),
                      .strength = shd_arena_alloc(arena, lights, sizeof *out->strength)};
    if (!out->color || !out->of_light || !out->strength) return false;
    for (size_t j = 0; j < lights; j++) {
        const double *color = plan->lights[j].color;
        const double strength = out->strength[j] = size_of_color(color);
        size_t hue = 0;
        while (hue < out->count && hue < MOST_COMPARED && !is_hue(out->color[hue], color, strength))
            hue++;
        if (hue == MOST_COMPARED) hue = out->count;
        if (hue == out->count) {
            for (int c = 0; c < 3; c++)
                out->color[hue][c] = strength > 0 ? fabs(color[c]) / strength : 0;
            out->count++;
        }
        out->of_light[j] = (uint32_t)hue;
        out->negative |= shd_is_negative(color);
    }
    return true;
}

/* Makes lumps of hues that are much alike: those in the same third of what red may be of a color,
 * and of what green may be. */
static bool lump_hues(const shd_plan *plan, shd_arena *arena, shd_hues *hues) {
    enum { THIRDS = 3, LUMPS = THIRDS * THIRDS };
    static const double BEYOND = 1e-12; /* more than what a hue is off by rounding, and by SAME */
    uint32_t number[LUMPS] = {0};       /* plus one */
    double(*most)[3] = shd_arena_zalloc(arena, LUMPS, sizeof *most);
    hues->least = shd_arena_alloc(arena, LUMPS, sizeof *hues->least);
    if (!most || !hues->least) return false;
    uint32_t count = 0;
    for (size_t j = 0; j < plan->light_count; j++) {
        const double *hue = hues->color[hues->of_light[j]];
        const int red = (int)shd_smaller(THIRDS * hue[0], THIRDS - 1),
                  green = (int)shd_smaller(THIRDS * hue[1], THIRDS - 1);
        uint32_t *lump = &number[THIRDS * red + green];
        if (!*lump) {
            *lump = ++count;
            for (int c = 0; c < 3; c++) hues->least[count - 1][c] = INFINITY;
        }
        for (int c = 0; c < 3; c++) {
            most[*lump - 1][c] = shd_larger(most[*lump - 1][c], hue[c] + 2 * BEYOND);
            hues->least[*lump - 1][c] =
                shd_smaller(hues->least[*lump - 1][c], shd_larger(hue[c] - 2 * BEYOND, 0));
        }
        hues->of_light[j] = *lump - 1;
    }
    /* No more of the lump's most color than the light's own one needs, which is still between. */
    for (size_t j = 0; j < plan->light_count; j++) {
        const double *lump = most[hues->of_light[j]], *color = plan->lights[j].color;
        double strength = 0;
        for (int c = 0; c < 3; c++) strength = shd_larger(strength, fabs(color[c]) / lump[c]);
        hues->strength[j] = strength;
    }
    hues->color = most;
    hues->count = count;
    return true;
}

bool shd_terms_new(const shd_plan *plan, bool lump, shd_arena *arena, shd_hues *hues,
                   shd_terms *out) {
    if (!find_hues(plan, arena, hues)) return false;
    lump = lump && hues->count > MOST_COMPARED;
    if (lump && !lump_hues(plan, arena, hues)) return false;
    const size_t most = 1 + hues->count * (1 + plan->max_lobes);
    *out = (shd_terms){.list = shd_arena_alloc(arena, most, sizeof *out->list),
                       .least = lump ? shd_arena_alloc(arena, most, sizeof *out->least) : NULL,
                       .first = shd_arena_zalloc(arena, hues->count, sizeof *out->first)};
    return out->list && out->first && (!lump || out->least);
}

void shd_parts_note(shd_parts *parts, const double color[3]) {
    const double sum = color[0] + color[1] + color[2];
    if (!(sum > 0) || !isfinite(sum)) return;
    for (int c = 0; c < 3; c++) {
        parts->least[c] = shd_smaller(parts->least[c], color[c] / sum);
        parts->most[c] = shd_larger(parts->most[c], color[c] / sum);
    }
}

/* Widens parts by those of all colors between the two. */
static void note_parts_between(shd_parts *parts, const double least[4], const double most[4]) {
    if (!(most[3] > 0) || !isfinite(most[3])) return;
    for (int c = 0; c < 3; c++) {
        const double high = most[c] + (least[3] - least[c]), low = least[c] + (most[3] - most[c]);
        const double largest = high > 0 ? most[c] / high : 1,
                     smallest = low > 0 ? least[c] / low : 0;
        parts->least[c] = shd_smaller(parts->least[c], shd_larger(smallest - 1e-9, 0));
        parts->most[c] = shd_larger(parts->most[c], shd_smaller(largest + 1e-9, 1));
    }
}

/* `least`: the light's least color if it is a lump's; or NULL. */
static void list_term(shd_terms *to, const double material[3], const double light[3],
                      const double *least) {
    const size_t index = to->count++;
    shd_term *term = &to->list[index];
    for (int c = 0; c < 3; c++) term->color[c] = fabs(material[c]) * light[c];
    const double sum = term->color[3] = term->color[0] + term->color[1] + term->color[2];
    to->negative |= shd_is_negative(material);
    double *low = to->least ? to->least[index] : NULL;
    if (low) {
        low[3] = 0;
        for (int c = 0; c < 3; c++)
            low[3] += low[c] = fabs(material[c]) * (least ? least[c] : light[c]);
    }
    if (!(sum > 0) || !isfinite(sum)) return;
    for (int c = 0; c < 3; c++) term->part[c] = term->color[c] / sum;
    if (low)
        note_parts_between(&to->parts, low, term->color);
    else
        shd_parts_note(&to->parts, term->color);
    if (to->mixed < SHD_MOST_MIXED) to->mixed_list[to->mixed] = (uint32_t)index;
    to->mixed++;
}

void shd_terms_set(const shd_plan *plan, const shd_hues *hues, const shd_plan_group *group,
                   shd_terms *to) {
    static const double white[3] = {1, 1, 1};
    const shd_plan_material *material = &plan->materials[group->material];
    memset(to->first, 0, hues->count * sizeof *to->first);
    to->count = to->mixed = 0;
    to->negative = false;
    to->parts = SHD_NO_PARTS;
    list_term(to, material->constant, white, NULL);
    /* Hues are in the order of their first lights. */
    const bool all = group->light_count == plan->light_count;
    const size_t count = all ? hues->count : group->light_count;
    for (size_t i = 0; i < count; i++) {
        const uint32_t hue = all ? (uint32_t)i : hues->of_light[group->lights[i]];
        const double *least = hues->least ? hues->least[hue] : NULL;
        if (to->first[hue]) continue;
        to->first[hue] = (uint32_t)to->count;
        list_term(to, material->diffuse, hues->color[hue], least);
        for (size_t k = 0; k < material->lobe_count; k++)
            list_term(to, material->lobes[k].specular, hues->color[hue], least);
    }
    if (to->mixed > SHD_MOST_MIXED || to->least) to->mixed = 0;
    for (int c = 0; c < 3; c++)
        for (size_t i = 0; i < to->mixed; i++) {
            const double part = to->list[to->mixed_list[i]].part[c];
            size_t at = i;
            for (; at > 0 && to->list[to->mixed_list[to->order[c][at - 1]]].part[c] < part; at--)
                to->order[c][at] = to->order[c][at - 1];
            to->order[c][at] = (uint8_t)i;
        }
}

/* The largest (or smallest) part of channel c that a sum of terms may have. The sum is at least
 * `all`, of which `sum` is in the channel, and terms may add `more`: those add all they can that
 * have more (or less) of the channel than the sum. *gain: the largest part that some term adds. */
static double extreme_part(const shd_terms *terms, const double *more, int c, bool largest,
                           double sum, double all, double *gain) {
    const size_t count = terms->mixed;
    bool first = true;
    for (size_t i = 0; i < count; i++) {
        const size_t place = terms->order[c][largest ? i : count - 1 - i];
        if (!(more[place] > 0)) continue;
        const double part = terms->list[terms->mixed_list[place]].part[c];
        if (first) *gain = part;
        first = false;
        if (all > 0 && !(largest ? part * all > sum : part * all < sum)) break;
        all += more[place];
        sum += more[place] * part;
    }
    return sum / all;
}

bool shd_terms_mix(const shd_terms *terms, const shd_much *much, const double low[3],
                   shd_parts *all, shd_parts *gain) {
    double more[SHD_MOST_MIXED], sum = low[0] + low[1] + low[2], high = sum;
    for (size_t i = 0; i < terms->mixed; i++) {
        const size_t index = terms->mixed_list[i];
        more[i] = terms->list[index].color[3] * (much[index].high - much[index].low);
        high += more[i];
    }
    if (!terms->mixed || !(high > 0)) return false;
    *gain = SHD_NO_PARTS;
    for (int c = 0; c < 3; c++) {
        all->least[c] = extreme_part(terms, more, c, false, low[c], sum, &gain->least[c]) - 1e-9;
        all->most[c] = extreme_part(terms, more, c, true, low[c], sum, &gain->most[c]) + 1e-9;
    }
    return true;
}
