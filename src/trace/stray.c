#include "trace/stray.h"

/* What is beyond the first order is less. */
static const double MORE = 1.1, DIRECTION = 16 * 0x1p-53;

shd_stray_hit shd_stray_meet(const shd_strays *strays, const shd_stray_ray *ray, double length,
                             size_t object, double facing) {
    const double bend = strays->of[object].bend;
    shd_stray_hit hit = {.ray = *ray};
    hit.ray.beside += length * ray->turned + strays->rounding + length * strays->further;
    hit.ray.lost |= !(facing * facing >= 8 * bend * hit.ray.beside && facing > 0);
    hit.moved = MORE * hit.ray.beside / facing;
    hit.normal = bend * hit.moved + DIRECTION;
    hit.place = hit.moved / strays->wide;
    /* So far out on a plane lights are 3/4 as far away at least. */
    if (strays->of[object].plane && length > strays->far) hit.place *= strays->far / (3 * length);
    return hit;
}

double shd_stray_error(const shd_strays *strays, const shd_stray_hit *hit, size_t object,
                       double view) {
    const shd_stray *of = &strays->of[object];
    const double off = shd_larger(hit->ray.turned + 2 * hit->normal, hit->place);
    int level = 0, seen = SHD_STRAY_VIEWS - 1;
    while (level < SHD_STRAY_LEVELS && !(off <= SHD_STRAY_OFF[level])) level++;
    while (seen >= 0 && !(view >= SHD_STRAY_VIEW[seen])) seen--;
    if (level == SHD_STRAY_LEVELS || (seen < 0 && of->by_view)) return 2 * of->most;
    return of->error[seen < 0 ? 0 : seen][level];
}

/* What is across the ray of a point that is moved along the surface. */
static double leave(const shd_stray_hit *hit, double out) {
    return MORE * shd_larger(hit->ray.beside, hit->moved * shd_smaller(fabs(out), 1));
}

shd_stray_ray shd_stray_mirrored(const shd_stray_hit *hit, double out) {
    return (shd_stray_ray){leave(hit, out), hit->ray.turned + 2 * hit->normal + DIRECTION,
                           hit->ray.lost};
}

shd_stray_ray shd_stray_straight(const shd_stray_hit *hit) {
    return (shd_stray_ray){MORE * hit->ray.beside, hit->ray.turned, hit->ray.lost};
}

shd_stray_ray shd_stray_refracted(const shd_stray_hit *hit, double eta, double in, double behind,
                                  double out) {
    const double both = hit->ray.turned + hit->normal;
    const double turned = eta * hit->ray.turned + eta * fabs(1 - eta * in / behind) * both +
                          fabs(behind - eta * in) * hit->normal;
    return (shd_stray_ray){leave(hit, out), MORE * turned + DIRECTION, hit->ray.lost};
}

bool shd_stray_turns(const shd_stray_hit *hit, double eta, double in) {
    const double square = 1 - eta * eta * (1 - in * in);
    return !(fabs(square) >= 8 * eta * eta * in * (hit->ray.turned + hit->normal) + 1e-14);
}
