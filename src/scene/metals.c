/* Metals by their measured indices of refraction.
 *
 * n and k are spectra that were measured (E. D. Palik, Handbook of Optical Constants of Solids,
 * 1985, and others), each integrated to linear Rec.709, as the renderer Tungsten publishes them
 * (ComplexIorData.hpp); brass is as Mitsuba's documentation has it. A channel's index is thus a
 * mean over the wavelengths that it stands for. Spectral scenes have curves instead. */
#include <math.h>
#include <string.h>

#include "scene/metals.h"

const char *const shd_metal_names[] = {"aluminium", "brass",  "chromium", "copper",
                                       "gold",      "silver", NULL};

static const shd_fresnel metals[SHD_METALS] = {
    {.n = {1.6574599595, 0.8803689579, 0.5212287346},
     .k = {9.2238691996, 6.2695232477, 4.8370012281},
     .n_curve = &shd_metal_curves[0][0],
     .k_curve = &shd_metal_curves[0][1]},
    {.n = {0.444, 0.527, 1.094},
     .k = {3.695, 2.765, 1.829},
     .n_curve = &shd_metal_curves[1][0],
     .k_curve = &shd_metal_curves[1][1]},
    {.n = {4.3696828663, 2.9167024892, 1.6547005413},
     .k = {5.2064337956, 4.2313645277, 3.7549467933},
     .n_curve = &shd_metal_curves[2][0],
     .k_curve = &shd_metal_curves[2][1]},
    {.n = {0.2004376970, 0.9240334304, 1.1022119527},
     .k = {3.9129485033, 2.4528477015, 2.1421879552},
     .n_curve = &shd_metal_curves[3][0],
     .k_curve = &shd_metal_curves[3][1]},
    {.n = {0.1431189557, 0.3749570432, 1.4424785571},
     .k = {3.9831604247, 2.3857207478, 1.6032152899},
     .n_curve = &shd_metal_curves[4][0],
     .k_curve = &shd_metal_curves[4][1]},
    {.n = {0.1552646489, 0.1167232965, 0.1383806959},
     .k = {4.8283433224, 3.1222459278, 2.1469504455},
     .n_curve = &shd_metal_curves[5][0],
     .k_curve = &shd_metal_curves[5][1]},
};

const shd_fresnel *shd_metal_find(const char *name) {
    for (size_t i = 0; shd_metal_names[i]; i++)
        if (!strcmp(shd_metal_names[i], name)) return &metals[i];
    return NULL;
}

double shd_index_of(double f0) {
    const double root = sqrt(shd_larger(f0, 0));
    return root < 1 ? (1 + root) / (1 - root) : INFINITY;
}

/* M. Born and E. Wolf, Principles of Optics, 14.2: with a + ib the root of (n + ik)^2 - s^2, c and
 * s the cosine and the sine, and t = s^2 / c, Rs = ((a - c)^2 + b^2) / ((a + c)^2 + b^2), Rp = Rs
 * ((a - t)^2 + b^2) / ((a + t)^2 + b^2). Differences are taken before squares, and the smaller one
 * of a and b follows from 2 a b = 2 n k: so nothing cancels, neither near Brewster's angle nor
 * where n < 1 lets no light in. */
double shd_fresnel_reflectance(const shd_fresnel *fresnel, int channel, double cosine) {
    const double n = fresnel->n[channel], k = fresnel->k[channel];
    if (isinf(n) || !(cosine > 0)) return 1;
    const double c = cosine < 1 ? cosine : 1, c2 = c * c, s2 = (1 - c) * (1 + c);
    const double real = (n - k) * (n + k) - s2, both = hypot(real, 2 * n * k),
                 large = sqrt((both + fabs(real)) / 2), small = large > 0 ? n * k / large : 0;
    const double a = real < 0 ? small : large, b2 = real < 0 ? large * large : small * small;
    const double below = (a + c) * (a + c) + b2, along = (a * c + s2) * (a * c + s2) + b2 * c2;
    if (!(below > 0 && along > 0)) return 1; /* n = 1 at the very horizon */
    const double across = ((a - c) * (a - c) + b2) / below;
    return across / 2 * (1 + ((a * c - s2) * (a * c - s2) + b2 * c2) / along);
}
