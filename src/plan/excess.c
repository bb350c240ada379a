/* Errors of colors, summed over each object's lights. */
#include <string.h>

#include "plan/bound.h"
#include "plan/parts.h"

/* Pairs of objects and lights that are looked at one by one: beyond, only the spheres
 * around objects are, and pictures count as having colors of any kind. */
enum { MOST_PAIRS = 1 << 20 };

/* Rounding of a position in f32, in the frame's unit: half an ulp below 2 in three coordinates.
 * A light's, whose coordinates may be larger, grows with them. */
static const double POSITION = 1.1e-7;

typedef struct finding {
    const shd_plan *plan;
    shd_tier tier;
    const shd_tier_error *error;
    shd_excess_list *list;
} finding;

/* A light at an object: what multiplies its color, at most, and errors that geometry adds. */
typedef struct influence {
    double factor;   /* largest f s */
    double position; /* relative error of distances and error of directions */
    double spot;     /* absolute error of s */
} influence;

static double spot_error(const finding *f, const shd_plan_light *light, double position) {
    if (!light->spot || light->steep || f->tier == SHD_EXACT) return 0;
    const double direction = f->error->direction + position;
    double error = 0;
    if (light->outer > light->inner)
        error = 1.5 * (sqrt(2 * light->outer) * direction + 2e-7 * light->outer) /
                (light->outer - light->inner);
    if (light->exponent > 0) error += shd_specular_error(f->tier, light->exponent, position);
    return fmin(error, 1);
}

static influence influence_of(const finding *f, const shd_plan_object *object,
                              const shd_place *place, const shd_plan_light *light) {
    const shd_plan *plan = f->plan;
    influence in = {light->gain, 0, 0};
    if (light->directional) return in;
    const double distance = shd_least_distance(place, light->position);
    if (light->attenuated) {
        double d = fmax(distance, light->min_distance);
        in.factor /= light->a + d * (light->b + d * light->c);
        if (!(in.factor < 1e200)) in.factor = 1e200; /* as the kernels hold it */
    }
    if (f->tier != SHD_EXACT && !plan->split_positions) {
        /* On a plane coordinates grow with the distance. */
        double size = shd_plan_size(plan, object, light) / (distance * plan->scale);
        in.position = POSITION * (object->bounded ? size : 1 + size);
        if (!light->directional) {
            const double far = shd_length(shd_sub(light->position, plan->origin));
            in.position += POSITION / 2 * far / distance;
        }
    }
    if (!(in.position < 1)) in.position = 1;
    in.spot = spot_error(f, light, in.position);
    return in;
}

/* The light's part of the two errors, as colors. */
static void add_light(const finding *f, const shd_plan_material *material,
                      const shd_plan_light *light, const influence *in, double absolute[3],
                      double limited[3], double reach[3]) {
    const shd_tier_error *e = f->error;
    const double shift = light->attenuated ? 3 : 1; /* of N.L, and of distance squared */
    for (int c = 0; c < 3; c++) {
        const double color = in->factor * fabs(light->color[c]), kd = fabs(material->diffuse[c]);
        double a = kd * (e->absolute + shift * in->position + in->spot), b = kd * e->relative,
               all = kd;
        for (size_t k = 0; k < material->lobe_count; k++) {
            const double ks = fabs(material->lobes[k].specular[c]);
            double lobe = shd_specular_error(f->tier, material->lobes[k].shininess, in->position);
            a += ks * (e->faint + in->spot);
            b += ks * fmin(lobe, 1);
            all += ks;
        }
        absolute[c] = color * a;
        limited[c] = color * b;
        reach[c] = color * all;
    }
}

/* ---- Colors that there are. ---- */

static bool is_negative(const double color[3]) {
    return color[0] < 0 || color[1] < 0 || color[2] < 0;
}

