/* What the outputs of a scene display, in figures. */
#include <math.h>

#include "analysis/figures.h"
#include "base/json_memory.h"
#include "render/request.h"
#include "render/show/displayed.h"
#include "render/tell/bare.h"
#include "render/tell/json.h"

enum { AXES = SHD_AXES_LAB + 1, CHANNELS = 3 };

/* Below this, a hue is that of rounding. */
static const float LEAST_SATURATION = 1e-4f;

/* ---- Finding. ---- */

typedef struct finding {
    const shd_rendering *rendering;
    shd_extent extents[CHANNELS];
    const float *planes;
    size_t pixels;
    shd_figures_scratch *scratch[CHANNELS];
    shd_figures found[CHANNELS];
} finding;

static void find_channel(void *context, size_t c, unsigned slot) {
    (void)slot;
    finding *f = context;
    shd_figures_find(f->planes + c * f->pixels, f->pixels, f->extents[c], f->scratch[c],
                     f->rendering->cancelled, &f->found[c]);
}

/* Where the values of usual pictures are. */
static void find_extents(shd_axes axes, shd_channels channels, shd_extent out[CHANNELS]) {
    static const shd_extent unit[] = {{0, 1}, {0, 1}, {0, 1}},
                            yiq[] = {{0, 1}, {-0.6, 0.6}, {-0.52, 0.52}},
                            lab[] = {{0, 100}, {-128, 128}, {-128, 128}};
    const bool own = axes == SHD_AXES_OWN;
    const shd_extent *extents = axes == SHD_AXES_YIQ || (own && channels == SHD_YIQ) ? yiq
                                : axes == SHD_AXES_LAB                               ? lab
                                                                                     : unit;
    for (int c = 0; c < CHANNELS; c++) out[c] = extents[c];
}

static void leave_out_greys(float *planes, size_t pixels) {
    for (size_t i = 0; i < pixels; i++)
        if (!(planes[pixels + i] > LEAST_SATURATION)) planes[i] = NAN;
}

/* ---- Telling. ---- */

static json_t *tell_figures(const char *name, const shd_figures *f) {
    static const char *const ranks[SHD_PERCENTILES] = {"1", "5", "25", "50", "75", "95", "99"};
    const bool any = f->count > 0;
    json_t *percentiles = json_object(), *counts = json_array();
    for (int p = 0; p < SHD_PERCENTILES; p++)
        json_object_set_new(percentiles, ranks[p],
                            any ? json_real(f->percentiles[p]) : json_null());
    for (int b = 0; b < SHD_BINS; b++)
        json_array_append_new(counts, json_integer((json_int_t)f->bins[b]));
    return json_pack("{ss sI so so so so s{s[ff] so}}", "name", name, "count", (json_int_t)f->count,
                     "min", any ? json_real(f->min) : json_null(), "max",
                     any ? json_real(f->max) : json_null(), "mean",
                     any ? json_real(f->mean) : json_null(), "percentiles", percentiles,
                     "histogram", "edges", f->low, f->high, "counts", counts);
}

/* Why there are no figures on such axes; NULL: there are. */
static const char *find_reason(const shd_displayed *d, shd_axes axes) {
    if (axes == SHD_AXES_OWN) return NULL;
    if (d->info->data) return "the output is data, whose values mean no color";
    if (axes != SHD_AXES_LAB && !d->color) return "the output's channels are not R, G and B";
    return NULL;
}

static const char *const axes_names[AXES] = {"rgb", "hsv", "yiq", "lab"};

static shd_status tell_axes(shd_rendering *r, const shd_displayed *d, shd_axes axes, float *planes,
                            finding *f, json_t *told, shd_error *error) {
    static const shd_channels channels[AXES] = {SHD_RGB, SHD_HSV, SHD_YIQ, SHD_LAB};
    const shd_channels own = d->info->channels;
    find_extents(axes, own, f->extents);
    if (!shd_displayed_axes(r, d, axes, planes)) return shd_rendering_cancelled(error);
    if (axes == SHD_AXES_HSV) leave_out_greys(planes, d->pixels);
    shd_stage_spread(r, CHANNELS, find_channel, f);
    if (shd_is_cancelled(r->cancelled)) return shd_rendering_cancelled(error);
    const char *const *names = shd_channel_names(axes == SHD_AXES_OWN ? own : channels[axes]);
    json_t *list = json_array();
    for (int c = 0; c < CHANNELS; c++)
        json_array_append_new(list, tell_figures(names[c], &f->found[c]));
    json_object_set_new(told, axes_names[axes], list);
    return SHD_OK;
}

