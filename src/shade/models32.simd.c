/* Light sums of the standard tier in f32, of models beside Phong's, where nothing stops light.
 * Compiled once for each instruction set; the equations are those of shade/brdf.h.
 *
 * All is made of N and W, the mirrored view, so that points are those of Phong's model. With c =
 * N.L and v = N.V = N.W, the part of L - W that is beside N is that of L + V: let t be it. Then
 * |L + V|^2 = t^2 + (c + v)^2, N.H = (c + v) / |L + V|, and 1 - N.H is t^2 / (|L + V|^2 + (c + v)
 * |L + V|), which does not cancel. L.V - c v is c v - L.W.
 *
 * Where f32's rounding would be magnified, near an end of the model or where light and view are
 * both along the surface (plan/tier.h), points are marked, and lit again in f64.
 * tests/unit/shade_models32.c measures errors. */
#include "base/cpu.h"
#include "shade/fast_simd.h"

#if !SHD_FUSES
/* No plan asks for it: f64 is faster. */
void SHD_VARIANT(shd_models32)(const shd_sums_job *job) {
    (void)job;
}
#else

typedef struct points {
    shd_vf p[3], low[3], n[3], w[3], nv;
} points;

/* A light at points. */
typedef struct arrival {
    shd_vf toward[3]; /* L */
    shd_vf facing;    /* N.L */
    shd_vf factor;    /* f s */
    shd_mf lit;
} arrival;

/* What lights add up to: diffuse by channel, then lobes by channel. */
typedef struct tally {
    shd_vf row[SHD_WIDE_ROWS];
    shd_vd total[SHD_WIDE_ROWS][2];
    size_t rows;
    bool any; /* a group is in `total` */
} tally;

SHD_INLINE shd_vf smaller_of(shd_vf a, shd_vf b) {
    return shd_vf_select(shd_vf_gt(a, b), b, a);
}

SHD_INLINE void load_points(const shd_points32 *from, size_t i, bool split, points *to) {
    for (int c = 0; c < 3; c++) {
        to->p[c] = shd_vf_load(from->position[c] + i);
        to->n[c] = shd_vf_load(from->normal[c] + i);
        to->w[c] = shd_vf_load(from->mirror[c] + i);
        to->low[c] = split ? shd_vf_load(from->low[c] + i) : shd_vf_set(0);
    }
    to->nv = dot_lanes(to->n, to->w);
}

/* Lanes of which the sign of N.L is not known. */
SHD_INLINE shd_mf find_ends(shd_vf facing, shd_vf d2, bool split) {
    const double turned = SHD_TURNED * SHD_TURNED, apart = split ? turned * SHD_SPLIT : turned;
    const shd_vf off2 = shd_vf_fma(d2, shd_vf_set((float)turned), shd_vf_set((float)apart));
    return shd_vf_gt(off2, facing * facing);
}

/* Finds how the light reaches the points. Lanes that are left to f64 are added to `again`; `ends`
 * asks for those at N.L = 0. False: no lane is lit. */
SHD_INLINE bool reach_points(const shd_packed_light *light, const points *at, bool split, bool ends,
                             shd_mf *again, arrival *out) {
    const shd_light_kind kind = (shd_light_kind)light->kind;
    const bool directional = kind == SHD_KIND_DIRECTIONAL;
    shd_vf path[3];
    for (int c = 0; c < 3; c++) {
        path[c] = shd_vf_set(light->at[c]);
        if (directional) continue;
        path[c] -= at->p[c];
        if (split) path[c] += shd_vf_set(light->low[c]) - at->low[c];
    }
    const shd_vf facing = dot_lanes(at->n, path); /* times the distance */
    shd_vf r = shd_vf_set(1), f = r;
    const shd_vf d2 = directional ? r : dot_lanes(path, path);
    if (ends) *again = shd_mf_or(*again, find_ends(facing, d2, split));
    out->lit = shd_vf_gt(facing, shd_vf_set(0));
    if (!directional) {
        const shd_vu above = (shd_vu)d2 - shd_vu_set(light->nearest); /* wraps below it */
        const shd_mf wide = shd_vu_ge(above, shd_vu_set(light->span));
        *again = shd_mf_or(*again, wide);
        out->lit = shd_mf_and(out->lit, shd_mf_not(wide));
    }
    if (!shd_mf_any(out->lit)) return false;
    if (!directional) weigh_distance(light, kind, d2, &r, &f);
    if (kind == SHD_KIND_SPOT) {
        shd_mf rim;
        const shd_vf spot = weigh_spot(light, path, r, &out->lit, &rim);
        *again = shd_mf_or(*again, rim);
        if (!shd_mf_any(out->lit)) return false;
        f *= spot;
    }
    for (int c = 0; c < 3; c++) out->toward[c] = directional ? path[c] : path[c] * r;
    out->facing = directional ? facing : facing * r;
    out->factor = f;
    return true;
}

