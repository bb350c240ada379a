#include "import/fit.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>

#include "base/primaries.h"
#include "color/delta_e.h"

#define PI 3.14159265358979323846

/* ---- What is compared ---- */

static double schlick(double f0, double vh) {
    return f0 + (1 - f0) * pow(1 - vh, 5);
}

static double smith(double alpha, double c) {
    return 2 * c / (c + sqrt(alpha * alpha + (1 - alpha * alpha) * c * c));
}

/* The foreign lobe times pi and N.L, without what depends on color. */
static double foreign_lobe(const shd_foreign *f, const shd_stand *s) {
    if (s->nl <= 0 || s->nv <= 0 || s->nh <= 0) return 0;
    if (f->kind == SHD_FOREIGN_BLINN) return pow(s->nh, f->shape);
    if (f->kind == SHD_FOREIGN_THREE)
        return 0.25 * (f->shape / 2 + 1) * pow(s->nh, f->shape) * s->nl;
    const double a2 = f->shape * f->shape, t = s->nh * s->nh * (a2 - 1) + 1;
    return a2 / (t * t) * smith(f->shape, s->nl) * smith(f->shape, s->nv) / (4 * s->nv);
}

static double foreign_fresnel(const shd_foreign *f, double f0, double vh) {
    return f->kind == SHD_FOREIGN_BLINN ? f0 : schlick(f0, vh);
}

static double foreign_light(const shd_foreign *f, const shd_stand *s, int c) {
    if (s->nl <= 0) return 0;
    const double fresnel = foreign_fresnel(f, f->specular[c], s->vh);
    const double diffuse = f->diffuse[c] * (f->kind == SHD_FOREIGN_GLTF ? 1 - fresnel : 1);
    return diffuse * s->nl + fresnel * foreign_lobe(f, s);
}

/* Fresnel's equations for a dielectric of that reflectance at a right angle. */
static double fresnel_of(double f0, double vh) {
    const double root = sqrt(fmin(f0, 1));
    if (root > 1 - 1e-9) return 1;
    const double n = (1 + root) / (1 - root), g = sqrt(n * n + vh * vh - 1);
    const double a = (g - vh) / (g + vh), b = (vh * (g + vh) - 1) / (vh * (g - vh) + 1);
    return a * a * (1 + b * b) / 2;
}

/* What a rough lobe of GGX has beside others' lobes: it scatters all around, as `diffuse` does. */
#define SCATTERED (-1.0)

/* As docs/model.md has them. */
static double native_lobe(shd_native_model model, double shape, const shd_stand *s) {
    if (s->nl <= 0) return 0;
    if (shape == SCATTERED) return s->nl;
    if (model == SHD_NATIVE_PHONG) return s->rv > 0 ? pow(s->rv, shape) : 0;
    if (s->nh <= 0) return 0;
    if (model == SHD_NATIVE_BLINN_PHONG) return pow(s->nh, shape);
    if (s->nv <= 0) return 0;
    const double c2 = s->nh * s->nh, m2 = shape * shape;
    const double d = exp(-(1 - c2) / (c2 * m2)) / (m2 * c2 * c2);
    const double g = fmin(1, 2 * s->nh * fmin(s->nv, s->nl) / s->vh);
    return d * g / (4 * s->nv);
}

static double native_light(const shd_native *n, const shd_stand *s, int c) {
    double sum = 0;
    if (s->nl <= 0) return 0;
    for (size_t k = 0; k < n->lobe_count; k++)
        sum += n->lobes[k].weight * native_lobe(n->model, n->lobes[k].shape, s);
    const bool facets = n->model == SHD_NATIVE_COOK_TORRANCE;
    return n->diffuse[c] * s->nl +
           sum * (facets ? fresnel_of(n->specular[c], s->vh) : n->specular[c]);
}

/* ---- The fit ---- */

enum { HALVES = 6, RINGS = 48, TURNS = 12, SAMPLES = HALVES * RINGS * TURNS, SHAPES = 37 };

typedef struct sample {
    shd_stand stand;
    double weight; /* of the sphere's picture, times that of the root */
    double wanted;
} sample;

static shd_stand stand_of(double nx, double ny, double nz, double half) {
    const double s = sin(half), c = cos(half); /* L and V are in the xz plane, H is z */
    shd_stand out = {.nl = nx * s + nz * c, .nv = -nx * s + nz * c, .nh = nz, .vh = c};
    (void)ny;
    out.rv = 2 * out.nl * out.nv - cos(2 * half);
    return out;
}

