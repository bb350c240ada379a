/* Errors of colors, summed over each object's lights. */
#include <stdlib.h>
#include <string.h>

#include "plan/bound.h"
#include "plan/pieces.h"

/* Pairs of objects and lights that are looked at one by one: beyond, only the spheres
 * around objects are, and pictures count as having colors of any kind. */
enum { MOST_PAIRS = 1 << 20 };

/* Pairs of pieces and lights that are looked at, some 60 ns each. */
enum { MOST_LOOKS = 1024 };

/* Rounding of a position in f32, in the frame's unit: half an ulp below 2 in three coordinates.
 * A light's, whose coordinates may be larger, grows with them. */
static const double POSITION = 1.1e-7;

/* What it moves a direction by at most where positions are not split: see frame.c. */
static const double MOVED = 2 * 1.1e-7 / 0.05;

typedef struct finding {
    const shd_plan *plan;
    shd_tier tier;
    double color, distance; /* relative errors: of rounding; of what depends on distances */
    shd_excess_list *list;
    shd_piece *pieces;     /* [SHD_MOST_PIECES] */
    double *least;         /* [light_count]: distances from the object in question */
    shd_lobe_error *lobes; /* [max_lobes]: of its material */
    int fineness;
    bool mixed; /* pixels may be made of several samples, which lie anywhere */
} finding;

/* ---- A light at a piece. ---- */

static double spot_error(const finding *f, const shd_plan_light *light, const shd_lit *lit,
                         double position) {
    if (!light->spot || light->steep || f->tier == SHD_EXACT) return 0;
    const shd_spot_shape shape = {light->inner, light->outer, light->exponent};
    return shd_spot_error(f->tier, &shape, lit->axis_low, lit->axis_high, position);
}

/* Relative error of the distance, and error of the direction. */
static double position_error(const finding *f, const shd_plan_object *object,
                             const shd_plan_light *light, double nearest) {
    const shd_plan *plan = f->plan;
    if (light->directional || f->tier == SHD_EXACT || plan->split_positions) return 0;
    /* On a plane coordinates grow with the distance. */
    const double size = shd_plan_size(plan, object, light) / (nearest * plan->scale);
    const double far = shd_length(shd_sub(light->position, plan->origin));
    const double error =
        POSITION * (object->bounded ? size : 1 + size) + POSITION / 2 * far / nearest;
    return error < 1 ? error : 1;
}

static shd_path path_of(const shd_plan_light *light) {
    return light->directional                 ? SHD_PATH_DIRECTIONAL
           : light->attenuated || light->spot ? SHD_PATH_ATTENUATED
                                              : SHD_PATH_POINT;
}

/* What a light adds to a piece's colors, and to their errors; `base` is the diffuse part of `low`.
 */
typedef struct share {
    double absolute[3], limited[3], base[3], low[3], high[3];
} share;

/* Light of one chromaticity in a piece's colors. */
typedef struct tint {
    double part[3];   /* r, g, b / (r + g + b) */
    double low, high; /* r + g + b */
} tint;

enum { MOST_TINTS = 32 };

typedef struct tints {
    size_t count; /* beyond MOST_TINTS: unknown */
    tint list[MOST_TINTS];
} tints;

static void add_tint(tints *to, const double a[3], const double b[3], double low, double high) {
    const double color[3] = {a[0] * b[0], a[1] * b[1], a[2] * b[2]};
    const double sum = color[0] + color[1] + color[2];
    if (!(sum * high > 0)) return;
    if (to->count++ >= MOST_TINTS) return;
    tint *t = &to->list[to->count - 1];
    for (int c = 0; c < 3; c++) t->part[c] = color[c] / sum;
    t->low = sum * low;
    t->high = sum * high;
}

/* The largest part of a channel in the sum of tints (sign 1; -1: the smallest): those with more of
 * it than the sum has are as bright, the others as dark as they can be. Each round but the last
 * finds fewer of them (W. Dinkelbach, "On nonlinear fractional programming", 1967). */
