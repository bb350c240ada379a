/* Blocks of pixels from rays to colors in f32, a vector of pixels at a time, with all lights on it
 * while its colors stay in registers. Compiled once for each instruction set; those that fuse give
 * the same bits. */
#define SHD_LOOSE /* where nothing fuses, products are rounded */
#include "base/cpu.h"
#include "shade/fast_simd.h"
#include "shade/sketch_job.h"

#define ROW(y)    y, y, y, y, y, y, y, y
#define COLUMNS() -3.5f, -2.5f, -1.5f, -0.5f, 0.5f, 1.5f, 2.5f, 3.5f

/* From a block's middle to its pixels' centers. */
_Alignas(64) static const float across[SHD_SKETCH_PIXELS] = {
    COLUMNS(), COLUMNS(), COLUMNS(), COLUMNS(), COLUMNS(), COLUMNS(), COLUMNS(), COLUMNS()};
_Alignas(64) static const float down[SHD_SKETCH_PIXELS] = {
    ROW(-3.5f), ROW(-2.5f), ROW(-1.5f), ROW(-0.5f), ROW(0.5f), ROW(1.5f), ROW(2.5f), ROW(3.5f)};

/* ---- Lights at a block. ---- */

/* A light at a block. */
typedef struct sketch_place {
    const shd_sketch_light *light;
    float at[3]; /* from the block's middle, in the plan's frame, or the direction toward it */
    bool turns;  /* N.L may be 0 or less somewhere */
    bool shines; /* highlights may be there */
} sketch_place;

/* Lights, as bits. */
typedef struct sides {
    unsigned known;  /* they are for sketches */
    unsigned some;   /* they may light the block */
    unsigned turn;   /* as above */
    unsigned glance; /* no highlight is there */
} sides;

SHD_INLINE shd_vd dot_with(const shd_vd a[3], const double b[3]) {
    return a[0] * shd_vd_set(b[0]) + a[1] * shd_vd_set(b[1]) + a[2] * shd_vd_set(b[2]);
}

/* Looks at the vector of lights from `k` on. */
SHD_INLINE sides look_at_lights(const shd_sketch_job *j, size_t k, float at[3][SHD_SKETCH_LIGHTS]) {
    /* Distances in the plan's frame of which f32 loses nothing. */
    const shd_vd least = shd_vd_set(1e-6), most = shd_vd_set(1e11);
    const shd_sketch_group *group = j->group;
    const shd_sketch_view *v = &j->view;
    const shd_vd point = shd_vd_load(group->point + k), scale = shd_vd_load(group->scale + k),
                 one = shd_vd_set(1), two = shd_vd_set(2), moved = shd_vd_set(v->moved);
    shd_vd path[3], square = shd_vd_set(0);
    for (int c = 0; c < 3; c++) {
        path[c] = shd_vd_load(group->at[c] + k) - point * shd_vd_set(v->point[c]);
        square += path[c] * path[c];
        const shd_vh rounded = shd_vh_narrow(path[c] * scale);
        memcpy(at[c] + k, &rounded, sizeof rounded);
    }
    const shd_vd away = shd_vd_sqrt(square), near = away - moved, inverse = one / away,
                 moves = point * moved / near, turned = shd_vd_set(v->turned) + moves,
                 chord = shd_vd_set(v->chord) + moves, facing = dot_with(path, v->normal) * inverse,
                 apart2 = two - two * dot_with(path, v->mirror) * inverse;
    const shd_md far = shd_md_and(
        shd_vd_gt(near, shd_vd_set(v->near)),
        shd_md_and(shd_vd_gt(near * scale, least), shd_vd_gt(most, (away + moved) * scale)));
    return (sides){shd_md_bits(shd_md_or(far, shd_vd_gt(one, point))),
                   shd_md_bits(shd_vd_gt(facing + turned, shd_vd_set(-1e-9))),
                   ~shd_md_bits(shd_vd_gt(facing, turned + shd_vd_set(SHD_SKETCH_OFF))),
                   shd_md_bits(shd_vd_gt(apart2, chord * chord))};
}

