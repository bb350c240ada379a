/* Light sums in f64 of what goes beyond Phong's model and lights that are points in RGB, where
 * nothing stops light. Compiled once for each instruction set; the equations are those of
 * shade/brdf.h, which tests/unit/shade_models.c holds it against. */
#include "base/cpu.h"
#include "shade/area_simd.h"
#include "shade/circle_simd.h"
#include "shade/extended.h"
#include "shade/lights_simd.h"
#include "shade/models_simd.h"
#include "shade/westin_simd.h"

/* The colors of a light on each term of the material. */
typedef struct tints {
    const double *color;       /* [term][3], for weights that are the same in all channels */
    size_t step;               /* from a term to the next one; 0 in RGB */
    const shd_packed_mix *mix; /* [term], for others; NULL: channels do not mix */
} tints;

SHD_INLINE tints tints_of(const shd_sums_job *job, uint32_t index) {
    const shd_plan *plan = job->lighting->plan;
    if (!plan->bins) return (tints){job->lighting->exact[index].color, 0, NULL};
    const size_t m = (size_t)(job->material - plan->materials), terms = 1 + plan->max_lobes;
    const shd_packed_mix *mixes = job->lighting->mixes[m];
    return (tints){plan->term_colors + 3 * terms * (index + plan->light_count * m), 3,
                   mixes ? mixes + index * (1 + job->material->lobe_count) : NULL};
}

/* Adds weights that are the same in all channels. */
SHD_INLINE void add_grey(const tints *t, size_t term, shd_vd weight, shd_vd *sums) {
    const double *color = t->color + t->step * term;
    for (size_t c = 0; c < 3; c++) sums[c] += weight * shd_vd_set(color[c]);
}

/* Adds weights that differ. */
SHD_INLINE void add_colors(const tints *t, size_t term, const shd_vd weights[3], shd_vd *sums) {
    if (!t->mix) {
        for (size_t c = 0; c < 3; c++) sums[c] += weights[c] * shd_vd_set(t->color[c]);
        return;
    }
    for (size_t i = 0; i < 3; i++)
        for (size_t c = 0; c < 3; c++) sums[c] += weights[i] * shd_vd_set(t->mix[term][i][c]);
}

/* ---- Lobes that differ from point to point ---- */

/* The vector from point i on of a row of points. */
SHD_INLINE shd_vd load_row(const shd_sums_job *job, const double *row, size_t i) {
    const double *from = row + i;
    const size_t left = job->count - i;
    double held[VW];
    if (left >= VW) return shd_vd_load(from);
    for (size_t k = 0; k < VW; k++) held[k] = from[k < left ? k : left - 1];
    return shd_vd_load(held);
}

/* The same of a row of points->sharp. */
SHD_INLINE shd_vd load_sharp(const shd_sums_job *job, size_t row, size_t i) {
    return load_row(job, job->points->sharp[row] + job->points->sharp_at, i);
}

/* The same of one of points->facets. */
SHD_INLINE shd_vd load_index(const shd_sums_job *job, size_t channel, size_t i) {
    return load_row(job, job->points->facets[channel] + job->points->facets_at, i);
}

/* Lobe k of the job, of Phong's or Blinn's, in lanes that are lit, of log(1 - off): in lanes whose
 * exponent is the material's own, the same bits as there. */
SHD_INLINE shd_vd weigh_sharp(const shd_sums_job *job, size_t k, size_t i, shd_vd off,
                              const arrival *by) {
    const size_t row = 2 * (job->first_lobe + k);
    const shd_vd n = load_sharp(job, row, i), one = shd_vd_set(1), cut = shd_vd_set(SHD_EXACT_CUT),
                 reach = shd_vd_select(shd_vd_gt(n, cut), cut / n, one);
    const shd_md in = shd_vd_gt_in(by->lit, reach, off);
    if (!shd_md_any(in)) return shd_vd_set(0);
    const shd_vd power = power_of_lanes(shd_log1m64(below_one(off)), n);
    return shd_vd_mul_in(in, power, by->factor * load_sharp(job, row + 1, i));
}

/* ---- Lobes of Phong's kin ---- */

