#include "render/tell/illuminants.h"

#include <math.h>
#include <string.h>

#include "base/primaries.h"
#include "color/delta_e.h"

enum { MATERIALS_MOST = 64 };

static const shd_affine SAME = {.linear = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};

typedef struct pair {
    size_t a, b;
    double apart, under_d65;
} pair;

typedef struct sweep {
    const shd_plan *plan;
    shd_bins bins; /* of lights in linear Rec.709 */
    double to_xyz[3][3];
    size_t count;
    size_t materials[MATERIALS_MOST]; /* in plan->materials */
} sweep;

/* CIE 15:2004 (8.3 to 8.6), of X / Xn. */
static double lab_curve(double t) {
    const double edge = 24.0 / 116;
    return t > edge * edge * edge ? cbrt(t) : (841.0 / 108) * t + 16.0 / 116;
}

static void find_xyz(const sweep *s, const double *reflectance, const double (*light)[3],
                     double xyz[3]) {
    double rgb[3];
    shd_bins_mix(s->bins.count, reflectance, light, rgb);
    for (int row = 0; row < 3; row++)
        xyz[row] =
            s->to_xyz[row][0] * rgb[0] + s->to_xyz[row][1] * rgb[1] + s->to_xyz[row][2] * rgb[2];
}

/* The Lab of each material's diffuse color. */
static void find_labs(const sweep *s, const shd_curve *illuminant, double labs[MATERIALS_MOST][3]) {
    double light[SHD_BINS_MOST][3], white[3];
    memset(light, 0, sizeof light);
    shd_bins_add_light(&s->bins, illuminant, light);
    find_xyz(s, NULL, (const double(*)[3])light, white);
    for (size_t i = 0; i < s->count; i++) {
        double f[3];
        find_xyz(s, s->plan->materials[s->materials[i]].bins, (const double(*)[3])light, f);
        for (int c = 0; c < 3; c++) f[c] = lab_curve(f[c] / white[c]);
        labs[i][0] = 116 * f[1] - 16;
        labs[i][1] = 500 * (f[0] - f[1]);
        labs[i][2] = 200 * (f[1] - f[2]);
    }
}

static pair widest(const sweep *s, double labs[MATERIALS_MOST][3],
                   double known[MATERIALS_MOST][3]) {
    pair found = {.apart = -INFINITY};
    for (size_t a = 0; a < s->count; a++)
        for (size_t b = a + 1; b < s->count; b++) {
            const pair p = {a, b, shd_delta_e_2000(labs[a], labs[b]),
                            shd_delta_e_2000(known[a], known[b])};
            if (p.apart - p.under_d65 > found.apart - found.under_d65) found = p;
        }
    return found;
}

/* Materials without a name are called by their index. */
static json_t *tell_name(const sweep *s, size_t i) {
    const char *name = s->plan->scene->materials[s->materials[i]].name;
    return name[0] ? json_string(name) : json_sprintf("material %zu", s->materials[i]);
}

static json_t *tell_pair(const sweep *s, const char *illuminant, const pair *p) {
    return json_pack("{ss s[oo] sf sf}", "illuminant", illuminant, "materials", tell_name(s, p->a),
                     tell_name(s, p->b), "deltaE2000", p->apart, "underD65", p->under_d65);
}

static void find_materials(sweep *s) {
    const shd_plan *plan = s->plan;
    for (size_t m = 0; m < plan->scene->material_count && s->count < MATERIALS_MOST; m++)
        if (plan->materials[m].has_diffuse && !plan->scene->materials[m].diffuse_texture)
            s->materials[s->count++] = m;
}

json_t *shd_tell_illuminants(const shd_plan *plan, shd_arena *arena) {
    const shd_bins *bins = plan->bins;
    double known[MATERIALS_MOST][3], labs[MATERIALS_MOST][3];
    sweep s = {.plan = plan};
    shd_curve_kind kind;
    if (!shd_bins_make(bins->count, bins->from, bins->to, &SAME, arena, &s.bins) ||
        !shd_primaries_to_xyz(shd_rec709, s.to_xyz))
        return NULL;
    find_materials(&s);
    if (s.count < 2) return json_null();
    for (size_t i = 0; i < shd_curve_names(); i++) {
        const shd_curve curve = shd_curve_named(i, &kind);
        if (!strcmp(curve.name, "D65")) find_labs(&s, &curve, known);
    }
    json_t *each = json_array(), *worst = NULL;
    double most = -INFINITY;
    for (size_t i = 0; i < shd_curve_names() && !shd_is_cancelled(plan->cancelled); i++) {
        const shd_curve curve = shd_curve_named(i, &kind);
        if (kind != SHD_CURVE_LIGHT) continue;
        find_labs(&s, &curve, labs);
        const pair p = widest(&s, labs, known);
        json_t *told = tell_pair(&s, curve.name, &p);
        json_array_append_new(each, told);
        if (!(p.apart - p.under_d65 > most)) continue;
        most = p.apart - p.under_d65;
        worst = told;
    }
    return json_pack("{sO so}", "worst", worst, "each", each);
}
