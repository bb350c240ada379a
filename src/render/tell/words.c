/* The plan in words: what a person wants to know first, a sentence a line. */
#include <stdarg.h>
#include <string.h>

#include "bound/light/extended.h"
#include "plan/bunches.h"
#include "plan/nodes.h"
#include "render/tell/lamps.h"
#include "render/tell/words.h"
#include "scene/surroundings.h"
#include "shade/westin.h"

enum { LIGHTS_NAMED = 8 }; /* lights that are left out and named; more are counted */

static SHD_PRINTF(2, 3) void say_line(json_t *words, const char *format, ...) {
    va_list args;
    va_start(args, format);
    json_array_append_new(words, json_vsprintf(format, args));
    va_end(args);
}

const char *shd_drop_reason(unsigned drops) {
    static const struct {
        unsigned bit;
        const char *text;
    } reasons[] = {{SHD_DROP_AMBIENT, "it is part of the ambient term"},
                   {SHD_DROP_BLACK, "its color is black"},
                   {SHD_DROP_BUDGET, "what it adds is under the budget"},
                   {SHD_DROP_BEHIND, "it is behind all that is seen"},
                   {SHD_DROP_CONE, "its cone misses the objects"},
                   {SHD_DROP_UNLIT, "no object reflects its color"}};
    for (size_t i = 0; i < sizeof reasons / sizeof reasons[0]; i++)
        if (drops & reasons[i].bit) return reasons[i].text;
    return NULL;
}

/* What of an extended scene f32 has no kernels for. */
static const char *why_exact(const shd_plan *plan) {
    if (plan->glossed) return "exponents and roughness that are patterns or pictures";
    if (plan->beyond_points)
        return "lights with a shape, environments, traced rays, spectra, maps of normals, "
               "specular antialiasing and values that f32 does not hold";
    if (!shd_isa_fuses(plan->isa)) return "models beside Phong's, of which f32's would be slower";
    return "models, lobes and cones that f32 is too coarse for";
}

static void say_tier(json_t *words, const shd_explained *e) {
    const shd_plan *plan = e->plan;
    const shd_accuracy *accuracy = &plan->scene->accuracy;
    const char *tier = shd_plan_tier_name(plan), *isa = shd_isa_name(plan->isa);
    if (accuracy->budget)
        say_line(words, "Tier %s, with %s kernels: the cheapest one that stays within %.6g %s.",
                 tier, isa, accuracy->max_error, shd_metric_names[accuracy->metric]);
    if (accuracy->budget && accuracy->max_error < accuracy->whole)
        say_line(words, "The rest of the %.6g is for what the format loses, which is measured.",
                 accuracy->whole);
    if (accuracy->budget) return;
    if (plan->extended && !plan->models32)
        say_line(words, "Tier %s: the only one for %s.", tier, why_exact(plan));
    else if (strcmp(tier, shd_asked_tier(accuracy)))
        say_line(words,
                 "Tier %s, with %s kernels: %s was asked for, which is another "
                 "one only of spheres and planes of Phong's model without patterns and pictures, "
                 "where there are no layers, and several samples or few lights.",
                 tier, isa, shd_asked_tier(accuracy));
    else
        say_line(words, "Tier %s, with %s kernels, as asked for.", tier, isa);
}

/* `unknown`: where it is not bounded, and why. `space` may be NULL. */
static void say_bound(json_t *words, const shd_plan *plan, shd_metric metric, const char *values,
                      const char *space, const char *unknown) {
    char most[SHD_BOUND_TEXT];
    shd_plan_print_bound(plan, metric, most);
    if (isfinite(shd_bound_in(&plan->bound, metric)))
        say_line(words, "Error: at most %s in %s%s%s%s against the %s.", most, values,
                 space ? " (" : "", space ? space : "", space ? ")" : "",
                 metric == SHD_LINEAR ? "model" : "exact tier");
    else
        say_line(words, "Error: not bounded in %s.", unknown);
}

const char *shd_no_shown_bound(const shd_plan *plan) {
    if (plan->textured)
        return "patterns and pictures make colors that are darker than bounds of codes know";
    return plan->point_off > 0 ? "lights with a shape are taken for points"
           : plan->glows       ? "environments are read from tables"
                               : "an output's colors are no curve of a matrix";
}

