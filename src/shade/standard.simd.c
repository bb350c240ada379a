/* The standard tier: the same equations in f32, SHD_LANES at a time, in the form that keeps
 * small angles (1 - R.V = |L - W|^2 / 2), and the sums of every tier. Compiled once an
 * instruction set. Errors are measured in tests/unit/shade_weights.c. */
#include "base/cpu.h"
#include "shade/math32.h"
#include "shade/shade.h"

/* Squared distances outside of this range have lost bits in f32: such lanes are done in f64. */
static const float NEAREST2 = 1e-13f, FARTHEST2 = 1e30f;

/* (R.V)^ns below exp(-60) is nothing beside any picture's maximum. */
static const float FAINTEST = 60;

/* (R.V)^ns with ns < 1 falls off so steeply at R.V = 0 that f32's last digit of R.V shows: with
 * ns = 0.1 it would make 3e-5 of the maximum. */
static bool has_steep_edge(const shd_plan_lobe *lobes, size_t lobe_count) {
    for (size_t k = 0; k < lobe_count; k++)
        if (lobes[k].shininess < 1) return true;
    return false;
}

/* Directions, N.L and f s at SHD_LANES points. Marks the lanes that need f64; returns whether
 * there is one. */
static bool weigh_directions(const shd_light32 *light, const shd_plan_light *kind,
                             const shd_prepared *block, size_t first, float toward[3][SHD_LANES],
                             float facing[SHD_LANES], float factor[SHD_LANES],
                             int redo[SHD_LANES]) {
    const float lx = light->high[0], ly = light->high[1], lz = light->high[2];
    const float mx = light->low[0], my = light->low[1], mz = light->low[2];
    const float *restrict nx = block->normal32[0] + first,
                          *restrict ny = block->normal32[1] + first,
                          *restrict nz = block->normal32[2] + first;
    if (kind->directional) {
        for (int i = 0; i < SHD_LANES; i++) {
            toward[0][i] = lx;
            toward[1][i] = ly;
            toward[2][i] = lz;
            factor[i] = 1;
            redo[i] = 0;
        }
    } else {
        const float *restrict hx = block->high[0] + first, *restrict hy = block->high[1] + first,
                              *restrict hz = block->high[2] + first;
        const float *restrict px = block->low[0] + first, *restrict py = block->low[1] + first,
                              *restrict pz = block->low[2] + first;
        /* Without attenuation 1 / (1 + d (0 + d 0)): no branch, the loop vectorizes. */
        const float a = kind->attenuated ? light->a : 1, b = kind->attenuated ? light->b : 0,
                    c = kind->attenuated ? light->c : 0, least = light->min_distance;
        for (int i = 0; i < SHD_LANES; i++) {
            float x = (lx - hx[i]) + (mx - px[i]);
            float y = (ly - hy[i]) + (my - py[i]);
            float z = (lz - hz[i]) + (mz - pz[i]);
            float d2 = x * x + y * y + z * z;
            int near = d2 > NEAREST2 ? 0 : 1;
            redo[i] = d2 < FARTHEST2 ? near : 1;
            float distance = sqrtf(d2);
            float inverse = 1 / distance;
            toward[0][i] = x * inverse;
            toward[1][i] = y * inverse;
            toward[2][i] = z * inverse;
            float d = distance > least ? distance : least;
            factor[i] = 1 / (a + d * (b + d * c));
        }
    }
    for (int i = 0; i < SHD_LANES; i++)
        facing[i] = nx[i] * toward[0][i] + ny[i] * toward[1][i] + nz[i] * toward[2][i];
    int any = 0;
    for (int i = 0; i < SHD_LANES; i++) any |= redo[i];
    return any;
}

static void weigh_spot(const shd_light32 *light, float toward[3][SHD_LANES],
                       float factor[SHD_LANES]) {
    const float ax = light->axis[0], ay = light->axis[1], az = light->axis[2];
    const float outer = light->outer, inner = light->inner, inverse_fade = light->inverse_fade;
    const float exponent = light->exponent;
    for (int i = 0; i < SHD_LANES; i++) {
        float x = ax + toward[0][i], y = ay + toward[1][i], z = az + toward[2][i];
        float q = (x * x + y * y + z * z) * 0.5f; /* 1 - cos t */
        float fade = (outer - q) * inverse_fade;
        float smooth = fade * fade * (3 - 2 * fade);
        float inside = q > inner ? smooth : 1;
        factor[i] *= q > outer ? 0 : inside;
    }
    if (!(exponent > 0)) return;
    for (int i = 0; i < SHD_LANES; i++) {
        float x = ax + toward[0][i], y = ay + toward[1][i], z = az + toward[2][i];
        float q = (x * x + y * y + z * z) * 0.5f;
        float held = q < 0.99999994f ? q : 0.99999994f;
        float power = shd_exp32(exponent * shd_log1m(held));
        factor[i] *= q < 1 ? power : 0;
    }
}

