/* The tier, and what may be left out under a budget. */
#include <math.h>
#include <stdlib.h>

#include "bound/shown/shown.h"
#include "plan/parts.h"

/* The share of lights of the whole picture in what the tier's own error leaves of a budget. The
 * rest is for lights of tiles. */
static const double PICTURE_SHARE = 0.3;

/* Curves are steep in the dark and flat in the light, where an error may grow with the light. This
 * share of the room is for the dark. */
static const double DARK_SHARE = 0.9;

static bool is_in_budget(const shd_choice *choice) {
    const shd_accuracy *accuracy = &choice->plan->scene->accuracy;
    return shd_bound_in(&choice->bound, accuracy->metric) <= accuracy->max_error;
}

/* The worst of all outputs. */
static shd_bound bound_of(const shd_plan *plan, shd_tier tier, const shd_shown *shown,
                          const shd_excess_list *list) {
    shd_bound bound = {shd_bound_linear(list), 0, 0};
    if (tier == SHD_EXACT && list->more == 0) return bound; /* it is the picture in question */
    if (!shown || !plan->scene->output_count) bound.code = bound.delta_e = INFINITY;
    for (size_t i = 0; shown && i < plan->scene->output_count; i++) {
        bound.code = fmax(bound.code, shd_bound_code(list, &shown[i]));
        bound.delta_e = fmax(bound.delta_e, shd_bound_delta_e(list, &shown[i], 0));
    }
    return bound;
}

static void set_bound(shd_choice *choice, const shd_shown *shown, shd_excess_list *list) {
    shd_excess_leave_out(list, choice->drop_tolerance + choice->dropped, choice->drop_relative);
    choice->bound = bound_of(choice->plan, choice->tier, shown, list);
}

