/* Light sums of the standard tier in f32. A vector of points is taken at a time, with all lights on
 * it while its sums stay in registers. Compiled once for each instruction set; those that fuse give
 * the same bits. tests/unit/shade_sums.c measures errors, tests/bench/kernels.c time. */
#define SHD_LOOSE /* where nothing fuses, products are rounded */
#include "base/cpu.h"
#include "shade/fast_simd.h"

enum { ROWS = SHD_WIDE_ROWS, MANY = 2 };

/* What a body is compiled for. These are constants where a specialization pays. */
typedef struct shape {
    bool split;
    int channels; /* 1 or 3 */
    int lobes;    /* 0, 1 or MANY */
} shape;

typedef struct points {
    shd_vf p[3], low[3], n[3], w[3];
} points;

/* Sums over one group of lights: diffuse by channel, then lobes by channel. */
typedef struct sums {
    shd_vf diffuse[3], specular[3];
    shd_vf *more; /* [3 lobe + channel] if lobes is MANY */
} sums;

/* Rows of f64 sums, each of two vectors: diffuse by channel, then lobes by channel. */
typedef struct totals {
    shd_vd row[ROWS][2];
    bool any;
} totals;

/* path r - w, of which no product is rounded: where it would be by itself, halves of digits are
 * multiplied, the first ones of which are exact, and the others too small to tell. */
SHD_INLINE shd_vf chord_of(shd_vf path, shd_vf r, shd_vf w) {
#if SHD_FUSES
    return shd_vf_fma(path, r, -w);
#else
    const shd_vu upper = shd_vu_set(0xfffff000);
    const shd_vf p = (shd_vf)((shd_vu)path & upper), s = (shd_vf)((shd_vu)r & upper);
    return (p * s - w) + (p * (r - s) + (path - p) * r);
#endif
}

/* f ((R.V)+)^ns in the lanes `lit`, 0 in the others. L is along `path`, r. */
SHD_INLINE shd_vf weigh_lobe(const shd_packed_lobe *lobe, const shd_vf path[3], shd_vf r,
                             const shd_vf w[3], shd_vf f, shd_mf lit, bool directional) {
    shd_vf chord[3];
#pragma GCC unroll 3
    for (int c = 0; c < 3; c++)
        chord[c] = directional ? path[c] - w[c] : chord_of(path[c], r, w[c]);
    shd_vf z = dot_lanes(chord, chord);
    shd_mf in = shd_vf_gt_in(lit, shd_vf_set(lobe->reach), z);
    if (!shd_mf_any(in)) return shd_vf_set(0);

    const shd_vf power = lobe->is_short
                             ? shd_exp2(z * shd_polynomial(z, lobe->log, SHD_LOG_TERMS))
                             : shd_power_1m(z * shd_vf_set(0.5f), shd_vf_set(lobe->shininess));
    return shd_vf_mul_in(in, power, f);
}

/* Adds one light in f64, for the lanes `wide` of the vector from `first` on. Sums are copied, or
 * they would not be in registers elsewhere. */
__attribute__((noinline, cold)) static sums
add_wide(const shd_sums_job *job, uint32_t index, size_t first, unsigned wide, shape is, sums s) {
    _Alignas(64) float rows[ROWS][SHD_W];
    SHD_VARIANT(shd_add_wide)(job, index, first, wide, rows[0]);
    shd_vf *specular = is.lobes == MANY ? s.more : s.specular;
    for (size_t c = 0; c < (size_t)is.channels; c++) {
        s.diffuse[c] += shd_vf_load(rows[c]);
        for (size_t k = 0; k < job->lobe_count; k++)
            specular[3 * k + c] += shd_vf_load(rows[3 + 3 * k + c]);
    }
    return s;
}

/* Marks the lanes whose N.L is as near to 0 as f32's rounding, under a highlight. That is twice
 * SHD_TURNED (plan/tier.h) where products are rounded before they are added. With u = 2^-24, the
 * normal is off by u of the distance d, positions by u (d + 2), or by nothing if they are split,
 * their difference by 2 u d, and N.(light - p), a sum of three products, by 2.5 u d: 6.5 u d + 2 u
 * at most, which is less than 8 u sqrt(d^2 + 1). */