static double extreme_part(const tints *of, int channel, double sign) {
    double best = 0;
    for (int round = 0; round < MOST_TINTS + 2; round++) {
        double sum = 0, all = 0;
        for (size_t i = 0; i < of->count; i++) {
            const tint *t = &of->list[i];
            const double much =
                round == 0 || sign * (t->part[channel] - best) > 0 ? t->high : t->low;
            sum += much * t->part[channel];
            all += much;
        }
        const double part = sum / all;
        if (round > 0 && !(sign * (part - best) > 1e-9)) break;
        best = part;
    }
    return best;
}

static share share_of(const finding *f, const shd_plan_object *object,
                      const shd_plan_material *material, const shd_plan_light *light,
                      const shd_lit *lit, tints *colors) {
    const shd_path path = path_of(light);
    const shd_path_error *e = shd_path_error_of(f->tier, path);
    const double position = position_error(f, object, light, lit->nearest);
    const double spot = spot_error(f, light, lit, position);
    const double distance = e->relative + (light->attenuated ? 2 * position : 0);
    share out;
    double all[3];
    for (int c = 0; c < 3; c++) {
        const double kd = fabs(material->diffuse[c]);
        out.absolute[c] = kd * (e->facing + position);
        all[c] = kd;
        out.limited[c] = kd * distance * lit->facing_high;
        out.base[c] = kd * lit->facing_low;
        out.low[c] = out.base[c];
        out.high[c] = kd * lit->facing_high;
    }
    if (material->has_diffuse)
        add_tint(colors, material->diffuse, light->color, lit->factor_low * lit->facing_low,
                 lit->factor_high * lit->facing_high);
    for (size_t k = 0; k < material->lobe_count; k++) {
        const shd_plan_lobe *lobe = &material->lobes[k];
        const shd_lobe_error *error = &f->lobes[k];
        const double most = shd_shine_power(lit->shine_high, lobe->shininess),
                     least = shd_shine_power(lit->shine_low, lobe->shininess);
        const double turned =
            shd_lobe_turned(error, lit->shine_high, most, e->direction + position);
        const double functions = shd_lobe_functions(error, most);
        /* What is not in proportion to the lobe is absolute. */
        const bool relative = isfinite(error->turned_ratio);
        const double wrong = relative ? shd_lobe_sum(turned, functions) : functions;
        const double faint = shd_lobe_faint(error, most) + (relative ? 0 : turned);
        for (int c = 0; c < 3; c++) {
            const double ks = fabs(lobe->specular[c]);
            out.absolute[c] += ks * faint;
            all[c] += ks;
            out.limited[c] += ks * shd_smaller(wrong + distance * most, 1);
            out.low[c] += ks * least;
            out.high[c] += ks * most;
        }
        add_tint(colors, lobe->specular, light->color, lit->factor_low * least,
                 lit->factor_high * most);
    }
    for (int c = 0; c < 3; c++) {
        const double color = fabs(light->color[c]);
        /* Where s is low, so are the errors that it multiplies, but not its own. */
        out.absolute[c] *= color * lit->factor_high;
        out.absolute[c] += color * lit->fall_high * spot * all[c];
        out.limited[c] *= color * lit->factor_high;
        out.base[c] *= color * lit->factor_low;
        out.low[c] *= color * lit->factor_low;
        out.high[c] *= color * lit->factor_high;
    }
    return out;
}

/* ---- Colors that there are. ---- */

static bool is_negative(const double color[3]) {
    return color[0] < 0 || color[1] < 0 || color[2] < 0;
}

static void note_part(shd_parts *parts, const double color[3]) {
    double sum = color[0] + color[1] + color[2];
    if (is_negative(color)) parts->negative = true;
    if (!(sum > 0) || !isfinite(sum)) return;
    for (int c = 0; c < 3; c++) {
        parts->least[c] = shd_smaller(parts->least[c], color[c] / sum);
        parts->most[c] = shd_larger(parts->most[c], color[c] / sum);
    }
}

static void note_product(shd_parts *parts, const double a[3], const double b[3]) {
    if (is_negative(a) || is_negative(b)) parts->negative = true;
    const double color[3] = {a[0] * b[0], a[1] * b[1], a[2] * b[2]};
    note_part(parts, color);
}

static const shd_parts NO_PARTS = {
    .least = {INFINITY, INFINITY, INFINITY},
    .most = {0, 0, 0},
};

