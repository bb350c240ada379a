/* What people read of a plan, and how bounds are printed. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "plan/bunches.h"
#include "plan/parts.h"
#include "plan/paths.h"

void shd_print_bound(double bound, double most, char out[SHD_BOUND_TEXT]) {
    if (!isfinite(bound) || (bound == floor(bound) && bound < 1e6)) {
        snprintf(out, SHD_BOUND_TEXT, "%.0f", bound);
        return;
    }
    /* 17 digits are the bound itself. */
    for (int digits = 2; digits <= 17; digits++) {
        snprintf(out, SHD_BOUND_TEXT, "%.*g", digits, bound);
        double told = strtod(out, NULL);
        if (told < bound) { /* one more of the last digit */
            told += pow(10, floor(log10(bound)) - digits + 1);
            snprintf(out, SHD_BOUND_TEXT, "%.*g", digits, told);
            told = strtod(out, NULL);
        }
        if (told >= bound && told <= most) return;
    }
}

double shd_bound_in(const shd_bound *bound, shd_metric metric) {
    return metric == SHD_LINEAR ? bound->linear : metric == SHD_CODE ? bound->code : bound->delta_e;
}

void shd_plan_print_bound(const shd_plan *plan, shd_metric metric, char out[SHD_BOUND_TEXT]) {
    const shd_accuracy *accuracy = &plan->scene->accuracy;
    const bool met = accuracy->budget && accuracy->metric == metric;
    shd_print_bound(shd_bound_in(&plan->bound, metric), met ? accuracy->max_error : INFINITY, out);
}

const char *shd_plan_tier_name(const shd_plan *plan) {
    return shd_plan_is_draft(plan) ? "draft" : shd_tier_names[plan->tier];
}

bool shd_plan_summarize(shd_plan *plan, shd_arena *arena) {
    char text[256]; /* of 237 at most */
    const shd_accuracy *accuracy = &plan->scene->accuracy;
    const char *tier = shd_plan_tier_name(plan), *asked = shd_asked_tier(accuracy);
    const bool other = !accuracy->budget && strcmp(asked, tier);
    int length =
        snprintf(text, sizeof text, "tier=%s%s%s; lights=%zu/%zu", tier, other ? "; asked=" : "",
                 other ? asked : "", plan->light_count, plan->scene->light_count);
    if (plan->bunches)
        length += snprintf(text + length, sizeof text - (size_t)length, "; groups=%zu",
                           shd_bunches_groups(plan->bunches));
    const char *before = "; error<=";
    for (shd_metric metric = SHD_LINEAR; metric <= SHD_DELTA_E_2000; metric++) {
        if (!isfinite(shd_bound_in(&plan->bound, metric))) continue;
        char number[SHD_BOUND_TEXT];
        shd_plan_print_bound(plan, metric, number);
        length += snprintf(text + length, sizeof text - (size_t)length, "%s%s %s", before, number,
                           shd_metric_names[metric]);
        before = ", ";
    }
    const shd_paths paths = shd_find_paths(plan);
    if (paths.bouncing) {
        char number[SHD_BOUND_TEXT];
        shd_print_bound(paths.cut, INFINITY, number);
        snprintf(text + length, sizeof text - (size_t)length, "; cut<=%s", number);
    }
    plan->summary = shd_arena_strdup(arena, text);
    return plan->summary;
}