SHD_INLINE void add_white(shd_vf weight, const float *color, shd_vf *sums) {
    add_colored(sums, weight, color, 3);
}

/* ---- Oren-Nayar ---- */

SHD_INLINE shd_vf weigh_rough(const shd_packed_model *m, const points *at, const arrival *by,
                              shd_mf *again) {
    const shd_vf zero = shd_vf_set(0), view = shd_vf_max(at->nv, zero), c = by->facing;
    const shd_vf mirrored = dot_lanes(by->toward, at->w), larger = shd_vf_max(c, view);
    /* L.V - N.L max(0, N.V), with L.V = 2 c v - L.W */
    const shd_vf along = shd_vf_fma(c, at->nv + at->nv - view, -mirrored);
    *again = shd_mf_or(*again, shd_vf_gt_in(by->lit, shd_vf_set((float)SHD_ALONG), larger));
    const shd_vf share = c / shd_vf_max(larger, shd_vf_set(0x1p-100f));
    return shd_vf_fma(shd_vf_max(along, zero) * share, shd_vf_set(m->rough),
                      c * shd_vf_set(m->even));
}

/* ---- Half vectors ---- */

typedef struct halfway {
    shd_vf sum;    /* N.L + N.V */
    shd_vf beside; /* t^2 */
    shd_vf lv;     /* |L + V|^2 */
} halfway;

/* Lanes in which |L + V|^2 is below `least` are added to `again`. */
SHD_INLINE halfway halve_lanes(const points *at, const arrival *by, float least, shd_mf *again) {
    shd_vf beside[3];
    const shd_vf along = by->facing - at->nv;
    for (int c = 0; c < 3; c++) beside[c] = shd_vf_fma(-along, at->n[c], by->toward[c] - at->w[c]);
    halfway h = {.sum = by->facing + at->nv, .beside = dot_lanes(beside, beside)};
    h.lv = shd_vf_fma(h.sum, h.sum, h.beside);
    const shd_vf floor = shd_vf_set(least);
    *again = shd_mf_or(*again, shd_vf_gt_in(by->lit, floor, h.lv));
    h.lv = shd_vf_max(h.lv, floor);
    return h;
}

/* ---- Lobes of Phong's kin ---- */

/* pi N.L / E(N.L, n) */
SHD_INLINE shd_vf normalize_lobe(const shd_packed_energy32 *e, shd_vf facing) {
    const shd_vf one = shd_vf_set(1), c = smaller_of(facing, one), kappa = shd_vf_set(e->kappa);
    const shd_vf x =
        shd_vf_fma((kappa - c) / (kappa + c), shd_vf_set(e->twice), shd_vf_set(e->shift));
    shd_vf b1 = shd_vf_set(0), b2 = b1; /* Clenshaw: x is doubled */
    for (int k = e->count - 1; k > 0; k--) {
        const shd_vf b = shd_vf_fma(x, b1, shd_vf_set(e->terms[k]) - b2);
        b2 = b1;
        b1 = b;
    }
    const shd_vf psi = shd_vf_fma(x * shd_vf_set(0.5f), b1, shd_vf_set(e->terms[0]) - b2);
    const shd_vf square = smaller_of(c * c, shd_vf_set(0x1.fffffep-1f)),
                 fall = shd_power_1m(square, shd_vf_set(e->exponent));
    return shd_vf_set(e->gain) * c /
           shd_vf_fma(shd_vf_set(e->beta) * fall, psi, shd_vf_set(e->slope) * c);
}

/* Adds lobes, of which `off` is 1 less the cosine. */
SHD_INLINE void add_lobes(const shd_sums_job *job, const shd_packed_model *m, const arrival *by,
                          const float *color, shd_vf off, shd_mf lit, shd_mf *again, shd_vf *sums) {
    const shd_plan_lobe *lobes = job->material->lobes + job->first_lobe;
    const shd_vf largest = shd_vf_set(0x1.fffffep-1f);
    shd_vf log = off;
    bool has_log = false;
    for (size_t k = 0; k < job->lobe_count; k++) {
        const float exponent = (float)lobes[k].shininess;
        const shd_mf in = shd_vf_gt_in(lit, shd_vf_set(m->cut / exponent), off);
        if (!shd_mf_any(in)) continue;
        if (!has_log) log = shd_log2_1m(smaller_of(off, largest));
        has_log = true;
        shd_vf weight =
            shd_exp2(shd_vf_max(log * shd_vf_set(exponent), shd_vf_set((float)SHD_LEAST_LOG2)));
        if (m->energies) {
            const shd_packed_energy32 *energy = &m->energies[job->first_lobe + k];
            *again = shd_mf_or(*again, shd_vf_gt_in(in, shd_vf_set(energy->low), by->facing));
            weight *= normalize_lobe(energy, by->facing);
        }
        add_white(shd_vf_mul_in(in, weight, by->factor), color, sums + 3 * k);
    }
}

