#include "base/spectrum.h"

#include <math.h>
#include <string.h>

#include "base/spectrum_tables.h"

/* ---- Curves ---- */

static const double EQUAL[1] = {1};

#define WIDE(called, table)                                                                        \
    {                                                                                              \
        .name = called, .count = SHD_WIDE_COUNT, .first = SHD_WIDE_FROM, .step = SHD_TABLE_STEP,   \
        .values = table, .scale = 1                                                                \
    }
#define NARROW(called, table)                                                                      \
    {                                                                                              \
        .name = called, .count = SHD_LAMP_COUNT, .first = SHD_LAMP_FROM, .step = SHD_TABLE_STEP,   \
        .values = table, .scale = 1                                                                \
    }
#define PRIMARY(i)                                                                                 \
    {                                                                                              \
        .count = SHD_PRIMARY_COUNT, .first = SHD_PRIMARY_FROM, .step = SHD_PRIMARY_STEP,           \
        .values = shd_primary_curves[i], .scale = 1                                                \
    }

static const shd_curve D65 = WIDE("D65", shd_illuminant_d65);
static const shd_curve PRIMARIES[3] = {PRIMARY(0), PRIMARY(1), PRIMARY(2)};

static const shd_curve NAMED[] = {
    {.name = "A", .count = 0, .scale = 1}, WIDE("D50", shd_illuminant_d50),
    WIDE("D55", shd_illuminant_d55),       WIDE("D65", shd_illuminant_d65),
    WIDE("D75", shd_illuminant_d75),       {.name = "E", .count = 1, .values = EQUAL, .scale = 1},
    NARROW("F1", shd_illuminants_f[0]),    NARROW("F2", shd_illuminants_f[1]),
    NARROW("F3", shd_illuminants_f[2]),    NARROW("F4", shd_illuminants_f[3]),
    NARROW("F5", shd_illuminants_f[4]),    NARROW("F6", shd_illuminants_f[5]),
    NARROW("F7", shd_illuminants_f[6]),    NARROW("F8", shd_illuminants_f[7]),
    NARROW("F9", shd_illuminants_f[8]),    NARROW("F10", shd_illuminants_f[9]),
    NARROW("F11", shd_illuminants_f[10]),  NARROW("F12", shd_illuminants_f[11]),
    NARROW("TCS01", shd_test_samples[0]),  NARROW("TCS02", shd_test_samples[1]),
    NARROW("TCS03", shd_test_samples[2]),  NARROW("TCS04", shd_test_samples[3]),
    NARROW("TCS05", shd_test_samples[4]),  NARROW("TCS06", shd_test_samples[5]),
    NARROW("TCS07", shd_test_samples[6]),  NARROW("TCS08", shd_test_samples[7]),
    NARROW("TCS09", shd_test_samples[8]),  NARROW("TCS10", shd_test_samples[9]),
    NARROW("TCS11", shd_test_samples[10]), NARROW("TCS12", shd_test_samples[11]),
    NARROW("TCS13", shd_test_samples[12]), NARROW("TCS14", shd_test_samples[13]),
};

enum { NAMES = sizeof NAMED / sizeof NAMED[0], LIGHTS = NAMES - SHD_SAMPLES };

size_t shd_curve_names(void) {
    return NAMES;
}

shd_curve shd_curve_named(size_t index, shd_curve_kind *kind) {
    *kind = index < LIGHTS ? SHD_CURVE_LIGHT : SHD_CURVE_REFLECTANCE;
    return NAMED[index];
}

/* CIE standard illuminant A (ISO 11664-2): Planck's law at 2848 K with c2 = 1.435e7 nm K, 1 at 560
 * nm. */
static double illuminant_a(double nm) {
    const double exponent = 1.435e7 / 2848;
    return pow(560 / nm, 5) * (expm1(exponent / 560) / expm1(exponent / nm));
}