SHD_INLINE void add_shine(const shd_sums_job *job, const tints *t, const points *at, size_t i,
                          bool sharp, const arrival *by, const pairing *p, shd_vd *sums) {
    const shd_plan_material *m = job->material;
    const shd_plan_lobe *lobes = m->lobes + job->first_lobe;
    const shd_packed_energy *energies = job->lighting->energies[m - job->lighting->plan->materials];
    const shd_vd away[3] = {-at->w[0], -at->w[1], -at->w[2]};
    const shd_vd off = m->model == SHD_MODEL_BLINN_PHONG ? p->off : half_chords(by->toward, away);
    shd_vd log = off;
    bool has_log = false;
    for (size_t k = 0; sharp && k < job->lobe_count; k++)
        add_grey(t, 1 + job->first_lobe + k, weigh_sharp(job, k, i, off, by), sums + 3 + 3 * k);
    if (sharp) return;
    for (size_t k = 0; k < job->lobe_count; k++) {
        const double n = lobes[k].shininess, reach = n > SHD_EXACT_CUT ? SHD_EXACT_CUT / n : 1;
        const shd_md in = shd_vd_gt_in(by->lit, shd_vd_set(reach), off);
        if (!shd_md_any(in)) continue;
        if (!has_log) log = shd_log1m64(below_one(off));
        has_log = true;
        shd_vd weight = power_of(log, n);
        if (m->model == SHD_MODEL_PHONG_NORMALIZED)
            weight *= normalize_lobe(&energies[job->first_lobe + k], by->facing);
        weight = shd_vd_mul_in(in, weight, by->factor);
        add_grey(t, 1 + job->first_lobe + k, weight, sums + 3 + 3 * k);
    }
}

/* ---- Cook-Torrance ---- */

/* Adds lobes of facets, without Fresnel's reflectance `weights`, whose index is another one in each
 * bin of the spectrum. */
SHD_INLINE void add_bins(const shd_sums_job *job, uint32_t index, shd_md seen,
                         const shd_vd *weights, shd_vd c2, shd_vd s2, shd_vd *sums) {
    const shd_plan_material *m = job->material;
    const size_t count = job->lighting->plan->bins->count;
    const double(*light)[3] = job->lighting->plan->lights[index].bins,
          *rows = m->bins + (1 + job->first_lobe) * count;
    for (size_t b = 0; b < count; b++) {
        const shd_fresnel *of = &m->indices[b / 3];
        const shd_vd mirrored = mirror_lanes(of->n[b % 3], of->k[b % 3], c2, s2);
        for (size_t k = 0; k < job->lobe_count; k++) {
            const shd_vd lit =
                shd_vd_mul_in(seen, weights[k], mirrored) * shd_vd_set(rows[k * count + b]);
            for (size_t c = 0; c < 3; c++) sums[3 * k + c] += lit * shd_vd_set(light[b][c]);
        }
    }
}

/* `own`: the index differs from point to point. */
SHD_INLINE void add_mirrored(const shd_sums_job *job, const tints *t, size_t i, bool own,
                             shd_md seen, const shd_vd *weights, shd_vd c2, shd_vd s2,
                             shd_vd *sums) {
    const shd_fresnel *of = &job->material->from->fresnel;
    shd_vd mirrored[3];
    for (int c = 0; c < 3; c++) {
        const bool again = c && of->n[c] == of->n[0] && of->k[c] == of->k[0];
        if (own)
            mirrored[c] = mirror_each(load_index(job, (size_t)c, i), c2, s2);
        else
            mirrored[c] = again ? mirrored[0] : mirror_lanes(of->n[c], of->k[c], c2, s2);
    }
    for (size_t k = 0; k < job->lobe_count; k++) {
        shd_vd colors[3];
        for (int c = 0; c < 3; c++) colors[c] = shd_vd_mul_in(seen, weights[k], mirrored[c]);
        add_colors(t, 1 + job->first_lobe + k, colors, sums + 3 * k);
    }
}

