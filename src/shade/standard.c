/* The standard tier: the same equations in f32, SHD_LANES at a time, in the form that keeps
 * small angles (1 - R.V = |L - W|^2 / 2). Its errors are measured in tests/unit/shade_weights.c. */
#include "shade/math32.h"
#include "shade/shade.h"

/* Squared distances outside of this range have lost bits in f32: such lanes are done in f64. */
static const float NEAREST2 = 1e-13f, FARTHEST2 = 1e30f;

/* (R.V)^ns below exp(-60) is nothing beside any picture's maximum. */
static const float FAINTEST = 60;

/* Whether f32 is enough for this light: a cone that fades within less than 5 degrees, a steep
 * exponent, one below 1 (vertical at 90 degrees), or constants beyond f32's range in the plan's
 * frame want f64. */
static bool fits_f32(const shd_light32 *light, const shd_plan_light *from) {
    if (from->spot) {
        double fade = 2 * (asin(sqrt(from->outer / 2)) - asin(sqrt(from->inner / 2)));
        bool steep = from->exponent > 500 || (from->exponent > 0 && from->exponent < 1);
        if ((fade > 0 && fade < 0.087) || from->outer < 0.004 || steep) return false;
    }
    if (from->directional) return true;
    const float reach =
        fmaxf(fabsf(light->high[0]), fmaxf(fabsf(light->high[1]), fabsf(light->high[2])));
    return light->min_distance < 1e15f && reach < 1e15f && light->gain > 0 && light->gain < 1e180;
}

shd_light32 shd_narrow_light(const shd_plan *plan, const shd_plan_light *light) {
    shd_light32 out = {0};
    double s = plan->scale;
    shd_vec3 at =
        light->directional ? light->toward : shd_scale(shd_sub(light->position, plan->origin), s);
    const double xyz[3] = {at.x, at.y, at.z};
    const double axis[3] = {light->axis.x, light->axis.y, light->axis.z};
    for (int c = 0; c < 3; c++) {
        shd_split32(xyz[c], &out.high[c], &out.low[c]);
        out.axis[c] = (float)axis[c];
    }
    /* In units of the plan's frame and divided by the largest of the three again: a scene of any
     * size gives f32 the same numbers. */
    const double a = light->a, b = light->b / s, c = light->c / s / s;
    const double largest = fmax(a, fmax(b, c));
    out.a = (float)(a / largest);
    out.b = (float)(b / largest);
    out.c = (float)(c / largest);
    out.gain = light->directional ? light->gain : light->gain / largest;
    out.min_distance = (float)(light->min_distance * s);
    out.outer = (float)light->outer;
    out.inner = (float)light->inner;
    out.inverse_fade = light->outer > light->inner ? (float)(1 / (light->outer - light->inner)) : 0;
    out.exponent = (float)light->exponent;
    out.fits = fits_f32(&out, light);
    return out;
}

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
        const float a = light->a, b = light->b, c = light->c, least = light->min_distance;
        const bool attenuated = kind->attenuated;
        for (int i = 0; i < SHD_LANES; i++) {
            float x = (lx - hx[i]) + (mx - px[i]);
            float y = (ly - hy[i]) + (my - py[i]);
            float z = (lz - hz[i]) + (mz - pz[i]);
            float d2 = x * x + y * y + z * z;
            redo[i] = !(d2 > NEAREST2) | !(d2 < FARTHEST2);
            float distance = sqrtf(d2);
            float inverse = 1 / distance;
            toward[0][i] = x * inverse;
            toward[1][i] = y * inverse;
            toward[2][i] = z * inverse;
            float d = distance > least ? distance : least;
            factor[i] = attenuated ? 1 / (a + d * (b + d * c)) : 1;
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

void shd_weigh_standard(const shd_light32 *light, const shd_plan_light *kind,
                        const shd_plan_lobe *lobes, size_t lobe_count, const shd_prepared *block,
                        shd_weights *out) {
    if (!light->fits || has_steep_edge(lobes, lobe_count)) {
        shd_weigh_exact(kind, lobes, lobe_count, block, out);
        return;
    }
    float toward[3][SHD_LANES], facing[SHD_LANES], factor[SHD_LANES];
    int redo[SHD_LANES];
    for (size_t first = 0; first < block->lanes; first += SHD_LANES) {
        bool any = weigh_directions(light, kind, block, first, toward, facing, factor, redo);
        if (kind->spot) weigh_spot(light, toward, factor);
        double *diffuse = out->diffuse + first;
        for (int i = 0; i < SHD_LANES; i++) {
            float weight = facing[i] > 0 ? factor[i] * facing[i] : 0;
            diffuse[i] = weight * light->gain;
        }
        for (size_t k = 0; k < lobe_count; k++)
            weigh_lobe((float)lobes[k].shininess, block, first, toward, facing, factor, light->gain,
                       out->specular[k] + first);
        if (!any) continue;
        for (size_t i = 0; i < SHD_LANES; i++)
            if (redo[i]) shd_weigh_exact_lane(kind, lobes, lobe_count, block, first + i, out);
    }
}