static void say_bounds(json_t *words, const shd_explained *e) {
    const shd_plan *plan = e->plan;
    char linear[256], codes[256];
    snprintf(codes, sizeof codes, "codes, as %s", shd_no_shown_bound(plan));
    snprintf(linear, sizeof linear, "linear components, as %s", shd_no_linear_bound());
    say_bound(words, plan, SHD_LINEAR, "linear components", plan->scene->working_space->name,
              linear);
    if (isfinite(e->estimate)) {
        char most[SHD_BOUND_TEXT];
        shd_print_bound(e->estimate, INFINITY, most);
        say_line(words, "%s should stay below %s, an estimate that no proof is of.",
                 plan->westin ? "Against the microgeometry of which tables are a simulation it"
                              : "It",
                 most);
    }
    say_bound(words, plan, SHD_CODE, "8-bit codes", NULL, codes);
    say_bound(words, plan, SHD_DELTA_E_2000, "CIEDE2000", NULL, "CIEDE2000");
    if (plan->scene->raster.samples > 1)
        say_line(words, "These are against the same %d samples a pixel, not against endless ones.",
                 plan->scene->raster.samples);
    say_line(words,
             "Single samples that lie on the edge of a cone or of a highlight are not counted.");
}

static void say_cost(json_t *words, const shd_cost *c, const shd_trees *trees) {
    say_line(
        words,
        "Cost: about %.2g ms of one core, which is an estimate: %.2g to see, %.2g to shade, %.2g "
        "for colors, %.2g to encode.",
        c->total, c->visibility, c->shade, c->color, c->encode);
    if (c->build > 0)
        say_line(words, "%.2g ms of it are for trees over %zu triangles, which take %.2g MB.",
                 c->build, trees->triangles, 1e-6 * (double)trees->bytes);
    if (c->shadow + c->trace > 0)
        say_line(words,
                 "%.2g ms of it are for shadows, and %.2g for rays that go on from surfaces.",
                 c->shadow, c->trace);
}

static void say_lights(json_t *words, const shd_plan *plan) {
    const size_t given = plan->scene->light_count;
    say_line(words, "Lights: %zu of %zu used%s.", plan->light_count, given,
             plan->light_count && plan->grey_lights ? ", all of them grey: one channel is summed"
                                                    : "");
    size_t named = 0, more = 0;
    for (size_t i = 0; i < given; i++) {
        const char *why = shd_drop_reason(plan->drops[i]);
        if (!why) continue;
        if (named++ < LIGHTS_NAMED)
            say_line(words, "Light %zu is left out: %s.", i, why);
        else
            more++;
    }
    if (more) say_line(words, "So are %zu more light%s.", more, more == 1 ? "" : "s");
    if (plan->drop_tolerance > 0)
        say_line(words,
                 "Tiles leave out lights that add no more than %.2g + %.2g of a value to it.",
                 plan->drop_tolerance, plan->drop_relative);
    if (plan->bunches)
        say_line(words,
                 "Within that, lights far from all that a tile or a block of it shows are lit "
                 "together: %zu lights, in %zu groups.",
                 plan->light_count, shd_bunches_groups(plan->bunches));
}

static void say_lamps(json_t *words, const shd_plan *plan) {
    size_t told = 0;
    for (uint32_t j = 0; j < plan->light_count && told < LIGHTS_NAMED; j++) {
        const shd_light *light = plan->lights[j].shape, *around = plan->lights[j].environment;
        double off;
        if (around) {
            const char *method = shd_around_method(plan, j, &off);
            say_line(words,
                     "Light %zu (environment, \"%s\", %d by %d texels): by %s, off by at most %.1e "
                     "of what "
                     "it adds at most%s.",
                     plan->lights[j].index, around->map->name, around->map->width,
                     around->map->height, method, off,
                     strcmp(method, "tables") ? "" : ", as measured when they were made");
            told++;
        }
        if (!light) continue;
        const shd_area_method method = shd_lamp_method(plan, j, &off);
        const size_t index = plan->lights[j].index;
        const char *type = shd_light_names[light->type];
        told++;
        if (method == SHD_AREA_POINT)
            say_line(words,
                     "Light %zu (%s): as a point, it is small and far: off by at most %.1e of what "
                     "it adds at most.",
                     index, type, off);
        else if (method == SHD_AREA_CLOSED)
            say_line(words, "Light %zu (%s): from all of its shape, in closed form.", index, type);
        else
            say_line(
                words,
                "Light %zu (%s): from all of its shape, by quadrature, to %.0e of what it adds "
                "at most.",
                index, type, off);
    }
}