static void weigh_lobe(float shininess, const shd_prepared *block, size_t first,
                       float toward[3][SHD_LANES], const float facing[SHD_LANES],
                       const float factor[SHD_LANES], double gain, double *out) {
    const float *wx = block->mirror32[0] + first, *wy = block->mirror32[1] + first,
                *wz = block->mirror32[2] + first;
    const float farthest = shininess > FAINTEST ? FAINTEST / shininess : 1;
    float d[SHD_LANES];
    int lit = 0;
    for (int i = 0; i < SHD_LANES; i++) {
        float x = toward[0][i] - wx[i], y = toward[1][i] - wy[i], z = toward[2][i] - wz[i];
        float q = (x * x + y * y + z * z) * 0.5f; /* 1 - R.V */
        int inside = (q < farthest) & (facing[i] > 0);
        d[i] = inside ? q : 2;
        lit |= inside;
    }
    if (!lit) {
        for (int i = 0; i < SHD_LANES; i++) out[i] = 0;
        return;
    }
    float weight[SHD_LANES];
    for (int i = 0; i < SHD_LANES; i++) {
        float held = d[i] < 0.99999994f ? d[i] : 0.99999994f;
        float power = shd_exp32(shininess * shd_log1m(held));
        float inside = d[i] < 1 ? 1.0f : 0.0f; /* not a branch: the loop vectorizes */
        weight[i] = factor[i] * power * inside;
    }
    for (int i = 0; i < SHD_LANES; i++) out[i] = weight[i] * gain;
}

static void weigh_standard(const shd_light32 *light, const shd_plan_light *kind,
                           const shd_plan_lobe *lobes, size_t lobe_count, const shd_prepared *block,
                           shd_weights *out) {
    if (!light->fits || has_steep_edge(lobes, lobe_count)) {
        shd_weigh_exact(kind, lobes, lobe_count, block, out);
        return;
    }
    float toward[3][SHD_LANES], facing[SHD_LANES], factor[SHD_LANES];
    int redo[SHD_LANES];
    const double gain = light->gain;
    for (size_t first = 0; first < block->lanes; first += SHD_LANES) {
        bool any = weigh_directions(light, kind, block, first, toward, facing, factor, redo);
        if (kind->spot) weigh_spot(light, toward, factor);
        double *restrict diffuse = out->diffuse + first;
        for (int i = 0; i < SHD_LANES; i++) {
            float weight = facing[i] > 0 ? factor[i] * facing[i] : 0;
            diffuse[i] = weight * gain;
        }
        for (size_t k = 0; k < lobe_count; k++)
            weigh_lobe((float)lobes[k].shininess, block, first, toward, facing, factor, gain,
                       out->specular[k] + first);
        if (!any) continue;
        for (size_t i = 0; i < SHD_LANES; i++)
            if (redo[i]) shd_weigh_exact_lane(kind, lobes, lobe_count, block, first + i, out);
    }
}

/* Mirrors V about N once a point, in f64 for every tier: R.V = L.W. */
static void prepare(const shd_plan *plan, const shd_points *points, shd_prepared *block) {
    block->points = points;
    block->lanes = (points->count + SHD_LANES - 1) / SHD_LANES * SHD_LANES;
    for (size_t i = 0; i < block->lanes; i++) {
        const double *n[3] = {points->normal[0], points->normal[1], points->normal[2]};
        const double *v[3] = {points->view[0], points->view[1], points->view[2]};
        double facing = n[0][i] * v[0][i] + n[1][i] * v[1][i] + n[2][i] * v[2][i];
        for (int c = 0; c < 3; c++) block->mirror[c][i] = 2 * facing * n[c][i] - v[c][i];
    }
    if (plan->tier != SHD_STANDARD) return;
    const double origin[3] = {plan->origin.x, plan->origin.y, plan->origin.z};
    for (int c = 0; c < 3; c++) {
        for (size_t i = 0; i < block->lanes; i++) {
            double p = (points->position[c][i] - origin[c]) * plan->scale;
            shd_split32(p, &block->high[c][i], &block->low[c][i]);
            block->normal32[c][i] = (float)points->normal[c][i];
            block->mirror32[c][i] = (float)block->mirror[c][i];
        }
    }
}

static void fill(double (*out)[SHD_BLOCK], const double value[3], size_t lanes) {
    for (int c = 0; c < 3; c++)
        for (size_t i = 0; i < lanes; i++) out[c][i] = value[c];
}

static void add_weight(double (*restrict sum)[SHD_BLOCK], const double *restrict weight,
                       const double color[3], size_t lanes) {
    const double r = color[0], g = color[1], b = color[2];
    for (size_t i = 0; i < lanes; i++) {
        sum[0][i] += weight[i] * r;
        sum[1][i] += weight[i] * g;
        sum[2][i] += weight[i] * b;
    }
}

static void add_scaled(double (*restrict sum)[SHD_BLOCK], double (*restrict term)[SHD_BLOCK],
                       const double color[3], size_t lanes) {
    for (int c = 0; c < 3; c++)
        for (size_t i = 0; i < lanes; i++) sum[c][i] += term[c][i] * color[c];
}

const shd_shade_kernel SHD_VARIANT(shd_shade_kernel) = {prepare, weigh_standard, fill, add_weight,
                                                        add_scaled};
