#include "render/tell/reflectance.h"

#include <math.h>

#include "shade/extended.h"

#define DEGREE (SHD_PI / 180)

const double shd_albedo_angles[SHD_ALBEDO_ANGLES] = {0,  5,  10, 15, 20, 25, 30, 35, 40, 45,
                                                     50, 55, 60, 65, 70, 75, 80, 85, 89};

void shd_reflectance_at(const shd_reflectance *r, shd_vec3 light, shd_vec3 view, double f[3]) {
    const shd_plan_material *m = r->material;
    const shd_vec3 up = {0, 0, 1};
    const shd_plan_light source = {.directional = true, .toward = light, .gain = 1};
    const shd_surface at = {.normal = up,
                            .view = view,
                            .mirror = {-view.x, -view.y, view.z},
                            .material = m,
                            .object = r->object};
    double row[SHD_BRDF_ROWS];
    f[0] = f[1] = f[2] = 0;
    if (!(light.z > 0 && view.z > 0) || !shd_weigh_extended(r->plan, &source, &at, row)) return;
    for (size_t c = 0; c < 3; c++) {
        double sum = m->diffuse[c] * row[c];
        for (size_t k = 0; k < m->lobe_count; k++)
            sum += m->lobes[k].specular[c] * row[3 + 3 * k + c];
        f[c] = sum / (SHD_PI * light.z);
    }
}

/* ---- The albedo: the integral of f_r N.V over the hemisphere of V. ---- */

/* The nodes and weights on [0, 1] of Gauss and Legendre, by Newton's method. */
static void make_nodes(size_t count, double *x, double *w) {
    for (size_t i = 0; i < count; i++) {
        double z = cos(SHD_PI * ((double)i + 0.75) / ((double)count + 0.5)), slope = 1;
        for (int step = 0; step < 20; step++) {
            double p = 1, before = 0;
            for (size_t k = 0; k < count; k++) {
                const double n = (double)k, next = ((2 * n + 1) * z * p - n * before) / (n + 1);
                before = p;
                p = next;
            }
            slope = (double)count * (z * p - before) / (z * z - 1);
            z -= p / slope;
        }
        x[i] = (1 - z) / 2;
        w[i] = 1 / ((1 - z * z) * slope * slope);
    }
}

enum { MOST_NODES = 32 };

typedef struct quadrature {
    size_t count;
    double x[MOST_NODES], w[MOST_NODES];
} quadrature;

/* The half of the circle of V at the angle t around the mirrored light, which is above the horizon
 * for azimuths up to `half`, on both sides of the plane of incidence. */
static void add_circle(const shd_reflectance *r, const quadrature *rule, double polar, double t,
                       double weight, double sum[3]) {
    enum { PIECES = 3 };
    const double p = cos(polar) * cos(t), q = sin(polar) * sin(t);
    const double half = p >= q ? SHD_PI : p <= -q ? 0 : acos(-p / q);
    const shd_vec3 light = shd_polar(polar, SHD_PI), mirror = shd_polar(polar, 0);
    const shd_vec3 upward = {-cos(polar), 0, sin(polar)}; /* in the plane, across the mirror */
    for (size_t i = 0; i < PIECES * rule->count; i++) {
        const size_t piece = i / rule->count, node = i % rule->count;
        const double turn = half * ((double)piece + rule->x[node]) / PIECES,
                     share = half * rule->w[node] / PIECES;
        for (int side = -1; side <= 1; side += 2) {
            const shd_vec3 v =
                shd_madd(shd_madd(shd_scale(mirror, cos(t)), upward, sin(t) * cos(turn)),
                         (shd_vec3){0, 1, 0}, side * sin(t) * sin(turn));
            double f[3];
            if (!(v.z > 0)) continue;
            shd_reflectance_at(r, light, v, f);
            for (int c = 0; c < 3; c++) sum[c] += f[c] * v.z * sin(t) * share * weight;
        }
    }
}

/* How narrow the narrowest lobe is. */
static double width_of(const shd_plan_material *m) {
    double width = 1;
    for (size_t k = 0; k < m->lobe_count; k++) {
        const double s = m->lobes[k].shininess;
        width = fmin(width, m->model == SHD_MODEL_COOK_TORRANCE ? s : 1 / sqrt(s + 1));
    }
    return width;
}

/* By circles around the mirrored light: from lobe to lobe twice as wide, and cut where circles meet
 * the horizon and where Phong's lobes end, with nodes that crowd at the cuts. */
