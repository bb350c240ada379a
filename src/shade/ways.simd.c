/* A model's weights of light from many directions at one point, and the directions of cells.
 * Compiled once for each instruction set; tests/unit/shade_ways.c holds them against shade/brdf.h.
 */
#include "shade/ways.h"

#include "base/cpu.h"
#include "shade/gauss.h"
#include "shade/models_simd.h"
#include "shade/westin_simd.h"

enum {
    STEP = SHD_WAYS_STEP,
    FEW_WAYS = 16 /* of a light that cost less than to see a whole table */
};

/* ---- Sums ---- */

/* Adds the products of values and weights, in the order of eight lanes on every machine. */
SHD_INLINE void sum_row(const shd_ways *w, const double *values, double out[SHD_WAY_SUMS]) {
    for (int k = 0; k < w->sums; k++) {
        double lanes[STEP];
        for (size_t h = 0; h < STEP; h += VW) {
            shd_vd sum = shd_vd_set(0);
            for (size_t i = h; i < w->count; i += STEP)
                sum += shd_vd_load(w->weight[k] + i) * shd_vd_load(values + i);
            shd_vd_store(lanes + h, sum);
        }
        out[k] += ((lanes[0] + lanes[1]) + (lanes[2] + lanes[3])) +
                  ((lanes[4] + lanes[5]) + (lanes[6] + lanes[7]));
    }
}

/* The same of a term whose channels are the same. */
SHD_INLINE void sum_grey(const shd_ways *w, const double *values, double (*out)[SHD_WAY_SUMS]) {
    double row[SHD_WAY_SUMS] = {0};
    sum_row(w, values, row);
    for (int c = 0; c < 3; c++)
        for (int k = 0; k < w->sums; k++) out[c][k] += row[k];
}

/* ---- Models ---- */

/* What is kept of each direction. */
typedef struct seen_ways {
    double facing[SHD_WAYS_MOST]; /* N.L; 0 or less: nothing is lit */
    double off[SHD_WAYS_MOST];    /* what a lobe's cosine is less than 1 */
    double log[SHD_WAYS_MOST];    /* and the logarithm of that cosine */
    double values[SHD_WAYS_MOST];
} seen_ways;

SHD_INLINE void load_way(const shd_ways *w, size_t i, shd_vd toward[3]) {
    for (int c = 0; c < 3; c++) toward[c] = shd_vd_load(w->toward[c] + i);
}

SHD_INLINE void spread_vector(shd_vec3 v, shd_vd out[3]) {
    out[0] = shd_vd_set(v.x);
    out[1] = shd_vd_set(v.y);
    out[2] = shd_vd_set(v.z);
}

SHD_INLINE points point_at(const shd_surface *at) {
    points out = {.split = false};
    spread_vector(at->normal, out.n);
    spread_vector(at->view, out.v);
    spread_vector(at->mirror, out.w);
    return out;
}

/* Lobes of Phong's kin. */
SHD_INLINE void sum_shine(const shd_way_point *p, const shd_ways *w, seen_ways *s,
                          double (*out)[SHD_WAY_SUMS]) {
    const shd_plan_material *m = p->at->material;
    const shd_vd zero = shd_vd_set(0), one = shd_vd_set(1);
    for (size_t i = 0; i < w->count && m->lobe_count; i += VW)
        shd_vd_store(s->log + i, shd_log1m64(below_one(shd_vd_load(s->off + i))));
    for (size_t k = 0; k < m->lobe_count; k++) {
        const double n = m->lobes[k].shininess, reach = n > SHD_EXACT_CUT ? SHD_EXACT_CUT / n : 1;
        bool any = false;
        for (size_t i = 0; i < w->count; i += VW) {
            const shd_vd facing = shd_vd_load(s->facing + i);
            const shd_md in =
                shd_vd_gt_in(shd_vd_gt(facing, zero), shd_vd_set(reach), shd_vd_load(s->off + i));
            shd_vd weight = zero;
            if (shd_md_any(in)) {
                weight = power_of(shd_vd_load(s->log + i), n);
                if (p->energies) weight *= normalize_lobe(&p->energies[k], facing);
                weight = shd_vd_mul_in(in, weight, one);
                any = true;
            }
            shd_vd_store(s->values + i, weight);
        }
        if (any) sum_grey(w, s->values, out + 3 * k);
    }
}

