#include "shade/brdf.h"

#include <math.h>

#include "shade/packed.h"

/* |a - b|^2 / 2 of unit vectors: 1 - a.b without its cancellation near a = b. */
static double half_chord(shd_vec3 a, shd_vec3 b) {
    const shd_vec3 chord = shd_sub(a, b);
    return shd_dot(chord, chord) / 2;
}

/* (1 - off)^n */
static double power_of(double off, double n) {
    return off < 1 ? exp(n * log1p(-off)) : 0;
}

/* ---- The energy of a Phong lobe. ---- */

/* Gamma(x + 1/2) / Gamma(x + 1): by its asymptotic series from 32 on, which then errs by less than
 * 1e-13, and by Gamma's recurrence below. */
static double gamma_ratio(double x) {
    double factor = 1;
    for (; x < 32; x++) factor *= (x + 1) / (x + 0.5);
    const double y = 1 / x;
    const double series =
        1 + y * (-1.0 / 8 +
                 y * (1.0 / 128 +
                      y * (5.0 / 1024 +
                           y * (-21.0 / 32768 + y * (-399.0 / 262144 + y * (869.0 / 4194304))))));
    return factor * series / sqrt(x);
}

/* a B(x; a, b), the incomplete beta function times a, but for its factor x^a (1 - x)^b: a continued
 * fraction (Abramowitz and Stegun 26.5.8) by Lentz's method, for x below (a + 1) / (a + b + 2). */
static double beta_fraction(double x, double a, double b) {
    enum { MOST = 1000 };
    const double least = 1e-300;
    double c = 1, d = 1 - (a + b) * x / (a + 1);
    if (fabs(d) < least) d = least;
    d = 1 / d;
    double value = d;
    for (int m = 1; m < MOST; m++) {
        const double terms[2] = {m * (b - m) * x / ((a + 2 * m - 1) * (a + 2 * m)),
                                 -(a + m) * (a + b + m) * x / ((a + 2 * m) * (a + 2 * m + 1))};
        double change = 1;
        for (int k = 0; k < 2; k++) {
            d = 1 + terms[k] * d;
            if (fabs(d) < least) d = least;
            c = 1 + terms[k] / c;
            if (fabs(c) < least) c = least;
            d = 1 / d;
            change = c * d;
            value *= change;
        }
        if (fabs(change - 1) < 1e-16) break;
    }
    return value;
}

/* Mallett and Yuksel's closed form: with s = sin^2 of the light's angle, h = n / 2 and g = Gamma(h
 * + 1/2) / Gamma(h + 1), E = (2 pi N.L + sqrt(pi) g (s^h - N.L h B(s; h, 1/2))) / (n + 2). */
double shd_phong_energy(double facing, double shininess) {
    const double c = facing < 1 ? facing : 1, h = shininess / 2, s = (1 - c) * (1 + c);
    const double g = gamma_ratio(h), root = sqrt(SHD_PI);
    const double power = s > 0 ? exp(h * log1p(-c * c)) : h > 0 ? 0 : 1;
    double beta; /* h B(s; h, 1/2) */
    if (s < (h + 1) / (h + 2.5))
        beta = power * c * beta_fraction(s, h, 0.5);
    else /* by B(s; a, b) = B(a, b) - B(1 - s; b, a) */
        beta = root / g - (h > 0 ? h * 2 * power * c * beta_fraction(c * c, 0.5, h) : 0);
    return (2 * SHD_PI * c + root * g * (power - c * beta)) / (shininess + 2);
}

/* What of E is not 2 pi N.L, but for s^(h + 1) and its factor: smooth, even where c is 0 or 1, and
 * from 1 down to 1 / (n + 2). Near c = 1 it is a hypergeometric series. */
static double energy_of_rest(double c, double h) {
    const double c2 = c * c, s = (1 - c) * (1 + c);
    if (s <= 0.5) {
        double sum = 0, term = 1;
        for (int k = 0; k < 200 && term > 1e-18 * sum; k++) {
            sum += term;
            term *= (h + 0.5 + k) / (h + 2 + k) * s;
        }
        return sum / (2 * (h + 1));
    }
    if (s < (h + 1) / (h + 2.5)) return (1 - c2 * beta_fraction(s, h, 0.5)) / s;
    const double beta = h > 0 ? 2 * h * c2 * beta_fraction(c2, 0.5, h) : 0;
    return (1 + beta - c * sqrt(SHD_PI) / (gamma_ratio(h) * exp(h * log1p(-c2)))) / s;
}

