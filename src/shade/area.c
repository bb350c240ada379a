#include "shade/area.h"

#include <string.h>

#include "shade/area_cells.h"
#include "shade/area_contour.h"
#include "shade/exact.h"

/* What a light may be off as a point, of the most that it adds. */
static const double POINT_OFF = 1e-9;

/* What sums over a whole shape by few points may be off, of the same (area_cells.h). */
static const double WHOLE_OFF = 1e-9;

/* Under this size, sums over the boundary lose digits to cancellation, which is eps / size, and a
 * few points inside are exact. */
static const double SMALL = 0.01;

/* Beyond this there is nothing but a point. */
static const double TINY = 1e-30;

/* How far the mean of a weight over a light of this size is off the weight of its middle. In the
 * angle t, a power of a cosine has |w'| <= sqrt(n) and |w''| <= n + 1, if n is 0 or at least 2, and
 * cos / distance^2 has the factor 1 + e with |e| <= 4 size to the first order and 12 size^2 to the
 * second. First orders vanish in the mean, but for their product. For n between 0 and 2, w'' is
 * unbounded at 90 degrees, which is 1 / size away or a horizon cuts the light. */
double shd_area_off(double size, double exponent) {
    return size * size * (exponent + 1 + 4 * sqrt(exponent) + 12);
}

/* The shape's size from a distance. */
static double size_at(const shd_light *light, double distance) {
    const double extent = light->type == SHD_LIGHT_RECT
                              ? shd_length((shd_vec3){light->size[0], light->size[1], 0}) / 2
                              : light->radius;
    return extent / distance;
}

shd_area_method shd_area_choose(const shd_light *light, const shd_plan_lobe *lobes, size_t count,
                                double distance, double point_off, double *off) {
    const double size = size_at(light, distance);
    bool closed = true;
    *off = shd_area_off(size, 1);
    for (size_t k = 0; k < count; k++) {
        *off = shd_larger(*off, shd_area_off(size, lobes[k].shininess));
        closed &= light->type == SHD_LIGHT_RECT && shd_has_moments(lobes[k].shininess);
    }
    if (*off <= shd_larger(point_off, POINT_OFF)) return SHD_AREA_POINT;
    *off = closed ? 0 : SHD_AREA_TOLERANCE;
    return closed ? SHD_AREA_CLOSED : SHD_AREA_QUADRATURE;
}

/* Whether the light is a point for this weight: no horizon cuts it, and it is small. */
static bool is_point(const shd_seen *seen, int side, double exponent) {
    return seen->size < TINY ||
           (side == 1 && shd_area_off(seen->size, exponent) <= seen->point_off);
}

/* Whether a few points inside are exact. */
static bool is_small(const shd_seen *seen, double exponent) {
    return seen->size < SMALL && seen->size * seen->size * (exponent + 1) < SMALL;
}

static double held(double weight) {
    return shd_smaller(weight, SHD_LARGEST_FALL);
}

typedef struct power {
    shd_vec3 axis;
    double exponent;
    unsigned whole; /* the exponent, if it is an integer that products are quicker for; or 0 */
} power;

static power power_of(shd_vec3 axis, double exponent) {
    enum { MOST = 1024 };
    const bool whole = exponent <= MOST && exponent == floor(exponent);
    return (power){axis, exponent, whole ? (unsigned)exponent : 0};
}

static void power_at(const void *context, shd_vec3 toward, double *row) {
    const power *p = context;
    const shd_vec3 off = shd_sub(toward, p->axis);
    if (p->whole) {
        double square = shd_larger(1 - shd_dot(off, off) / 2, 0), product = 1;
        for (unsigned n = p->whole; n; n >>= 1, square *= square)
            if (n & 1) product *= square;
        *row = product;
        return;
    }
    *row = shd_weigh_lobe(p->exponent, 1, shd_dot(off, off) / 2);
}

/* Whether the power is less than e^-40 all over the shape, which is in the cone of sine `size`
 * around its middle. */