static void note_part(shd_excess_list *list, const double color[3]) {
    double sum = color[0] + color[1] + color[2];
    if (is_negative(color)) list->nonnegative = false;
    if (!(sum > 0) || !isfinite(sum)) return;
    for (int c = 0; c < 3; c++) {
        list->least_part[c] = fmin(list->least_part[c], color[c] / sum);
        list->most_part[c] = fmax(list->most_part[c], color[c] / sum);
    }
}

static void note_product(shd_excess_list *list, const double a[3], const double b[3]) {
    if (is_negative(a) || is_negative(b)) list->nonnegative = false;
    const double color[3] = {a[0] * b[0], a[1] * b[1], a[2] * b[2]};
    note_part(list, color);
}

static void note_colors(const finding *f) {
    const shd_plan *plan = f->plan;
    const shd_scene *scene = plan->scene;
    shd_excess_list *list = f->list;
    size_t pairs = 0;
    for (int c = 0; c < 3; c++) {
        list->least_part[c] = INFINITY;
        list->most_part[c] = 0;
        list->most[c] = scene->transparent ? 0 : fabs(scene->background[c]);
    }
    if (!scene->transparent) note_part(list, scene->background);
    for (size_t g = 0; g < plan->group_count; g++) {
        const shd_plan_group *group = &plan->groups[g];
        const shd_plan_material *material = &plan->materials[group->material];
        note_part(list, material->constant);
        pairs += group->light_count;
        if (pairs > MOST_PAIRS) list->nonnegative = false;
        for (size_t i = 0; i < group->light_count && pairs <= MOST_PAIRS; i++) {
            const shd_plan_light *light = &plan->lights[group->lights[i]];
            note_product(list, light->color, material->diffuse);
            for (size_t k = 0; k < material->lobe_count; k++)
                note_product(list, light->color, material->lobes[k].specular);
        }
    }
    for (int c = 0; c < 3; c++)
        if (!(list->least_part[c] <= list->most_part[c])) /* all is black */
            list->least_part[c] = list->most_part[c] = 1.0 / 3;
}

/* ---- Objects. ---- */

/* Sums over the lights of one object, with regard to a main direction. */
static void sum_lights(const finding *f, size_t index, const shd_place *place, const double main[3],
                       shd_excess *sum, double most[3]) {
    const shd_plan *plan = f->plan;
    const shd_plan_object *object = &plan->objects[index];
    const shd_plan_material *material = &plan->materials[object->material];
    for (size_t i = 0; i < object->light_count; i++) {
        const shd_plan_light *light = &plan->lights[object->lights[i]];
        const influence in = influence_of(f, object, place, light);
        double a[3], b[3], reach[3];
        add_light(f, material, light, &in, a, b, reach);
        const double a_main = main ? a[0] + a[1] + a[2] : 0, b_main = main ? b[0] + b[1] + b[2] : 0;
        sum->main_absolute += a_main;
        sum->main_limited += b_main;
        for (int c = 0; c < 3; c++) {
            sum->absolute[c] += a[c];
            sum->limited[c] += b[c];
            most[c] += reach[c];
            if (!main) continue;
            sum->rest_absolute[c] += fabs(a[c] - a_main * main[c]);
            sum->rest_limited[c] += fabs(b[c] - b_main * main[c]);
        }
    }
    sum->ratio = f->error->relative;
    for (size_t k = 0; k < material->lobe_count; k++)
        sum->ratio = fmax(sum->ratio, shd_specular_ratio(f->tier, material->lobes[k].shininess,
                                                         2 * POSITION / 0.05));
}

/* The direction of an object's errors. */
static void find_main(const shd_excess *sum, double main[3]) {
    double total = 0;
    for (int c = 0; c < 3; c++) total += sum->absolute[c] + sum->limited[c];
    for (int c = 0; c < 3; c++)
        main[c] = total > 0 && isfinite(total) ? (sum->absolute[c] + sum->limited[c]) / total : 0;
}

static void take_larger(double *to, const double *from, size_t count) {
    for (size_t i = 0; i < count; i++) to[i] = fmax(to[i], from[i]);
}