SHD_INLINE void mark_ends(const shd_sums_job *job, size_t first, const points *at,
                          const shd_vf path[3], shd_vf facing, shd_vf d2, bool split) {
    const double most = SHD_FUSES ? SHD_TURNED : 2 * SHD_TURNED, turned = most * most,
                 apart = split ? turned * SHD_SPLIT : turned;
    const shd_vf off2 = shd_mad(d2, shd_vf_set((float)turned), shd_vf_set((float)apart));
    const shd_mf near = shd_vf_gt(off2, facing * facing);
    if (__builtin_expect(shd_mf_any(near), 0))
        shd_mark_edges(job->edges, first,
                       shd_mf_bits(shd_vf_gt_in(near, dot_lanes(at->w, path), shd_vf_set(0))));
}

SHD_INLINE void add_light(const shd_sums_job *job, uint32_t index, shd_light_kind kind,
                          const points *at, size_t first, const shd_packed_lobe *lobes,
                          size_t lobe_count, shape is, sums *s) {
    const shd_packed_light *light = &job->lighting->lights[index];
    const bool directional = kind == SHD_KIND_DIRECTIONAL;
    shd_vf path[3];
#pragma GCC unroll 3
    for (int c = 0; c < 3; c++) {
        path[c] = shd_vf_set(light->at[c]);
        if (directional) continue;
        path[c] -= at->p[c];
        if (is.split) path[c] += shd_vf_set(light->low[c]) - at->low[c];
    }
    shd_vf facing = dot_lanes(at->n, path); /* times the distance */
    shd_mf lit = shd_vf_gt(facing, shd_vf_set(0));

    shd_vf r = shd_vf_set(1), f = r;
    const shd_vf d2 = directional ? r : dot_lanes(path, path);
    if (is.lobes) mark_ends(job, first, at, path, facing, d2, is.split);
    if (!directional) {
        shd_vu above = (shd_vu)d2 - shd_vu_set(light->nearest); /* wraps below it */
        shd_mf wide = shd_vu_ge(above, shd_vu_set(light->span));
        if (__builtin_expect(shd_mf_any(wide), 0)) {
            *s = add_wide(job, index, first, shd_mf_bits(wide), is, *s);
            lit = shd_mf_and(lit, shd_mf_not(wide));
        }
        if (!shd_mf_any(lit)) return;
        weigh_distance(light, kind, d2, &r, &f);
    } else if (!shd_mf_any(lit)) {
        return;
    }
    if (kind == SHD_KIND_SPOT) {
        shd_mf rim;
        shd_vf spot = weigh_spot(light, path, r, &lit, &rim);
        if (__builtin_expect(shd_mf_any(rim), 0))
            *s = add_wide(job, index, first, shd_mf_bits(rim), is, *s);
        if (!shd_mf_any(lit)) return;
        f *= spot;
    }

    shd_vf weight = shd_vf_mul_in(lit, facing, directional ? f : f * r);
    add_colored(s->diffuse, weight, light->color, is.channels);
    if (is.lobes == 1)
        add_colored(s->specular, weigh_lobe(lobes, path, r, at->w, f, lit, directional),
                    light->color, is.channels);
    for (size_t k = 0; is.lobes == MANY && k < lobe_count; k++)
        add_colored(s->more + 3 * k, weigh_lobe(&lobes[k], path, r, at->w, f, lit, directional),
                    light->color, is.channels);
}

/* Moves a group's sums to the totals. */
SHD_INLINE void end_group(sums *s, shape is, size_t lobe_count, totals *t) {
#pragma GCC unroll 3
    for (int c = 0; c < is.channels; c++) {
        add_row(&s->diffuse[c], t->row[c]);
        if (is.lobes == 1) add_row(&s->specular[c], t->row[3 + c]);
    }
    for (size_t k = 0; is.lobes == MANY && k < lobe_count; k++)
        for (int c = 0; c < is.channels; c++)
            add_row(&s->more[3 * k + (size_t)c], t->row[3 + 3 * k + (size_t)c]);
    t->any = true;
}

SHD_INLINE void load_points(const shd_points32 *from, size_t i, shape is, points *to) {
#pragma GCC unroll 3
    for (int c = 0; c < 3; c++) {
        to->p[c] = shd_vf_load(from->position[c] + i);
        to->n[c] = shd_vf_load(from->normal[c] + i);
        to->w[c] = shd_vf_load(from->mirror[c] + i);
        to->low[c] = is.split ? shd_vf_load(from->low[c] + i) : shd_vf_set(0);
    }
}

