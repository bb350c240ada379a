/* Compiled once for each instruction set. All is in f32: looks choose nodes, and need not be exact.
 */
#include "shade/around_look.h"

#include "base/cpu.h"
#include "shade/plain_simd.h"

/* Lobes count up to e^-14 of their peaks: that. */
static const float LEAST = 8e-7F;

/* What nodes are off where the lobe has a kink, by how far the block reaches, of what the kink is
 * wide; and where the horizon ends it in a kink, or as off a cliff. */
static const float KINK = 0.06F, HORIZON = 0.1F, CLIFF = 0.7F;
/* The same of facets, whose G over N.V is steeper. */
static const float FACETS_KINK = 0.15F, FACETS_HORIZON = 0.25F;

/* What f32 may be off a tangent; and the square of one that is as good as infinite. */
static const float BLUR = 5e-4F, UPRIGHT = 1e12F;

/* What is known of vectors of places. */
typedef struct place {
    shd_vf d[3], reach, side; /* side: N.L in the middle */
    shd_mf seen;
} place;

typedef struct look {
    shd_vf near, far, high, low, plain, square, kink;
} look;

SHD_INLINE shd_vf set(double x) {
    return shd_vf_set((float)x);
}

SHD_INLINE shd_vf absolute(shd_vf x) {
    return shd_vf_max(x, -x);
}

SHD_INLINE shd_vf if_in(shd_mf m, shd_vf x) {
    return shd_vf_mul_in(m, x, shd_vf_set(1));
}

SHD_INLINE shd_vf dot_vector(const shd_vf d[3], shd_vec3 v) {
    return d[0] * set(v.x) + d[1] * set(v.y) + d[2] * set(v.z);
}

SHD_INLINE shd_vf exp_of(shd_vf x) {
    return power_of_two(x * shd_vf_set(1.44269504F));
}

/* The square of the tangent of an angle less or more by about `by`. */
SHD_INLINE shd_vf nearer(shd_vf tangent, shd_vf by) {
    const shd_vf t = shd_vf_max(tangent - by, shd_vf_set(0)) / (shd_vf_set(1) + tangent * by);
    return t * t;
}
SHD_INLINE shd_vf farther(shd_vf tangent, shd_vf by) {
    const shd_vf under = shd_vf_max(shd_vf_set(1) - tangent * by, shd_vf_set(1e-9F)),
                 t = (tangent + by) / under;
    return smaller_of(t * t, shd_vf_set(UPRIGHT));
}

/* cos^n by the square x of the tangent: log(1 + x) is between two fractions. */
SHD_INLINE shd_vf faint_power(shd_vf n, shd_vf x) {
    return n * x / (shd_vf_set(2) + x);
}
SHD_INLINE shd_vf power_far(shd_vf n, shd_vf x) {
    const shd_vf six = shd_vf_set(6),
                 log = shd_vf_set(0.5F) * x * (six + x) / (six + shd_vf_set(4) * x);
    return exp_of(-n * log);
}

SHD_INLINE shd_vf facets_at(shd_vf inverse, shd_vf x) {
    const shd_vf rise = shd_vf_set(1) + x;
    return if_in(shd_vf_gt(shd_vf_set(UPRIGHT), x), rise * rise * exp_of(-x * inverse));
}

/* The square of what a place reaches in widths, times how much more than at the peak derivatives
 * are beside the lobe where that is e^-faint. */
SHD_INLINE void spread(shd_vf reach, shd_vf width, shd_vf faint, look *out) {
    const shd_vf by = reach / width;
    out->plain = by * by;
    out->square = out->plain * (shd_vf_set(1) + shd_vf_set(0.9F) * faint);
}