SHD_INLINE void sum_facets(const shd_way_point *p, const shd_ways *w, const points *at,
                           seen_ways *s, double (*out)[SHD_WAY_SUMS]) {
    const shd_plan_material *m = p->at->material;
    shd_fresnel own;
    const shd_fresnel *of = shd_index_at(p->at, &own);
    const shd_vd quarter = shd_vd_set(0.25);
    bool same[3] = {false, false, false};
    for (int c = 1; c < 3; c++) same[c] = of->n[c] == of->n[c - 1] && of->k[c] == of->k[c - 1];
    double mirrored[3][SHD_WAYS_MOST], open[SHD_WAYS_MOST], tangent[SHD_WAYS_MOST],
        nh2[SHD_WAYS_MOST];
    for (size_t i = 0; i < w->count; i += VW) {
        shd_vd toward[3];
        load_way(w, i, toward);
        const shd_vd facing = shd_vd_load(s->facing + i);
        const pairing pair = pair_lanes(at, toward);
        const shd_md lit = see_facets(shd_vd_gt(facing, shd_vd_set(0)), &pair);
        const facets f = face_lanes(facing, &pair);
        const shd_vd some = shd_vd_mul_in(lit, f.open, shd_vd_set(1));
        shd_vd_store(open + i, some);
        shd_vd_store(tangent + i, f.tangent);
        shd_vd_store(nh2 + i, shd_vd_select(lit, f.nh2, shd_vd_set(1)));
        for (int c = 0; c < 3; c++)
            if (!same[c])
                shd_vd_store(mirrored[c] + i, mirror_lanes(of->n[c], of->k[c], pair.lv * quarter,
                                                           pair.apart * quarter));
    }
    for (size_t k = 0; k < m->lobe_count; k++) {
        double row[SHD_WAY_SUMS] = {0};
        for (size_t i = 0; i < w->count; i += VW) {
            const facets f = {shd_vd_load(open + i), shd_vd_load(tangent + i),
                              shd_vd_load(nh2 + i)};
            const shd_md lit = shd_vd_gt(f.open, shd_vd_set(0));
            shd_vd_store(s->off + i,
                         shd_vd_mul_in(lit, weigh_slope(&f, m->lobes[k].shininess), shd_vd_set(1)));
        }
        for (int c = 0; c < 3; c++) {
            if (!same[c]) {
                memset(row, 0, sizeof row);
                for (size_t i = 0; i < w->count; i += VW) {
                    const shd_vd weight = shd_vd_load(s->off + i);
                    const shd_md lit = shd_vd_gt(weight, shd_vd_set(0));
                    shd_vd_store(s->values + i,
                                 shd_vd_mul_in(lit, weight, shd_vd_load(mirrored[c] + i)));
                }
                sum_row(w, s->values, row);
            }
            for (int j = 0; j < w->sums; j++) out[3 * k + (size_t)c][j] += row[j];
        }
    }
}

/* The table's rows of one rise of the light, as the view's nodes have them: first by quarters of
 * the view, then folded back. */
SHD_INLINE void see_rise(const double *rho, const westin_rows *rows, double *out) {
    enum { TURNS = SHD_WESTIN_TURNS };
    double by[4][TURNS];
    bool any[4] = {false, false, false, false};
    for (int k = 0; k < 9; k++) {
        const uint32_t q = rows->quarter[k];
        for (size_t t = 0; t < TURNS; t += VW) {
            const shd_vd add = shd_vd_set(rows->weight[k]) * shd_vd_load(rho + rows->row[k] + t);
            shd_vd_store(by[q] + t, any[q] ? shd_vd_load(by[q] + t) + add : add);
        }
        any[q] = true;
    }
    for (int t = 0; t < SHD_WESTIN_ROW; t++) out[t] = 0;
    for (int q = 0; q < 4; q++)
        for (int t = 0; any[q] && t < TURNS; t++) out[t] += by[q][shd_westin_fold(q, t)];
    for (int t = TURNS; t < SHD_WESTIN_ROW; t++) out[t] = out[t - TURNS];
}

SHD_INLINE void see_table(const shd_westin_colored *colored, const westin_rows *rows,
                          shd_westin_seen *out) {
    for (size_t c = 0; c < colored->channels; c++)
        for (size_t rise = 0; rise < SHD_WESTIN_RISES; rise++)
            see_rise(colored->rho[c] + rise * SHD_WESTIN_ROW, rows, out->rho[c][rise]);
    out->made = true;
}

/* As read_lane. */
SHD_INLINE double read_seen(const double rho[SHD_WESTIN_RISES][SHD_WESTIN_ROW],
                            const westin_lane *lane) {
    westin_turns turns;
    read_turns(rho[0], lane->start[0], lane->rises, &turns);
    turns *= lane->turns[0];
    return turns[0] + turns[1] + turns[2];
}