/* Of the colors that a material has in a list of lights. */
static shd_parts parts_of(const shd_plan *plan, const shd_plan_group *group) {
    const shd_plan_material *material = &plan->materials[group->material];
    shd_parts parts = NO_PARTS;
    note_part(&parts, material->constant);
    for (size_t i = 0; i < group->light_count; i++) {
        const shd_plan_light *light = &plan->lights[group->lights[i]];
        note_product(&parts, light->color, material->diffuse);
        for (size_t k = 0; k < material->lobe_count; k++)
            note_product(&parts, light->color, material->lobes[k].specular);
    }
    return parts;
}

static void add_parts(shd_parts *to, const shd_parts *from) {
    for (int c = 0; c < 3; c++) {
        to->least[c] = shd_smaller(to->least[c], from->least[c]);
        to->most[c] = shd_larger(to->most[c], from->most[c]);
    }
    to->negative |= from->negative;
}

/* Pixels that mix samples have colors between all that there are. */
static void finish_parts(const finding *f, const shd_parts *all) {
    shd_excess_list *list = f->list;
    list->nonnegative = !all->negative;
    for (size_t i = 0; i < list->count; i++) {
        shd_excess *e = &list->excess[i];
        if (f->mixed) e->parts = e->gain = *all;
        for (int c = 0; c < 3; c++) {
            if (!(e->parts.least[c] <= e->parts.most[c])) /* all is black */
                e->parts.least[c] = e->parts.most[c] = 1.0 / 3;
            if (!(e->gain.least[c] <= e->gain.most[c])) /* all is floor */
                e->gain.least[c] = e->parts.least[c], e->gain.most[c] = e->parts.most[c];
        }
    }
}

/* ---- Pieces. ---- */

/* The part of an error beside its main direction. */
static void add_error(shd_excess *to, const double absolute[3], const double limited[3]) {
    const double a = absolute[0] + absolute[1] + absolute[2],
                 b = limited[0] + limited[1] + limited[2];
    to->main_absolute += a;
    to->main_limited += b;
    for (int c = 0; c < 3; c++) {
        to->absolute[c] += absolute[c];
        to->limited[c] += limited[c];
        to->rest_absolute[c] += fabs(absolute[c] - a * to->main[c]);
        to->rest_limited[c] += fabs(limited[c] - b * to->main[c]);
    }
}

static void take_larger(double *to, const double *from, size_t count) {
    for (size_t i = 0; i < count; i++) to[i] = shd_larger(to[i], from[i]);
}

/* The larger of both, in everything; their main directions are the same. */
static void merge(shd_excess *to, const shd_excess *from) {
    take_larger(to->absolute, from->absolute, 3);
    take_larger(to->limited, from->limited, 3);
    take_larger(to->rest_absolute, from->rest_absolute, 3);
    take_larger(to->rest_limited, from->rest_limited, 3);
    take_larger(to->most, from->most, 3);
    to->main_absolute = shd_larger(to->main_absolute, from->main_absolute);
    to->main_limited = shd_larger(to->main_limited, from->main_limited);
    to->ratio = shd_larger(to->ratio, from->ratio);
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
    for (int k = 0; k < 2; k++) note_part(&to->gain, above[k]);
}

/* In powers of 2.5 from 1e-4 on. */
static int step_of(const double color[3]) {
    const double sum = color[0] + color[1] + color[2];
    return sum > 1e-4 ? 1 + (int)(0.75 * log2(shd_smaller(sum / 1e-4, 1e6))) : 0;
}

/* Where the errors of a piece go: to those of its material, as dark and as bright as it is. Where
 * there is no room, to those that are nearest. */