SHD_INLINE void add_facets(const shd_sums_job *job, uint32_t index, const tints *t, size_t i,
                           bool sharp, bool own, const arrival *by, const pairing *p,
                           shd_vd *sums) {
    const shd_plan_lobe *lobes = job->material->lobes + job->first_lobe;
    const shd_vd quarter = shd_vd_set(0.25);
    const shd_md seen = see_facets(by->lit, p);
    if (!shd_md_any(seen)) return;
    const facets f = face_lanes(by->facing, p);
    shd_vd weights[SHD_WIDE_LOBES];
    for (size_t k = 0; k < job->lobe_count; k++)
        weights[k] =
            shd_vd_mul_in(seen,
                          sharp ? weigh_slopes(&f, load_sharp(job, 2 * (job->first_lobe + k), i))
                                : weigh_slope(&f, lobes[k].shininess),
                          by->factor);
    if (job->material->indices)
        add_bins(job, index, seen, weights, p->lv * quarter, p->apart * quarter, sums + 3);
    else
        add_mirrored(job, t, i, own, seen, weights, p->lv * quarter, p->apart * quarter, sums + 3);
}

/* ---- Sums ---- */

/* Computes one light, by the reference, in lanes that vectors cannot hold. */
__attribute__((noinline, cold)) static void add_left(const shd_sums_job *job, uint32_t index,
                                                     size_t first, unsigned left, shd_vd *sums) {
    if (shd_is_cancelled(job->lighting->plan->cancelled)) return;
    for (size_t i = 0; i < VW; i++) {
        if (!(left >> i & 1)) continue;
        double row[SHD_BRDF_ROWS] = {0};
        shd_add_extended(job->lighting, job->material, index, job->points, first + i, row);
        for (size_t c = 0; c < 3; c++) sums[c][i] += row[c];
        for (size_t k = 0; k < 3 * job->lobe_count; k++)
            sums[3 + k][i] += row[3 + 3 * job->first_lobe + k];
    }
}

/* Adds one light. Returns the lanes that are left to the reference. */
SHD_INLINE unsigned add_light(const shd_sums_job *job, uint32_t index, const points *at, size_t i,
                              bool sharp, bool own, shd_md all, shd_vd *sums) {
    const shd_wide_light *light = &job->lighting->exact[index];
    arrival by;
    const unsigned left = reach_points(light, at, all, NULL, &by);
    if (!shd_md_any(by.lit)) return left;
    const tints t = tints_of(job, index);
    if (t.step) by.factor *= shd_vd_set(light->gain);
    const shd_model model = job->material->model;
    pairing p = {0}; /* the others do not ask */
    if (model != SHD_MODEL_PHONG && model != SHD_MODEL_PHONG_NORMALIZED)
        p = pair_lanes(at, by.toward);
    add_grey(&t, 0, shd_vd_mul_in(by.lit, by.factor, weigh_diffuse(job->material, by.facing, &p)),
             sums);
    if (model == SHD_MODEL_COOK_TORRANCE)
        add_facets(job, index, &t, i, sharp, own, &by, &p, sums);
    else
        add_shine(job, &t, at, i, sharp, &by, &p, sums);
    return left;
}

/* Whether all lobes have closed forms over rectangles. */
static bool is_closed(const shd_plan_material *m) {
    if (m->model != SHD_MODEL_PHONG) return false;
    for (size_t k = 0; k < m->lobe_count; k++)
        if (!shd_has_moments(m->lobes[k].shininess)) return false;
    return true;
}

SHD_INLINE void add_area_lobes(const shd_sums_job *job, const tints *t, rectangle *r,
                               const points *at, shd_vd gain, shd_vd *sums) {
    const shd_plan_lobe *lobes = job->material->lobes + job->first_lobe;
    const shd_vd zero = shd_vd_set(0), largest = shd_vd_set(SHD_LARGEST_FALL);
    shd_vd most, found[SHD_WIDE_LOBES];
    const shd_md lit = rise_over_lobes(r, at->w, &most);
    shd_md in[SHD_WIDE_LOBES];
    bool any = false;
    for (size_t k = 0; k < job->lobe_count; k++) {
        in[k] = shd_vd_gt_in(lit, most, shd_vd_set(faint_of(lobes[k].shininess)));
        any |= shd_md_any(in[k]);
    }
    if (!any) return;
    sum_lobes(&r->edge, at->w, lobes, job->lobe_count, found);
    for (size_t k = 0; k < job->lobe_count; k++) {
        const shd_vd weight = smaller_of(shd_vd_max(found[k], zero) * gain, largest);
        add_grey(t, 1 + job->first_lobe + k, shd_vd_mul_in(in[k], weight, shd_vd_set(1)),
                 sums + 3 + 3 * k);
    }
}

