#include "bound/light/error.h"

#include "plan/nodes.h"

/* Half an ulp of f32 and f64, relative. */
#define U32 0x1p-24
#define U64 0x1p-53

static const shd_path_error fused[] = {
    [SHD_PATH_DIRECTIONAL] = {2 * U32, 1.2 * U32, 1.8 * U32},
    [SHD_PATH_POINT] = {2.6 * U32, 2.4 * U32, 2.3 * U32},
    [SHD_PATH_ATTENUATED] = {2.6 * U32, 9.4 * U32, 2.3 * U32},
};
/* Where products are rounded by themselves, the sum of three is off by one unit more at most, of
 * the products' absolute sum: N.L, and, where none is below 0, |L|^2 and |L - W|^2. L - W is as
 * above. a + d (b + d c) is off by two more, and the attenuation by that and by |L|^2. */
static const shd_path_error loose[] = {
    [SHD_PATH_DIRECTIONAL] = {3 * U32, 1.2 * U32, 1.8 * U32},
    [SHD_PATH_POINT] = {3.6 * U32, 2.9 * U32, 2.4 * U32},
    [SHD_PATH_ATTENUATED] = {3.6 * U32, 12.9 * U32, 2.4 * U32},
};
/* Of sketches: light's directions err by 28 units, normals by 77 and mirrored views by 278 (proven
 * in shade/sketch.c), beside what is told above, of products that may not be fused. */
static const shd_path_error sketched[] = {
    [SHD_PATH_DIRECTIONAL] = {112 * U32, 1.2 * U32, 312 * U32},
    [SHD_PATH_POINT] = {112 * U32, 35 * U32, 312 * U32},
    [SHD_PATH_ATTENUATED] = {112 * U32, 70 * U32, 312 * U32},
};
/* The same on ellipsoids: 14, 127 and 434 units. */
static const shd_path_error sketched_ellipsoids[] = {
    [SHD_PATH_DIRECTIONAL] = {150 * U32, 1.2 * U32, 460 * U32},
    [SHD_PATH_POINT] = {150 * U32, 21 * U32, 460 * U32},
    [SHD_PATH_ATTENUATED] = {150 * U32, 42 * U32, 460 * U32},
};
/* Of N.V, the products and the difference, and because N and V are not unit to the last digit. */
static const shd_path_error exact = {4 * U64, 8 * U64, 8 * U64};

shd_rounding shd_rounding_of(shd_tier tier, shd_isa isa) {
    return tier == SHD_EXACT    ? SHD_ROUNDS_64
           : shd_isa_fuses(isa) ? SHD_ROUNDS_FUSED
                                : SHD_ROUNDS_LOOSE;
}

const shd_path_error *shd_path_error_of(shd_rounding rounding, shd_path path) {
    return rounding == SHD_ROUNDS_64      ? &exact
           : rounding == SHD_ROUNDS_FUSED ? &fused[path]
                                          : &loose[path];
}

const shd_path_error *shd_sketch_error_of(bool ellipsoid, shd_path path) {
    return ellipsoid ? &sketched_ellipsoids[path] : &sketched[path];
}

double shd_color_error(const shd_plan *plan, shd_tier tier) {
    const shd_scene *scene = plan->scene;
    const shd_rounding rounding = shd_rounding_of(tier, plan->isa);
    double roundings = rounding == SHD_ROUNDS_64      ? 1
                       : rounding == SHD_ROUNDS_FUSED ? SHD_LIGHT_GROUP + 1
                                                      : SHD_LIGHT_GROUP + 2 /* colors' products */;
    /* Of each light's terms, their colors, and the sum. */
    if (plan->sketched)
        roundings += fmin((double)plan->light_count, SHD_SKETCH_LIGHTS) * (1 + SHD_SKETCH_LOBES);
    for (size_t i = 0; i < scene->object_count; i++)
        if (scene->objects[i].interpolation == SHD_GOURAUD) {
            roundings++;
            break;
        }
    /* Of each pattern: its weight, what that multiplies, their mean and color and what these add
     * to, of a color that may go down as far as the other one is up. */
    if (plan->textured) roundings += 10 * (double)(plan->max_terms - plan->max_lobes);
    const int samples = scene->raster.samples;
    if (samples > 1) {
        if (plan->sketched && scene->mesh_triangles) roundings += samples; /* f32 sums those */
        const double groups = (double)plan->group_count,
                     parts = groups < samples ? groups : samples;
        const bool even = (samples & (samples - 1)) == 0; /* shares are not rounded */
        roundings += 1 + parts + 2 + (even ? 0 : 2 * parts);
        /* Of the background's alpha and share, and of what the sum is divided by. */
        if (scene->transparent && scene->background_alpha > 0) roundings += 7;
        if (shd_plan_rules(plan, tier) > 0) roundings *= SHD_NODES_SPREAD;
    }
    return roundings * U32;
}