static void integrate(const shd_reflectance *r, const quadrature *rule, double polar,
                      double sum[3]) {
    const double kink = SHD_PI / 2 - polar, edge = SHD_PI / 2, end = SHD_PI / 2 + polar;
    double low = 0, next = width_of(r->material) / 4;
    sum[0] = sum[1] = sum[2] = 0;
    while (low < end) {
        double high = fmin(next, end);
        if (low < kink && high > kink) high = kink;
        if (low < edge && high > edge) high = edge;
        for (size_t i = 0; i < rule->count; i++) {
            const double u = rule->x[i], t = low + (high - low) * u * u * (3 - 2 * u);
            add_circle(r, rule, polar, t, (high - low) * 6 * u * (1 - u) * rule->w[i], sum);
        }
        low = high;
        if (high >= next) next *= 2;
    }
}

static bool find_albedo(shd_reflectance *r) {
    quadrature fine = {.count = 24}, coarse = {.count = 16};
    make_nodes(fine.count, fine.x, fine.w);
    make_nodes(coarse.count, coarse.x, coarse.w);
    r->gains = NAN;
    for (size_t i = 0; i < SHD_ALBEDO_ANGLES; i++) {
        if (shd_is_cancelled(r->plan->cancelled)) return false;
        const double polar = shd_albedo_angles[i] * DEGREE;
        double rough[3];
        integrate(r, &fine, polar, r->albedo[i]);
        integrate(r, &coarse, polar, rough);
        for (int c = 0; c < 3; c++) {
            r->quadrature = fmax(r->quadrature, fabs(r->albedo[i][c] - rough[c]));
            if (r->albedo[i][c] > 1 + 1e-6 && isnan(r->gains)) r->gains = shd_albedo_angles[i];
        }
    }
    /* The degree between the angle before and that one. */
    for (double angle = r->gains - 4; !isnan(r->gains) && angle > 0 && angle < r->gains; angle++) {
        double sum[3];
        if (shd_is_cancelled(r->plan->cancelled)) return false;
        integrate(r, &coarse, angle * DEGREE, sum);
        if (fmax(sum[0], fmax(sum[1], sum[2])) > 1 + 1e-6) r->gains = angle;
    }
    return true;
}

/* ---- Reciprocity and limits. ---- */

static void find_residual(shd_reflectance *r) {
    for (int a = 5; a < 90; a += 10)
        for (int b = a; b < 90; b += 10)
            for (int turn = 0; turn <= 180; turn += 30) {
                const shd_vec3 x = shd_polar(a * DEGREE, 0),
                               y = shd_polar(b * DEGREE, turn * DEGREE);
                double there[3], back[3];
                shd_reflectance_at(r, x, y, there);
                shd_reflectance_at(r, y, x, back);
                for (int c = 0; c < 3; c++) {
                    const double larger = fmax(fabs(there[c]), fabs(back[c])),
                                 residual = fabs(there[c] - back[c]) / larger;
                    if (!(larger > 1e-9) || !(residual > r->residual)) continue;
                    r->residual = residual;
                    r->residual_light = a;
                    r->residual_view = b;
                    r->residual_turn = turn;
                }
            }
}

/* Whether it grows toward the surface, the eye at the mirrored direction or at the light: a hundred
 * times nearer it is more than ten times as large, twice. */
static bool grows_toward(const shd_reflectance *r, double eye) {
    double before = 0;
    int grown = 0;
    for (double height = 1e-2; height > 1e-8; height /= 100) {
        double f[3];
        shd_reflectance_at(r, shd_polar(SHD_PI / 2 - height, SHD_PI),
                           shd_polar(SHD_PI / 2 - height, eye), f);
        const double most = fmax(f[0], fmax(f[1], f[2]));
        grown += before > 0 && most > 10 * before;
        before = most;
    }
    return grown >= 2;
}

static bool grows_without_limit(const shd_reflectance *r) {
    return grows_toward(r, 0) || grows_toward(r, SHD_PI);
}

bool shd_reflectance_find(const shd_plan *plan, size_t object, shd_reflectance *out) {
    *out = (shd_reflectance){.plan = plan,
                             .material = &plan->materials[plan->objects[object].material],
                             .object = object};
    if (!find_albedo(out)) return false;
    find_residual(out);
    out->unbounded = grows_without_limit(out);
    return true;
}