/* Adds a rectangle to a material that is closed. As add_light. */
__attribute__((noinline)) static unsigned add_rectangle(const shd_sums_job *job, uint32_t index,
                                                        const points *at, shd_vd *sums) {
    const shd_plan *plan = job->lighting->plan;
    const shd_plan_light *light = &plan->lights[index];
    const double area = shd_light_area(light->shape);
    const shd_vd gain = shd_vd_set(shd_smaller(1 / area, SHD_LARGEST_FALL)),
                 largest = shd_vd_set(SHD_LARGEST_FALL);
    rectangle r;
    if (job->lighting->exact[index].sheet_count) return (1u << VW) - 1;
    see_rectangle(light->shape, at, plan->scale, &r);
    rise_over(&r, at->n, plan->point_off);
    const unsigned left = shd_md_bits(r.left);
    if (!shd_md_any(r.lit)) return left;
    tints t = tints_of(job, index);
    if (!t.step) t.color = light->color;
    const shd_vd half = shd_vd_set(0.5), zero = shd_vd_set(0),
                 sum = shd_vd_max(sum_diffuse(&r.edge, at->n) * half, zero) * gain;
    add_grey(&t, 0, shd_vd_mul_in(r.lit, smaller_of(sum, largest), shd_vd_set(1)), sums);
    if (job->lobe_count) add_area_lobes(job, &t, &r, at, gain, sums);
    return left;
}

/* Adds a disc or a sphere to a material of Phong's model. As add_light. */
__attribute__((noinline)) static unsigned add_circle(const shd_sums_job *job, uint32_t index,
                                                     const points *at, shd_vd *sums) {
    const shd_plan *plan = job->lighting->plan;
    const shd_plan_light *light = &plan->lights[index];
    const shd_plan_lobe *lobes = job->material->lobes + job->first_lobe;
    const shd_vd one = shd_vd_set(1), largest = shd_vd_set(SHD_LARGEST_FALL),
                 gain = shd_vd_set(shd_smaller(1 / shd_light_area(light->shape), SHD_LARGEST_FALL));
    circle o;
    shd_md bright, in[SHD_WIDE_LOBES];
    shd_vd found[SHD_WIDE_LOBES];
    if (job->lighting->exact[index].sheet_count) return (1u << VW) - 1;
    see_circle(light->shape, at, plan->scale, &o);
    keep_whole(&o, at, job->lobe_count, plan->point_off, &bright);
    const bool shines = shd_md_any(bright);
    if (shines) {
        const shd_vd most = most_of(at->w, o.toward, o.size);
        for (size_t k = 0; k < job->lobe_count; k++)
            in[k] = shd_vd_gt_in(bright, most, shd_vd_set(faint_of(lobes[k].shininess)));
        const shd_md hard = sum_round_lobes(&o, at->w, light->shape->type == SHD_LIGHT_SPHERE,
                                            lobes, job->lobe_count, in, found);
        o.left = shd_md_or(o.left, hard);
        o.lit = shd_md_and(o.lit, shd_md_not(hard));
    }
    const unsigned left = shd_md_bits(o.left);
    if (!shd_md_any(o.lit)) return left;
    tints t = tints_of(job, index);
    if (!t.step) t.color = light->color;
    const shd_vd diffuse = smaller_of(sum_round_diffuse(&o, at->n) * gain, largest);
    add_grey(&t, 0, shd_vd_mul_in(o.lit, diffuse, one), sums);
    for (size_t k = 0; shines && k < job->lobe_count; k++) {
        const shd_vd weight = smaller_of(found[k] * gain, largest);
        add_grey(&t, 1 + job->first_lobe + k, shd_vd_mul_in(shd_md_and(in[k], o.lit), weight, one),
                 sums + 3 + 3 * k);
    }
    return left;
}

/* Adds a light with a shape to a material of Phong's model; rectangles only if it is `closed`. As
 * add_light. */
