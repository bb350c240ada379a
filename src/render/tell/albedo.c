#include "render/tell/albedo.h"

#include <math.h>
#include <string.h>

#include "render/tell/quadrature.h"

static const shd_vec3 up = {0, 0, 1};

/* ---- Where lobes are. ---- */

/* How a term's directions are gone through: V by its angles from the normal, V by its angles from
 * R, or H by its angles from the normal. */
typedef enum grid_kind { OVER_HEMISPHERE, AROUND_MIRROR, OVER_HALVES } grid_kind;

static grid_kind kind_of(shd_model model) {
    switch (model) {
    case SHD_MODEL_PHONG:
    case SHD_MODEL_PHONG_NORMALIZED:
        return AROUND_MIRROR;
    case SHD_MODEL_BLINN_PHONG:
    case SHD_MODEL_COOK_TORRANCE:
        return OVER_HALVES;
    default:
        return OVER_HEMISPHERE;
    }
}

/* In the angle that the lobe is gone through by. cos^n falls as exp(-n t^2 / 2). */
static double width_of(const shd_plan_material *m, const shd_plan_lobe *lobe) {
    const double sharp = lobe->shininess;
    if (m->model == SHD_MODEL_COOK_TORRANCE) return fmin(1, sharp);
    return sharp > 2 ? sqrt(2 / sharp) : 1;
}

double shd_lobe_width(const shd_plan_material *m) {
    double least = 1;
    for (size_t k = 0; k < m->lobe_count; k++) least = fmin(least, width_of(m, &m->lobes[k]));
    return least;
}

/* ---- Integrals. ---- */

enum { PIECES_MOST = 8 };

/* The integral over one term, whose material has no others. */
typedef struct term_job {
    const shd_reflectance *of; /* has no other terms */
    const atomic_bool *cancelled;
    grid_kind kind;
    double width;
    shd_vec3 toward, mirror, across, side; /* `across` is perpendicular to the mirror */
    double polar;                          /* of the light */
    double tolerance;                      /* of inner integrals */
    size_t left;
    double inner; /* the largest error of an inner integral */
    double turn;  /* the outer variable: around the axis */
    double end;   /* of the inner one; where it is 0, that is the angle itself */
} term_job;

/* 0 where V is not seen. `jacobian` is dV of the grid's angles. */
static void reflect_to(const term_job *job, shd_vec3 view, double jacobian, double out[3]) {
    shd_reflectance_at(job->of, job->toward, view, out);
    for (size_t c = 0; c < 3; c++) out[c] *= view.z * jacobian;
}

static shd_vec3 unit_of(shd_vec3 v) {
    shd_normalize(v, &v);
    return v;
}

static void at_angle(void *context, double x, double out[3]) {
    const term_job *job = context;
    /* The root that a lobe of a small exponent has at its end is none of the fourth root. */
    const double cube = x * x * x, t = job->end > 0 ? job->end - x * cube : x,
                 stretch = job->end > 0 ? 4 * cube : 1;
    const double s = sin(t), c = cos(t);
    const shd_vec3 along =
        shd_add(shd_scale(job->across, cos(job->turn)), shd_scale(job->side, sin(job->turn)));
    const shd_vec3 axis = job->kind == AROUND_MIRROR ? job->mirror : up;
    const shd_vec3 d = shd_add(shd_scale(axis, c), shd_scale(along, s));
    if (job->kind != OVER_HALVES) {
        reflect_to(job, unit_of(d), s * stretch, out);
        return;
    }
    /* dV = 4 (L.H) dH */
    const double between = shd_dot(job->toward, d);
    const shd_vec3 view = shd_sub(shd_scale(d, 2 * between), job->toward);
    reflect_to(job, unit_of(view), 4 * between * s * stretch, out);
}

/* The angle at which the grid's ray reaches the horizon. Around R, N.V is A cos(t - delta) with
 * delta = atan2(cos(turn) sin, cos) of the light's angle. Over H, N.V is
 * A cos(2t - delta), for the same delta. */
static double horizon_of(const term_job *job, double delta) {
    if (job->kind == OVER_HEMISPHERE) return SHD_PI / 2;
    if (job->kind == OVER_HALVES) return (delta + SHD_PI / 2) / 2;
    return fmin(SHD_PI / 2, delta + SHD_PI / 2); /* (R.V)+ ends at a right angle */
}

/* Adds an end in its place, unless it is beyond the others. */
static void add_end(double ends[PIECES_MOST], size_t *count, double end) {
    size_t at = *count;
    if (!(end > 0 && end < ends[at - 1])) return;
    for (; ends[at - 1] > end; at--) ends[at] = ends[at - 1];
    ends[at] = end;
    ++*count;
}

/* Where the integrand bends. Cook and Torrance's G leaves 1 where the facets' groove shadows or
 * masks them: with k = tan(delta), 2 N.H N.L = V.H is tan t = 1 / k, 2 N.H N.V = V.H is
 * tan 3t = -1 / k, and between them, N.L = N.V is tan t = k. */