double shd_shine_power(double shine, double shininess) {
    if (!(shine > 0)) return 0;
    return shine < 1 && shininess > 0 ? pow(shine, shininess) : 1;
}

shd_lobe_error shd_lobe_error_of(shd_rounding rounding, double shininess, size_t lights) {
    const bool wide = rounding == SHD_ROUNDS_64;
    /* Polynomials have twice the roundings. */
    const double unit = rounding == SHD_ROUNDS_LOOSE ? 2 * U32 : U32;
    shd_lobe_error e = {.shininess = shininess,
                        .square = 2 * (wide ? U64 : unit),
                        .ratio = wide ? 10 * U64 : 4 * unit};
    if (!wide) {
        const double cut = shd_lobe_cut(lights);
        if (shd_is_short_lobe(shininess, SHD_LEAST_CUT)) e.rough = 0.3 * unit;
        if (cut < shininess) e.faint = exp(shininess * log1p(-cut / shininess));
    }
    if (shd_is_sheer(shininess)) { /* it is done in f64, by positions of twice f32's digits */
        e.slope = fmax(2, shininess * pow(SHD_CLIFF, shininess - 1));
        e.turned_ratio = INFINITY;
        return e;
    }
    e.crest = (shininess - 1) / (shininess - 0.5);
    e.slope = e.crest > 0 ? shininess * pow(e.crest, shininess - 1) : 1;
    /* Up to the crest, errors rise with R.V, and relative errors fall. */
    e.foot = pow(SHD_LOBE_FOOT, 1 / shininess);
    e.turned_ratio =
        e.foot < e.crest ? shininess * sqrt(2 - 2 * e.foot) / e.foot : (double)INFINITY;
    return e;
}

double shd_lobe_turned(const shd_lobe_error *e, double shine, double power, double direction) {
    double slope = e->slope, c = e->crest;
    if (shine < c) {
        if (!(shine > 0)) return 0;
        c = shine;
        slope = e->shininess * power / shine;
    }
    return slope * (sqrt(2 - 2 * c) * direction + (1 - c) * e->square);
}

double shd_lobe_foot(const shd_lobe_error *e, double shine, double power, double direction) {
    if (e->turned_ratio < INFINITY && shine > e->foot) shine = e->foot, power = SHD_LOBE_FOOT;
    return shd_lobe_turned(e, shine, power, direction);
}

double shd_lobe_ratio(const shd_lobe_error *e, double direction) {
    if (!(e->turned_ratio < INFINITY)) return e->ratio;
    return e->ratio + direction * e->turned_ratio +
           e->square * e->shininess * (1 - e->foot) / e->foot;
}

double shd_lobe_functions(const shd_lobe_error *e, double power) {
    return e->ratio * power;
}

double shd_lobe_faint(const shd_lobe_error *e, double power) {
    const double none = ldexp(2, SHD_LEAST_LOG2); /* twice the kernels' least power */
    return (e->faint < power ? e->faint : power) +
           (e->rough < 0.5 * power ? e->rough : 0.5 * power) + none;
}

/* The error by functions is largest at the highlight's middle, and that by directions where the
 * highlight has fallen to 0.6. */
double shd_lobe_sum(double turned, double functions) {
    const double both = 0.8 * functions + turned;
    return functions > both ? functions : both;
}

double shd_spot_error(shd_rounding rounding, const shd_plan_light *spot, double low, double high,
                      double moved) {
    const double direction = shd_path_error_of(rounding, SHD_PATH_ATTENUATED)->direction + moved;
    const double unit = rounding == SHD_ROUNDS_64 ? U64 : U32;
    double error = 0;
    /* q is off by sqrt(2 q) times the directions' error, and smoothstep is 1.5 steep at most. All
     * this is nothing before the cone begins to fade. */
    const double q = 1 - low < spot->outer ? 1 - low : spot->outer;
    if (spot->outer > spot->inner && q > spot->inner - 1e-5)
        error = 1.5 *
                (sqrt(2 * q) * direction + (rounding == SHD_ROUNDS_LOOSE ? 5 : 4) * unit * q) /
                (spot->outer - spot->inner);
    if (spot->exponent > 0) {
        const shd_lobe_error e = shd_lobe_error_of(rounding, spot->exponent, 1);
        const double power = shd_shine_power(high, spot->exponent);
        error += shd_lobe_sum(shd_lobe_turned(&e, high, power, direction),
                              shd_lobe_functions(&e, power));
    }
    return error < 1 ? error : 1;
}