static json_t *tell_count(uint64_t count, bool is_known) {
    return is_known ? json_integer((json_int_t)count) : json_null();
}

static json_t *tell_output(const shd_output *output, const shd_displayed *d) {
    const shd_color_transform *lab = d->showing.detour ? d->showing.detour : d->showing.transform;
    return json_pack(
        "{so ss so sI sI sI so so s{}}", "name",
        output->name ? json_string(output->name) : json_null(), "displayed", d->info->name, "labOf",
        d->info->data ? json_null() : json_string(shd_color_describe(lab)->name), "pixels",
        (json_int_t)d->pixels, "transparent", (json_int_t)d->transparent, "nonFinite",
        (json_int_t)d->not_finite, "clipped", tell_count(d->clipped, d->integers), "outOfGamut",
        tell_count(d->beyond, d->color), "reasons");
}

/* Appends what is found of an output to `list`. */
static shd_status analyze_output(shd_rendering *r, const shd_film *film, const shd_output *output,
                                 json_t *list, shd_error *error) {
    const shd_arena_mark mark = shd_arena_mark_here(r->arena);
    shd_displayed d;
    shd_status status = shd_displayed_make(r, r->plan->scene, output, film, &d, error);
    if (status != SHD_OK) return status;
    float *planes = shd_arena_alloc(r->arena, d.pixels, CHANNELS * sizeof *planes);
    finding f = {.rendering = r, .planes = planes, .pixels = d.pixels};
    for (int c = 0; c < CHANNELS; c++)
        if (!(f.scratch[c] = shd_figures_scratch_new(r->arena)))
            return shd_rendering_full(r, "analysis", error);
    if (!planes) return shd_rendering_full(r, "analysis", error);

    json_t *told = tell_output(output, &d);
    for (int axes = 0; axes < AXES && status == SHD_OK; axes++) {
        const char *reason = find_reason(&d, (shd_axes)axes);
        if (!reason) {
            status = tell_axes(r, &d, (shd_axes)axes, planes, &f, told, error);
            continue;
        }
        json_object_set_new(told, axes_names[axes], json_null());
        json_object_set_new(json_object_get(told, "reasons"), axes_names[axes],
                            json_string(reason));
    }
    json_array_append_new(list, told);
    shd_arena_return(r->arena, mark);
    return status;
}

/* ---- The story. ---- */

static shd_status analyze_film(shd_rendering *r, const shd_film *film, char **json,
                               shd_error *error) {
    const shd_scene *scene = r->plan->scene;
    const shd_raster *raster = &scene->raster;
    shd_status status = SHD_OK;
    shd_json_memory_watch();
    json_t *list = json_array();
    shd_stage_begin(r);
    for (size_t i = 0; i < scene->output_count && status == SHD_OK; i++)
        status = analyze_output(r, film, &scene->outputs[i], list, error);
    shd_stage_end(r, &r->times.color);
    if (status != SHD_OK) {
        json_decref(list);
        return status;
    }
    json_t *all = json_pack("{s{si si si} ss so}", "image", "width", raster->w, "height", raster->h,
                            "samples", raster->samples, "plan", r->plan->summary, "outputs", list);
    *json = shd_tell_print(all, 12, r->cancelled);
    if (*json) return SHD_OK;
    return shd_is_cancelled(r->cancelled) ? shd_rendering_cancelled(error)
                                          : shd_fail(error, SHD_EXHAUSTED, "", "out of memory");
}

shd_status shd_request_analyze(shd_request *request, const shd_render_options *options, char **json,
                               shd_error *error) {
    shd_rendering *r = &request->rendering;
    shd_film film = {0};
    shd_status status = shd_bare_render(r, request->scene, options, &film, error);
    if (status == SHD_OK) status = analyze_film(r, &film, json, error);
    return shd_request_blame(request, status, error);
}
