/* The tier, and what may be left out under a budget. */
#include <stdlib.h>

#include "bound/light/brightest.h"
#include "bound/light/extended.h"
#include "bound/shown/shown.h"

/* The share of lights of the whole picture in what the tier's own error leaves of a budget. The
 * rest is for lights of tiles. */
static const double PICTURE_SHARE = 0.3;

/* Curves are steep in the dark and flat in the light, where an error may grow with the light. This
 * share of the room is for the dark. The quarter that it leaves lets errors in the light be some
 * two thirds of what they might be at the most. */
static const double DARK_SHARE = 0.75;

/* Whether what the list is of is the picture that codes are measured against. */
static bool is_exact(const shd_choice *choice, const shd_excess_list *list) {
    return choice->tier == SHD_EXACT && list->more == 0;
}

/* Whether environments are all that the plan sums otherwise than the exact tier does. Then both
 * have the same points, and differ by their sums alone; CIEDE2000 has no use for shares. */
static bool differs_by_sums(const shd_plan *plan, shd_metric metric, double *share) {
    *share = 0;
    if (!plan->glows || plan->point_off > 0 || shd_has_models32(plan)) return false;
    *share = metric == SHD_CODE ? shd_quick_share(plan) : -1;
    return *share >= 0;
}

/* How far a plan with points for shapes (point_off), with tables of environments, or with models in
 * f32, is off the exact tier's picture, which has shapes, quadrature and f64: each is within its
 * bound of the model. Channels may err any way, of any colors up to the brightest. */
static void compare_points(const shd_plan *plan, shd_metric metric, shd_excess_list *out) {
    static const shd_parts any = {{0, 0, 0}, {1, 1, 1}};
    shd_plan shapes = *plan;
    shapes.point_off = 0;
    shapes.glows = NULL;
    shapes.tier = SHD_EXACT;
    *out = (shd_excess_list){.count = 1, .mixed = plan->scene->raster.samples > 1};
    double share;
    if (differs_by_sums(plan, metric, &share)) {
        out->more = shd_sums_error(plan) + shd_sums_error(&shapes);
        out->color = share;
        out->nonnegative = share > 0;
    } else {
        out->more = shd_extended_error(plan) + shd_extended_error(&shapes);
    }
    shd_excess *e = &out->excess[0];
    e->parts = e->gain = any;
    const double most = shd_brightest(plan) + out->more;
    for (int c = 0; c < 3; c++) e->most[c] = out->most[c] = most;
}

/* The bound of it in codes, or in CIEDE2000: `enough` as in shd_bound_delta_e. */
static double shown_off(const shd_plan *plan, const shd_shown *shown, shd_metric metric,
                        double enough) {
    if (!(plan->point_off > 0) && !plan->glows && !shd_has_models32(plan)) return 0;
    shd_excess_list list;
    double worst = 0;
    compare_points(plan, metric, &list);
    const size_t outputs = shown ? plan->scene->output_count : 0;
    if (!outputs || !isfinite(list.most[0])) return INFINITY;
    for (size_t o = 0; o < outputs; o++)
        worst = fmax(worst, metric == SHD_CODE ? shd_bound_code(&list, &shown[o])
                                               : shd_bound_delta_e(&list, &shown[o], enough));
    return worst;
}

/* The plan as it was chosen so far. */
static shd_plan chosen_plan(const shd_choice *choice) {
    shd_plan plan = *choice->plan;
    plan.tier = choice->tier;
    plan.point_off = choice->point_off;
    if (choice->by_quadrature) plan.glows = NULL;
    return plan;
}