static void add_bends(const term_job *job, double delta, double ends[PIECES_MOST], size_t *count) {
    if (job->kind == OVER_HEMISPHERE) { /* Oren-Nayar's max(N.L, N.V) */
        add_end(ends, count, job->polar);
        return;
    }
    for (int k = 0; k < 4; k++) add_end(ends, count, job->width * (1 << k));
    if (job->of->material->model != SHD_MODEL_COOK_TORRANCE) return;
    if (delta <= SHD_PI / 4) {
        add_end(ends, count, (SHD_PI / 2 + delta) / 3);
    } else {
        add_end(ends, count, SHD_PI / 2 - delta);
        add_end(ends, count, delta);
    }
}

static void at_turn(void *context, double turn, double out[3]) {
    term_job *job = context;
    const double delta = atan2(cos(turn) * sin(job->polar), cos(job->polar)),
                 end = horizon_of(job, delta);
    double ends[PIECES_MOST] = {0, end};
    size_t count = 2;
    job->turn = turn;
    job->end = 0;
    if (job->kind == AROUND_MIRROR && job->width == 1) {
        job->end = end;
        ends[1] = pow(end, 0.25);
    } else {
        add_bends(job, delta, ends, &count);
    }
    const shd_quadrature inner = {at_angle, context, job->tolerance, &job->left};
    shd_integral sum;
    shd_integrate(&inner, ends, count, &sum);
    job->inner = fmax(job->inner, sum.error);
    if (shd_is_cancelled(job->cancelled)) job->left = 0;
    memcpy(out, sum.value, sizeof sum.value);
}

/* Points that an integral may take: some 50 ms of the slowest formula. The table of a simulation is
 * off by more than any quadrature of it. */
enum { POINTS_MOST = 200000, SIMULATED_MOST = 10000 };

static shd_integral integrate_term(term_job *job, double tolerance) {
    const double quarter = SHD_PI / 2;
    /* Isotropic models are alike on both sides of the plane of incidence. */
    const bool half = job->of->material->model != SHD_MODEL_WESTIN;
    double ends[PIECES_MOST] = {0, 2 * quarter, 4 * quarter};
    size_t count = half ? 2 : 3;
    add_end(ends, &count, quarter);
    if (!half) add_end(ends, &count, 3 * quarter);
    /* Where delta is 45 degrees: see add_bends. */
    if (job->kind == OVER_HALVES && half && tan(job->polar) > 1)
        add_end(ends, &count, acos(1 / tan(job->polar)));
    job->left = half ? POINTS_MOST : SIMULATED_MOST;
    job->tolerance = tolerance / 20;
    const shd_quadrature outer = {at_turn, job, tolerance, &job->left};
    shd_integral sum;
    shd_integrate(&outer, ends, count, &sum);
    sum.error += job->inner * (half ? 2 : 4) * quarter;
    for (int c = 0; c < 3; c++) sum.value[c] *= half ? 2 : 1;
    sum.error *= half ? 2 : 1;
    return sum;
}

/* Adds the integral of a material's terms that are gone through alike. */
static void add_terms(const shd_reflectance *of, grid_kind kind, double width, double polar,
                      double tolerance, double share[3], double *error) {
    term_job job = {.of = of,
                    .cancelled = of->plan->cancelled,
                    .kind = kind,
                    .width = width,
                    .toward = shd_polar(polar, SHD_PI),
                    .mirror = shd_polar(polar, 0),
                    .polar = polar};
    /* Toward the normal from R, or from the normal toward L. */
    job.across =
        kind == AROUND_MIRROR ? (shd_vec3){-cos(polar), 0, sin(polar)} : (shd_vec3){-1, 0, 0};
    job.side = shd_cross(kind == AROUND_MIRROR ? job.mirror : up, job.across);
    const shd_integral sum = integrate_term(&job, tolerance);
    for (int c = 0; c < 3; c++) share[c] += sum.value[c];
    *error += sum.error;
}

bool shd_albedo_find(const shd_reflectance *of, double polar, double tolerance, double share[3],
                     double *error) {
    const shd_plan_material *m = of->material;
    share[0] = share[1] = share[2] = *error = 0;
    if (m->model == SHD_MODEL_WESTIN) { /* whose table is found by the material's place */
        add_terms(of, OVER_HEMISPHERE, 1, polar, tolerance, share, error);
        return !shd_is_cancelled(of->plan->cancelled);
    }
    shd_plan_material alone = *m;
    shd_reflectance part = {.plan = of->plan, .material = &alone, .object = of->object};
    alone.lobe_count = 0;
    if (m->has_diffuse) add_terms(&part, OVER_HEMISPHERE, 1, polar, tolerance, share, error);
    memset(alone.diffuse, 0, sizeof alone.diffuse);
    alone.lobe_count = 1;
    for (size_t k = 0; k < m->lobe_count && !shd_is_cancelled(of->plan->cancelled); k++) {
        alone.lobes = &m->lobes[k];
        /* In a spectral scene the lobe's reflectances follow those of the diffuse term, which is 0.
         */
        if (m->bins) alone.bins = m->bins + k * of->plan->bins->count;
        add_terms(&part, kind_of(m->model), width_of(m, alone.lobes), polar, tolerance, share,
                  error);
    }
    return !shd_is_cancelled(of->plan->cancelled);
}
