/* What the cells of a sheet, or the frames of a turntable, will take and have taken. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "render/planning.h"
#include "render/sheet.h"

typedef struct weight {
    double seconds;
    shd_bound bound; /* the worst of each kind */
    bool mixed;      /* tiers are several */
    const char *tier;
} weight;

static void add_plan(weight *w, const shd_plan *plan, double seconds, bool is_first) {
    const shd_bound *b = &plan->bound;
    w->seconds += seconds;
    const char *tier = shd_plan_tier_name(plan);
    w->mixed = w->mixed || (!is_first && strcmp(tier, w->tier) != 0);
    w->tier = tier;
    w->bound = (shd_bound){.linear = fmax(w->bound.linear, b->linear),
                           .code = fmax(w->bound.code, b->code),
                           .delta_e = fmax(w->bound.delta_e, b->delta_e)};
}

static void tell_weight(const weight *w, shd_contact_sheet *sheet) {
    const char *before = "; error<=";
    const size_t room = sizeof sheet->told;
    size_t length =
        (size_t)snprintf(sheet->told, room, "tier=%s; %s=%zu", w->mixed ? "mixed" : w->tier,
                         sheet->turns ? "frames" : "sheet", sheet->count);
    for (shd_metric metric = SHD_LINEAR; metric <= SHD_DELTA_E_2000; metric++) {
        char number[SHD_BOUND_TEXT];
        if (!isfinite(shd_bound_in(&w->bound, metric))) continue;
        shd_print_bound(shd_bound_in(&w->bound, metric), INFINITY, number);
        length += (size_t)snprintf(sheet->told + length, room - length, "%s%s %s", before, number,
                                   shd_metric_names[metric]);
        before = ", ";
    }
    if (*before == ',')
        snprintf(sheet->told + length, room - length, ", worst of %zu", sheet->count);
}

shd_status shd_sheet_open(shd_request *request, size_t index, shd_request **out, shd_error *error) {
    const shd_status status = shd_sheet_cell(request, index, out, error);
    if (status != SHD_OK || (*out)->report.status == SHD_OK) return status;
    const shd_report *report = &(*out)->report; /* a mesh may be forgotten meanwhile */
    shd_fail(error, report->status, report->errors[0].pointer, "%s", report->errors[0].detail);
    error->limit = report->limit;
    shd_request_drop(*out);
    return error->status;
}

static shd_status weigh_cells(shd_request *request, weight *w, shd_error *error) {
    for (size_t i = 0; i < request->sheet->count; i++) {
        shd_request *cell;
        shd_status status = shd_sheet_open(request, i, &cell, error);
        if (status != SHD_OK) return status;
        shd_rendering *r = &cell->rendering;
        shd_stage_begin(r);
        status = shd_rendering_plan(r, cell->scene, error);
        shd_stage_end(r, &r->times.plan);
        if (status == SHD_OK) add_plan(w, r->plan, shd_rendering_seconds(r), !i);
        status = shd_request_blame(cell, status, error);
        shd_times_add(&request->rendering.times, &r->times);
        shd_request_drop(cell);
        if (status != SHD_OK) return status;
    }
    if (w->seconds <= (double)request->limits.work) return SHD_OK;
    shd_fail(error, SHD_LIMIT, request->sheet->turns ? "/turntable" : "/sheet",
             "it is expected to take %.0f seconds of one processor; the limit `work` is %llu",
             w->seconds, (unsigned long long)request->limits.work);
    return shd_fail_limit(error, SHD_LIMIT_WORK);
}

shd_status shd_sheet_weigh(shd_request *request, shd_error *error) {
    weight w = {0};
    const shd_status status = weigh_cells(request, &w, error);
    if (status == SHD_OK) tell_weight(&w, request->sheet);
    return status;
}

void shd_sheet_account(shd_request *request, const shd_request *cell, bool is_first) {
    shd_rendering *all = &request->rendering;
    const shd_rendering *r = &cell->rendering;
    shd_times_add(&all->times, &r->times);
    all->saturated += r->saturated;
    all->clipped += r->clipped;
    all->rays += r->rays;
    all->cut = fmax(all->cut, r->cut);
    all->ray_error = fmax(all->ray_error, r->ray_error);
    all->ray_edges += r->ray_edges;
    if (is_first || cell->reused < request->reused) request->reused = cell->reused;
}
