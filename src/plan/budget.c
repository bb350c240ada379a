/* The tier, and what may be left out under a budget. */
#include <math.h>
#include <stdlib.h>

#include "plan/cost.h"
#include "plan/terms.h"

/* Of what the tier's own error leaves of a budget, to lights of the whole picture; the rest goes to
 * lights of tiles. */
static const double PICTURE_SHARE = 0.3;

/* Curves are steep in the dark and flat in the light: there an error may grow with the light. This
 * much of the room is for the dark. */
static const double DARK_SHARE = 0.9;

/* In a list without it. */
static void count_left_out(const shd_plan *plan, shd_excess_list *list) {
    list->more = plan->drop_tolerance + plan->dropped;
    list->color = list->rounding + plan->drop_relative;
}

bool shd_plan_excess(const shd_plan *plan, shd_tier tier, shd_arena *arena, shd_excess_list *out) {
    if (!shd_excess_find(plan, tier, arena, out, NULL)) return false;
    count_left_out(plan, out);
    return true;
}

bool shd_plan_bound(const shd_plan *plan, shd_tier tier, const shd_shown *shown, shd_arena *arena,
                    shd_bound *out) {
    shd_excess_list list;
    if (!shd_plan_excess(plan, tier, arena, &list)) return false;
    *out = shd_bound_of(&list, shown, shown ? plan->scene->output_count : 0, tier);
    return true;
}

bool shd_plan_meets_budget(const shd_plan *plan) {
    const shd_accuracy *accuracy = &plan->scene->accuracy;
    return shd_bound_in(&plan->bound, accuracy->metric) <= accuracy->max_error;
}

static bool is_within(const shd_plan *plan, const shd_shown *shown, const shd_excess_list *list,
                      shd_tier tier) {
    const shd_accuracy *accuracy = &plan->scene->accuracy;
    if (accuracy->metric == SHD_LINEAR) return shd_bound_linear(list) <= accuracy->max_error;
    if (tier == SHD_EXACT && list->more == 0) return true; /* it is the picture in question */
    for (size_t o = 0; shown && o < plan->scene->output_count; o++) {
        const double most = accuracy->max_error;
        const double bound = accuracy->metric == SHD_CODE
                                 ? shd_bound_code(list, &shown[o])
                                 : shd_bound_delta_e(list, &shown[o], most);
        if (!(bound <= most)) return false;
    }
    return shown;
}

/* The most that `value`, `more` or `color` of the list, may be, to a factor of 1.2. */
static double find_room(const shd_plan *plan, const shd_shown *shown, shd_excess_list *list,
                        shd_tier tier, double *value) {
    const double begin = *value;
    double low = 1e-9, high = 16;
    *value = begin + low;
    if (!is_within(plan, shown, list, tier)) low = 0;
    while (low > 0 && high / low > 1.2 && !shd_is_cancelled(plan->cancelled)) {
        double middle = sqrt(low * high);
        *value = begin + middle;
        *(is_within(plan, shown, list, tier) ? &low : &high) = middle;
    }
    *value = begin;
    return low;
}

/* What a tier within the budget leaves of it. */
static void share_room(shd_plan *plan, const shd_shown *shown, shd_excess_list *list, shd_tier tier,
                       double *lights) {
    double room = find_room(plan, shown, list, tier, &list->more);
    if (plan->scene->accuracy.metric != SHD_LINEAR) {
        room *= DARK_SHARE;
        list->more = room;
        /* What is seen is no less than what is sure to be seen only where light adds up. */
        if (list->nonnegative && plan->light_count > 1)
            plan->drop_relative = find_room(plan, shown, list, tier, &list->color);
    }
    *lights = room;
}

typedef struct weak {
    double most;
    uint32_t light;
} weak;

static int compare_weak(const void *a, const void *b) {
    const weak *x = a, *y = b;
    if (x->most != y->most) return x->most < y->most ? -1 : 1;
    return x->light < y->light ? -1 : 1;
}

/* Drops the weakest lights, as long as they add no more than `room` together, wherever that is.
 * False: memory. */