SHD_INLINE unsigned add_shape(const shd_sums_job *job, uint32_t index, bool closed,
                              const points *at, shd_vd *sums) {
    if (job->lighting->plan->lights[index].shape->type != SHD_LIGHT_RECT)
        return add_circle(job, index, at, sums);
    return closed ? add_rectangle(job, index, at, sums) : (1u << VW) - 1;
}

/* Microgeometry has no lobes, and a view that counts for all lights. */
static void sum_westin(const shd_sums_job *job) {
    westin_view view = {.object = -1};
    const shd_md all = shd_md_not(shd_vd_gt(shd_vd_set(0), shd_vd_set(0)));
    for (size_t i = job->first; i < job->end; i += VW) {
        const size_t count = job->count - i;
        points at;
        if (count >= VW)
            load_points(job->points, i, job->lighting->plan->scale, &at);
        else
            load_last(job->points, i, job->lighting->plan->scale, &at);
        see_westin(job, i, &at, &view);
        shd_vd sums[3] = {shd_vd_set(0), shd_vd_set(0), shd_vd_set(0)};
        for (size_t k = 0; k < job->n; k++) {
            const uint32_t index = job->which[k];
            const shd_wide_light *light = &job->lighting->exact[index];
            arrival by;
            unsigned left = (1u << VW) - 1;
            if (light->kind != SHD_KIND_WIDE && !job->lighting->plan->lights[index].shape) {
                left = reach_points(light, &at, all, NULL, &by);
                if (shd_md_any(by.lit)) {
                    const tints t = tints_of(job, index);
                    if (t.step) by.factor *= shd_vd_set(light->gain);
                    shd_vd weights[3];
                    if (weigh_westin(job, &at, &by, &view, weights))
                        add_colors(&t, 0, weights, sums);
                }
            }
            if (count < VW) left &= (1u << count) - 1;
            if (left) add_left(job, index, i, left, sums);
        }
        for (size_t c = 0; c < 3; c++) store_sums(job, c, i, sums[c]);
    }
}

/* `sharp`: lobes differ from point to point; `own`: what facets mirror does. */
SHD_INLINE void sum_brdf(const shd_sums_job *job, bool sharp, bool own) {
    const shd_wide_light *lights = job->lighting->exact;
    const double scale = job->lighting->plan->scale;
    const bool closed = is_closed(job->material);
    /* What has no body for exponents that differ is left to the reference. */
    const bool alone = sharp && job->material->model == SHD_MODEL_PHONG_NORMALIZED;
    const shd_md all = shd_md_not(shd_vd_gt(shd_vd_set(0), shd_vd_set(0)));
    for (size_t i = job->first; i < job->end; i += VW) {
        const size_t count = job->count - i;
        points at;
        if (count >= VW)
            load_points(job->points, i, scale, &at);
        else
            load_last(job->points, i, scale, &at);
        shd_vd sums[ROWS];
        for (size_t k = 0; k < 3 + 3 * job->lobe_count; k++) sums[k] = shd_vd_set(0);
        for (size_t k = 0; k < job->n; k++) {
            const uint32_t index = job->which[k];
            unsigned left = (1u << VW) - 1;
            const shd_light *shape = job->lighting->plan->lights[index].shape;
            if ((shape || job->material->indices || lights[index].kind == SHD_KIND_WIDE) &&
                shd_is_cancelled(job->lighting->plan->cancelled))
                return; /* some of them take microseconds */
            const bool held = lights[index].kind != SHD_KIND_WIDE;
            if (held && !shape && !alone)
                left = add_light(job, index, &at, i, sharp, own, all, sums);
            else if (held && !sharp && job->material->model == SHD_MODEL_PHONG)
                left = add_shape(job, index, closed, &at, sums);
            if (count < VW) left &= (1u << count) - 1;
            if (left) add_left(job, index, i, left, sums);
        }
        for (size_t k = 0; k < 3 + 3 * job->lobe_count; k++) store_sums(job, k, i, sums[k]);
    }
}

void SHD_VARIANT(shd_brdf64)(const shd_sums_job *job) {
    if (job->material->model == SHD_MODEL_WESTIN)
        sum_westin(job);
    else if (job->points->facets)
        sum_brdf(job, job->points->sharp, true);
    else if (job->points->sharp)
        sum_brdf(job, true, false);
    else
        sum_brdf(job, false, false);
}
