#include "render/tell/figures.h"

#include <math.h>
#include <string.h>

#include "render/tell/albedo.h"

#define DEGREE (SHD_PI / 180)

/* ---- The albedo. ---- */

/* Where else it is looked whether energy is gained: an albedo may grow up to the horizon. */
static const double beyond[] = {89.9, 89.99};
enum { SCANNED = SHD_ALBEDO_ANGLES + 2 };

/* What is no gain where all light is sent on: of quadrature, and of what f32 holds of a table that
 * sends on all. */
static double slack_of(const shd_reflectance *r) {
    return r->material->model == SHD_MODEL_WESTIN ? 1e-6 : 1e-9;
}

static double largest_of(const double f[3]) {
    return fmax(f[0], fmax(f[1], f[2]));
}

/* Of coefficients below 0, too, which take light away. */
static double largest_size_of(const double f[3]) {
    return fmax(fabs(f[0]), fmax(fabs(f[1]), fabs(f[2])));
}

static double scanned_angle(size_t i) {
    return i < SHD_ALBEDO_ANGLES ? shd_albedo_angles[i] : beyond[i - SHD_ALBEDO_ANGLES];
}

/* The angle between two at which more than all light begins to be sent on. */
static double find_gain(const shd_reflectance *r, double low, double high) {
    for (int step = 0; step < 12 && !shd_is_cancelled(r->plan->cancelled); step++) {
        const double middle = (low + high) / 2;
        double share[3], error;
        shd_albedo_find(r, middle * DEGREE, 1e-7, share, &error);
        *(largest_of(share) > 1 ? &high : &low) = middle;
    }
    return (low + high) / 2;
}

/* f_r N.L of Phong's and Blinn's lobes is not 0 at the horizon, so that their albedo grows as 1 /
 * N.L there, and passes 1 however narrow a lobe is. */
static bool ends_in_gain(const shd_plan_material *m) {
    bool positive[3] = {false, false, false}, negative[3] = {false, false, false}, any = false;
    if (m->model != SHD_MODEL_PHONG && m->model != SHD_MODEL_BLINN_PHONG) return false;
    for (size_t k = 0; k < m->lobe_count; k++)
        for (int c = 0; c < 3; c++) {
            positive[c] |= m->lobes[k].specular[c] > 0;
            negative[c] |= m->lobes[k].specular[c] < 0;
        }
    for (int c = 0; c < 3; c++) any |= positive[c] && !negative[c];
    return any;
}

/* The same beyond all angles of the scan, nearer to the horizon by a tenth each time. 90: nearer
 * than f64 tells. */
static double find_last_gain(const shd_reflectance *r) {
    static const double NEAREST = 5e-12;
    for (double off = 1e-3; off > NEAREST; off /= 10) {
        double share[3], error;
        if (!shd_albedo_find(r, (90 - off) * DEGREE, 1e-7, share, &error)) return NAN;
        if (largest_of(share) > 1 + 1e-6) return find_gain(r, 90 - 10 * off, 90 - off);
    }
    return 90;
}

static bool find_albedo(shd_reflectance *r) {
    const double slack = slack_of(r);
    r->gains = NAN;
    for (size_t i = 0; i < SCANNED; i++) {
        double share[3], error;
        const double angle = scanned_angle(i);
        if (!shd_albedo_find(r, angle * DEGREE, 1e-11, share, &error)) return false;
        const double most = largest_of(share);
        if (i < SHD_ALBEDO_ANGLES) {
            memcpy(r->albedo[i], share, sizeof share);
            r->quadrature = fmax(r->quadrature, error);
        }
        if (i == 0 || most > r->most + slack) {
            r->most = most;
            r->most_angle = angle;
        }
        if (isnan(r->gains) && most > 1 + slack + error)
            r->gains = i ? find_gain(r, scanned_angle(i - 1), angle) : 0;
    }
    if (isnan(r->gains) && ends_in_gain(r->material)) r->gains = find_last_gain(r);
    return !shd_is_cancelled(r->plan->cancelled);
}

/* ---- Reciprocity and limits. ---- */

static void try_pair(shd_reflectance *r, double a, double b, double turn) {
    const shd_vec3 x = shd_polar(a * DEGREE, 0), y = shd_polar(b * DEGREE, turn * DEGREE);
    double there[3], back[3];
    if (!(b >= 0 && b < 90)) return;
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

static void find_residual(shd_reflectance *r) {
    static const double offs[] = {-2, -1, -0.5, 0.5, 1, 2};
    const double width = shd_lobe_width(r->material) / DEGREE;
    for (int a = 5; a < 90; a += 10) {
        for (int b = a; b < 90; b += 10)
            for (int turn = 0; turn <= 180; turn += 30) try_pair(r, a, b, turn);
        /* Beside the mirrored direction, where narrow lobes are. */
        for (size_t k = 0; k < sizeof offs / sizeof offs[0]; k++)
            try_pair(r, a, a + offs[k] * width, 180);
    }
}

/* The largest |f_r| of light so high above the surface, over views among which are L, where rough
 * facets send light back, and R. */
static double largest_at(const shd_reflectance *r, double height) {
    const double level = sqrt(1 - height * height);
    const shd_vec3 light = {-level, 0, height}, ends[] = {light, {level, 0, height}};
    double f[3], most = 0;
    for (size_t i = 0; i < 2; i++) {
        shd_reflectance_at(r, light, ends[i], f);
        most = fmax(most, largest_size_of(f));
    }
    for (int polar = 0; polar < 90; polar += 10)
        for (int turn = 0; turn <= 180; turn += 15) {
            shd_reflectance_at(r, light, shd_polar(polar * DEGREE, turn * DEGREE), f);
            most = fmax(most, largest_size_of(f));
        }
    return most;
}

/* A hundred times nearer to the surface it is more than ten times as large, twice. */
static bool grows_without_limit(const shd_reflectance *r) {
    double before = 0;
    int grown = 0;
    for (double height = 1e-4; height > 1e-9; height /= 100) {
        const double most = largest_at(r, height);
        grown += before > 0 && most > 10 * before;
        before = most;
    }
    return grown >= 2;
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