/* The worst of all outputs. */
static void set_bound(shd_choice *choice, const shd_shown *shown, shd_excess_list *list) {
    const size_t outputs = choice->plan->scene->output_count;
    shd_bound *bound = &choice->bound;
    if (shd_errs_otherwise(choice->plan)) {
        const shd_plan plan = chosen_plan(choice);
        *bound = (shd_bound){shd_extended_error(&plan), shown_off(&plan, shown, SHD_CODE, 0),
                             shown_off(&plan, shown, SHD_DELTA_E_2000, 0)};
        return;
    }
    shd_excess_leave_out(list,
                         choice->drop_tolerance + choice->dropped + choice->mean_room.absolute,
                         choice->drop_relative + choice->mean_room.relative);
    *bound = (shd_bound){shd_bound_linear(list), 0, 0};
    if (is_exact(choice, list)) return;
    if (!shown || !outputs) bound->code = bound->delta_e = INFINITY;
    for (size_t i = 0; shown && i < outputs; i++) {
        bound->code = fmax(bound->code, shd_bound_code(list, &shown[i]));
        bound->delta_e = fmax(bound->delta_e, shd_bound_delta_e(list, &shown[i], 0));
    }
}

/* False: memory. */
static bool find_bound(shd_choice *choice, const shd_shown *shown, shd_arena *arena) {
    shd_excess_list list = {0};
    if (!shd_errs_otherwise(choice->plan) &&
        !shd_excess_find(choice->plan, choice->tier, arena, &list, NULL))
        return false;
    set_bound(choice, shown, &list);
    return true;
}

static bool is_within(const shd_choice *choice, const shd_shown *shown,
                      const shd_excess_list *list) {
    const shd_scene *scene = choice->plan->scene;
    const shd_metric metric = scene->accuracy.metric;
    const double most = scene->accuracy.max_error;
    if (shd_errs_otherwise(choice->plan)) {
        const shd_plan plan = chosen_plan(choice);
        if (metric == SHD_LINEAR) return shd_extended_error(&plan) <= most;
        return shown_off(&plan, shown, metric, most) <= most;
    }
    if (metric == SHD_LINEAR) return shd_bound_linear(list) <= most;
    if (is_exact(choice, list)) return true;
    for (size_t o = 0; shown && o < scene->output_count; o++) {
        const double bound = metric == SHD_CODE ? shd_bound_code(list, &shown[o])
                                                : shd_bound_delta_e(list, &shown[o], most);
        if (!(bound <= most)) return false;
    }
    return shown;
}

/* The most that may come on top of `value` (`more` or `color` of the list), to a factor of 1.2. */
static double find_room(const shd_choice *choice, const shd_shown *shown, shd_excess_list *list,
                        double *value) {
    const double begin = *value;
    double low = 1e-9, high = 16;
    *value = begin + low;
    if (!is_within(choice, shown, list)) low = 0;
    while (low > 0 && high / low > 1.2 && !shd_is_cancelled(choice->plan->cancelled)) {
        double middle = sqrt(low * high);
        *value = begin + middle;
        *(is_within(choice, shown, list) ? &low : &high) = middle;
    }
    *value = begin;
    return low;
}