/* Microgeometry: one view, many lights. */
SHD_INLINE void sum_westin(const shd_way_point *p, const shd_ways *w, const points *at,
                           double (*out)[SHD_WAY_SUMS]) {
    const shd_westin_colored *colored = p->westin;
    const bool isotropic = colored->table->isotropic;
    const bool many = w->points > FEW_WAYS;
    const shd_vd node = shd_vd_set(SHD_PI / SHD_WESTIN_TURNS), zero = shd_vd_set(0);
    shd_vd x[3], y[3];
    westin_taps taps;
    westin_rows rows;
    double rho[3][SHD_WAYS_MOST] = {{0}}, row[SHD_WAY_SUMS];
    spread_vector(p->tangent, x);
    spread_vector(shd_cross(p->at->normal, p->tangent), y);
    const shd_vd vx = dot_lanes(at->v, x), vy = dot_lanes(at->v, y), vz = dot_lanes(at->v, at->n);
    if (!(vz[0] > 0)) return;
    const shd_vd turn = turn_of_lanes(vx, vy), by = isotropic ? turn : node;
    tap_westin(vx, vy, vz, isotropic ? node : turn, &taps);
    find_rows(&taps, 0, &rows);
    if (many && !p->seen->made) see_table(colored, &rows, p->seen);
    for (size_t i = 0; i < w->count; i += VW) {
        shd_vd toward[3];
        load_way(w, i, toward);
        const shd_vd lx = dot_lanes(toward, x), ly = dot_lanes(toward, y),
                     lz = dot_lanes(toward, at->n);
        tap_westin(lx, ly, lz, turn_of_lanes(lx, ly) - (by - node), &taps);
        for (unsigned lanes = shd_md_bits(shd_vd_gt(lz, zero)); lanes; lanes &= lanes - 1) {
            const size_t k = (size_t)__builtin_ctz(lanes);
            westin_lane lane;
            start_lane(&taps, k, many ? 1 : rows.quarters, &lane);
            for (size_t c = 0; c < colored->channels; c++) {
                const double value = many ? read_seen(p->seen->rho[c], &lane)
                                          : read_lane(colored->rho[c], &rows, &lane);
                rho[c][i + k] = lz[k] * value;
            }
        }
    }
    for (size_t c = 0; c < 3; c++) {
        if (c < colored->channels) {
            memset(row, 0, sizeof row);
            sum_row(w, rho[c], row);
        }
        for (int j = 0; j < w->sums; j++) out[c][j] += row[j];
    }
}

void SHD_VARIANT(shd_sum_ways)(const void *context, const shd_ways *w,
                               double (*out)[SHD_WAY_SUMS]) {
    const shd_way_point *p = context;
    const shd_plan_material *m = p->at->material;
    const points at = point_at(p->at);
    const shd_vd zero = shd_vd_set(0);
    seen_ways s;
    if (p->westin) {
        sum_westin(p, w, &at, out);
        return;
    }
    const shd_vd away[3] = {-at.w[0], -at.w[1], -at.w[2]};
    for (size_t i = 0; i < w->count; i += VW) {
        shd_vd toward[3];
        load_way(w, i, toward);
        const shd_vd facing = dot_lanes(at.n, toward);
        shd_vd off = half_chords(toward, away), diffuse = facing;
        if (m->model == SHD_MODEL_BLINN_PHONG || m->model == SHD_MODEL_OREN_NAYAR) {
            const pairing pair = pair_lanes(&at, toward);
            off = pair.off;
            diffuse = weigh_diffuse(m, facing, &pair);
        }
        shd_vd_store(s.facing + i, facing);
        shd_vd_store(s.off + i, off);
        shd_vd_store(s.values + i, shd_vd_mul_in(shd_vd_gt(facing, zero), diffuse, shd_vd_set(1)));
    }
    sum_grey(w, s.values, out);
    if (m->model == SHD_MODEL_COOK_TORRANCE)
        sum_facets(p, w, &at, &s, out + 3);
    else
        sum_shine(p, w, &s, out + 3);
}

/* ---- Cells ---- */

/* Places along a piece: x and y, and their derivatives. */
SHD_INLINE void walk_lanes(const shd_fan *fan, shd_vd t, shd_vd at[2], shd_vd step[2]) {
    const shd_stretch *p = fan->piece;
    if (!p->arc) {
        for (int c = 0; c < 2; c++) {
            const double *ends = c ? p->y : p->x;
            step[c] = shd_vd_set(ends[1] - ends[0]);
            at[c] = shd_vd_set(ends[0]) + t * step[c];
        }
        return;
    }
    const shd_vd span = shd_vd_set(p->to - p->from), radius = shd_vd_set(fan->seen->radius);
    shd_vd sine, cosine;
    shd_sincos64(shd_vd_set(p->from) + t * span, &sine, &cosine);
    at[0] = radius * cosine;
    at[1] = radius * sine;
    step[0] = -at[1] * span;
    step[1] = at[0] * span;
}

/* A direction to the piece, as the apex sees it. */
typedef struct spoke {
    shd_vd beside[3]; /* unit, perpendicular to the apex */
    shd_vd reach;     /* the angle to the piece */
    shd_vd turn;      /* by how much it turns around the apex, over s */
} spoke;