static bool is_faint(const shd_seen *seen, shd_vec3 axis, double exponent) {
    const double s = seen->size, z = shd_dot(axis, seen->toward);
    if (!(s < 1)) return false;
    const double cosine = sqrt((1 - s) * (1 + s));
    if (!(z < cosine)) return false;
    const double most = z * cosine + sqrt((1 - z) * (1 + z)) * s;
    return most <= 0 ? exponent > 0 : exponent * log(most) < -40;
}

/* The mean of (axis.L)^n over the region, times its solid angle over A. */
static double weigh_power(const shd_seen *seen, shd_vec3 axis, double exponent, int side,
                          double *error) {
    double off = 0, sum = 0;
    if (is_faint(seen, axis, exponent)) return 0;
    if (is_point(seen, side, exponent)) {
        power_at(&(power){axis, exponent, 0}, seen->toward, &sum);
        return sum * seen->fall;
    }
    const bool steep = exponent < 2 && side < 1 && exponent != 1;
    const power p = power_of(axis, exponent);
    const shd_area_model model = {.weigh = power_at, .context = &p, .count = 1};
    /* Powers that are no integers have a kink on their horizon, which few points stay away from. */
    const bool smooth =
        side == 1 && (exponent == 1 || shd_dot(axis, seen->toward) > 4 * seen->size);
    if (smooth && shd_cells_whole(seen, shd_area_off(seen->size, exponent), &model, &sum)) {
        *error = shd_larger(held(WHOLE_OFF * seen->fall), *error);
        return held(sum * seen->gain);
    }
    if (!steep && is_small(seen, exponent))
        shd_cells_small(seen, &model, &sum);
    else
        sum = shd_contour_lobe(seen, axis, exponent, &off);
    *error = shd_larger(held(off * seen->gain), *error);
    return held(sum * seen->gain);
}

static double weigh_diffuse(const shd_seen *seen, shd_vec3 normal, int side) {
    double sum = 0;
    const power cosine = power_of(normal, 1);
    const shd_area_model model = {.weigh = power_at, .context = &cosine, .count = 1};
    if (is_point(seen, side, 1)) return shd_dot(normal, seen->toward) * seen->fall;
    if (!is_small(seen, 1))
        sum = shd_contour_diffuse(seen, normal);
    else if (side < 1 || !shd_cells_whole(seen, shd_area_off(seen->size, 1), &model, &sum))
        shd_cells_small(seen, &model, &sum);
    return held(sum * seen->gain);
}

/* What of the shape is before the surface. The answer: as shd_side_of_seen. */
static int see_before(const shd_light *light, const shd_surface *at, double point_off,
                      shd_seen *seen) {
    if (!shd_see_area(light, at->position, seen)) return -1;
    seen->point_off = shd_larger(point_off, POINT_OFF);
    const int side = shd_side_of_seen(seen, at->normal, seen->slack);
    if (side == 0 && seen->size < TINY) return shd_dot(at->normal, seen->toward) > 0 ? 1 : -1;
    if (side == 0) shd_clip_seen(seen, at->normal);
    return side == 0 && seen->count < 2 ? -1 : side;
}

bool shd_area_weigh(const shd_light *light, const shd_surface *at, double point_off,
                    double *diffuse, double *lobe, double *error) {
    shd_seen seen;
    double off = 0;
    const int before = see_before(light, at, point_off, &seen);
    if (before < 0) return false;
    *diffuse = weigh_diffuse(&seen, at->normal, before);
    const size_t count = at->material->lobe_count;
    int side = count ? shd_side_of_seen(&seen, at->mirror, 0) : -1;
    if (side == 0 && seen.size < TINY) side = 1; /* a lobe is 0 beyond its horizon */
    if (side == 0) shd_clip_seen(&seen, at->mirror);
    if (side == 0 && seen.count < 2) side = -1;
    for (size_t k = 0; k < count; k++)
        lobe[k] = side < 0 ? 0
                           : weigh_power(&seen, at->mirror, at->material->lobes[k].shininess,
                                         before < side ? before : side, &off);
    if (error) *error = off;
    return true;
}