/* Rings are as dense about the half vector as the lobe is narrow. Returns how many are seen. */
static size_t take_samples(const shd_foreign *f, sample out[SAMPLES]) {
    const double width = f->kind == SHD_FOREIGN_GLTF ? f->shape : 1 / sqrt(f->shape + 1);
    const double first = 0.02 * fmin(width, 1), step = pow(PI / 2 / first, 1.0 / RINGS);
    size_t count = 0;
    double most = 0;
    for (int h = 0; h < HALVES; h++) {
        const double half = (10 + 10 * h) * PI / 180;
        for (int ring = 0; ring < RINGS; ring++) {
            const double angle = first * pow(step, ring + 0.5);
            const double area = sin(angle) * angle * log(step);
            for (int turn = 0; turn < TURNS; turn++) {
                const double phi = (turn + 0.5) * PI / TURNS; /* the other half mirrors it */
                sample *s = &out[count];
                s->stand = stand_of(sin(angle) * cos(phi), sin(angle) * sin(phi), cos(angle), half);
                if (s->stand.nl <= 0 || s->stand.nv <= 0) continue;
                s->wanted = foreign_lobe(f, &s->stand);
                s->weight = area * s->stand.nv;
                most = fmax(most, s->wanted);
                count++;
            }
        }
    }
    for (size_t i = 0; i < count; i++) out[i].weight /= fmax(out[i].wanted, most * 1e-6);
    return count;
}

/* Shapes to choose from: geometric, and the last one scattered. */
static double shape_at(const shd_foreign *f, shd_native_model model, int i) {
    const double share = (double)i / (SHAPES - 2);
    if (i == SHAPES - 1) return SCATTERED;
    if (model == SHD_NATIVE_COOK_TORRANCE) {
        const double low = fmax(0.4 * f->shape, 1e-3), high = fmin(8 * f->shape + 0.05, 2.5);
        return low * pow(high / low, share);
    }
    const double sharp = f->kind == SHD_FOREIGN_GLTF ? 2 / (f->shape * f->shape) : f->shape + 1;
    return fmin(2 * sharp, 1e5) * pow(0.5 / fmin(2 * sharp, 1e5), share);
}

/* Solves for the weights of up to three lobes. False: they are no weights. */
static bool solve(double gram[SHAPES][SHAPES], const double *right, const int *chosen, size_t n,
                  double out[SHD_FIT_LOBES]) {
    double a[SHD_FIT_LOBES][SHD_FIT_LOBES + 1];
    for (size_t r = 0; r < n; r++) {
        for (size_t c = 0; c < n; c++) a[r][c] = gram[chosen[r]][chosen[c]];
        a[r][n] = right[chosen[r]];
    }
    for (size_t p = 0; p < n; p++) { /* positive definite: no pivots are sought */
        if (!(a[p][p] > 1e-12 * gram[chosen[p]][chosen[p]])) return false;
        for (size_t r = 0; r < n; r++) {
            const double factor = a[r][p] / a[p][p];
            for (size_t c = p; c <= n && r != p; c++) a[r][c] -= factor * a[p][c];
        }
    }
    for (size_t p = 0; p < n; p++)
        if (!((out[p] = a[p][n] / a[p][p]) > 0)) return false;
    return true;
}

typedef struct search {
    double gram[SHAPES][SHAPES], right[SHAPES];
    double gain; /* by how much the best choice lessens the sum of squares */
    int chosen[SHD_FIT_LOBES];
    double weights[SHD_FIT_LOBES];
    size_t count;
} search;

static void try_choice(search *s, const int *chosen, size_t n) {
    double weights[SHD_FIT_LOBES], gain = 0;
    if (!solve(s->gram, s->right, chosen, n, weights)) return;
    for (size_t k = 0; k < n; k++) gain += weights[k] * s->right[chosen[k]];
    /* One more lobe costs time: it must be worth it. */
    if (!(gain > s->gain + (n > s->count ? 1e-9 * s->gain : 0))) return;
    s->gain = gain;
    s->count = n;
    memcpy(s->chosen, chosen, n * sizeof *chosen);
    memcpy(s->weights, weights, sizeof weights);
}

static void try_choices(search *s, int shapes, size_t lobes) {
    for (int i = 0; i < shapes; i++) {
        try_choice(s, (int[]){i}, 1);
        for (int j = i + 1; j < shapes && lobes > 1; j++) {
            try_choice(s, (int[]){i, j}, 2);
            for (int k = j + 1; k < shapes && lobes > 2; k++) try_choice(s, (int[]){i, j, k}, 3);
        }
    }
}