static shd_excess *slot_of(const finding *f, const shd_excess *sum, bool *fresh) {
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

/* The lobes of a material, and the largest of their relative errors. */
static double find_lobes(const finding *f, const shd_plan_material *material) {
    const double direction = shd_path_error_of(f->tier, SHD_PATH_ATTENUATED)->direction +
                             (f->tier == SHD_EXACT ? 0 : MOVED);
    double ratio = 0;
    for (size_t k = 0; k < material->lobe_count; k++) {
        shd_lobe_error *e = &f->lobes[k];
        *e = shd_lobe_error_of(f->tier, material->lobes[k].shininess, f->plan->scene->light_count);
        ratio = shd_larger(
            ratio, e->ratio + (isfinite(e->turned_ratio) ? direction * e->turned_ratio : 0));
    }
    return ratio;
}

/* The sum over an object's lights at one of its pieces. `shares` is memory. */
static void add_piece(const finding *f, size_t index, const shd_piece *piece, double ratio,
                      const shd_parts *parts, share *shares) {
    const shd_plan *plan = f->plan;
    const shd_plan_object *object = &plan->objects[index];
    const shd_plan_material *material = &plan->materials[object->material];
    shd_excess sum = {.parts = *parts, .ratio = ratio, .distance = f->distance};
    memcpy(sum.floor, material->constant, sizeof sum.floor);
    memcpy(sum.base, material->constant, sizeof sum.base);
    for (int c = 0; c < 3; c++) sum.most[c] = fabs(material->constant[c]);
    static const double white[3] = {1, 1, 1};
    tints colors = {.count = 0};
    add_tint(&colors, material->constant, white, 1, 1);
    size_t count = 0;
    double main[3] = {0, 0, 0}, total = 0;
    for (size_t i = 0; i < object->light_count; i++) {
        const shd_plan_light *light = &plan->lights[object->lights[i]];
        shd_lit lit;
        if (!shd_piece_lit(plan->scene, piece, light, f->least[i], &lit)) continue;
        const share s = shares[count++] = share_of(f, object, material, light, &lit, &colors);
        for (int c = 0; c < 3; c++) {
            sum.base[c] += s.base[c];
            sum.floor[c] += s.low[c];
            sum.most[c] += s.high[c];
            main[c] += s.absolute[c] + s.limited[c];
        }
    }
    sum.gain = *parts;
    if (colors.count <= MOST_TINTS && !parts->negative) {
        sum.gain = NO_PARTS;
        for (size_t i = 0; i < colors.count; i++)
            if (colors.list[i].high > colors.list[i].low) note_part(&sum.gain, colors.list[i].part);
    }
    for (int c = 0; c < 3 && colors.count && colors.count <= MOST_TINTS && !parts->negative; c++) {
        sum.parts.least[c] = extreme_part(&colors, c, -1) - 1e-9;
        sum.parts.most[c] = extreme_part(&colors, c, 1) + 1e-9;
    }
    bool fresh;
    sum.material = object->material;
    sum.dark = step_of(sum.floor);
    sum.bright = step_of(sum.most);
    shd_excess *to = slot_of(f, &sum, &fresh);
    for (int c = 0; c < 3; c++) total += main[c];
    for (int c = 0; c < 3; c++)
        sum.main[c] = !fresh ? to->main[c] : total > 0 && isfinite(total) ? main[c] / total : 0;
    for (size_t i = 0; i < count; i++) add_error(&sum, shares[i].absolute, shares[i].limited);
    double worst = 0;
    for (int c = 0; c < 3; c++)
        worst = shd_larger(worst, sum.absolute[c] + sum.limited[c] + f->color * sum.most[c]);
    if (!(worst >= 0)) worst = INFINITY; /* not a number */
    f->list->worst = shd_larger(f->list->worst, worst);
    take_larger(f->list->most, sum.most, 3);
    if (fresh)
        *to = sum;
    else
        merge(to, &sum);
}

/* How finely objects are looked at. Of the pieces of a solid about half may be seen. */
static int fineness_of(const shd_plan *plan) {
    double pairs = 0;
    for (size_t i = 0; i < plan->scene->object_count; i++)
        pairs += (double)plan->objects[i].light_count;
    int fineness = 3;
    while (fineness > 0 && 3 * fineness * fineness * pairs > MOST_LOOKS) fineness--;
    return fineness;
}

static bool add_objects(const finding *f, shd_arena *arena) {
    const shd_plan *plan = f->plan;
    const shd_scene *scene = plan->scene;
    share *shares = shd_arena_alloc(arena, plan->light_count, sizeof *shares);
    shd_parts *parts = shd_arena_alloc(arena, plan->group_count, sizeof *parts);
    if (!shares || !parts) return false;
    shd_parts all = NO_PARTS;
    size_t pairs = 0;
    for (size_t g = 0; g < plan->group_count; g++) {
        pairs += plan->groups[g].light_count;
        parts[g] = NO_PARTS;
        if (pairs <= MOST_PAIRS) parts[g] = parts_of(plan, &plan->groups[g]);
        if (pairs > MOST_PAIRS) parts[g].negative = true;
        add_parts(&all, &parts[g]);
    }
    if (!scene->transparent) {
        note_part(&all, scene->background);
        for (int c = 0; c < 3; c++) {
            const double most = fabs(scene->background[c]);
            f->list->most[c] = most;
            f->list->worst = shd_larger(f->list->worst, f->color * most);
        }
    }
    pairs = 0;
    for (size_t i = 0; i < scene->object_count; i++) {
        const shd_plan_object *object = &plan->objects[i];
        pairs += object->light_count;
        shd_place place = shd_place_of(&scene->objects[i], object);
        place.known = place.known && pairs <= MOST_PAIRS;
        for (size_t k = 0; k < object->light_count; k++) {
            const shd_plan_light *light = &plan->lights[object->lights[k]];
            f->least[k] = light->directional ? 0 : shd_least_distance(&place, light->position);
        }
        const double ratio = find_lobes(f, &plan->materials[object->material]);
        const size_t count = shd_plan_pieces(scene, i, object, f->fineness, f->pieces);
        for (size_t p = 0; p < count; p++)
            add_piece(f, i, &f->pieces[p], ratio, &parts[object->group], shares);
    }
    finish_parts(f, &all);
    return true;
}

static double distance_error(shd_tier tier) {
    return shd_path_error_of(tier, SHD_PATH_ATTENUATED)->relative +
           (tier == SHD_EXACT ? 0 : 2 * MOVED);
}

bool shd_excess_find(const shd_plan *plan, shd_tier tier, shd_arena *arena, shd_excess_list *out) {
    *out = (shd_excess_list){.grey = plan->grey};
    /* Facets mix colors of one piece, which are all in its range. */
    const bool mixed = plan->scene->raster.samples > 1;
    const finding f = {.plan = plan,
                       .tier = tier,
                       .color = shd_color_error(tier),
                       .distance = distance_error(tier),
                       .list = out,
                       .pieces = shd_arena_alloc(arena, SHD_MOST_PIECES, sizeof(shd_piece)),
                       .least = shd_arena_alloc(arena, plan->light_count, sizeof(double)),
                       .lobes = shd_arena_alloc(arena, plan->max_lobes, sizeof(shd_lobe_error)),
                       .fineness = fineness_of(plan),
                       .mixed = mixed};
    out->color = out->rounding = f.color;
    out->mixed = mixed;
    return f.pieces && f.least && f.lobes && add_objects(&f, arena);
}

bool shd_plan_influences(const shd_plan *plan, shd_arena *arena, shd_influences *out) {
    const shd_scene *scene = plan->scene;
    const size_t lights = plan->light_count, fineness = (size_t)fineness_of(plan);
    /* Rows of pieces where these are few, else one of the most that each light adds anywhere. */
    const size_t most_rows = fineness ? SHD_MOST_PIECES * scene->object_count : 1;
    shd_piece *pieces = shd_arena_alloc(arena, SHD_MOST_PIECES, sizeof *pieces);
    out->rows = 0;
    out->most = shd_arena_zalloc(arena, most_rows * lights, sizeof *out->most);
    if (!pieces || !out->most) return false;
    size_t pairs = 0;
    for (size_t i = 0; i < scene->object_count; i++) {
        const shd_plan_object *object = &plan->objects[i];
        const shd_plan_material *material = &plan->materials[object->material];
        pairs += object->light_count;
        shd_place place = shd_place_of(&scene->objects[i], object);
        place.known = place.known && pairs <= MOST_PAIRS;
        const size_t count = shd_plan_pieces(scene, i, object, (int)fineness, pieces);
        for (size_t p = 0; p < count && object->light_count; p++) {
            double *row = out->most + (fineness ? out->rows : 0) * lights;
            for (size_t k = 0; k < object->light_count; k++) {
                const uint32_t j = object->lights[k];
                const shd_plan_light *light = &plan->lights[j];
                const double least =
                    light->directional ? 0 : shd_least_distance(&place, light->position);
                row[j] =
                    shd_larger(row[j], shd_piece_most(scene, &pieces[p], material, light, least));
            }
            out->rows = fineness ? out->rows + 1 : 1;
        }
    }
    return true;
}