/* Adds the sum over a region, on both sides of its creases from `crease` on. Returns the error. */
static double sum_parts(const shd_seen *seen, shd_vec3 peak, const shd_area_model *model,
                        int crease, double *row) {
    for (; crease < model->crease_count; crease++) {
        if (shd_side_of_seen(seen, model->creases[crease], 0) != 0) continue;
        double error = 0;
        for (int side = 0; side < 2; side++) {
            shd_seen part = *seen;
            shd_clip_seen(&part, shd_scale(model->creases[crease], side ? -1 : 1));
            if (part.count > 1) error += sum_parts(&part, peak, model, crease + 1, row);
        }
        return error;
    }
    if (!is_small(seen, model->sharpness)) return shd_cells_sum(seen, peak, model, row);
    if (!shd_cells_whole(seen, shd_area_off(seen->size, model->sharpness), model, row))
        shd_cells_small(seen, model, row);
    return 0;
}

double shd_area_integrate(const shd_light *light, const shd_surface *at, double point_off,
                          const shd_area_model *model, double *row) {
    shd_seen seen;
    memset(row, 0, model->count * sizeof *row);
    int before = see_before(light, at, point_off, &seen);
    if (before < 0) return -1;
    double error = 0, gain = seen.gain;
    for (int i = 0; i < model->crease_count; i++) /* a point has no kink in it */
        if (before && !shd_side_of_seen(&seen, model->creases[i], 0)) before = 0;
    if (is_point(&seen, before, model->sharpness)) {
        shd_ways way = {.points = 0};
        shd_add_way(&way, seen.toward, 1);
        shd_sum_row(model, &way, row);
        gain = seen.fall;
    } else {
        error = sum_parts(&seen, at->mirror, model, 0, row);
    }
    for (size_t k = 0; k < model->count; k++) row[k] = held(row[k] * gain);
    return error * gain;
}

/* ---- Points. ---- */

/* The unit square to the unit disc: P. Shirley and K. Chiu, "A Low Distortion Map Between Disk and
 * Square", Journal of Graphics Tools 2(3), 1997. */
static void to_disc(double u, double v, double *x, double *y) {
    const double a = 2 * u - 1, b = 2 * v - 1;
    const bool wide = fabs(a) > fabs(b);
    const double r = wide ? a : b;
    const double angle = wide     ? SHD_PI / 4 * (b / a)
                         : r != 0 ? SHD_PI / 2 - SHD_PI / 4 * (a / b)
                                  : 0;
    *x = r * cos(angle);
    *y = r * sin(angle);
}

shd_vec3 shd_area_point(const shd_light *light, shd_vec3 from, double u, double v) {
    if (light->type == SHD_LIGHT_RECT)
        return shd_madd(shd_madd(light->position, light->across, (u - 0.5) * light->size[0]),
                        light->up, (v - 0.5) * light->size[1]);
    double x, y;
    to_disc(u, v, &x, &y);
    if (light->type == SHD_LIGHT_DISC)
        return shd_madd(shd_madd(light->position, light->across, x * light->radius), light->up,
                        y * light->radius);
    /* Archimedes: areas of a zone are its heights'. */
    shd_vec3 axis = {0, 0, 1}, a, b;
    const shd_vec3 path = shd_sub(from, light->position);
    const double distance = shd_length(path);
    shd_normalize(path, &axis);
    const double most = distance > light->radius ? 1 - light->radius / distance : 2;
    shd_perpendicular(axis, &a, &b);
    const double low = most * (x * x + y * y), stretch = sqrt(most * (2 - low));
    const shd_vec3 out =
        shd_madd(shd_madd(shd_scale(axis, 1 - low), a, x * stretch), b, y * stretch);
    return shd_madd(light->position, out, light->radius);
}