/* Shares what a tier leaves of the budget: sets drop_relative, and returns the absolute part. */
static double share_room(shd_choice *choice, const shd_shown *shown, shd_excess_list *list) {
    const shd_plan *plan = choice->plan;
    double room = find_room(choice, shown, list, &list->more);
    if (plan->scene->accuracy.metric != SHD_LINEAR) {
        room *= DARK_SHARE;
        list->more += room;
        /* All that is seen is no less than a part of it only if light adds up. */
        if (list->nonnegative && plan->light_count > 1)
            choice->drop_relative = find_room(choice, shown, list, &list->color);
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

/* Whether the errors of a plan with fewer lights are within those of all. It is not looked at more
 * finely as long as pairs are many, so that another look tells no less. */
static bool errs_no_more(const shd_plan *fewer, const shd_plan *all) {
    return shd_is_crowded(fewer) && fewer->split_positions == all->split_positions;
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
    if (!shd_plan_without(draft, drops, arena, &choice->plan)) return false;
    if (!errs_no_more(choice->plan, draft)) {
        if (!find_bound(choice, shown, arena)) return false;
        const shd_accuracy *accuracy = &draft->scene->accuracy;
        if (shd_bound_in(&choice->bound, accuracy->metric) <= accuracy->max_error) return true;
        /* With fewer lights, pieces are other ones. Those of all lights do have the room. */
        choice->plan = draft;
        choice->drop_tolerance += choice->dropped;
        choice->dropped = 0;
    }
    set_bound(choice, shown, list);
    return true;
}

/* Fails with the best bound that there is. */
static shd_status fail_budget(const shd_plan *draft, const shd_shown *shown, shd_arena *arena,
                              shd_error *error) {
    const shd_accuracy *accuracy = &draft->scene->accuracy;
    shd_choice exact = {.plan = draft, .tier = SHD_EXACT};
    if (!find_bound(&exact, shown, arena)) return SHD_MEMORY;
    const double reached = shd_bound_in(&exact.bound, accuracy->metric);
    const char *path = "/accuracy/maxError", *metric = shd_metric_names[accuracy->metric];
    if (!isfinite(reached))
        return shd_fail(error, SHD_SCENE, path, "no bound in %s is known for this scene: %s",
                        metric, shd_no_linear_bound());
    char told[SHD_BOUND_TEXT];
    shd_print_bound(reached, INFINITY, told);
    return shd_fail(error, SHD_SCENE, path,
                    "no tier stays within %.9g %s in this scene: `exact` reaches %s",
                    accuracy->max_error, metric, told);
}

static bool has_shapes(const shd_plan *plan) {
    for (size_t j = 0; j < plan->light_count; j++)
        if (plan->lights[j].shape) return true;
    return false;
}

/* The most that lights with a shape may be off as points within the budget. */
static double find_point_off(const shd_plan *draft, bool by_quadrature, const shd_shown *shown) {
    const shd_accuracy *accuracy = &draft->scene->accuracy;
    const double most = accuracy->max_error;
    shd_plan plan = *draft;
    if (by_quadrature) plan.glows = NULL;
    for (plan.point_off = 1e-2; plan.point_off > 1e-8; plan.point_off /= 10) {
        if (shd_is_cancelled(draft->cancelled)) return plan.point_off;
        const double off = accuracy->metric == SHD_LINEAR
                               ? shd_extended_error(&plan)
                               : shown_off(&plan, shown, accuracy->metric, most);
        if (off <= most) return plan.point_off;
    }
    return 0;
}

/* Whether models in f32 meet the budget, and cost less. */
static bool meet_by_models32(shd_choice *choice, const shd_shown *shown,
                             const shd_kernel_cost *costs) {
    const shd_plan *draft = choice->plan;
    shd_tier ranked[SHD_EXACT + 1];
    if (!draft->models32 || draft->scene->accuracy.exactly) return false;
    shd_plan_rank_tiers(draft, costs, ranked);
    choice->tier = ranked[0];
    if (choice->tier == SHD_EXACT || !is_within(choice, shown, NULL)) return false;
    set_bound(choice, shown, NULL);
    return true;
}

/* The only tier that most extended scenes have. */
static shd_status meet_exactly(shd_choice *choice, const shd_shown *shown, shd_arena *arena,
                               shd_error *error) {
    shd_excess_list list = {0};
    choice->tier = SHD_EXACT;
    if (!shd_errs_otherwise(choice->plan) &&
        !shd_excess_find(choice->plan, SHD_EXACT, arena, &list, NULL))
        return SHD_MEMORY;
    choice->by_quadrature =
        choice->plan->scene->accuracy.exactly || !is_within(choice, shown, &list);
    if (!is_within(choice, shown, &list)) return fail_budget(choice->plan, shown, arena, error);
    if (has_shapes(choice->plan) && !choice->plan->scene->accuracy.exactly)
        choice->point_off = find_point_off(choice->plan, choice->by_quadrature, shown);
    set_bound(choice, shown, &list);
    return SHD_OK;
}

/* The plan with sketches, if it may have any. NULL: memory. */
static const shd_plan *sketch_plan(const shd_plan *draft, shd_arena *arena) {
    if (!shd_plan_may_sketch(draft)) return draft;
    shd_plan *plan = shd_arena_alloc(arena, 1, sizeof *plan);
    if (!plan) return NULL;
    *plan = *draft;
    plan->sketched = true;
    return plan;
}

/* The largest part of draft's room that is within the budget. Where lights are many, some of it is
 * left to them. */
static shd_mean_room find_mean_room(const shd_choice *choice, const shd_shown *shown,
                                    shd_excess_list *list) {
    static const double LEAST = 0x1p-8;
    const double times = choice->plan->light_count > SHD_SKETCH_LIGHTS ? 2 : 1;
    shd_mean_room room = {0, 0};
    for (double part = 1; part >= LEAST && !(room.absolute > 0); part /= 4) {
        const shd_mean_room some = {part * SHD_DRAFT_ROOM.absolute, part * SHD_DRAFT_ROOM.relative};
        shd_excess_leave_out(list, times * some.absolute, times * some.relative);
        if (is_within(choice, shown, list)) room = some;
    }
    shd_excess_leave_out(list, room.absolute, room.relative);
    return room;
}

/* Draft is cheaper than any other tier, if it differs. *met: it is within the budget. False:
 * memory. */
static bool meet_by_draft(shd_choice *choice, const shd_shown *shown, shd_arena *arena, bool *met) {
    const shd_plan *draft = choice->plan;
    shd_excess_list list;
    shd_influences influences;
    *met = false;
    if (draft->scene->accuracy.exactly) return true;
    const shd_plan *plan = sketch_plan(draft, arena);
    if (plan == draft && !shd_plan_may_thin(draft)) return true;
    choice->tier = SHD_STANDARD;
    if (!plan || !shd_excess_find(plan, SHD_STANDARD, arena, &list, &influences)) return false;
    if (!is_within(choice, shown, &list)) return true;
    choice->plan = plan;
    if (shd_plan_may_thin(draft)) choice->mean_room = find_mean_room(choice, shown, &list);
    *met = plan->sketched || choice->mean_room.absolute > 0;
    return !*met || leave_out(choice, shown, &list, &influences, arena);
}

static shd_status meet_budget(shd_choice *choice, const shd_shown *shown,
                              const shd_kernel_cost *costs, shd_arena *arena, shd_error *error) {
    const shd_plan *draft = choice->plan;
    if (meet_by_models32(choice, shown, costs)) return SHD_OK;
    if (draft->extended) return meet_exactly(choice, shown, arena, error);
    bool met;
    if (!meet_by_draft(choice, shown, arena, &met)) return SHD_MEMORY;
    if (met) return SHD_OK;
    shd_tier ranked[SHD_EXACT + 1];
    shd_plan_rank_tiers(draft, costs, ranked);
    for (int k = 0; k <= SHD_EXACT; k++) {
        shd_excess_list list;
        shd_influences influences;
        choice->tier = ranked[k];
        if (draft->scene->accuracy.exactly && choice->tier != SHD_EXACT) continue;
        if (!shd_excess_find(draft, choice->tier, arena, &list, &influences)) return SHD_MEMORY;
        if (!is_within(choice, shown, &list)) continue;
        if (choice->tier != SHD_EXACT)
            return leave_out(choice, shown, &list, &influences, arena) ? SHD_OK : SHD_MEMORY;
        set_bound(choice, shown, &list); /* the exact tier leaves nothing out */
        return SHD_OK;
    }
    return fail_budget(draft, shown, arena, error);
}

shd_status shd_choose(const shd_plan *draft, const shd_shown *shown, const shd_kernel_cost *costs,
                      shd_arena *arena, shd_choice *out, shd_error *error) {
    const shd_accuracy *accuracy = &draft->scene->accuracy;
    shd_choice choice = {.plan = draft,
                         .tier = draft->extended && !draft->models32 ? SHD_EXACT : accuracy->tier,
                         .by_quadrature = !accuracy->budget && accuracy->tier == SHD_EXACT,
                         .mean_room = accuracy->draft && shd_plan_may_thin(draft)
                                          ? SHD_DRAFT_ROOM
                                          : (shd_mean_room){0, 0}};
    if (accuracy->draft) choice.plan = sketch_plan(draft, arena);
    if (!choice.plan) return SHD_MEMORY;
    const shd_status status = accuracy->budget ? meet_budget(&choice, shown, costs, arena, error)
                              : find_bound(&choice, shown, arena) ? SHD_OK
                                                                  : SHD_MEMORY;
    if (status == SHD_OK) *out = choice;
    return status;
}
