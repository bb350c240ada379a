/* Westin materials in vectors of points. Only for brdf.simd.c.
 *
 * A point's view stands for all lights: its splines are found once, and where their rows begin.
 * A light's directions are turned into splines in vectors; then each lane reads nine nodes of the
 * light for nine of the view, three turns at a time (westin_table.h). Sums go in the same order on
 * every machine. */
#pragma once

#include "base/cpu.h"
#include "shade/lights_simd.h"
#include "shade/westin_table.h"

typedef double westin_turns __attribute__((vector_size(4 * sizeof(double))));

/* Splines of a vector of directions: the nodes in the middle, and the weights around them. */
typedef struct westin_taps {
    double rise[VW], turn[VW]; /* whole numbers */
    double by_rise[3][VW], by_turn[3][VW];
} westin_taps;

/* A view's nodes. */
typedef struct westin_rows {
    uint32_t row[9]; /* where the row of a view in the first quarter begins in the colored table */
    uint32_t quarter[9];
    double weight[9];
    unsigned quarters; /* bits of those that are in `quarter` */
} westin_rows;

typedef struct westin_view {
    shd_vd x[3], y[3]; /* the surface's frame; z is its normal */
    shd_vd turn;       /* of the view around the normal, where that counts */
    shd_md seen;       /* the view is above the horizon */
    westin_rows rows[VW];
    int32_t object; /* whose tangents these are; -1: none yet */
    shd_tangents tangents;
} westin_view;

SHD_INLINE void split_westin(shd_vd u, double near[VW], double weight[3][VW]) {
    const shd_vd magic = shd_vd_set(0x1.8p52), half = shd_vd_set(0.5);
    const shd_vd node = (u + magic) - magic, f = u - node, low = half - f, high = half + f;
    shd_vd_store(near, node);
    shd_vd_store(weight[0], half * low * low);
    shd_vd_store(weight[1], shd_vd_set(0.75) - f * f);
    shd_vd_store(weight[2], half * high * high);
}

SHD_INLINE shd_vd turn_of_lanes(shd_vd x, shd_vd y) {
    const double pole = SHD_WESTIN_POLE * SHD_WESTIN_POLE;
    const shd_vd turn = shd_atan2_64(y, x);
    return shd_vd_select(shd_vd_gt(x * x + y * y, shd_vd_set(pole)), turn, shd_vd_set(0));
}

SHD_INLINE void tap_westin(shd_vd x, shd_vd y, shd_vd z, shd_vd turn, westin_taps *out) {
    const shd_vd half = shd_vd_set(0.5), rise = shd_atan2_64(shd_vd_sqrt(x * x + y * y), z);
    split_westin(rise * shd_vd_set(SHD_WESTIN_RISES / (SHD_PI / 2)) - half, out->rise,
                 out->by_rise);
    split_westin(turn * shd_vd_set(SHD_WESTIN_TURNS / (2 * SHD_PI)) - half, out->turn,
                 out->by_turn);
}

/* Nodes before the pole are those across it; at the horizon the last one repeats. */
SHD_INLINE int place_rise(int rise, int *turned) {
    *turned = rise < 0 ? SHD_WESTIN_TURNS / 2 : 0;
    if (rise < 0) rise = -1 - rise;
    return rise < SHD_WESTIN_RISES ? rise : SHD_WESTIN_RISES - 1;
}

SHD_INLINE void find_rows(const westin_taps *taps, size_t lane, westin_rows *out) {
    out->quarters = 0;
    for (int a = 0; a < 3; a++) {
        int turned;
        const int rise = place_rise((int)taps->rise[lane] + a - 1, &turned);
        for (int b = 0; b < 3; b++) {
            const int turn = ((int)taps->turn[lane] + b - 1 + turned) & (SHD_WESTIN_TURNS - 1),
                      quarter = turn / (SHD_WESTIN_TURNS / 4),
                      view = rise * (SHD_WESTIN_TURNS / 4) + shd_westin_fold(quarter, turn);
            out->row[3 * a + b] = (uint32_t)view * (SHD_WESTIN_RISES * SHD_WESTIN_ROW);
            out->quarters |= 1u << quarter;
            out->quarter[3 * a + b] = (uint32_t)quarter;
            out->weight[3 * a + b] = taps->by_rise[a][lane] * taps->by_turn[b][lane];
        }
    }
}

/* What one lane's light has at hand for any quarter of the view: where its three turns begin in a
 * row, for each rise, and their weights in the order in which they stand there. */
typedef struct westin_lane {
    uint32_t start[4][4];  /* [quarter][rise], padded */
    westin_turns turns[2]; /* as they are, and mirrored */
    double rises[3];
} westin_lane;

SHD_INLINE void start_lane(const westin_taps *taps, size_t lane, unsigned quarters,
                           westin_lane *out) {
    enum { LAST = SHD_WESTIN_TURNS - 1 };
    for (int a = 0; a < 3; a++) {
        int turned;
        const int rise = place_rise((int)taps->rise[lane] + a - 1, &turned),
                  first = (int)taps->turn[lane] - 1 + turned;
        for (unsigned left = quarters; left; left &= left - 1) {
            const int q = __builtin_ctz(left); /* a mirrored quarter has the last turn first */
            const int from = shd_westin_fold(q, q & 1 ? first + 2 : first) & LAST;
            out->start[q][a] = (uint32_t)(rise * SHD_WESTIN_ROW + from);
        }
        out->rises[a] = taps->by_rise[a][lane];
    }
    const double w[3] = {taps->by_turn[0][lane], taps->by_turn[1][lane], taps->by_turn[2][lane]};
    out->turns[0] = (westin_turns){w[0], w[1], w[2], 0};
    out->turns[1] = (westin_turns){w[2], w[1], w[0], 0};
}