/* H = (L + V) / |L + V| turns by what L does over |L + V|. */
SHD_INLINE void look_at_half(const shd_lobe_view *v, const place *at, look *out) {
    const shd_vf one = shd_vf_set(1), zero = shd_vf_set(0), n = set(v->lobe->sharpness),
                 two = shd_vf_set(2), between = dot_vector(at->d, v->lobe->view),
                 length = shd_vf_sqrt(shd_vf_max(two + two * between, shd_vf_set(1e-12F))),
                 up = at->side + set(v->viewing), cosine = smaller_of(up / length, one);
    const shd_mf small = shd_vf_gt_in(shd_vf_gt(length, two * at->reach), cosine, zero);
    const shd_vf turn = shd_vf_set(1.05F) * at->reach / length,
                 by = turn * (one + shd_vf_set(0.4F) * turn * turn) + shd_vf_set(BLUR),
                 tangent = shd_vf_sqrt((one - cosine) * (one + cosine)) /
                           shd_vf_select(small, cosine, one),
                 near = if_in(small, nearer(tangent, by)),
                 far = shd_vf_select(small, farther(tangent, by), shd_vf_set(UPRIGHT));
    shd_vf faint;
    if (v->lobe->model == SHD_MODEL_BLINN_PHONG) {
        faint = faint_power(n, near);
        out->near = exp_of(-faint);
        out->far = power_far(n, far);
    } else {
        const shd_vf inverse = set(v->inverse),
                     most = smaller_of(shd_vf_max(set(v->peak), near), far);
        faint = near * inverse;
        out->near = facets_at(inverse, most);
        out->far = smaller_of(facets_at(inverse, near), facets_at(inverse, far));
    }
    spread(at->reach, shd_vf_max(length - at->reach, shd_vf_set(1e-6F)) * set(v->own), faint, out);
}

/* What G over N.V is, and whether it becomes another of its three in the place: 2 N.H N.V / V.H is
 * 2 (N.L + N.V) N.V / (1 + L.V), and so on. */
SHD_INLINE void open_facets(const shd_lobe_view *view, const place *at, look *out) {
    const shd_vf one = shd_vf_set(1), zero = shd_vf_set(0), two = shd_vf_set(2), side = at->side,
                 half = shd_vf_set(0.5F), v = set(view->viewing), reach = at->reach,
                 between = one + dot_vector(at->d, view->lobe->view),
                 length = shd_vf_sqrt(two * shd_vf_max(between, zero)), h = length * half,
                 inverse = one / shd_vf_max(length, shd_vf_set(1e-6F)), off = reach * inverse,
                 u = smaller_of((side + v) * inverse, one),
                 over = shd_vf_max(h - reach * half, v * half), most = smaller_of(u + off, one),
                 least = shd_vf_max(u - off, zero), wide = h + reach * half;
    const shd_vf open = set(1 / view->viewing), many = two * most / over, few = two * least / wide;
    out->high = smaller_of(smaller_of(open, many), many * (side + reach) * open);
    out->low = smaller_of(smaller_of(open, few), few * shd_vf_max(side - reach, zero) * open);
    const shd_vf by_view = two * (side + v) * v - between,
                 by_light = two * (side + v) * side - between,
                 steep = two * (two * (absolute(side) + reach) + v) + one,
                 turned = (two * v + one) * reach;
    const shd_mf first = shd_vf_gt_in(shd_vf_gt(turned, absolute(by_view)), side + reach, v),
                 second =
                     shd_vf_gt_in(shd_vf_gt(steep * reach, absolute(by_light)), v + reach, side),
                 third = shd_vf_gt_in(shd_vf_gt(reach, absolute(side - v)), turned, by_view),
                 near = shd_mf_or(shd_mf_or(first, second), third);
    out->kink = if_in(near, shd_vf_set(FACETS_KINK) * off);
    out->kink = shd_vf_select(shd_vf_gt(reach, side),
                              shd_vf_max(out->kink, shd_vf_set(FACETS_HORIZON)), out->kink);
}

/* (R.V)^n as it is, whose edge is steep if n is low. */
SHD_INLINE void look_at_mirror(const shd_lobe_view *v, place *at, look *out) {
    const shd_vf one = shd_vf_set(1), zero = shd_vf_set(0), n = set(v->lobe->sharpness),
                 reach = at->reach, cosine = smaller_of(dot_vector(at->d, v->lobe->mirror), one),
                 by = reach * (one + shd_vf_set(0.4F) * reach * reach) + shd_vf_set(BLUR);
    const shd_mf small =
        shd_vf_gt_in(shd_vf_gt(cosine, shd_vf_set(1e-3F)), shd_vf_set(0.7F), reach);
    const shd_vf tangent = shd_vf_sqrt(shd_vf_max((one - cosine) * (one + cosine), zero)) /
                           shd_vf_select(small, cosine, one),
                 faint = if_in(small, faint_power(n, nearer(tangent, by)));
    at->seen = shd_mf_and(at->seen, shd_mf_or(small, shd_mf_not(shd_vf_gt(-reach, cosine))));
    out->far = if_in(small, power_far(n, farther(tangent, by)));
    out->near = exp_of(-faint);
    spread(reach, set(v->own), faint, out);
    if (v->lobe->sharpness < 4) out->kink = if_in(shd_vf_gt(reach, cosine), shd_vf_set(HORIZON));
}

