/* Errors of colors, summed over each object's lights. */
#include "bound/light/excess.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

#include "bound/light/finding.h"
#include "plan/textures.h"

enum {
    MOST_PAIRS = 1 << 20, /* of objects and lights; then only spheres around objects count */
    MOST_LOOKS = 1024,    /* pairs of pieces and lights that are looked at, some 40 ns each */
    LIGHTS_AT_ONCE = 64   /* between looks at the flag that cancels; each has up to 65 lobes */
};

/* ---- The colors that there are. ---- */

static void add_parts(shd_parts *to, const shd_parts *from) {
    for (int c = 0; c < 3; c++) {
        to->least[c] = shd_smaller(to->least[c], from->least[c]);
        to->most[c] = shd_larger(to->most[c], from->most[c]);
    }
}

/* A pixel that mixes samples has a color between all that there are. */
static void finish_parts(const shd_finding *f, const shd_parts *all) {
    shd_excess_list *list = f->list;
    for (size_t i = 0; i < list->count; i++) {
        shd_excess *e = &list->excess[i];
        if (list->mixed) e->parts = e->gain = *all;
        for (int c = 0; c < 3; c++) {
            if (!(e->parts.least[c] <= e->parts.most[c])) /* all is black */
                e->parts.least[c] = e->parts.most[c] = 1.0 / 3;
            if (!(e->gain.least[c] <= e->gain.most[c])) /* all is floor */
                e->gain.least[c] = e->parts.least[c], e->gain.most[c] = e->parts.most[c];
        }
    }
}

/* ---- Pieces. ---- */

static void take_larger(double *to, const double *from, size_t count) {
    for (size_t i = 0; i < count; i++) to[i] = shd_larger(to[i], from[i]);
}

/* Keeps how much there is of each term with an excess of the list. */
static void keep_terms(const shd_finding *f, shd_excess *to, bool fresh) {
    shd_much *kept = f->list->much[to - f->list->excess];
    if (to->terms != f->kept) to->terms = NULL;
    assert(!to->terms || to->term_count <= SHD_MOST_TERMS);
    for (size_t i = 0; to->terms && i < to->term_count; i++) {
        const shd_much *from = &f->much[i];
        if (fresh) {
            kept[i] = *from;
            continue;
        }
        kept[i].low = shd_smaller(kept[i].low, from->low);
        kept[i].high = shd_larger(kept[i].high, from->high);
        kept[i].absolute = shd_larger(kept[i].absolute, from->absolute);
        kept[i].limited = shd_larger(kept[i].limited, from->limited);
    }
}

/* The larger of both, in everything. Their main directions are the same. */
static void merge_excess(shd_excess *to, const shd_excess *from) {
    take_larger(to->absolute, from->absolute, 3);
    take_larger(to->limited, from->limited, 3);
    take_larger(to->rest_absolute, from->rest_absolute, 3);
    take_larger(to->rest_limited, from->rest_limited, 3);
    take_larger(to->most, from->most, 3);
    to->main_absolute = shd_larger(to->main_absolute, from->main_absolute);
    to->main_limited = shd_larger(to->main_limited, from->main_limited);
    to->ratio = shd_larger(to->ratio, from->ratio);
    to->distance = shd_larger(to->distance, from->distance);
    double floor[3], above[2][3];
    for (int c = 0; c < 3; c++) {
        to->base[c] = shd_smaller(to->base[c], from->base[c]);
        floor[c] = shd_smaller(to->floor[c], from->floor[c]);
        above[0][c] = to->floor[c] - floor[c];
        above[1][c] = from->floor[c] - floor[c];
        to->floor[c] = floor[c];
    }
    add_parts(&to->parts, &from->parts);
    add_parts(&to->gain, &from->gain);
    for (int k = 0; k < 2; k++) shd_parts_note(&to->gain, above[k]);
}

/* The step of a color: powers of 2.5 from 1e-4 on. */
static int brightness_step(const double color[3]) {
    const double sum = color[0] + color[1] + color[2];
    return sum > 1e-4 ? 1 + (int)(0.75 * log2(shd_smaller(sum / 1e-4, 1e6))) : 0;
}

/* The excess that a piece's errors are counted in: of its material, and as dark and as bright as
 * the piece. If there is none and no room for another, it is the nearest. */