/* Three turns of the light, over its three rises, that a view's node sees. */
SHD_INLINE void read_turns(const double *at, const uint32_t start[3], const double rises[3],
                           westin_turns *out) {
    westin_turns r[3];
    for (int a = 0; a < 3; a++) memcpy(&r[a], at + start[a], sizeof r[a]);
    *out = rises[0] * r[0] + rises[1] * r[1] + rises[2] * r[2];
}

SHD_INLINE double read_lane(const double *rho, const westin_rows *rows, const westin_lane *lane) {
    westin_turns sum = {0, 0, 0, 0}, turns;
    uint32_t quarter = rows->quarter[0];
    if (rows->quarters & (rows->quarters - 1)) {
#pragma GCC unroll 9
        for (int k = 0; k < 9; k++) {
            quarter = rows->quarter[k];
            read_turns(rho + rows->row[k], lane->start[quarter], lane->rises, &turns);
            sum += turns * (rows->weight[k] * lane->turns[quarter & 1]);
        }
    } else { /* most views */
#pragma GCC unroll 9
        for (int k = 0; k < 9; k++) {
            read_turns(rho + rows->row[k], lane->start[quarter], lane->rises, &turns);
            sum += rows->weight[k] * turns;
        }
        sum *= lane->turns[quarter & 1];
    }
    return sum[0] + sum[1] + sum[2];
}

/* The tangents of points from `i` on; objects' frames are looked up when they change. */
SHD_INLINE void load_tangents(const shd_sums_job *job, const shd_westin *table, size_t i,
                              const points *at, westin_view *out) {
    const shd_points64 *from = job->points;
    const shd_object *objects = job->lighting->plan->scene->objects;
    double x[3][VW];
    for (size_t k = 0; k < VW; k++) {
        const size_t p = i + k < from->count ? i + k : from->count - 1;
        if (from->object[p] != out->object)
            out->tangents = shd_westin_tangents(table, &objects[from->object[p]]);
        out->object = from->object[p];
        const shd_vec3 t = shd_tangent_at(
            &out->tangents,
            (shd_vec3){from->position[0][p], from->position[1][p], from->position[2][p]},
            (shd_vec3){from->normal[0][p], from->normal[1][p], from->normal[2][p]});
        x[0][k] = t.x;
        x[1][k] = t.y;
        x[2][k] = t.z;
    }
    for (int c = 0; c < 3; c++) out->x[c] = shd_vd_load(x[c]);
    for (int c = 0; c < 3; c++) {
        const int d = (c + 1) % 3, e = (c + 2) % 3;
        out->y[c] = at->n[d] * out->x[e] - at->n[e] * out->x[d];
    }
}

SHD_INLINE void see_westin(const shd_sums_job *job, size_t i, const points *at, westin_view *out) {
    const shd_westin *table =
        job->lighting->westin[job->material - job->lighting->plan->materials].table;
    load_tangents(job, table, i, at, out);
    const shd_vd x = dot_lanes(at->v, out->x), y = dot_lanes(at->v, out->y),
                 z = dot_lanes(at->v, at->n);
    westin_taps taps;
    out->seen = shd_vd_gt(z, shd_vd_set(0));
    out->turn = turn_of_lanes(x, y);
    /* The view of a surface that has no direction stands on a node: only differences count. */
    const shd_vd node = shd_vd_set(SHD_PI / SHD_WESTIN_TURNS);
    tap_westin(x, y, z, table->isotropic ? node : out->turn, &taps);
    if (!table->isotropic) out->turn = node;
    const unsigned lanes = shd_md_bits(out->seen);
    for (size_t k = 0; k < VW; k++)
        if (lanes >> k & 1) find_rows(&taps, k, &out->rows[k]);
}

/* The weights of each channel. False: they are 0, and not set. */
SHD_INLINE bool weigh_westin(const shd_sums_job *job, const points *at, const arrival *by,
                             const westin_view *view, shd_vd weights[3]) {
    const shd_westin_colored *colored =
        &job->lighting->westin[job->material - job->lighting->plan->materials];
    const shd_vd x = dot_lanes(by->toward, view->x), y = dot_lanes(by->toward, view->y),
                 z = dot_lanes(by->toward, at->n);
    /* Beside a face's plane, N.L itself may be on the other side by its rounding. */
    const shd_md lit = shd_vd_gt_in(shd_md_and(by->lit, view->seen), z, shd_vd_set(0));
    unsigned lanes = shd_md_bits(lit);
    if (!lanes) return false;
    westin_taps taps;
    double rho[3][VW] = {{0}};
    tap_westin(x, y, z, turn_of_lanes(x, y) - (view->turn - shd_vd_set(SHD_PI / SHD_WESTIN_TURNS)),
               &taps);
    for (; lanes; lanes &= lanes - 1) {
        const size_t k = (size_t)__builtin_ctz(lanes);
        westin_lane lane;
        start_lane(&taps, k, view->rows[k].quarters, &lane);
        for (size_t c = 0; c < colored->channels; c++)
            rho[c][k] = read_lane(colored->rho[c], &view->rows[k], &lane);
    }
    const shd_vd weight = shd_vd_mul_in(lit, z, by->factor);
    for (size_t c = 0; c < 3; c++)
        weights[c] = weight * shd_vd_load(rho[colored->channels == 3 ? c : 0]);
    return true;
}