SHD_INLINE spoke spoke_at(const shd_fan *fan, shd_vd s) {
    const shd_seen *seen = fan->seen;
    const double a[3] = {seen->a.x, seen->a.y, seen->a.z}, b[3] = {seen->b.x, seen->b.y, seen->b.z},
                 center[3] = {seen->center.x, seen->center.y, seen->center.z};
    const shd_vd zero = shd_vd_set(0), one = shd_vd_set(1), half = shd_vd_set(0.5),
                 span = shd_vd_set(fan->to - fan->from), near = shd_vd_set(fan->near);
    const shd_vd x = shd_vd_set(fan->from) + s * span, size = shd_vd_max(x, -x),
                 small = shd_exp64(-size), large = one / small;
    const shd_vd rise = (large - small) * half,
                 sinh = shd_vd_select(shd_vd_gt(zero, x), -rise, rise);
    const shd_vd quick = span * near * ((large + small) * half);
    shd_vd place[2], along[2], apex[3], p[3], step[3], side[3], swing[3];
    walk_lanes(fan, shd_vd_set(fan->foot) + near * sinh, place, along);
    spread_vector(fan->apex, apex);
    for (int c = 0; c < 3; c++) {
        p[c] = shd_vd_set(center[c]) + (place[0] * shd_vd_set(a[c]) + place[1] * shd_vd_set(b[c]));
        step[c] = along[0] * shd_vd_set(a[c]) + along[1] * shd_vd_set(b[c]);
    }
    for (int c = 0; c < 3; c++) {
        const int d = (c + 1) % 3, e = (c + 2) % 3;
        side[c] = apex[d] * p[e] - apex[e] * p[d];
        swing[c] = p[d] * step[e] - p[e] * step[d];
    }
    const shd_vd squared = dot_lanes(side, side), ahead = dot_lanes(apex, p);
    const shd_md is = shd_vd_gt(squared, zero);
    const shd_vd some = shd_vd_select(is, squared, one), aside = shd_vd_sqrt(some);
    spoke out;
    for (int c = 0; c < 3; c++) out.beside[c] = (p[c] - apex[c] * ahead) / aside;
    out.reach = shd_vd_mul_in(is, shd_atan2_64(aside, ahead), one);
    out.turn = shd_vd_mul_in(is, quick * dot_lanes(apex, swing), one / some);
    return out;
}

void SHD_VARIANT(shd_fan_ways)(const shd_fan *fan, const double s[2], const double h[2], bool rough,
                               shd_ways *out) {
    /* The last lane repeats the one before it, and counts nothing. */
    double nodes[STEP], fine[STEP] = {0}, coarse[STEP] = {0};
    for (int i = 0; i < STEP; i++) nodes[i] = SHD_NODES_7[i < 7 ? i : 6];
    for (int i = 0; i < 7; i++) fine[i] = SHD_WEIGHTS_7[i], coarse[i] = SHD_WEIGHTS_G3[i];
    const double wide = (s[1] - s[0]) / 2, deep = (h[1] - h[0]) / 2;
    const shd_vd one = shd_vd_set(1);
    shd_vd apex[3];
    spread_vector(fan->apex, apex);
    out->sums = rough ? 1 : 3;
    out->count = (rough ? 3 : 7) * STEP;
    for (size_t l = 0; l < STEP; l += VW) {
        const spoke k =
            spoke_at(fan, shd_vd_set(s[0]) + shd_vd_set(wide) * (one + shd_vd_load(nodes + l)));
        const shd_vd area = k.turn * k.reach * shd_vd_set(wide * deep), by7 = shd_vd_load(fine + l),
                     by3 = shd_vd_load(coarse + l);
        size_t to = l;
        for (int j = rough ? 1 : 0; j < 7; j += rough ? 2 : 1, to += STEP) {
            shd_vd sine, cosine;
            shd_sincos64(k.reach * shd_vd_set(h[0] + deep * (1 + SHD_NODES_7[j])), &sine, &cosine);
            const shd_vd weight = area * sine;
            for (int c = 0; c < 3; c++)
                shd_vd_store(out->toward[c] + to, apex[c] * cosine + k.beside[c] * sine);
            if (rough) {
                shd_vd_store(out->weight[0] + to, weight * by3 * shd_vd_set(SHD_WEIGHTS_G3[j]));
                continue;
            }
            shd_vd_store(out->weight[0] + to, weight * by7 * shd_vd_set(SHD_WEIGHTS_7[j]));
            shd_vd_store(out->weight[1] + to, weight * by3 * shd_vd_set(SHD_WEIGHTS_7[j]));
            shd_vd_store(out->weight[2] + to, weight * by7 * shd_vd_set(SHD_WEIGHTS_G3[j]));
        }
    }
}