static shd_excess *slot_of(const shd_finding *f, const shd_excess *sum, bool *fresh) {
    shd_excess_list *list = f->list;
    shd_excess *nearest = NULL;
    int least = 0;
    for (size_t i = 0; i < list->count; i++) {
        shd_excess *e = &list->excess[i];
        const int apart = 64 * (e->material != sum->material) + 2 * abs(e->dark - sum->dark) +
                          abs(e->bright - sum->bright);
        if (!nearest || apart < least) nearest = e, least = apart;
    }
    *fresh = !nearest || (least > 0 && list->count < SHD_EXCESSES);
    return *fresh ? &list->excess[list->count++] : nearest;
}

/* Finds all about an object but its pieces. Its group has its material and terms. False: memory. */
static bool find_object(shd_finding *f, size_t index, bool same_group, bool few, shd_arena *arena) {
    const shd_plan *plan = f->plan;
    const shd_plan_object *object = &plan->objects[index];
    const shd_plan_material *material = &plan->materials[object->material];
    if (!same_group) {
        const size_t lights = plan->scene->light_count;
        const shd_rounding rounding =
            plan->sketched ? SHD_ROUNDS_LOOSE : shd_rounding_of(f->tier, plan->isa);
        for (size_t k = 0; k < material->lobe_count; k++)
            f->lobes[k] = shd_lobe_error_of(rounding, material->lobes[k].shininess, lights);
        shd_terms_set(plan, &f->hues, &plan->groups[object->group], &f->terms);
        f->kept = NULL;
        if (!f->terms.least && f->terms.count <= SHD_MOST_TERMS && f->list->count < SHD_EXCESSES) {
            shd_term *kept = shd_arena_alloc(arena, f->terms.count, sizeof *kept);
            if (!kept) return false;
            f->kept = memcpy(kept, f->terms.list, f->terms.count * sizeof *kept);
        }
    }
    f->place = shd_place_of(&plan->scene->objects[index], object);
    f->place.known = f->place.known && few;
    f->misplaced = shd_misplaced_of(plan->scene, &f->place);
    shd_set_path_errors(f);
    for (size_t k = 0; k < object->light_count && !shd_is_clustered(f, object); k++)
        f->sources[k] = shd_source_of(f, object->lights[k]);
    return true;
}

/* Sums up the terms: their colors and errors. */
static void sum_terms(const shd_finding *f, const shd_plan_material *material, shd_excess *to) {
    const size_t stride = 1 + material->lobe_count;
    double low[4] = {0}, high[4] = {0}, absolute[4] = {0}, limited[4] = {0}, base[4] = {0};
    for (size_t i = 0; i < f->terms.count; i++) {
        const double *color = f->terms.list[i].color;
        const shd_much much = f->much[i];
        for (int c = 0; c < 4; c++) low[c] += color[c] * much.low;
        for (int c = 0; c < 4; c++) high[c] += color[c] * much.high;
        for (int c = 0; c < 4; c++) absolute[c] += color[c] * much.absolute;
        for (int c = 0; c < 4; c++) limited[c] += color[c] * much.limited;
    }
    for (size_t i = 1; i < f->terms.count; i += stride)
        for (int c = 0; c < 4; c++) base[c] += f->terms.list[i].color[c] * f->much[i].low;
    for (int c = 0; c < 3; c++) {
        to->base[c] = f->terms.list[0].color[c] + base[c];
        to->floor[c] = low[c];
        to->most[c] = high[c];
        to->absolute[c] = absolute[c];
        to->limited[c] = limited[c];
    }
    to->main_absolute = absolute[3];
    to->main_limited = limited[3];
}

/* The largest error of a channel because points are elsewhere. */
static double misplaced_of(const shd_finding *f) {
    double sum[3] = {0};
    for (size_t i = 1; i < f->terms.count; i++)
        for (int c = 0; c < 3; c++) sum[c] += f->terms.list[i].color[c] * f->much[i].misplaced;
    return shd_larger(shd_larger(sum[0], sum[1]), sum[2]);
}