static void say_spectrum(json_t *words, const shd_plan *plan) {
    const shd_scene *scene = plan->scene;
    const shd_spectral *spectral = &scene->spectral;
    if (!spectral->channels) return;
    say_line(words,
             "Spectrum: %d channels from %.6g to %.6g nm; each term and light has one color.",
             spectral->channels, spectral->from, spectral->to);
    size_t named = 0;
    for (size_t i = 0; i < scene->light_count; i++) {
        const shd_light *light = &scene->lights[i];
        const shd_curve *curve = light->color_curve ? light->color_curve : light->ambient_curve;
        if (!curve || named++ >= LIGHTS_NAMED) continue;
        if (curve->name)
            say_line(words, "Light %zu has the spectrum of CIE %s.", i, curve->name);
        else
            say_line(words, "Light %zu has a spectrum of %zu samples.", i, curve->count);
    }
    if (named > LIGHTS_NAMED) say_line(words, "So have %zu more lights.", named - LIGHTS_NAMED);
}

static void say_objects(json_t *words, const shd_plan *plan) {
    const shd_scene *scene = plan->scene;
    size_t pairs = 0;
    for (size_t i = 0; i < scene->object_count; i++) pairs += plan->objects[i].light_count;
    size_t most = scene->object_count * plan->light_count;
    say_line(words, "Objects: %zu, lit in %zu group%s of one material and one list of lights.",
             scene->object_count, plan->group_count, plan->group_count == 1 ? "" : "s");
    if (pairs < most)
        say_line(words, "Of %zu pairs of an object and a light, %zu matter.", most, pairs);
    if (plan->split_positions && plan->tier != SHD_EXACT)
        say_line(words, "Positions keep more digits than f32 has: %s.",
                 plan->textured ? "patterns and pictures are found by them"
                                : "a light is near an object, or a cone or a lobe is steep");
}

/* Which soft shadows have no bound: some pairs by name. */
static void say_unbounded(json_t *words, const shd_explained *e) {
    enum { NAMED = 4 };
    char names[NAMED * 64] = "";
    size_t used = 0;
    if (!e->unbounded_count) return;
    for (size_t i = 0; i < e->unbounded_count && i < NAMED; i++)
        used += (size_t)snprintf(names + used, sizeof names - used, "%slight %zu on object %zu",
                                 i ? ", " : "", e->unbounded[i][0], e->unbounded[i][1]);
    say_line(words,
             "Soft shadows have no bound where a light is at a surface's horizon, or seen from its "
             "edge: %s%s.",
             names, e->unbounded_count > NAMED ? ", and more" : "");
}

/* What is traced beyond the eye's rays. */
static void say_traced(json_t *words, const shd_explained *e) {
    const shd_trace *trace = &e->plan->scene->trace;
    char cut[SHD_BOUND_TEXT];
    if (trace->shadows)
        say_line(words,
                 "Shadows: of %zu pairs of an object and a light, %zu may have something between "
                 "them; rays go there only.",
                 e->occlusion.pair_count, e->occlusion.shadowed);
    say_unbounded(words, e);
    if (!trace->depth) return;
    if (!e->paths.bouncing) {
        say_line(words, "No ray goes on: all objects are opaque, and none mirrors or transmits.");
        return;
    }
    shd_print_bound(e->paths.cut, INFINITY, cut);
    say_line(words,
             "Rays go on from %zu object%s, %d time%s at most. What is left out of a sample is at "
             "most %s of the largest radiance that they would have met.",
             e->paths.bouncing, e->paths.bouncing == 1 ? "" : "s", trace->depth,
             trace->depth == 1 ? "" : "s", cut);
    if (!isfinite(e->cut)) return;
    shd_print_bound(e->cut, INFINITY, cut);
    say_line(words, "That is at most %s in linear components.", cut);
}

