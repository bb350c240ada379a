/* Bounds in linear light and in codes. */
#include <string.h>

#include "bound/shown/shown.h"

double shd_curve_noise(shd_transfer transfer) {
    return transfer == SHD_TRANSFER_LINEAR ? 0 : transfer == SHD_TRANSFER_REC1886 ? 3.4e-7 : 6.5e-7;
}

shd_screen shd_screen_of(const shd_shown *shown) {
    shd_screen s = {.same = true};
    memcpy(s.rgb, shown->screen, sizeof s.rgb);
    memcpy(s.to_xyz, shown->to_xyz, sizeof s.to_xyz);
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++) {
            s.same &= r == c ? s.rgb[r][c] == s.rgb[0][0] : s.rgb[r][c] == 0;
            for (int k = 0; k < 3; k++) s.xyz[r][c] += s.to_xyz[r][k] * s.rgb[k][c];
            s.columns[c][r] = s.xyz[r][c];
            s.channels[c][r] = s.to_xyz[r][c];
        }
    return s;
}

/* ---- Codes. ---- */

/* The error of an output's linear channel is at most
 *     absolute + min(limited, ratio (u - base) + distance u) + color u
 * if its value is u >= 0, which is in [floor, most]. */
typedef struct channel {
    double absolute, limited, ratio, distance, color, base, floor, most;
} channel;

static channel channel_of(const shd_excess_list *list, const shd_excess *e, const double row[3]) {
    channel out = {.absolute = 0};
    double whole = 0, products = 0;
    int others = -1;
    bool positive = list->nonnegative;
    for (int c = 0; c < 3; c++) {
        const double weight = fabs(row[c]);
        out.absolute += weight * (e->absolute[c] + list->more);
        out.limited += weight * e->limited[c];
        out.base += row[c] * e->base[c];
        out.floor += row[c] * e->floor[c];
        out.most += weight * e->most[c];
        whole += weight;
        products += weight * e->most[c];
        others += weight > 0;
        if (row[c] < -1e-6 * whole) positive = false;
    }
    if (others > 0) out.absolute += SHD_MATRIX_NOISE * products;
    if (positive) {
        out.ratio = e->ratio;
        out.distance = e->distance;
        out.color = list->color;
    } else {
        out.absolute += list->color * out.most;
        out.ratio = INFINITY;
        out.base = out.floor = 0;
    }
    return out;
}

static double error_at(const channel *c, double u) {
    double limited = c->limited;
    if (isfinite(c->ratio))
        limited = shd_smaller(limited, c->ratio * shd_larger(u - c->base, 0) + c->distance * u);
    return c->absolute + limited + c->color * u;
}

/* The largest curve(u + error) - curve(u) for u in [low, high]. Curves are concave, so that it is
 * at most that of the lower end with the error of the upper one. A spread that is no more than
 * `enough` is told as any value up to that. */
static double spread_in(const channel *c, shd_transfer curve, double most, double low, double high,
                        double enough) {
    const double error =
        error_at(c, shd_smaller(high + most, c->most)) + shd_curve_noise(curve) * high;
    double spread = shd_curve_encode(curve, shd_smaller(error, 1));
    if (spread <= enough) return spread;
    spread = shd_curve_encode(curve, shd_smaller(low + error, 1)) - shd_curve_encode(curve, low);
    const double begin = shd_larger(low, 1e-5);
    if (spread <= enough || high <= 1.3 * begin) return spread;
    const double middle = sqrt(begin * high);
    const double dark = spread_in(c, curve, most, low, middle, enough);
    return shd_larger(dark, spread_in(c, curve, most, middle, high, shd_larger(dark, enough)));
}

/* The same of a color that is held at 1 but covers only a part x of a pixel. There it errs by x
 * times its error, which is largest, relative to u, at the least u. */
static double spread_of_held(const channel *c, shd_transfer curve) {
    const double least = shd_larger(c->floor, 1);
    const double error = c->absolute / least + c->color + shd_curve_noise(curve) +
                         shd_smaller(c->limited / least, c->ratio + c->distance);
    return shd_curve_encode(curve, 1) - shd_curve_encode(curve, shd_larger(1 - error, 0));
}

/* The same for all u in [0,1] that there are. Below the floor there are only colors that cover a
 * part of their pixel. Their errors shrink with them faster than the curve rises, because x times
 * its slope at x does not fall. */
static double spread_of(const channel *c, shd_transfer curve, bool mixed, double enough) {
    /* u is of either picture. */
    const double most = error_at(c, c->most);
    /* Lights that are left out may add to what `c->most` tells. */
    const double low = fmin(fmax(c->floor - most, 0), 1), high = fmin(c->most + most, 1);
    const double held = mixed && c->most + most > 1 ? spread_of_held(c, curve) : 0;
    return low < high ? shd_larger(held, spread_in(c, curve, most, low, high, enough)) : held;
}

double shd_bound_code(const shd_excess_list *list, const shd_shown *shown) {
    if (!shown->coded || list->textured) return INFINITY;
    const double codes = 255 * (list->mixed ? SHD_MIXTURE : 1);
    double worst = 0;
    for (size_t i = 0; i < list->count; i++)
        for (int r = 0; r < 3; r++) {
            const channel c = channel_of(list, &list->excess[i], shown->matrix[r]);
            /* Up to this value the bound in codes stays as it is. */
            const double enough = (floor(codes * worst) + 1) / codes * (1 - 1e-9);
            worst = fmax(worst, spread_of(&c, shown->curve, list->mixed, enough));
        }
    if (!(worst * codes < 255)) return 255;
    return worst > 0 ? floor(codes * worst) + 1 : 0;
}