/* Lists those that may light the block. Returns how many, or SIZE_MAX: not all are for sketches. */
SHD_INLINE size_t place_lights(const shd_sketch_job *j, sketch_place out[SHD_SKETCH_LIGHTS]) {
    enum { LANES = SHD_W / 2 };
    const size_t count = j->group->light_count;
    float at[3][SHD_SKETCH_LIGHTS];
    size_t placed = 0;
    for (size_t k = 0; k < count; k += LANES) {
        const sides s = look_at_lights(j, k, at);
        const unsigned mine =
            count - k < LANES ? (1u << (count - k)) - 1 : (1u << (LANES - 1) << 1) - 1;
        if (mine & ~s.known) return SIZE_MAX;
        for (unsigned some = s.some & mine; some; some &= some - 1) {
            const unsigned i = (unsigned)__builtin_ctz(some);
            sketch_place *p = &out[placed++];
            p->light = &j->group->lights[k + i];
            for (int c = 0; c < 3; c++) p->at[c] = at[c][k + i];
            p->turns = s.turn >> i & 1;
            p->shines = !(s.glance >> i & 1);
        }
    }
    return placed;
}

/* ---- Pixels. ---- */

/* What is seen through a vector of pixels. */
typedef struct seen {
    shd_mf there, unsure;                  /* of a rim: rays that hit it, and that may */
    shd_vf moved[3], normal[3], mirror[3]; /* from the middle, in the plan's frame; unit; unit */
} seen;

/* On an ellipsoid, moved from the middle of its own frame, where N.w is -root. */
SHD_INLINE seen place(const shd_sketch_job *j, shd_vf x, shd_vf y, const shd_vf moved[3],
                      shd_vf root) {
    const shd_vf one = shd_vf_set(1);
    shd_vf n[3], w[3];
    seen out;
#pragma GCC unroll 3
    for (int c = 0; c < 3; c++) {
        const float *to = j->to_normal[c], *at = j->to_frame[c];
        n[c] = shd_mad(moved[2], shd_vf_set(to[2]),
                       shd_mad(moved[1], shd_vf_set(to[1]),
                               shd_mad(moved[0], shd_vf_set(to[0]), shd_vf_set(j->normal[c]))));
        out.moved[c] = shd_mad(moved[2], shd_vf_set(at[2]),
                               shd_mad(moved[1], shd_vf_set(at[1]), moved[0] * shd_vf_set(at[0])));
        w[c] = shd_mad(y, shd_vf_set(j->seen_y[c]),
                       shd_mad(x, shd_vf_set(j->seen_x[c]), shd_vf_set(j->seen[c])));
    }
    const shd_vf length = one / shd_vf_sqrt(dot_lanes(n, n)),
                 inverse = one / shd_vf_sqrt(dot_lanes(w, w)),
                 along = (root + root) * shd_vf_set(j->along) * length * inverse;
#pragma GCC unroll 3
    for (int c = 0; c < 3; c++) {
        out.normal[c] = n[c] * length;
        out.mirror[c] = shd_mad(w[c], inverse, along * out.normal[c]);
    }
    return out;
}

/* From o, beside the middle m of the surface, the ray o + s w meets the ball where |m + o + s w| =
 * 1. With q = m + o, b = q.w, and c = |q|^2 - 1 = o.(m + q), which does not cancel, that is
 * s = c / (root - b) with root = sqrt(b^2 - |w|^2 c), and N.w is -root there. A plane has m for its
 * normal, c = 2 o.m, and root = -b. An ellipsoid is met in a frame of its own, from which maps lead
 * to points and to normals' directions. */