static void fit_lobes(const shd_foreign *f, size_t lobes, shd_native *out) {
    static _Thread_local sample samples[SAMPLES];
    static _Thread_local double values[SHAPES][SAMPLES];
    static _Thread_local search s;
    const size_t count = take_samples(f, samples);
    memset(&s, 0, sizeof s);
    for (int i = 0; i < SHAPES; i++)
        for (size_t k = 0; k < count; k++)
            values[i][k] = native_lobe(out->model, shape_at(f, out->model, i), &samples[k].stand);
    for (int i = 0; i < SHAPES; i++) {
        for (int j = 0; j <= i; j++) {
            double sum = 0;
            for (size_t k = 0; k < count; k++)
                sum += samples[k].weight * values[i][k] * values[j][k];
            s.gram[i][j] = s.gram[j][i] = sum;
        }
        for (size_t k = 0; k < count; k++)
            s.right[i] += samples[k].weight * values[i][k] * samples[k].wanted;
    }
    try_choices(&s, f->is_pictured ? SHAPES - 1 : SHAPES, lobes);
    for (size_t k = 0; k < s.count; k++) {
        const double shape = shape_at(f, out->model, s.chosen[k]);
        if (shape == SCATTERED) {
            for (int c = 0; c < 3; c++) out->diffuse[c] += out->specular[c] * s.weights[k];
            continue;
        }
        out->lobes[out->lobe_count].shape = shape;
        out->lobes[out->lobe_count++].weight = s.weights[k];
    }
}

/* The share of light that glTF's facets leave to what is beneath, in the mean over the sphere. */
static double left_beneath(double f0) {
    double sum = 0, all = 0;
    for (int i = 0; i < 90; i++) { /* by half the angle between light and eye, as often as it is */
        const double vh = cos((i + 0.5) / 90 * PI / 3), area = sin((i + 0.5) / 90 * PI / 3);
        sum += area * (1 - schlick(f0, vh));
        all += area;
    }
    return sum / all;
}

void shd_fit(const shd_foreign *foreign, shd_native_model model, size_t lobes, shd_native *out) {
    *out = (shd_native){.model = model};
    bool shines = false;
    for (int c = 0; c < 3; c++) {
        const double beneath =
            foreign->kind == SHD_FOREIGN_GLTF ? left_beneath(foreign->specular[c]) : 1;
        out->diffuse[c] = foreign->diffuse[c] * beneath;
        out->specular[c] = foreign->specular[c];
        shines |= foreign->specular[c] > 0;
    }
    if (foreign->kind == SHD_FOREIGN_BLINN && model == SHD_NATIVE_BLINN_PHONG) {
        out->lobes[0].shape = foreign->shape;
        out->lobes[0].weight = 1;
        out->lobe_count = shines;
    } else if (shines) {
        fit_lobes(foreign, lobes, out);
    }
}

/* ---- How far off ---- */

shd_fit_error shd_fit_measure(const shd_foreign *foreign, const shd_native *native) {
    enum { SIDE = 64 };
    static const double rec709[8] = {0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329};
    const double third = 1 / sqrt(3), half = acos(third) / 2;
    const double h[3] = {third / (2 * cos(half)), third / (2 * cos(half)),
                         (third + 1) / (2 * cos(half))};
    shd_lab_space space;
    shd_fit_error out = {0, 0};
    size_t count = 0;
    if (!shd_lab_space_make(SHD_TRANSFER_SRGB, rec709, &space)) return out;
    for (int i = 0; i < SIDE * SIDE; i++) {
        const double x = (i % SIDE + 0.5) / SIDE * 2 - 1, y = 1 - (i / SIDE + 0.5) / SIDE * 2;
        if (x * x + y * y >= 1) continue;
        const double z = sqrt(1 - x * x - y * y);
        shd_stand s = {.nl = (x + y + z) * third,
                       .nv = z,
                       .nh = x * h[0] + y * h[1] + z * h[2],
                       .vh = cos(half)};
        s.rv = 2 * s.nl * s.nv - third;
        float theirs[3], ours[3];
        for (int c = 0; c < 3; c++) {
            theirs[c] =
                (float)shd_curve_encode(SHD_TRANSFER_SRGB, fmin(foreign_light(foreign, &s, c), 1));
            ours[c] =
                (float)shd_curve_encode(SHD_TRANSFER_SRGB, fmin(native_light(native, &s, c), 1));
        }
        double a[3], b[3];
        shd_lab_of(&space, theirs, a);
        shd_lab_of(&space, ours, b);
        const double apart = shd_delta_e_2000(a, b);
        out.mean += apart;
        out.most = fmax(out.most, apart);
        count++;
    }
    out.mean /= (double)count;
    return out;
}