void shd_fit_phong_energy(double shininess, shd_packed_energy *out) {
    enum { TERMS = SHD_ENERGY_TERMS };
    const double h = shininess / 2, kappa = 2.7 / sqrt(h + 1), low = (kappa - 1) / (kappa + 1);
    *out = (shd_packed_energy){.half = h,
                               .beta = sqrt(SHD_PI) * gamma_ratio(h),
                               .kappa = kappa,
                               .middle = (1 + low) / 2,
                               .twice = 4 / (1 - low)};
    for (int j = 0; j < TERMS; j++) {
        const double angle = SHD_PI * (j + 0.5) / TERMS,
                     t = out->middle + (1 - low) / 2 * cos(angle),
                     value = energy_of_rest(kappa * (1 - t) / (1 + t), h);
        for (int m = 0; m < TERMS; m++)
            out->terms[m] += value * cos(m * angle) * (m ? 2.0 : 1.0) / TERMS;
    }
}

/* ---- The models. ---- */

/* The lobe as it is at the point, and what it is multiplied by. */
static shd_lobe lobe_at(const shd_surface *at, size_t k, double *share) {
    shd_lobe lobe = at->material->lobes[k];
    *share = 1;
    if (at->sharp) {
        lobe.shininess = at->sharp[2 * k][at->sharp_at];
        *share = at->sharp[2 * k + 1][at->sharp_at];
    }
    return lobe;
}

static double weigh_oren_nayar(double sigma, double facing, double viewing, double between) {
    const double square = sigma * sigma, a = 1 - square / (2 * (square + 0.33)),
                 b = 0.45 * square / (square + 0.09);
    const double view = viewing > 0 ? viewing : 0, along = between - facing * view;
    const double s = along > 0 ? along / fmax(facing, view) : 0;
    return facing * (a + b * s);
}

/* F D G / (4 N.V) of each channel. */
static void weigh_facets(const shd_surface *at, const shd_lobe *lobe, shd_vec3 half, double facing,
                         double viewing, double out[3]) {
    const double off = half_chord(at->normal, half), upright = 1 - off,
                 bent = shd_dot(at->view, half);
    out[0] = out[1] = out[2] = 0;
    if (!(viewing > 0 && upright > 0 && bent > 0)) return;
    const double slope = lobe->shininess * lobe->shininess, cosine = upright * upright,
                 tangent = off * (2 - off) / cosine;
    const double d = exp(-tangent / slope) / (slope * cosine * cosine);
    /* G / N.V, so that nothing is divided by an N.V near 0 that G takes back. */
    const double open =
        fmin(fmin(1 / viewing, 2 * upright / bent), 2 * upright * facing / (bent * viewing));
    shd_fresnel own;
    const shd_fresnel *index = shd_index_at(at, &own);
    for (int c = 0; c < 3; c++) out[c] = shd_fresnel_reflectance(index, c, bent) * d * open / 4;
}

static double weigh_lobe(const shd_surface *at, const shd_lobe *lobe, shd_vec3 toward,
                         shd_vec3 half, double facing) {
    const double n = lobe->shininess;
    switch (at->material->model) {
    case SHD_MODEL_BLINN_PHONG:
        return power_of(half_chord(at->normal, half), n);
    case SHD_MODEL_PHONG_NORMALIZED:
        return power_of(half_chord(toward, at->mirror), n) * (SHD_PI * facing) /
               shd_phong_energy(facing, n);
    default:
        return power_of(half_chord(toward, at->mirror), n);
    }
}

bool shd_brdf_weigh(const shd_surface *at, shd_vec3 toward, double row[SHD_BRDF_ROWS]) {
    const shd_plan_material *m = at->material;
    const double facing = shd_dot(at->normal, toward), viewing = shd_dot(at->normal, at->view);
    if (!(facing > 0)) return false;
    double diffuse = facing;
    if (m->model == SHD_MODEL_OREN_NAYAR)
        diffuse = weigh_oren_nayar(m->from->sigma, facing, viewing, shd_dot(toward, at->view));
    row[0] = row[1] = row[2] = diffuse;
    shd_vec3 half = at->normal;
    const bool bisects = m->model == SHD_MODEL_BLINN_PHONG || m->model == SHD_MODEL_COOK_TORRANCE;
    const bool opposite = bisects && !shd_normalize(shd_add(toward, at->view), &half);
    for (size_t k = 0; k < m->lobe_count; k++) {
        double *out = row + 3 + 3 * k, share;
        const shd_lobe lobe = lobe_at(at, k, &share);
        if (opposite) /* light passes along the surface */
            out[0] = out[1] = out[2] = 0;
        else if (m->model == SHD_MODEL_COOK_TORRANCE)
            weigh_facets(at, &lobe, half, facing, viewing, out);
        else
            out[0] = out[1] = out[2] = share * weigh_lobe(at, &lobe, toward, half, facing);
    }
    return true;
}