/* False: memory. */
static bool find_bound(shd_choice *choice, const shd_shown *shown, shd_arena *arena) {
    shd_excess_list list;
    if (!shd_excess_find(choice->plan, choice->tier, arena, &list, NULL)) return false;
    set_bound(choice, shown, &list);
    return true;
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

/* The most that may come on top of `value` (`more` or `color` of the list), to a factor of 1.2. */
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

/* Shares what a tier leaves of the budget: sets drop_relative, and returns the absolute part. */
static double share_room(shd_choice *choice, const shd_shown *shown, shd_excess_list *list) {
    const shd_plan *plan = choice->plan;
    double room = find_room(plan, shown, list, choice->tier, &list->more);
    if (plan->scene->accuracy.metric != SHD_LINEAR) {
        room *= DARK_SHARE;
        list->more = room;
        /* All that is seen is no less than a part of it only if light adds up. */
        if (list->nonnegative && plan->light_count > 1)
            choice->drop_relative = find_room(plan, shown, list, choice->tier, &list->color);
    }
    return room;
}

typedef struct weak_light {
    double most;
    uint32_t light;
} weak_light;

static int compare_weak(const void *a, const void *b) {
    const weak_light *x = a, *y = b;
    if (x->most != y->most) return x->most < y->most ? -1 : 1;
    return x->light < y->light ? -1 : 1;
}

/* Drops the weakest lights, as long as together they add no more than `room` anywhere. `drops`:
 * [light_count]. *dropped: the most that they add. *some: whether there are any. False: memory. */
static bool drop_weakest(const shd_plan *plan, double room, const shd_influences *in, bool *drops,
                         double *dropped, bool *some, shd_arena *arena) {
    const size_t lights = plan->light_count;
    weak_light *order = shd_arena_zalloc(arena, lights, sizeof *order);
    double *sums = shd_arena_zalloc(arena, in->count, sizeof *sums);
    if (!order || !sums) return false;
    size_t count = 0;
    for (size_t r = 0; r < in->count; r++)
        for (size_t j = 0; j < lights; j++)
            order[j].most = shd_larger(in->rows[r][j], order[j].most);
    for (size_t j = 0; j < lights; j++)
        if (order[j].most <= room) order[count++] = (weak_light){order[j].most, (uint32_t)j};
    qsort(order, count, sizeof *order, compare_weak);
    for (size_t k = 0; k < count; k++) {
        const uint32_t j = order[k].light;
        bool fits = true;
        for (size_t r = 0; r < in->count && fits; r++) fits = sums[r] + in->rows[r][j] <= room;
        if (!fits) continue;
        for (size_t r = 0; r < in->count; r++) {
            sums[r] += in->rows[r][j];
            *dropped = fmax(*dropped, sums[r]);
        }
        drops[j] = *some = true;
    }
    return true;
}

/* Chooses what a tier leaves out that meets the budget. `list` is its excess. False: memory. */
static bool leave_out(shd_choice *choice, const shd_shown *shown, shd_excess_list *list,
                      const shd_influences *influences, shd_arena *arena) {
    const shd_plan *draft = choice->plan;
    bool *drops = shd_arena_zalloc(arena, draft->light_count, sizeof *drops), some = false;
    const double room = share_room(choice, shown, list);
    if (!drops || !drop_weakest(draft, PICTURE_SHARE * room, influences, drops, &choice->dropped,
                                &some, arena))
        return false;
    choice->drop_tolerance = draft->light_count > 1 ? room - choice->dropped : 0;
    if (!some) {
        set_bound(choice, shown, list);
        return true;
    }
    if (!shd_plan_without(draft, drops, arena, &choice->plan) || !find_bound(choice, shown, arena))
        return false;
    if (is_in_budget(choice)) return true;
    /* With fewer lights, pieces are other ones. Those of all lights do have the room. */
    choice->plan = draft;
    choice->drop_tolerance += choice->dropped;
    choice->dropped = 0;
    return find_bound(choice, shown, arena);
}

/* Fails with the best bound that there is. */
static shd_status fail_budget(const shd_plan *draft, const shd_shown *shown, shd_arena *arena,
                              shd_error *error) {
    const shd_accuracy *accuracy = &draft->scene->accuracy;
    shd_choice exact = {.plan = draft, .tier = SHD_EXACT};
    if (!find_bound(&exact, shown, arena)) return SHD_MEMORY;
    double reached = shd_bound_in(&exact.bound, accuracy->metric);
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

static shd_status meet_budget(shd_choice *choice, const shd_shown *shown,
                              const shd_kernel_cost *costs, shd_arena *arena, shd_error *error) {
    const shd_plan *draft = choice->plan;
    shd_tier ranked[SHD_EXACT + 1];
    shd_plan_rank_tiers(draft, costs, ranked);
    for (int k = 0; k <= SHD_EXACT; k++) {
        shd_excess_list list;
        shd_influences influences;
        choice->tier = ranked[k];
        if (!shd_excess_find(draft, choice->tier, arena, &list, &influences)) return SHD_MEMORY;
        if (!is_within(draft, shown, &list, choice->tier)) continue;
        /* The exact tier leaves nothing out. */
        if (choice->tier == SHD_EXACT)
            set_bound(choice, shown, &list);
        else if (!leave_out(choice, shown, &list, &influences, arena))
            return SHD_MEMORY;
        return SHD_OK;
    }
    return fail_budget(draft, shown, arena, error);
}

shd_status shd_choose(const shd_plan *draft, const shd_shown *shown, const shd_kernel_cost *costs,
                      shd_arena *arena, shd_choice *out, shd_error *error) {
    const shd_accuracy *accuracy = &draft->scene->accuracy;
    shd_choice choice = {.plan = draft, .tier = accuracy->tier};
    shd_status status = SHD_OK;
    if (accuracy->budget)
        status = meet_budget(&choice, shown, costs, arena, error);
    else if (!find_bound(&choice, shown, arena))
        status = SHD_MEMORY;
    if (status == SHD_OK) *out = choice;
    return status;
}