SHD_INLINE void add_shine(const shd_sums_job *job, const shd_packed_model *m, const points *at,
                          const arrival *by, const float *color, shd_mf *again, shd_vf *sums) {
    const shd_vf one = shd_vf_set(1), zero = shd_vf_set(0);
    if (!job->lobe_count) return;
    if (m->energies) {
        shd_vf chord[3];
        for (int c = 0; c < 3; c++) chord[c] = by->toward[c] - at->w[c];
        const shd_vf off = dot_lanes(chord, chord) * shd_vf_set(0.5f);
        add_lobes(job, m, by, color, off, shd_vf_gt_in(by->lit, one, off), again, sums);
    } else {
        const halfway h = halve_lanes(at, by, (float)SHD_OPPOSITE, again);
        const shd_mf upright = shd_vf_gt_in(by->lit, h.sum, zero);
        /* 1 - N.H, whose errors near N.H = 0 do not grow */
        const shd_vf off = h.beside / shd_vf_fma(h.sum, shd_vf_sqrt(h.lv), h.lv);
        add_lobes(job, m, by, color, off, upright, again, sums);
    }
}

/* ---- Sums ---- */

SHD_INLINE void add_light(const shd_sums_job *job, const shd_packed_model *m,
                          const shd_packed_light *light, const points *at, bool split,
                          shd_mf *again, shd_vf *sums) {
    const shd_model model = job->material->model;
    arrival by;
    const bool ends = model == SHD_MODEL_BLINN_PHONG && job->lobe_count;
    if (!reach_points(light, at, split, ends, again, &by)) return;
    const shd_vf diffuse =
        model == SHD_MODEL_OREN_NAYAR ? weigh_rough(m, at, &by, again) : by.facing;
    add_white(shd_vf_mul_in(by.lit, diffuse, by.factor), light->color, sums);
    add_shine(job, m, at, &by, light->color, again, sums + 3);
}

SHD_INLINE void end_group(tally *s) {
    for (size_t k = 0; k < s->rows; k++) add_row(&s->row[k], s->total[k]);
    s->any = true;
}

SHD_INLINE void store_sums(const shd_sums_job *job, const tally *s, size_t i) {
    float *const *specular = job->specular + 3 * job->first_lobe;
    for (size_t k = 0; k < s->rows; k++) {
        if (k < 3 && !job->diffuse) continue;
        store_row(s->row[k], s->total[k], s->any, (k < 3 ? job->diffuse[k] : specular[k - 3]) + i);
    }
}

SHD_INLINE void sum_lights(const shd_sums_job *job, bool split) {
    const shd_packed_light *lights = job->lighting->lights;
    const shd_packed_model *m =
        job->lighting->materials[job->material - job->lighting->plan->materials].model;
    const shd_mf none = shd_vf_gt(shd_vf_set(0), shd_vf_set(0)), all = shd_mf_not(none);
    for (size_t i = job->first; i < job->end; i += SHD_W) {
        points at;
        load_points(job->narrow, i, split, &at);
        tally s = {.rows = 3 + 3 * job->lobe_count, .any = false};
        for (size_t k = 0; k < s.rows; k++) {
            s.row[k] = shd_vf_set(0);
            s.total[k][0] = s.total[k][1] = shd_vd_set(0);
        }
        shd_mf again = none;
        uint32_t group = job->n ? lights[job->which[0]].group : 0;
        for (size_t k = 0; k < job->n; k++) {
            const shd_packed_light *light = &lights[job->which[k]];
            if (light->group != group) end_group(&s);
            group = light->group;
            if (light->kind == SHD_KIND_WIDE)
                again = all;
            else
                add_light(job, m, light, &at, split, &again, s.row);
        }
        store_sums(job, &s, i);
        if (__builtin_expect(shd_mf_any(again), 0))
            shd_mark_edges(job->edges, i, shd_mf_bits(again));
    }
}

void SHD_VARIANT(shd_models32)(const shd_sums_job *job) {
    if (job->narrow->low[0])
        sum_lights(job, true);
    else
        sum_lights(job, false);
}

#endif
