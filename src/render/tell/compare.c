/* What each tier costs for a scene, and how far it is from the exact one. */
#include <math.h>

#include "base/json_memory.h"
#include "render/planning.h"
#include "render/request.h"
#include "render/tell/illuminants.h"
#include "render/tell/json.h"
#include "render/tell/measure.h"

enum { TIERS = SHD_EXACT + 1 };

static const shd_accuracy exactly = {.tier = SHD_EXACT};

/* Another rendering for the same request, with nothing planned or counted yet. */
static shd_rendering begin_beside(const shd_rendering *r, shd_arena *arena) {
    return (shd_rendering){.engine = r->engine,
                           .arena = arena,
                           .limits = r->limits,
                           .cancelled = r->cancelled,
                           .lease = r->lease,
                           .tables = r->tables};
}

static void end_beside(shd_rendering *whole, const shd_rendering *part) {
    shd_times_add(&whole->times, &part->times);
    whole->saturated += part->saturated;
    whole->clipped += part->clipped;
}

/* ---- One tier ---- */

/* Its share of the whole comparison's progress. */
typedef struct stretch {
    const shd_render_options *whole; /* NULL: nobody wants to know */
    int done;                        /* pictures before it */
    int pictures;                    /* tiers, and RGB beside a spectral scene */
} stretch;

static void on_progress(void *context, double share) {
    const stretch *s = context;
    if (s->whole && s->whole->progress)
        s->whole->progress(s->whole->context, (s->done + share) / s->pictures);
}

/* The scene in the given tier, with nothing but its beauty wanted. */
static const shd_scene *in_tier(const shd_scene *given, shd_accuracy tier, shd_arena *arena) {
    shd_scene *scene = shd_arena_alloc(arena, 1, sizeof *scene);
    shd_output *output = shd_arena_alloc(arena, 1, sizeof *output);
    if (!scene || !output) return NULL;
    *scene = *given;
    *output = scene->outputs[0];
    output->layer_count = 0;
    scene->accuracy = tier;
    scene->outputs = output;
    scene->output_count = 1;
    return scene;
}

/* Everything that is made lives in r->arena, r->plan too. */
static shd_status render_tier(shd_rendering *r, const shd_scene *given, shd_accuracy tier,
                              stretch *progress, shd_film *film, shd_error *error) {
    const shd_scene *scene = in_tier(given, tier, r->arena);
    if (!scene) return shd_fail(error, SHD_MEMORY, "/image", "the limit `memory` is reached");
    shd_stage_begin(r);
    shd_status status = shd_rendering_plan(r, scene, error);
    if (status == SHD_OK) status = shd_rendering_admit(r, NULL, true, error);
    shd_stage_end(r, &r->times.plan);
    shd_sight *sight;
    if (status == SHD_OK) status = shd_sight_new(r->plan, r->cancelled, r->arena, &sight, error);
    shd_stage_end(r, &r->times.visibility);
    if (status != SHD_OK) return status;
    const shd_render_options options = {on_progress, progress};
    *film = (shd_film){0};
    return shd_film_render(r, sight, NULL, &options, film, error);
}

/* ---- The answer ---- */

static json_t *tell_spread(const shd_spread *spread, double unit) {
    return json_pack("{sf sf sf}", "max", spread->max / unit, "mean", spread->mean / unit, "p99",
                     spread->p99 / unit);
}

static json_t *tell_error(const shd_difference *d) {
    json_t *linear = tell_spread(&d->linear, 1), *code = tell_spread(&d->code, 1);
    /* A black picture has no scale. */
    json_t *relative = d->largest > 0 ? tell_spread(&d->linear, d->largest) : json_null();
    json_object_set_new(linear, "relative", relative);
    json_object_set_new(code, "equal", json_real(d->equal));
    return json_pack("{so so so so}", "linear", linear, "code", code, "deltaE2000",
                     tell_spread(&d->delta_e, 1), "psnr", shd_tell_number(d->psnr));
}

static json_t *tell_tier(const shd_rendering *r, const shd_difference *difference) {
    const shd_plan *plan = r->plan;
    const shd_times *times = &r->times;
    shd_bound seen = plan->bound;
    seen.delta_e = difference->most;
    json_t *seconds = json_pack("{sf sf sf sf}", "plan", times->plan, "visibility",
                                times->visibility, "shade", times->shade, "color", times->color);
    if (plan->scene->trace.shadows)
        json_object_set_new(seconds, "shadow", json_real(times->shadow));
    if (plan->scene->trace.depth) json_object_set_new(seconds, "trace", json_real(times->trace));
    return json_pack("{ss ss so so so so}", "tier", shd_asked_tier(&plan->scene->accuracy), "plan",
                     plan->summary, "bound", shd_tell_bound(&plan->bound), "boundSeen",
                     shd_tell_bound(&seen), "seconds", seconds, "error", tell_error(difference));
}

/* Takes the references to `tiers` and `spectral`. */
static json_t *tell_all(const shd_request *request, const shd_showing *showing, double largest,
                        json_t *tiers, json_t *spectral) {
    const shd_raster *raster = &request->scene->raster;
    const shd_color_transform *lab = showing->detour ? showing->detour : showing->transform;
    return json_pack(
        "{ss s{si si si} sf s{ss ss ss} s{sf} so so*}", "reference", shd_tier_names[SHD_EXACT],
        "image", "width", raster->w, "height", raster->h, "samples", raster->samples, "largest",
        largest, "measuredIn", "linear", request->scene->working_space->name, "code",
        shd_color_describe(showing->transform)->name, "deltaE2000", shd_color_describe(lab)->name,
        "seconds", "parse", request->rendering.times.parse, "tiers", tiers, "spectral", spectral);
}

