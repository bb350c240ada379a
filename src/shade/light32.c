/* Lights in f32, for the standard tier. */
#include "shade/math32.h"
#include "shade/shade.h"

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