/* Finds the errors beside the main direction. Each term errs for itself. */
static void part_errors(const shd_finding *f, shd_excess *to) {
    const double main[4] = {to->main[0], to->main[1], to->main[2], 0};
    double absolute[4] = {0}, limited[4] = {0};
    for (size_t i = 1; i < f->terms.count; i++) {
        const double *color = f->terms.list[i].color;
        const shd_much much = f->much[i];
        double beside[4];
        const double *least = f->terms.least ? f->terms.least[i] : color;
        for (int c = 0; c < 4; c++)
            beside[c] = shd_larger(fabs(color[c] - least[3] * main[c]),
                                   fabs(least[c] - color[3] * main[c]));
        for (int c = 0; c < 4; c++) absolute[c] += much.absolute * beside[c];
        for (int c = 0; c < 4; c++) limited[c] += much.limited * beside[c];
    }
    memcpy(to->rest_absolute, absolute, sizeof to->rest_absolute);
    memcpy(to->rest_limited, limited, sizeof to->rest_limited);
}

/* Counts the errors of all of an object's lights at one of its pieces. */
static void add_piece_error(shd_finding *f, const shd_plan_object *object, const shd_piece *piece,
                            double *influences) {
    const shd_plan *plan = f->plan;
    const shd_plan_material *material = &plan->materials[object->material];
    memset(f->much, 0, f->terms.count * sizeof *f->much);
    f->much[0] = (shd_much){.low = 1, .high = 1};
    f->ratio = f->distance = 0;
    if (shd_is_clustered(f, object)) {
        shd_crowd_begin(f, influences);
        shd_add_clusters(f, object, piece, influences);
    }
    for (size_t i = 0; i < object->light_count && !shd_is_clustered(f, object); i++) {
        if (i % LIGHTS_AT_ONCE == 0 && shd_is_cancelled(plan->cancelled)) return;
        shd_add_light(f, material, &f->sources[i], object->lights[i], piece, influences);
    }
    shd_excess sum = {.ratio = f->ratio,
                      .distance = f->distance,
                      .terms = f->kept,
                      .term_count = f->terms.count,
                      .lobe_count = material->lobe_count,
                      .material = object->material};
    sum_terms(f, material, &sum);
    if (!shd_terms_mix(&f->terms, f->much, sum.floor, &sum.parts, &sum.gain))
        sum.parts = sum.gain = f->terms.parts;
    bool fresh;
    sum.dark = brightness_step(sum.floor);
    sum.bright = brightness_step(sum.most);
    shd_excess *to = slot_of(f, &sum, &fresh);
    double total = 0, worst = 0;
    for (int c = 0; c < 3; c++) total += sum.absolute[c] + sum.limited[c];
    for (int c = 0; c < 3; c++) {
        const double error = sum.absolute[c] + sum.limited[c];
        sum.main[c] = !fresh ? to->main[c] : total > 0 && isfinite(total) ? error / total : 0;
        worst = shd_larger(worst, error + f->list->rounding * sum.most[c]);
    }
    f->list->misplaced = shd_larger(f->list->misplaced, misplaced_of(f));
    part_errors(f, &sum);
    if (!(worst >= 0)) worst = INFINITY; /* not a number */
    f->list->worst = shd_larger(f->list->worst, worst);
    take_larger(f->list->most, sum.most, 3);
    if (fresh)
        *to = sum;
    else
        merge_excess(to, &sum);
    keep_terms(f, to, fresh);
}

static double count_pairs(const shd_plan *plan) {
    double pairs = 0;
    for (size_t i = 0; i < plan->scene->object_count; i++)
        pairs += (double)plan->objects[i].light_count;
    return pairs;
}

bool shd_is_crowded(const shd_plan *plan) {
    return count_pairs(plan) > SHD_PLAN_PAIRS;
}

/* How finely objects are looked at. About half of a solid's pieces may be seen. */
static int fineness_of(double pairs) {
    int fineness = 3;
    while (fineness > 0 && 3 * fineness * fineness * pairs > MOST_LOOKS) fineness--;
    return fineness;
}

/* Makes a row for each piece if these are few, else one for all. False: memory. */
static bool next_row(const shd_finding *f, shd_arena *arena) {
    shd_influences *in = f->influences;
    if (!in || (in->count && f->fineness == 0)) return true;
    in->rows[in->count] = shd_arena_zalloc(arena, f->plan->light_count, sizeof **in->rows);
    return in->rows[in->count++];
}