SHD_INLINE seen meet(const shd_sketch_job *j, shd_vf x, shd_vf y, shd_sketch_form form) {
    const bool curved = form != SHD_SKETCH_PLANE;
    shd_vf w[3], o[3], m[3], sum[3], q[3];
    seen out;
#pragma GCC unroll 3
    for (int c = 0; c < 3; c++) {
        m[c] = shd_vf_set(j->middle[c]);
        w[c] = shd_mad(y, shd_vf_set(j->way_y[c]),
                       shd_mad(x, shd_vf_set(j->way_x[c]), shd_vf_set(j->way[c])));
        o[c] = shd_mad(y, shd_vf_set(j->at_y[c]), x * shd_vf_set(j->at_x[c]));
        q[c] = curved ? m[c] + o[c] : m[c];
        sum[c] = m[c] + q[c];
    }
    const shd_vf b = dot_lanes(q, w), away = dot_lanes(o, sum), square = dot_lanes(w, w),
                 root = curved ? shd_vf_sqrt(shd_mad(-square, away, b * b)) : -b,
                 s = away / (root - b);
    if (form == SHD_SKETCH_ELLIPSOID) {
        shd_vf moved[3];
#pragma GCC unroll 3
        for (int c = 0; c < 3; c++) moved[c] = shd_mad(s, w[c], o[c]);
        return place(j, x, y, moved, root);
    }
    const shd_vf inverse = shd_vf_set(1) / shd_vf_sqrt(square), twice = (root + root) * inverse;
#pragma GCC unroll 3
    for (int c = 0; c < 3; c++) {
        const shd_vf moved = shd_mad(s, w[c], o[c]);
        out.normal[c] = curved ? m[c] + moved : m[c];
        out.mirror[c] = shd_mad(w[c], inverse, twice * out.normal[c]);
        out.moved[c] = moved * shd_vf_set(j->scale);
    }
    return out;
}

/* At a rim. The place of the ray w that is nearest to the center is o - b / |w|^2 w beside that of
 * the middle one, at right angles to the middle's w. */
SHD_INLINE seen meet_rim(const shd_sketch_job *j, shd_vf x, shd_vf y) {
    const float *d = j->square;
    const shd_vf slope =
                     shd_mad(y, shd_vf_set(d[4]), shd_mad(x, shd_vf_set(d[3]), shd_vf_set(d[1]))),
                 fall = shd_mad(y, shd_vf_set(d[5]), shd_vf_set(d[2])),
                 facing2 = shd_mad(x, slope, shd_mad(y, fall, shd_vf_set(d[0])));
    shd_vf w[3], o[3], m[3], turned[3];
    seen out;
#pragma GCC unroll 3
    for (int c = 0; c < 3; c++) {
        m[c] = shd_vf_set(j->middle[c]);
        turned[c] = shd_mad(y, shd_vf_set(j->way_y[c]), x * shd_vf_set(j->way_x[c]));
        w[c] = turned[c] + shd_vf_set(j->way[c]);
        o[c] = shd_mad(y, shd_vf_set(j->at_y[c]), x * shd_vf_set(j->at_x[c]));
    }
    out.there = shd_vf_gt(facing2, shd_vf_set(j->sure));
    out.unsure = shd_mf_and(shd_vf_gt(facing2, shd_vf_set(-j->unsure)), shd_mf_not(out.there));
    const shd_vf b = dot_lanes(m, turned) + dot_lanes(o, w), square = dot_lanes(w, w),
                 root = shd_vf_sqrt(shd_vf_max(facing2, shd_vf_set(0))), s = -(root + b) / square,
                 inverse = shd_vf_set(1) / shd_vf_sqrt(square), twice = (root + root) * inverse;
#pragma GCC unroll 3
    for (int c = 0; c < 3; c++) {
        const shd_vf moved = shd_mad(s, w[c], o[c]);
        out.normal[c] = m[c] + moved;
        out.mirror[c] = shd_mad(w[c], inverse, twice * out.normal[c]);
        out.moved[c] = moved * shd_vf_set(j->scale);
    }
    return out;
}
#include "shade/faces_simd.h"

/* f (R.V)^ns in the lanes `lit`, 0 in the others. L is along `path`, r. */
SHD_INLINE shd_vf weigh_lobe(const shd_packed_lobe *lobe, const shd_vf path[3], shd_vf r,
                             const shd_vf mirror[3], shd_vf f, shd_mf lit) {
    shd_vf chord[3];
#pragma GCC unroll 3
    for (int c = 0; c < 3; c++) chord[c] = shd_mad(path[c], r, -mirror[c]);
    const shd_vf z = dot_lanes(chord, chord);
    const shd_mf in = shd_vf_gt_in(lit, shd_vf_set(lobe->reach), z);
    if (!shd_mf_any(in)) return shd_vf_set(0);
    const shd_vf power = lobe->is_short
                             ? shd_exp2(z * shd_polynomial(z, lobe->log, SHD_LOG_TERMS))
                             : shd_power_1m(z * shd_vf_set(0.5f), shd_vf_set(lobe->shininess));
    return shd_vf_mul_in(in, power, f);
}