/* The larger of both, in everything; their main directions are the same. */
static void merge(shd_excess *to, const shd_excess *from) {
    take_larger(to->absolute, from->absolute, 3);
    take_larger(to->limited, from->limited, 3);
    take_larger(to->rest_absolute, from->rest_absolute, 3);
    take_larger(to->rest_limited, from->rest_limited, 3);
    to->main_absolute = fmax(to->main_absolute, from->main_absolute);
    to->main_limited = fmax(to->main_limited, from->main_limited);
    to->ratio = fmax(to->ratio, from->ratio);
    for (int c = 0; c < 3; c++) to->floor[c] = fmin(to->floor[c], from->floor[c]);
}

/* Every object's errors go to its material's slot. */
static bool add_objects(const finding *f, shd_arena *arena) {
    const shd_plan *plan = f->plan;
    const shd_scene *scene = plan->scene;
    shd_excess_list *list = f->list;
    int8_t *slots = shd_arena_alloc(arena, scene->material_count, sizeof *slots);
    if (!slots) return false;
    memset(slots, -1, scene->material_count);
    size_t pairs = 0;
    for (size_t i = 0; i < scene->object_count; i++) {
        const shd_plan_object *object = &plan->objects[i];
        const shd_plan_material *material = &plan->materials[object->material];
        pairs += object->light_count;
        shd_place place = shd_place_of(&scene->objects[i], object);
        place.known = place.known && pairs <= MOST_PAIRS;
        shd_excess sum = {.ratio = 0};
        double most[3] = {0, 0, 0};
        memcpy(sum.floor, material->constant, sizeof sum.floor);
        for (int c = 0; c < 3; c++) most[c] = fabs(material->constant[c]);

        int8_t *slot = &slots[object->material];
        const bool first = *slot < 0;
        if (first) *slot = (int8_t)(list->count < SHD_EXCESSES ? list->count : SHD_EXCESSES - 1);
        shd_excess *to = &list->excess[*slot];
        const bool fresh = (size_t)*slot == list->count;
        if (fresh) {
            double unused[3] = {0, 0, 0};
            shd_excess draft = {.ratio = 0};
            sum_lights(f, i, &place, NULL, &draft, unused);
            find_main(&draft, sum.main);
        } else {
            memcpy(sum.main, to->main, sizeof sum.main);
        }
        sum_lights(f, i, &place, sum.main, &sum, most);
        if (fresh)
            list->excess[list->count++] = sum;
        else
            merge(to, &sum);
        take_larger(list->most, most, 3);
    }
    return true;
}

void shd_plan_influences(const shd_plan *plan, double *most) {
    const finding f = {plan, SHD_EXACT, shd_tier_error_of(SHD_EXACT), NULL};
    for (size_t j = 0; j < plan->light_count; j++) most[j] = 0;
    size_t pairs = 0;
    for (size_t i = 0; i < plan->scene->object_count; i++) {
        const shd_plan_object *object = &plan->objects[i];
        const shd_plan_material *material = &plan->materials[object->material];
        pairs += object->light_count;
        shd_place place = shd_place_of(&plan->scene->objects[i], object);
        place.known = place.known && pairs <= MOST_PAIRS;
        for (size_t k = 0; k < object->light_count; k++) {
            const uint32_t j = object->lights[k];
            const influence in = influence_of(&f, object, &place, &plan->lights[j]);
            double a[3], b[3], reach[3];
            add_light(&f, material, &plan->lights[j], &in, a, b, reach);
            for (int c = 0; c < 3; c++) most[j] = fmax(most[j], reach[c]);
        }
    }
}

bool shd_excess_find(const shd_plan *plan, shd_tier tier, shd_arena *arena, shd_excess_list *out) {
    *out = (shd_excess_list){.nonnegative = true, .grey = plan->grey};
    const finding f = {plan, tier, shd_tier_error_of(tier), out};
    out->color = f.error->color;
    note_colors(&f);
    return add_objects(&f, arena);
}