static bool drop_weakest(shd_plan *plan, double room, const shd_influences *in, uint8_t *drops,
                         bool *dropped, shd_arena *arena) {
    const size_t lights = plan->light_count;
    weak *order = shd_arena_zalloc(arena, lights, sizeof *order);
    double *sums = shd_arena_zalloc(arena, in->count, sizeof *sums);
    if (!order || !sums) return false;
    size_t some = 0;
    for (size_t r = 0; r < in->count; r++)
        for (size_t j = 0; j < lights; j++)
            order[j].most = shd_larger(in->rows[r][j], order[j].most);
    for (size_t j = 0; j < lights; j++)
        if (order[j].most <= room) order[some++] = (weak){order[j].most, (uint32_t)j};
    qsort(order, some, sizeof *order, compare_weak);
    for (size_t k = 0; k < some; k++) {
        const uint32_t j = order[k].light;
        bool fits = true;
        for (size_t r = 0; r < in->count && fits; r++) fits = sums[r] + in->rows[r][j] <= room;
        if (!fits) continue;
        for (size_t r = 0; r < in->count; r++) {
            sums[r] += in->rows[r][j];
            plan->dropped = fmax(plan->dropped, sums[r]);
        }
        drops[plan->lights[j].index] |= SHD_DROP_BUDGET;
        *dropped = true;
    }
    return true;
}

/* The best that there is, for the message. */
static shd_status fail_budget(const shd_plan *plan, const shd_shown *shown, shd_arena *arena,
                              shd_error *error) {
    const shd_accuracy *accuracy = &plan->scene->accuracy;
    shd_bound bound;
    if (!shd_plan_bound(plan, SHD_EXACT, shown, arena, &bound)) return SHD_MEMORY;
    double reached = shd_bound_in(&bound, accuracy->metric);
    if (!isfinite(reached))
        return shd_fail(error, SHD_SCENE, "/accuracy/maxError",
                        "no bound in %s is known for this scene: " SHD_NO_LINEAR_BOUND,
                        shd_metric_names[accuracy->metric]);
    char told[SHD_BOUND_TEXT];
    shd_print_bound(reached, INFINITY, told);
    return shd_fail(error, SHD_SCENE, "/accuracy/maxError",
                    "no tier stays within %.9g %s in this scene: `exact` reaches %s",
                    accuracy->max_error, shd_metric_names[accuracy->metric], told);
}

static shd_status meet_budget(shd_plan *plan, const shd_shown *shown, const shd_kernel_cost *costs,
                              uint8_t *drops, bool *dropped, shd_arena *arena, shd_error *error) {
    shd_tier ranked[SHD_EXACT + 1];
    shd_plan_rank_tiers(plan, costs, ranked);
    for (int k = 0; k <= SHD_EXACT; k++) {
        const shd_tier tier = ranked[k];
        shd_excess_list list;
        shd_influences influences;
        if (!shd_excess_find(plan, tier, arena, &list, &influences)) return SHD_MEMORY;
        if (!is_within(plan, shown, &list, tier)) continue;
        plan->tier = tier;
        double left = 0;
        /* Of the exact tier's error nothing should be left to doubt. */
        if (tier != SHD_EXACT) share_room(plan, shown, &list, tier, &left);
        if (tier != SHD_EXACT &&
            !drop_weakest(plan, PICTURE_SHARE * left, &influences, drops, dropped, arena))
            return SHD_MEMORY;
        plan->drop_tolerance = plan->light_count > 1 ? left - plan->dropped : 0;
        count_left_out(plan, &list);
        plan->bound = shd_bound_of(&list, shown, shown ? plan->scene->output_count : 0, tier);
        return SHD_OK;
    }
    return fail_budget(plan, shown, arena, error);
}

shd_status shd_plan_choose(shd_plan *plan, const shd_shown *shown, const shd_kernel_cost *costs,
                           uint8_t *drops, bool *dropped, shd_arena *arena, shd_error *error) {
    const shd_accuracy *accuracy = &plan->scene->accuracy;
    *dropped = false;
    if (accuracy->budget) return meet_budget(plan, shown, costs, drops, dropped, arena, error);
    plan->tier = accuracy->tier;
    return shd_plan_bound(plan, plan->tier, shown, arena, &plan->bound) ? SHD_OK : SHD_MEMORY;
}