/* The attenuation over the distance, and for highlights 1/distance and the attenuation. */
SHD_INLINE shd_vf weigh_fall(const shd_packed_light *light, shd_vf d2, bool shines, shd_vf *r,
                             shd_vf *f) {
    const shd_vf one = shd_vf_set(1), distance = shd_vf_sqrt(d2);
    if (light->kind == SHD_KIND_POINT) return *r = one / distance;
    const shd_vf d = shd_vf_max(distance, shd_vf_set(light->least)),
                 slope = shd_mad(d, shd_vf_set(light->c), shd_vf_set(light->b)),
                 fall = shd_mad(d, slope, shd_vf_set(light->a)), both = one / (fall * distance);
    if (shines) {
        *r = both * fall;
        *f = both * distance;
    }
    return both;
}

/* Adds a light. Sets the lanes of `unknown` in which f32 does not tell whether there is a
 * highlight, which may be where N.L `turns` its sign. */
SHD_INLINE void add_light(const sketch_place *place, const shd_sketch_group *group,
                          size_t lobe_count, const seen *at, bool turns, float turned2,
                          shd_vf rgb[3], shd_mf *unknown) {
    const shd_sketch_light *light = place->light;
    const shd_packed_light *from = light->from;
    const bool directional = from->kind == SHD_KIND_DIRECTIONAL;
    const shd_vf one = shd_vf_set(1), none = shd_vf_set(0);
    shd_vf path[3], r = one, f = one, d2 = one;
#pragma GCC unroll 3
    for (int c = 0; c < 3; c++) path[c] = shd_vf_set(place->at[c]);
    if (!directional) {
#pragma GCC unroll 3
        for (int c = 0; c < 3; c++) path[c] -= at->moved[c];
        d2 = dot_lanes(path, path);
    }
    const shd_vf facing = dot_lanes(at->normal, path); /* times the distance */
    shd_mf lit = shd_vf_gt(one, none);
    if (turns) {
        lit = shd_vf_gt(facing, none);
        const shd_vf off2 = d2 * shd_vf_set(turned2);
        if (place->shines)
            *unknown = shd_mf_or(*unknown, shd_vf_gt_in(shd_vf_gt(off2, facing * facing),
                                                        dot_lanes(at->mirror, path), none));
        if (!shd_mf_any(lit)) return;
    }
    const shd_vf along = directional ? f : weigh_fall(from, d2, place->shines, &r, &f),
                 weight = turns ? shd_vf_mul_in(lit, facing, along) : facing * along;
#pragma GCC unroll 3
    for (int c = 0; c < 3; c++) rgb[c] = shd_mad(weight, shd_vf_set(light->diffuse[c]), rgb[c]);
    for (size_t k = 0; place->shines && k < lobe_count; k++) {
        const shd_vf lobe = weigh_lobe(&group->lobes[k], path, r, at->mirror, f, lit);
#pragma GCC unroll 3
        for (int c = 0; c < 3; c++)
            rgb[c] = shd_mad(lobe, shd_vf_set(light->specular[k][c]), rgb[c]);
    }
}

/* Stores the vector of pixels from `i` on. */
SHD_INLINE void store_rows(shd_vf v, int i, size_t stride, float *out) {
    float *row = out + (size_t)(i / SHD_SKETCH_SIDE) * stride;
#if SHD_W == 16
    const shd_vh half[2] = {shd_vf_half(v, 0), shd_vf_half(v, 1)};
    memcpy(row, &half[0], sizeof half[0]);
    memcpy(row + stride, &half[1], sizeof half[1]);
#else
    shd_vf_store(row + i % SHD_SKETCH_SIDE, v);
#endif
}