/* ---- The comparison ---- */

/* Renders a tier and measures it, in an arena of its own. So the tiers take turns in the memory
 * that the exact film leaves of the request's, and the cap holds for all of them. Adds what is told
 * of it as the first of `tiers`. */
static shd_status compare_tier(shd_request *request, shd_accuracy tier, const shd_showing *showing,
                               const shd_film *exact, stretch *progress, double *exact_seconds,
                               double *largest, json_t *tiers, shd_error *error) {
    const shd_rendering *first = &request->rendering;
    shd_arena *arena = shd_arena_new_from(first->engine->spares, shd_arena_room(first->arena));
    if (!arena) return shd_fail(error, SHD_EXHAUSTED, "", "out of memory");

    shd_rendering r = begin_beside(first, arena);
    shd_film film;
    shd_difference difference;
    shd_status status = render_tier(&r, request->scene, tier, progress, &film, error);
    if (status == SHD_OK)
        status = shd_film_measure(&r, showing, exact, &film, &difference, exact_seconds, error);
    if (status == SHD_OK) {
        *largest = difference.largest;
        shd_json_memory_watch();
        json_array_insert_new(tiers, 0, tell_tier(&r, &difference));
        if (shd_json_memory_short()) status = shd_fail(error, SHD_EXHAUSTED, "", "out of memory");
    }
    end_beside(&request->rendering, &r);
    request->full = request->full || shd_arena_full(arena);
    request->crowded = request->crowded || shd_arena_crowded(arena);
    shd_arena_drop(arena);
    return status;
}

/* The scene in RGB, its spectra integrated, against the spectral picture. `out` is NULL if it is
 * not spectral. */
static shd_status compare_rgb(shd_request *request, const shd_showing *showing,
                              const shd_film *exact, stretch *progress, json_t **out,
                              shd_error *error) {
    const shd_rendering *first = &request->rendering;
    shd_scene scene = *request->scene;
    *out = NULL;
    if (!scene.spectral.channels) return SHD_OK;
    shd_arena *arena = shd_arena_new_from(first->engine->spares, shd_arena_room(first->arena));
    if (!arena) return shd_fail(error, SHD_EXHAUSTED, "", "out of memory");
    scene.spectral.channels = 0;
    shd_rendering r = begin_beside(first, arena);
    shd_film film;
    shd_difference difference;
    double seconds = 0;
    shd_status status = render_tier(&r, &scene, exactly, progress, &film, error);
    if (status == SHD_OK)
        status = shd_film_measure(&r, showing, exact, &film, &difference, &seconds, error);
    if (status == SHD_OK) {
        shd_json_memory_watch();
        *out = json_pack("{si s{so} so}", "channels", request->scene->spectral.channels, "rgb",
                         "deltaE2000", tell_spread(&difference.delta_e, 1), "illuminants",
                         shd_tell_illuminants(first->plan, arena));
        if (shd_json_memory_short() || !*out)
            status = shd_fail(error, SHD_EXHAUSTED, "", "out of memory");
    }
    end_beside(&request->rendering, &r);
    request->full = request->full || shd_arena_full(arena);
    request->crowded = request->crowded || shd_arena_crowded(arena);
    shd_arena_drop(arena);
    return status;
}

static shd_status compare_tiers(shd_request *request, const shd_render_options *options,
                                char **json, shd_error *error) {
    shd_rendering *whole = &request->rendering;
    shd_showing showing;
    shd_status status =
        shd_showing_make(whole, request->scene, &request->scene->outputs[0], &showing, error);
    if (status != SHD_OK) return status;

    const bool spectral = request->scene->spectral.channels;
    stretch progress = {options, 0, TIERS + spectral};
    shd_rendering r = begin_beside(whole, whole->arena);
    shd_film exact;
    status = render_tier(&r, request->scene, exactly, &progress, &exact, error);
    whole->plan = r.plan;
    if (status != SHD_OK) return status;
    const bool drafts = shd_plan_may_draft(r.plan);
    progress.pictures += drafts;

    json_t *tiers = json_array(); /* the cheapest first; if it is NULL, nothing is printed */
    double largest = 0;
    for (int t = SHD_STANDARD; t >= 0 && status == SHD_OK; t--) {
        progress.done++;
        status = compare_tier(request, (shd_accuracy){.tier = (shd_tier)t}, &showing, &exact,
                              &progress, &r.times.color, &largest, tiers, error);
    }
    progress.done++;
    if (drafts && status == SHD_OK)
        status = compare_tier(request, (shd_accuracy){.draft = true}, &showing, &exact, &progress,
                              &r.times.color, &largest, tiers, error);
    json_t *beside = NULL;
    progress.done += drafts;
    if (status == SHD_OK)
        status = compare_rgb(request, &showing, &exact, &progress, &beside, error);
    if (status != SHD_OK) {
        json_decref(tiers);
        return status;
    }
    /* Errors are measured against the exact tier: its own are 0. */
    const shd_difference none = {.largest = largest, .equal = 1, .psnr = INFINITY};
    shd_json_memory_watch();
    json_array_append_new(tiers, tell_tier(&r, &none));
    end_beside(whole, &r);
    *json = shd_tell_print(tell_all(request, &showing, largest, tiers, beside), 9, NULL);
    return *json ? SHD_OK : shd_fail(error, SHD_EXHAUSTED, "", "out of memory");
}

shd_status shd_request_compare(shd_request *request, const shd_render_options *options, char **json,
                               shd_error *error) {
    return shd_request_blame(request, compare_tiers(request, options, json, error), error);
}