static bool add_objects(shd_finding *f, shd_arena *arena) {
    const shd_plan *plan = f->plan;
    const shd_scene *scene = plan->scene;
    shd_parts all = SHD_NO_PARTS;
    bool negative = f->hues.negative;
    if (shd_has_background(scene)) {
        shd_parts_note(&all, scene->background);
        negative |= shd_is_negative(scene->background);
        for (int c = 0; c < 3; c++) {
            const double most = fabs(scene->background[c]);
            f->list->most[c] = most;
            f->list->worst = shd_larger(f->list->worst, f->list->rounding * most);
        }
    }
    size_t pairs = 0, group = plan->group_count;
    for (size_t k = 0; k < scene->object_count; k++) {
        const size_t i = f->crowded ? shd_crowd_enter(f, k) : k;
        const shd_plan_object *object = &plan->objects[i];
        pairs += object->light_count;
        if (shd_is_cancelled(plan->cancelled)) return false;
        const bool same_group = object->group == group;
        group = object->group;
        if (!find_object(f, i, same_group, pairs <= MOST_PAIRS, arena)) return false;
        add_parts(&all, &f->terms.parts);
        negative |= f->terms.negative;
        const shd_plan_textures *textures = plan->materials[object->material].textures;
        /* Where colors may cancel each other, the larger ones are not the most. */
        if (textures && textures->negative) f->list->worst = INFINITY;
        const size_t count =
            shd_plan_pieces(scene, i, object, f->fineness, plan->cancelled, f->pieces);
        for (size_t p = 0; p < count; p++) {
            if (shd_is_cancelled(plan->cancelled) || !next_row(f, arena)) return false;
            shd_influences *in = f->influences;
            add_piece_error(f, object, &f->pieces[p], in ? in->rows[in->count - 1] : NULL);
        }
    }
    if (f->crowded && f->influences && f->influences->count)
        shd_clusters_influence(plan, &f->hues, &f->clusters, f->influences->rows[0]);
    f->list->nonnegative = !negative;
    finish_parts(f, &all);
    return true;
}

bool shd_excess_find(const shd_plan *plan, shd_tier tier, shd_arena *arena, shd_excess_list *out,
                     shd_influences *influences) {
    const double pairs = count_pairs(plan);
    shd_finding f = {.plan = plan,
                     .tier = tier,
                     .list = out,
                     .influences = influences,
                     .sources = shd_arena_alloc(arena, plan->light_count, sizeof(shd_source)),
                     .beside = shd_arena_zalloc(arena, plan->light_count, sizeof(double)),
                     .lobes = shd_arena_alloc(arena, plan->max_lobes, sizeof(shd_lobe_error)),
                     .pieces = shd_arena_alloc(arena, SHD_MOST_PIECES, sizeof(shd_piece)),
                     .fineness = fineness_of(pairs),
                     .nodes = shd_plan_rules(plan, tier) > 0,
                     .crowded = shd_is_crowded(plan)};
    if (!f.sources || !f.beside || !f.lobes || !f.pieces ||
        !shd_terms_new(plan, f.crowded, arena, &f.hues, &f.terms))
        return false;
    const size_t terms = 1 + f.hues.count * (1 + plan->max_lobes);
    f.much = shd_arena_alloc(arena, terms, sizeof(shd_much));
    for (size_t j = 0; j < plan->light_count; j++)
        if (!plan->lights[j].directional)
            f.beside[j] = shd_ray_distance(plan->scene, plan->lights[j].position);
    if (f.crowded && !(shd_clusters_new(plan, &f.hues, f.beside, arena, &f.clusters) &&
                       shd_crowd_new(&f, terms, arena)))
        return false;
    if (influences) {
        const size_t rows = f.fineness ? SHD_MOST_PIECES * plan->scene->object_count : 1;
        *influences = (shd_influences){0, shd_arena_alloc(arena, rows, sizeof(double *))};
    }
    out->count = 0;
    out->grey = plan->grey;
    out->textured = plan->textured;
    for (size_t j = 0; j < plan->scene->light_count; j++) /* those that are left out, too */
        out->grey = out->grey && shd_is_grey(plan->scene->lights[j].color);
    /* A facet mixes colors of one piece alone, which are in its range. */
    out->mixed = plan->scene->raster.samples > 1;
    out->color = out->rounding = shd_color_error(plan, tier);
    out->more = out->worst = out->misplaced = 0;
    memset(out->most, 0, sizeof out->most);
    return f.much && (!influences || influences->rows) && add_objects(&f, arena);
}

void shd_excess_leave_out(shd_excess_list *list, double absolute, double relative) {
    list->more = absolute;
    list->color = list->rounding + relative;
}