SHD_INLINE void clear_sums(sums *s, shape is, size_t lobe_count, totals *t) {
    t->any = false;
#pragma GCC unroll 3
    for (int c = 0; c < 3; c++) {
        s->diffuse[c] = s->specular[c] = shd_vf_set(0);
        for (int h = 0; h < 2; h++) t->row[c][h] = t->row[3 + c][h] = shd_vd_set(0);
    }
    for (size_t k = 0; is.lobes == MANY && k < 3 * lobe_count; k++) {
        s->more[k] = shd_vf_set(0);
        t->row[3 + k][0] = t->row[3 + k][1] = shd_vd_set(0);
    }
}

SHD_INLINE void store_sums(const sums *s, shape is, size_t lobe_count, const totals *t,
                           float *const *diffuse, float *const *specular, size_t i) {
#pragma GCC unroll 3
    for (int c = 0; c < is.channels; c++) {
        if (diffuse) store_row(s->diffuse[c], t->row[c], t->any, diffuse[c] + i);
        if (is.lobes == 1) store_row(s->specular[c], t->row[3 + c], t->any, specular[c] + i);
    }
    for (size_t k = 0; is.lobes == MANY && k < lobe_count; k++)
        for (size_t c = 0; c < (size_t)is.channels; c++)
            store_row(s->more[3 * k + c], t->row[3 + 3 * k + c], t->any, specular[3 * k + c] + i);
}

SHD_INLINE void sum_lights(const shd_sums_job *job, shape is) {
    const shd_packed_light *lights = job->lighting->lights;
    const size_t lobe_count = job->lobe_count;
    const shd_packed_lobe *lobes = job->lobes + job->first_lobe;
    float *const *specular = job->specular + 3 * job->first_lobe;
    for (size_t i = job->first; i < job->end; i += SHD_W) {
        points at;
        load_points(job->narrow, i, is, &at);
        shd_vf more[ROWS];
        sums s;
        s.more = more;
        totals total;
        clear_sums(&s, is, lobe_count, &total);
        uint32_t group = job->n ? lights[job->which[0]].group : 0;

        for (size_t k = 0; k < job->n; k++) {
            const uint32_t index = job->which[k];
            if (lights[index].group != group) {
                end_group(&s, is, lobe_count, &total);
                group = lights[index].group;
            }
#define CASE(kind)                                                                                 \
    case kind:                                                                                     \
        add_light(job, index, kind, &at, i, lobes, lobe_count, is, &s);                            \
        break
            switch ((shd_light_kind)lights[index].kind) {
                CASE(SHD_KIND_ATTENUATED);
                CASE(SHD_KIND_POINT);
                CASE(SHD_KIND_DIRECTIONAL);
                CASE(SHD_KIND_SPOT);
            case SHD_KIND_WIDE:
                s = add_wide(job, index, i, ~0u, is, s);
            }
#undef CASE
        }
        store_sums(&s, is, lobe_count, &total, job->diffuse, specular, i);
    }
}

/* Every form for which code of its own pays. Sanitizer builds would take minutes to compile all of
 * them, so there one body asks about forms as it goes. */
#if !defined(SHD_ONE_BODY)
#define FORM(split, channels, lobes)                                                               \
    static void sum_##split##channels##lobes(const shd_sums_job *job) {                            \
        sum_lights(job, (shape){split, channels, lobes});                                          \
    }
#define LOBES(m, split, channels) m(split, channels, 0) m(split, channels, 1) m(split, channels, 2)
#define FORMS(m)                  LOBES(m, 0, 1) LOBES(m, 0, 3) LOBES(m, 1, 1) LOBES(m, 1, 3)
FORMS(FORM)
#define ENTRY(split, channels, lobes) [split][channels == 3][lobes] = sum_##split##channels##lobes,
static shd_sums_function *const forms[2][2][3] = {FORMS(ENTRY)};
#endif

void SHD_VARIANT(shd_sums32)(const shd_sums_job *job) {
    const size_t lobes = job->material->lobe_count;
    const shape is = {job->narrow->low[0] != NULL, job->lighting->plan->grey_lights ? 1 : 3,
                      lobes < MANY ? (int)lobes : MANY};
#if defined(SHD_ONE_BODY)
    sum_lights(job, is);
#else
    forms[is.split][is.channels == 3][is.lobes](job);
#endif
}
