/* The bound of linear errors, of a whole picture and by the color of a pixel. */
#include "bound/light/error.h"
#include "bound/shown/shown.h"

double shd_bound_linear(const shd_excess_list *list) {
    double most = 0;
    for (int c = 0; c < 3; c++) most = fmax(most, list->most[c]);
    const double worst =
        list->worst + list->misplaced + (list->color - list->rounding) * most + list->more;
    return worst < 1e37 ? worst : INFINITY; /* beyond what the film holds */
}

/* Each excess is concave in the value where nothing of it is below its base. A pixel that mixes
 * excesses and the background takes the most of each part: that is concave from 0 on, so that the
 * mean of errors is no more than the error of the mean. */
static void mix_excesses(const shd_excess_list *list, shd_linear_error out[3]) {
    for (int c = 0; c < 3; c++) {
        shd_linear_error mixed = {0, 0, 0, 0, 0};
        for (size_t i = 0; i < list->count; i++) {
            const shd_excess *e = &list->excess[i];
            mixed.absolute = fmax(mixed.absolute, e->absolute[c]);
            mixed.limited = fmax(mixed.limited, e->limited[c]);
            mixed.ratio = fmax(mixed.ratio, e->ratio + e->distance);
        }
        out[c] = mixed;
    }
}

bool shd_pixel_bound_make(const shd_plan *plan, shd_arena *arena, shd_pixel_bound *out) {
    const double rounding = shd_color_error(plan, plan->tier);
    *out = (shd_pixel_bound){.most = plan->bound.linear, .background = 0};
    for (int c = 0; c < 3; c++)
        out->background = fmax(out->background, rounding * fabs(plan->scene->background[c]));
    if (plan->scene->backdrop) out->background = out->most;
    out->background = fmin(out->background, out->most);
    /* Shadows and patterns take light away, so that an excess has no base there. */
    if (plan->extended || plan->textured || !isfinite(out->most)) return true;
    shd_excess_list *list = shd_arena_alloc(arena, 1, sizeof *list);
    if (!list || !shd_excess_find(plan, plan->tier, arena, list, NULL)) return false;
    if (!list->nonnegative) return true;
    shd_excess_leave_out(list, plan->drop_tolerance + plan->dropped + plan->mean_room.absolute,
                         plan->drop_relative + plan->mean_room.relative);
    out->color = list->color;
    out->more = list->more + list->misplaced;
    out->count = list->mixed ? 1 : list->count;
    out->of = shd_arena_alloc(arena, out->count, sizeof *out->of);
    if (!out->of) return false;
    if (list->mixed) mix_excesses(list, out->of[0]);
    for (size_t i = 0; !list->mixed && i < list->count; i++) {
        const shd_excess *e = &list->excess[i];
        for (int c = 0; c < 3; c++)
            out->of[i][c] = (shd_linear_error){e->absolute[c], e->limited[c], e->ratio, e->distance,
                                               e->base[c]};
    }
    return true;
}

double shd_pixel_bound_at(const shd_pixel_bound *bound, const double rgb[3]) {
    double worst = 0;
    if (!bound->of) return bound->most;
    for (int c = 0; c < 3; c++) {
        /* The model's value is no more than this. */
        const double v = fmax(rgb[c], 0) + bound->most;
        double error = 0;
        for (size_t i = 0; i < bound->count; i++) {
            const shd_linear_error *e = &bound->of[i][c];
            double limited = e->limited;
            if (isfinite(e->ratio))
                limited = fmin(limited, e->ratio * fmax(v - e->base, 0) + e->distance * v);
            error = fmax(error, e->absolute + limited);
        }
        worst = fmax(worst, error + bound->color * v + bound->more);
    }
    return worst < bound->most ? worst : bound->most;
}