static void say_noise(json_t *words, const shd_plan *plan) {
    for (size_t g = 0; plan->westin && g < plan->group_count; g++) {
        const size_t material = plan->groups[g].material;
        const shd_westin *table = plan->westin[material];
        if (!table) continue;
        const char *name = plan->scene->materials[material].name;
        const shd_westin_error noise = shd_westin_noise(table);
        say_line(
            words,
            "Material \"%s\" reflects by simulated microgeometry: the standard error of pi f_r "
            "is %.2g in the mean, %.2g at most.",
            name, noise.rms, noise.max);
    }
}

static void say_samples(json_t *words, const shd_plan *plan) {
    const int samples = plan->scene->raster.samples;
    if (samples == 1)
        say_line(words, "Samples: one a pixel, through its center.");
    else if (shd_plan_is_thin(plan))
        say_line(words,
                 "Samples: one at the center of a pixel where a sphere or a plane fills 8 x 8 of "
                 "them and bends light by no more than %.2g + %.2g of a value, %sall %d elsewhere.",
                 plan->mean_room.absolute, plan->mean_room.relative,
                 shd_plan_rules(plan, plan->tier) && !plan->bunches
                     ? "fewer weighed ones where their mean is the same to f32's digits, "
                     : "",
                 samples);
    else if (shd_plan_rules(plan, plan->tier) && !plan->bunches)
        say_line(words,
                 "Samples: all %d of every pixel, but 7 weighed ones, 4, or pixels' centers alone "
                 "where a sphere or a plane fills %s pixels and their mean is the same to f32's "
                 "digits.",
                 samples, samples < SHD_FINE ? "8 x 8" : "4 x 4");
    else
        say_line(words, "Samples: all %d of every pixel.", samples);
}

static void say_sketches(json_t *words, const shd_plan *plan) {
    if (!plan->sketched) return;
    say_line(words,
             "Sketches: where a sphere or a plane is before all else in 8 x 8 pixels, f32 draws "
             "them from rays to colors, and past the rim of a sphere, but for other silhouettes, "
             "near lights and where highlights end.");
    if (plan->scene->mesh_triangles)
        say_line(words,
                 "Where one mesh alone may be seen in them, f64 tells which of its triangles rays "
                 "meet, and f32 draws these, but near lights and where highlights end.");
}

static void say_outputs(json_t *words, const shd_explained *e) {
    const shd_scene *scene = e->plan->scene;
    for (size_t i = 0; i < scene->output_count; i++) {
        const shd_output *output = &scene->outputs[i];
        say_line(words, "Output%s%s: %s, %s, its colors %s.", output->name ? " " : "",
                 output->name ? output->name : "", shd_format_get(output->format)->name,
                 output->depth == SHD_U8    ? "8 bits"
                 : output->depth == SHD_U16 ? "16 bits"
                                            : shd_depth_name(output->depth),
                 e->codes[i] ? "looked up in tables of codes" : "converted in floats");
    }
}

static void say_tiers(json_t *words, const shd_explained *e) {
    const char *own = shd_plan_tier_name(e->plan);
    if (e->plan->extended && !e->plan->models32) {
        if (!e->plan->glows) return; /* the others are the same */
        own = shd_tier_names[SHD_STANDARD];
    }
    for (int t = 0; t < e->tier_count; t++) {
        const shd_told_tier *tier = &e->tiers[t];
        char linear[SHD_BOUND_TEXT] = "an unknown sum";
        if (!strcmp(tier->name, own)) continue;
        if (isfinite(tier->bound.linear)) shd_print_bound(tier->bound.linear, INFINITY, linear);
        say_line(words,
                 "Tier %s would take about %.2g ms and err by at most %s in linear components.",
                 tier->name, tier->cost.total, linear);
    }
}

json_t *shd_explain_words(const shd_explained *e) {
    json_t *words = json_array();
    say_tier(words, e);
    if (e->plan->glows)
        say_line(words,
                 "Environments are summed less closely than where the tier exact is asked for.");
    say_bounds(words, e);
    say_cost(words, &e->cost, &e->trees);
    say_lights(words, e->plan);
    say_lamps(words, e->plan);
    say_spectrum(words, e->plan);
    say_objects(words, e->plan);
    say_traced(words, e);
    say_noise(words, e->plan);
    say_samples(words, e->plan);
    say_sketches(words, e->plan);
    say_outputs(words, e);
    say_tiers(words, e);
    return words;
}