/* N.L over what normalizes it rises to 1 from the horizon on. */
SHD_INLINE void look_at_normalized(const shd_lobe_view *v, place *at, look *out) {
    const shd_vf one = shd_vf_set(1), zero = shd_vf_set(0), reach = at->reach,
                 rise = set(sqrt(v->lobe->sharpness + 1));
    look_at_mirror(v, at, out);
    out->high = smaller_of((at->side + reach) * rise, one);
    out->low = smaller_of(shd_vf_max(at->side - reach, zero) * rise, one) * shd_vf_set(0.5F);
    out->kink = shd_vf_max(out->kink, if_in(shd_vf_gt(reach, at->side), shd_vf_set(HORIZON)));
}

/* Where the horizon cuts a lobe as off a cliff. */
SHD_INLINE void end_at_horizon(const place *at, look *out) {
    const shd_mf ends = shd_vf_gt(at->reach, at->side);
    out->low = if_in(shd_mf_not(ends), out->low);
    out->kink = shd_vf_max(out->kink, if_in(ends, shd_vf_set(CLIFF)));
}

SHD_INLINE void look_at_rough(const shd_lobe_view *view, const place *at, look *out) {
    const shd_vf zero = shd_vf_set(0), v = set(view->viewing), side = at->side, reach = at->reach,
                 kink = shd_vf_set(KINK) * reach;
    out->near = out->far = shd_vf_set(1);
    out->high = shd_vf_set(2) * (side + reach);
    out->low = shd_vf_max(side - reach, zero);
    spread(reach, set(view->own), zero, out);
    const shd_mf along = shd_vf_gt(reach, absolute(dot_vector(at->d, view->lobe->view) - side * v)),
                 even = shd_vf_gt(reach, absolute(side - v));
    out->kink =
        shd_vf_max(if_in(along, kink), if_in(even, kink * set(1 / shd_larger(view->viewing, 0.2))));
    out->kink = shd_vf_select(shd_vf_gt(reach, side), shd_vf_set(HORIZON), out->kink);
}

SHD_INLINE void look_at(const shd_lobe_view *v, shd_model model, shd_looks *looks, size_t i) {
    place at = {.reach = shd_vf_load(looks->reach + i)};
    look out = {.high = shd_vf_set(1), .low = shd_vf_set(1), .kink = shd_vf_set(0)};
    for (int c = 0; c < 3; c++) at.d[c] = shd_vf_load(looks->middle[c] + i);
    at.side = dot_vector(at.d, v->lobe->normal);
    at.seen = shd_vf_gt(at.side, -at.reach);
    if (model == SHD_MODEL_COOK_TORRANCE) {
        look_at_half(v, &at, &out);
        open_facets(v, &at, &out);
    } else if (model == SHD_MODEL_BLINN_PHONG) {
        look_at_half(v, &at, &out);
        end_at_horizon(&at, &out);
    } else if (model == SHD_MODEL_PHONG) {
        look_at_mirror(v, &at, &out);
        end_at_horizon(&at, &out);
    } else if (model == SHD_MODEL_PHONG_NORMALIZED) {
        look_at_normalized(v, &at, &out);
    } else {
        look_at_rough(v, &at, &out);
    }
    const shd_mf seen = shd_vf_gt_in(at.seen, out.near, shd_vf_set(LEAST));
    shd_vf_store(looks->near + i, if_in(seen, out.near));
    shd_vf_store(looks->far + i, out.far);
    shd_vf_store(looks->high + i, out.high);
    shd_vf_store(looks->low + i, out.low);
    shd_vf_store(looks->plain + i, out.plain);
    shd_vf_store(looks->square + i, out.square);
    shd_vf_store(looks->kink + i, out.kink);
}

void SHD_VARIANT(shd_look_at_lobe)(const shd_lobe_view *v, shd_looks *looks) {
    const size_t count = looks->count;
    if (!count) return;
    for (size_t i = count; i % SHD_LOOKS_STEP; i++) {
        for (int c = 0; c < 3; c++) looks->middle[c][i] = looks->middle[c][count - 1];
        looks->reach[i] = looks->reach[count - 1];
    }
    for (size_t i = 0; i < count; i += SHD_W) look_at(v, v->lobe->model, looks, i);
}