/* How many samples are at or below the wavelength. */
static size_t samples_up_to(const shd_curve *curve, double nm) {
    if (!curve->at) {
        const double steps = floor((nm - curve->first) / curve->step);
        if (!(steps >= 0)) return 0;
        return steps < (double)curve->count ? (size_t)steps + 1 : curve->count;
    }
    size_t low = 0, high = curve->count;
    while (low < high) {
        const size_t middle = low + (high - low) / 2;
        if (curve->at[middle] <= nm)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

static double sample_at(const shd_curve *curve, size_t i) {
    return curve->at ? curve->at[i] : curve->first + curve->step * (double)i;
}

double shd_curve_value(const shd_curve *curve, double nm) {
    if (!curve->count) return illuminant_a(nm);
    if (curve->count == 1) return curve->values[0];
    const size_t i = samples_up_to(curve, nm);
    if (i == 0) return curve->values[0];
    if (i == curve->count) return curve->values[i - 1];
    const double low = sample_at(curve, i - 1), t = (nm - low) / (sample_at(curve, i) - low);
    return curve->values[i - 1] + t * (curve->values[i] - curve->values[i - 1]);
}

/* The first sample above the wavelength, or `end` if that is nearer. */
static double next_sample(const shd_curve *curve, double nm, double end) {
    if (curve->count < 2) return end;
    const size_t i = samples_up_to(curve, nm);
    if (i == curve->count) return end;
    const double next = sample_at(curve, i);
    return next > nm && next < end ? next : end;
}

/* ---- Integrals ---- */

static void add_observed(const shd_curve *surface, const shd_curve *light, double nm, double weight,
                         double xyz[3]) {
    const double steps = (nm - SHD_WIDE_FROM) / SHD_TABLE_STEP;
    const size_t most = SHD_WIDE_COUNT - 2, i = steps < (double)most ? (size_t)steps : most;
    const double t = steps - (double)i;
    weight *= shd_curve_value(light, nm);
    if (surface) weight *= shd_curve_value(surface, nm);
    for (int c = 0; c < 3; c++)
        xyz[c] += weight * (shd_observer[c][i] + t * (shd_observer[c][i + 1] - shd_observer[c][i]));
}

/* XYZ of light on a surface (NULL: white) between two wavelengths. */
static void integrate(const shd_curve *surface, const shd_curve *light, double from, double to,
                      double xyz[3]) {
    memset(xyz, 0, 3 * sizeof *xyz);
    for (double nm = from, next; nm < to; nm = next) {
        next = fmin(to, SHD_TABLE_STEP * (floor(nm / SHD_TABLE_STEP) + 1));
        next = next_sample(light, nm, next);
        if (surface) next = next_sample(surface, nm, next);
        const double sixth = (next - nm) / 6;
        add_observed(surface, light, nm, sixth, xyz);
        add_observed(surface, light, (nm + next) / 2, 4 * sixth, xyz);
        add_observed(surface, light, next, sixth, xyz);
    }
}

static double mean_of(const shd_curve *curve, double from, double to) {
    double sum = 0, at = shd_curve_value(curve, from);
    for (double nm = from, next; nm < to; nm = next) {
        next = next_sample(curve, nm, to);
        const double value = shd_curve_value(curve, next);
        sum += (at + value) / 2 * (next - nm);
        at = value;
    }
    return sum / (to - from);
}

static double product_at(const shd_curve *const factors[3], double nm) {
    double product = 1;
    for (int i = 0; i < 3; i++) product *= shd_curve_value(factors[i], nm);
    return product;
}

/* Of three curves that are linear between samples: Simpson's rule is exact for their product. */
static double integrate_product(const shd_curve *const factors[3]) {
    double sum = 0;
    for (double nm = SHD_PRIMARY_FROM, next; nm < SHD_PRIMARY_TO; nm = next) {
        next = SHD_PRIMARY_TO;
        for (int i = 0; i < 3; i++) next = next_sample(factors[i], nm, next);
        sum += (next - nm) / 6 *
               (product_at(factors, nm) + 4 * product_at(factors, (nm + next) / 2) +
                product_at(factors, next));
    }
    return sum;
}

void shd_curve_means(const shd_curve *curve, double out[3]) {
    static const double one = 1;
    static const shd_curve constant = {.count = 1, .values = &one};
    for (int c = 0; c < 3; c++)
        out[c] = curve->scale *
                 (integrate_product((const shd_curve *[]){curve, &D65, &PRIMARIES[c]}) /
                  integrate_product((const shd_curve *[]){&constant, &D65, &PRIMARIES[c]}));
}

static double bin_edge(const shd_bins *bins, size_t b) {
    return bins->from + (bins->to - bins->from) * ((double)b / (double)bins->count);
}

static shd_vec3 vector_of(const double v[3]) {
    return (shd_vec3){v[0], v[1], v[2]};
}

static void store(shd_vec3 v, double out[3]) {
    out[0] = v.x;
    out[1] = v.y;
    out[2] = v.z;
}

/* ---- Colors ---- */

static const double FROM = SHD_PRIMARY_FROM,
                    TO = SHD_PRIMARY_FROM + SHD_PRIMARY_STEP * (SHD_PRIMARY_COUNT - 1);

bool shd_eye_make(shd_eye *out) {
    shd_affine lifted = {.origin = {0, 0, 0}};
    double xyz[3];
    for (int i = 0; i < 3; i++) {
        integrate(&PRIMARIES[i], &D65, FROM, TO, xyz);
        for (int row = 0; row < 3; row++) lifted.linear[row][i] = xyz[row];
    }
    integrate(NULL, &D65, FROM, TO, xyz);
    out->white = xyz[1];
    return shd_invert(&lifted, &out->to_rgb);
}

bool shd_curve_rgb(const shd_eye *eye, const shd_curve *curve, shd_curve_kind kind, double rgb[3]) {
    double xyz[3];
    if (kind == SHD_CURVE_LIGHT)
        integrate(NULL, curve, FROM, TO, xyz);
    else
        integrate(curve, &D65, FROM, TO, xyz);
    const double brightness = kind == SHD_CURVE_LIGHT ? eye->white / xyz[1] : 1;
    if (!isfinite(brightness)) return false;
    store(shd_scale(shd_linear(&eye->to_rgb, vector_of(xyz)), brightness * curve->scale), rgb);
    return true;
}

bool shd_bins_make(size_t count, double from, double to, const shd_affine *to_working,
                   shd_arena *arena, shd_bins *out) {
    shd_bins bins = {.count = count,
                     .from = from,
                     .to = to,
                     .primaries = shd_arena_alloc(arena, count, sizeof *bins.primaries),
                     .white = shd_arena_alloc(arena, count, sizeof *bins.white)};
    if (!bins.primaries || !bins.white) return false;
    shd_affine lifted = {.origin = {0, 0, 0}}, to_rgb;
    double brightness = 0;
    for (size_t b = 0; b < count; b++) {
        double *xyz = bins.white[b];
        integrate(NULL, &D65, bin_edge(&bins, b), bin_edge(&bins, b + 1), xyz);
        brightness += xyz[1];
        for (int i = 0; i < 3; i++) {
            const double p = mean_of(&PRIMARIES[i], bin_edge(&bins, b), bin_edge(&bins, b + 1));
            bins.primaries[b][i] = p;
            for (int row = 0; row < 3; row++) lifted.linear[row][i] += xyz[row] * p;
        }
    }
    for (int i = 0; i < 9; i++) lifted.linear[i / 3][i % 3] /= brightness;
    if (!shd_invert(&lifted, &to_rgb) || !shd_invert(to_working, &bins.from_working)) return false;
    bins.to_rgb = shd_compose(to_working, &to_rgb);
    for (size_t b = 0; b < count; b++)
        store(shd_scale(shd_linear(&bins.to_rgb, vector_of(bins.white[b])), 1 / brightness),
              bins.white[b]);
    *out = bins;
    return true;
}

void shd_bins_reflect(const shd_bins *bins, const shd_curve *curve, double *out) {
    for (size_t b = 0; b < bins->count; b++)
        out[b] = curve->scale * mean_of(curve, bin_edge(bins, b), bin_edge(bins, b + 1));
}

void shd_bins_lift(const shd_bins *bins, const double rgb[3], double *out) {
    const shd_vec3 v = shd_linear(&bins->from_working, vector_of(rgb));
    for (size_t b = 0; b < bins->count; b++) out[b] = shd_dot(v, vector_of(bins->primaries[b]));
}

bool shd_bins_add_light(const shd_bins *bins, const shd_curve *curve, double (*out)[3]) {
    double xyz[SHD_BINS_MOST][3], brightness = 0;
    for (size_t b = 0; b < bins->count; b++) {
        integrate(NULL, curve, bin_edge(bins, b), bin_edge(bins, b + 1), xyz[b]);
        brightness += xyz[b][1];
    }
    const double scale = curve->scale / brightness;
    if (!isfinite(scale)) return false;
    for (size_t b = 0; b < bins->count; b++) {
        const shd_vec3 rgb = shd_scale(shd_linear(&bins->to_rgb, vector_of(xyz[b])), scale);
        store(shd_add(vector_of(out[b]), rgb), out[b]);
    }
    return true;
}

void shd_bins_add_lifted(const shd_bins *bins, const double rgb[3], double (*out)[3]) {
    const shd_vec3 v = shd_linear(&bins->from_working, vector_of(rgb));
    for (size_t b = 0; b < bins->count; b++) {
        const double value = shd_dot(v, vector_of(bins->primaries[b]));
        for (int c = 0; c < 3; c++) out[b][c] += value * bins->white[b][c];
    }
}