/* Draws the block whose middle is (x, y) beside the middle of all. False: something is unknown. */
SHD_INLINE bool sketch_block(const shd_sketch_job *j, shd_sketch_form form, size_t lobe_count,
                             float x, float y, const sketch_place *places, size_t count,
                             size_t stride, float *const out[3]) {
    const shd_sketch_group *group = j->group;
    const shd_mf none = shd_vf_gt(shd_vf_set(0), shd_vf_set(0));
    for (int i = 0; i < SHD_SKETCH_PIXELS; i += SHD_W) {
        const bool rim = form == SHD_SKETCH_RIM;
        const shd_vf right = shd_vf_load(across + i) + shd_vf_set(x),
                     below = shd_vf_load(down + i) + shd_vf_set(y);
        const seen at = rim                        ? meet_rim(j, right, below)
                        : form == SHD_SKETCH_FACES ? meet_faces(j, i, right, below)
                                                   : meet(j, right, below, form);
        shd_mf unknown = none;
        if (rim && shd_mf_any(at.unsure)) return false;
        shd_vf rgb[3];
#pragma GCC unroll 3
        for (int c = 0; c < 3; c++) rgb[c] = shd_vf_set(group->constant[c]);
        for (size_t k = 0; k < count; k++)
            if (places[k].turns)
                add_light(&places[k], group, lobe_count, &at, true, j->turned2, rgb, &unknown);
            else
                add_light(&places[k], group, lobe_count, &at, false, 0, rgb, &unknown);
        if (rim) unknown = shd_mf_and(unknown, at.there);
        if (shd_mf_any(unknown)) return false;
#pragma GCC unroll 3
        for (int c = 0; rim && c < 3; c++)
            rgb[c] = shd_vf_select(at.there, rgb[c], shd_vf_set(j->beyond[c]));
#pragma GCC unroll 3
        for (int c = 0; c < 3; c++) store_rows(rgb[c], i, stride, out[c]);
    }
    return true;
}

SHD_INLINE bool sketch(const shd_sketch_job *j, shd_sketch_form form, size_t lobe_count,
                       size_t stride, float *const out[3], bool *drawn) {
    sketch_place places[SHD_SKETCH_LIGHTS];
    const size_t count = place_lights(j, places);
    if (count == SIZE_MAX) return false;
    for (int k = 0; k < j->blocks * j->blocks; k++) {
        const int x = k % j->blocks, y = k / j->blocks;
        const size_t at = ((size_t)y * stride + (size_t)x) * SHD_SKETCH_SIDE;
        float *const rows[3] = {out[0] + at, out[1] + at, out[2] + at};
        const float middle = (float)(j->blocks - 1) * (0.5f * SHD_SKETCH_SIDE);
        drawn[k] = sketch_block(j, form, lobe_count, (float)(x * SHD_SKETCH_SIDE) - middle,
                                (float)(y * SHD_SKETCH_SIDE) - middle, places, count, stride, rows);
    }
    return true;
}

bool SHD_VARIANT(shd_sketch)(const shd_sketch_job *j, size_t stride, float *const out[3],
                             bool *drawn) {
    const size_t lobes = j->group->lobe_count;
#if defined(SHD_ONE_BODY)
    return sketch(j, j->form, lobes, stride, out, drawn);
#else
#define FORM(lobes)                                                                                \
    (j->form == SHD_SKETCH_PLANE   ? sketch(j, SHD_SKETCH_PLANE, lobes, stride, out, drawn)        \
     : j->form == SHD_SKETCH_BALL  ? sketch(j, SHD_SKETCH_BALL, lobes, stride, out, drawn)         \
     : j->form == SHD_SKETCH_RIM   ? sketch(j, SHD_SKETCH_RIM, lobes, stride, out, drawn)          \
     : j->form == SHD_SKETCH_FACES ? sketch(j, SHD_SKETCH_FACES, lobes, stride, out, drawn)        \
                                   : sketch(j, SHD_SKETCH_ELLIPSOID, lobes, stride, out, drawn))
    return lobes == 0 ? FORM(0) : lobes == 1 ? FORM(1) : FORM(lobes);
#endif
}
