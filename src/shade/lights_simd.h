/* How lights reach points in f64: what the kernels of all models share. Only for *.simd.c of
 * shade/. The forms are those of fast.simd.c, without fused products. */
#pragma once

#include "shade/math64_simd.h"
#include "shade/packed.h"

enum { VW = SHD_W / 2, ROWS = SHD_WIDE_ROWS };

/* Squared distances outside of these have lost bits, or their products would. Such lanes are left
 * to the reference. */
static const double NEAREST2 = 0x1p-600, FARTHEST2 = 0x1p600;

typedef struct points {
    shd_vd p[3], n[3], w[3];
    shd_vd v[3]; /* of points in f64 */
    bool split;  /* from two floats each */
} points;

SHD_INLINE shd_vd dot_lanes(const shd_vd a[3], const shd_vd b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* |a + b|^2 / 2 of unit vectors. */
SHD_INLINE shd_vd half_chords(const shd_vd a[3], const shd_vd b[3]) {
    const shd_vd chord[3] = {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
    return dot_lanes(chord, chord) * shd_vd_set(0.5);
}

/* (1 - d)^exponent from log(1 - d). */
SHD_INLINE shd_vd power_of(shd_vd log, double exponent) {
    return shd_exp64(shd_vd_max(log * shd_vd_set(exponent), shd_vd_set(-700)));
}

/* The same where each lane has its own. */
SHD_INLINE shd_vd power_of_lanes(shd_vd log, shd_vd exponent) {
    return shd_exp64(shd_vd_max(log * exponent, shd_vd_set(-700)));
}

/* d if it is a power's, otherwise a value that is as good as 1. */
SHD_INLINE shd_vd below_one(shd_vd d) {
    const shd_vd largest = shd_vd_set(0x1.fffffffffffffp-1);
    return shd_vd_select(shd_vd_gt(largest, d), d, largest);
}

/* The factor of a spot. Lanes outside of its cone leave `lit`. */
SHD_INLINE shd_vd weigh_spot(const shd_wide_light *light, const shd_vd toward[3], shd_md *lit) {
    const shd_vd axis[3] = {shd_vd_set(light->axis[0]), shd_vd_set(light->axis[1]),
                            shd_vd_set(light->axis[2])};
    const shd_vd one = shd_vd_set(1), outer = shd_vd_set(light->outer);
    shd_vd q = half_chords(axis, toward); /* 1 - cos t */
    *lit = shd_md_and(*lit, shd_md_not(shd_vd_gt(q, outer)));
    if (!shd_md_any(*lit)) return q;
    shd_vd fade = (outer - q) * shd_vd_set(light->inverse_fade);
    shd_vd smooth = fade * fade * (shd_vd_set(3) - (fade + fade));
    shd_vd factor = shd_vd_select(shd_vd_gt(q, shd_vd_set(light->inner)), smooth, one);
    if (!(light->exponent > 0)) return factor;
    *lit = shd_vd_gt_in(*lit, one, q);
    return factor * power_of(shd_log1m64(below_one(q)), light->exponent);
}

/* N.(light - p), or N.L, of points that lie in a face whose plane the light is in or near to: those
 * are set in `known`. */
SHD_INLINE shd_vd facing_of_sheets(const shd_wide_light *light, const points *at, shd_vd facing,
                                   shd_md *known) {
    const shd_vd zero = shd_vd_set(0), one = shd_vd_set(1);
    shd_vd place = zero;
    for (int c = 0; c < 3; c++) place += shd_vd_max(at->p[c], -at->p[c]);
    for (uint32_t k = 0; k < light->sheet_count; k++) {
        const shd_packed_sheet *s = &light->sheets[k];
        shd_vd n[3], off[3];
        for (int c = 0; c < 3; c++) n[c] = shd_vd_set(s->normal[c]);
        const shd_vd sign = shd_vd_select(shd_vd_gt(zero, dot_lanes(at->n, n)), -one, one);
        for (int c = 0; c < 3; c++) off[c] = at->n[c] - sign * n[c];
        shd_vd apart = dot_lanes(at->p, n) - shd_vd_set(s->offset);
        apart = shd_vd_max(apart, -apart);
        const shd_vd most = place * shd_vd_set(s->same_place) + shd_vd_set(s->slack);
        const shd_md on =
            shd_vd_gt_in(shd_vd_gt(most, apart), shd_vd_set(s->same_normal), dot_lanes(off, off));
        facing = shd_vd_select(on, sign * shd_vd_set(s->height), facing);
        *known = shd_md_or(*known, on);
    }
    return facing;
}

/* 1/distance, and the attenuation as *factor. */
SHD_INLINE shd_vd weigh_distance(const shd_wide_light *light, shd_vd d2, shd_vd *factor) {
    const shd_vd distance = shd_vd_sqrt(d2);
    if (light->kind == SHD_KIND_POINT) return shd_vd_set(1) / distance;
    shd_vd d = shd_vd_max(distance, shd_vd_set(light->least));
    shd_vd slope = d * shd_vd_set(light->c) + shd_vd_set(light->b);
    shd_vd fall = d * slope + shd_vd_set(light->a);
    shd_vd both = shd_vd_set(1) / (fall * distance);
    *factor = both * distance;
    return both * fall;
}

/* Points as near to N.L = 0, under a highlight, as f32's rounding; but for those of which the side
 * is known. */
SHD_INLINE unsigned find_ends(const points *at, const shd_vd path[3], shd_vd facing, shd_vd d2,
                              shd_md known) {
    const double turned = SHD_TURNED * SHD_TURNED;
    const shd_vd reach = (d2 + shd_vd_set(at->split ? SHD_SPLIT : 1)) * shd_vd_set(turned);
    const shd_md near = shd_md_and(shd_vd_gt(reach, facing * facing), shd_md_not(known));
    if (!shd_md_any(near)) return 0;
    return shd_md_bits(shd_vd_gt_in(near, dot_lanes(at->w, path), shd_vd_set(0)));
}

/* N.(light - p), or N.L. Lanes in which its sign is not known are added to `edges`, unless that is
 * NULL. */
SHD_INLINE shd_vd find_facing(const shd_wide_light *light, const points *at, const shd_vd path[3],
                              shd_vd d2, unsigned *edges) {
    shd_vd facing = dot_lanes(at->n, path);
    shd_md known = shd_vd_gt(d2, d2); /* none */
    if (__builtin_expect(light->sheet_count > 0, 0))
        facing = facing_of_sheets(light, at, facing, &known);
    if (edges) *edges |= find_ends(at, path, facing, d2, known);
    return facing;
}

/* How a light reaches points. */
typedef struct arrival {
    shd_vd toward[3]; /* L */
    shd_vd facing;    /* N.L */
    shd_vd factor;    /* f s, but for the color's share of it */
    shd_md lit;       /* the light is before the surface, and its cone is around the point */
} arrival;

/* Finds how the light reaches the lanes `asked`. Nothing is set but `lit` if none is lit. Returns
 * the lanes that are left to the reference. Lanes on edges to within f32's rounding are added to
 * `edges`, unless that is NULL. */
SHD_INLINE unsigned reach_points(const shd_wide_light *light, const points *at, shd_md asked,
                                 unsigned *edges, arrival *out) {
    shd_vd toward[3];
    shd_vd factor = shd_vd_set(1);
    unsigned left = 0;
    for (int c = 0; c < 3; c++) toward[c] = shd_vd_set(light->at[c]);
    shd_md lit;
    shd_vd facing;
    if (light->kind == SHD_KIND_DIRECTIONAL) {
        facing = find_facing(light, at, toward, factor, edges);
        lit = shd_vd_gt_in(asked, facing, shd_vd_set(0));
        out->lit = lit;
        if (!shd_md_any(lit)) return 0;
    } else {
        for (int c = 0; c < 3; c++) toward[c] -= at->p[c];
        shd_vd d2 = dot_lanes(toward, toward);
        shd_md held = shd_vd_gt_in(shd_vd_gt(d2, shd_vd_set(NEAREST2)), shd_vd_set(FARTHEST2), d2);
        left = shd_md_bits(shd_md_and(asked, shd_md_not(held)));
        facing = find_facing(light, at, toward, d2, edges);
        lit = shd_vd_gt_in(shd_md_and(held, asked), facing, shd_vd_set(0));
        out->lit = lit;
        if (!shd_md_any(lit)) return left;
        const shd_vd inverse = weigh_distance(light, d2, &factor);
        for (int c = 0; c < 3; c++) toward[c] *= inverse;
        facing *= inverse;
    }
    if (light->kind == SHD_KIND_SPOT) factor *= weigh_spot(light, toward, &lit);
    for (int c = 0; c < 3; c++) out->toward[c] = toward[c];
    out->facing = facing;
    out->factor = factor;
    out->lit = lit;
    return left;
}

SHD_INLINE void load_points(const shd_points64 *from, size_t i, double scale, points *to) {
    shd_vd *v = to->v;
    to->split = false;
    for (int c = 0; c < 3; c++) {
        to->p[c] = shd_vd_load(from->position[c] + i) * shd_vd_set(scale);
        to->n[c] = shd_vd_load(from->normal[c] + i);
        v[c] = shd_vd_load(from->view[c] + i);
    }
    shd_vd twice = dot_lanes(to->n, v) * shd_vd_set(2);
    for (int c = 0; c < 3; c++) to->w[c] = twice * to->n[c] - v[c];
}

/* The last vector of points, filled with repeats of the last point: nothing beyond is read. */
__attribute__((noinline, cold, unused)) static void load_last(const shd_points64 *from, size_t i,
                                                              double scale, points *to) {
    double held[9][VW];
    for (size_t k = 0; k < VW; k++) {
        const size_t at = i + k < from->count ? i + k : from->count - 1;
        for (int c = 0; c < 3; c++) {
            held[c][k] = from->position[c][at];
            held[3 + c][k] = from->normal[c][at];
            held[6 + c][k] = from->view[c][at];
        }
    }
    const shd_points64 last = {.count = VW,
                               .position = {held[0], held[1], held[2]},
                               .normal = {held[3], held[4], held[5]},
                               .view = {held[6], held[7], held[8]}};
    load_points(&last, 0, scale, to);
}

SHD_INLINE void store_sums(const shd_sums_job *job, size_t row, size_t i, shd_vd sum) {
    const bool is_diffuse = row < 3;
    const size_t at = is_diffuse ? row : row - 3 + 3 * job->first_lobe;
    if (job->narrow) {
        float *const *rows = is_diffuse ? job->diffuse : job->specular;
        shd_vh half = shd_vh_narrow(sum);
        if (rows) memcpy(rows[at] + i, &half, sizeof half);
        return;
    }
    double *const *rows = is_diffuse ? job->diffuse64 : job->specular64;
    const size_t left = job->count - i;
    if (!rows) return;
    if (__builtin_expect(left >= VW, 1))
        shd_vd_store(rows[at] + i, sum);
    else
        memcpy(rows[at] + i, &sum, left * sizeof(double));
}
