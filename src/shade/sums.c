/* Sums by the kernels, where nothing stops light. */
#include <math.h>
#include <string.h>

#include "plan/bunches.h"
#include "plan/tier.h"
#include "shade/packed.h"
#include "shade/quick.h"

static void sum_points(const shd_sums_job *all, shd_sums_function *sums) {
    /* Between looks at the flag that cancels: so many points times lights times terms, or one
     * vector of points if that is more. */
    enum { AT_ONCE = 1 << 17 };
    const size_t lobes = all->material->lobe_count, each = all->n * (1 + lobes),
                 points = each ? AT_ONCE / each / SHD_LANES * SHD_LANES : AT_ONCE,
                 step = points ? points : SHD_LANES;
    for (size_t first = 0; first < all->count; first += step) {
        shd_sums_job job = *all;
        job.first = first;
        job.end = all->count - first < step ? all->count : first + step;
        do {
            const size_t left = lobes - job.first_lobe;
            if (shd_is_cancelled(all->lighting->plan->cancelled)) return;
            job.lobe_count = left < SHD_WIDE_LOBES ? left : SHD_WIDE_LOBES;
            sums(&job);
            job.diffuse = NULL;
            job.diffuse64 = NULL;
            job.first_lobe += SHD_WIDE_LOBES;
        } while (job.first_lobe < lobes);
    }
}

void shd_light_sums32(const shd_lighting *lighting, const shd_plan_material *material,
                      const uint32_t *which, size_t n, const shd_points32 *points,
                      float *const diffuse[3], float *const *specular, uint8_t *edges) {
    const shd_packed_material *packed = &lighting->materials[material - lighting->plan->materials];
    const shd_sums_job job = {.lighting = lighting,
                              .material = material,
                              .lobes = packed->lobes,
                              .which = which,
                              .n = n,
                              .count = points->count,
                              .narrow = points,
                              .diffuse = diffuse,
                              .specular = specular,
                              .edges = edges};
    sum_points(&job, packed->sums);
}

void shd_light_dull32(const shd_lighting *lighting, const shd_plan_material *material,
                      const uint32_t *which, size_t n, const shd_points32 *points,
                      float *const diffuse[3]) {
    const shd_packed_material *packed = &lighting->materials[material - lighting->plan->materials];
    shd_plan_material dull = *material;
    dull.lobe_count = 0;
    const shd_sums_job job = {.lighting = lighting,
                              .material = &dull,
                              .lobes = packed->lobes,
                              .which = which,
                              .n = n,
                              .count = points->count,
                              .narrow = points,
                              .diffuse = diffuse};
    sum_points(&job, packed->sums);
}

bool shd_is_quick(const shd_lighting *lighting, const shd_plan_material *material) {
    const shd_plan *plan = lighting->plan;
    const shd_packed_material *packed = &lighting->materials[material - plan->materials];
    if (plan->tier == SHD_EXACT || plan->split_positions || packed->model ||
        material->lobe_count > 1 || !(lighting->quick.span > 0))
        return false;
    /* What is seen is no less than a part of it. */
    for (int c = 0; c < 3; c++)
        if (!(material->constant[c] >= 0 && material->diffuse[c] >= 0 &&
              (!material->lobe_count || material->lobes->specular[c] >= 0)))
            return false;
    const double n = material->lobe_count ? material->lobes->shininess : 0;
    if (!(shd_quick_off(n) <= SHD_QUICK_SHARE * plan->drop_relative)) return false;
    if (!material->lobe_count) return true;
    return n >= SHD_QUICK_LEAST && n <= SHD_QUICK_MOST && n == floor(n);
}

size_t shd_part_quick(const shd_lighting *lighting, const uint32_t *which, size_t n,
                      uint32_t *quick, uint32_t *others) {
    size_t count = 0;
    for (size_t k = 0; k < n; k++) {
        const uint32_t index = which[k];
        quick[count] = index;
        others[k - count] = index;
        count += lighting->lamps.packed[index].quick;
    }
    return count;
}

/* ---- Points in an order. ---- */

enum { ARRANGED = 256, ARRANGED_ROWS = 9 };

/* Lets points before the `middle` be no further along than those from there on (Hoare). */
static void select_points(const float *along, uint32_t *order, int count, int middle) {
    for (int low = 0, high = count - 1; low < high;) {
        const float pivot = along[order[(low + high) / 2]];
        int i = low, j = high;
        while (i <= j) {
            while (along[order[i]] < pivot) i++;
            while (pivot < along[order[j]]) j--;
            if (i > j) break;
            const uint32_t one = order[i];
            order[i++] = order[j];
            order[j--] = one;
        }
        if (middle > j && middle < i) return;
        middle <= j ? (high = j) : (low = i);
    }
}

/* Halves points along the longest side of the box around their normals. Parts begin where vectors
 * of any width do. */
static void arrange_points(const shd_points32 *points, uint32_t *order, int count) {
    const int vector = count > SHD_LANES ? SHD_LANES
                       : count > 8       ? 8
                                         : 4,
              middle = (count / 2 + vector - 1) / vector * vector;
    if (count <= vector) return;
    const float *along = NULL;
    float widest = -1;
    for (int c = 0; c < 3; c++) {
        const float *n = points->normal[c];
        float low = INFINITY, high = -INFINITY;
        for (int i = 0; i < count; i++) {
            low = n[order[i]] < low ? n[order[i]] : low;
            high = n[order[i]] > high ? n[order[i]] : high;
        }
        if (!along || high - low > widest) widest = high - low, along = n;
    }
    select_points(along, order, count, middle);
    arrange_points(points, order, middle);
    arrange_points(points, order + middle, count - middle);
}

/* Some of a job's points, in an order. */
typedef struct arranged {
    _Alignas(64) float in[ARRANGED_ROWS][ARRANGED], out[6][ARRANGED];
    uint8_t edges[ARRANGED];
} arranged;

/* Copies a job's points, and what their rows have. The last one is repeated. */
static void gather_points(const shd_sums_job *job, const uint32_t *order, size_t count,
                          int channels, arranged *to) {
    const shd_points32 *from = job->narrow;
    const size_t padded = (count + SHD_LANES - 1) / SHD_LANES * SHD_LANES;
    memset(to->edges, 0, sizeof to->edges);
    for (size_t i = 0; i < padded; i++) {
        const uint32_t of = order[i < count ? i : count - 1];
        for (int c = 0; c < 3; c++) {
            to->in[c][i] = from->position[c][of];
            to->in[3 + c][i] = from->normal[c][of];
            to->in[6 + c][i] = from->mirror[c][of];
        }
        for (int c = 0; c < channels; c++) {
            to->out[c][i] = job->diffuse[c][of];
            if (job->material->lobe_count) to->out[3 + c][i] = job->specular[c][of];
        }
    }
}

static void scatter_sums(const shd_sums_job *job, const uint32_t *order, size_t count, int channels,
                         const arranged *from) {
    for (size_t i = 0; i < count; i++) {
        for (int c = 0; c < channels; c++) {
            job->diffuse[c][order[i]] = from->out[c][i];
            if (job->material->lobe_count) job->specular[c][order[i]] = from->out[3 + c][i];
        }
        if (job->edges) job->edges[order[i]] |= from->edges[i];
    }
}

/* The same, of points whose normals lie together, so that lights are behind all of a vector of
 * them, or shine on none, as often as can be. What a point gets is the same. */
static void light_arranged(const shd_sums_job *job, shd_sums_function *sums) {
    const int channels = job->lighting->plan->grey_lights ? 1 : 3;
    arranged a;
    float *rows[6];
    shd_points32 points = {.count = 0};
    shd_sums_job part = *job;
    for (int c = 0; c < 3; c++) {
        points.position[c] = a.in[c];
        points.normal[c] = a.in[3 + c];
        points.mirror[c] = a.in[6 + c];
        rows[c] = a.out[c];
        rows[3 + c] = a.out[3 + c];
    }
    part.narrow = &points;
    part.diffuse = rows;
    part.specular = rows + 3;
    part.edges = a.edges;
    for (size_t first = 0; first < job->count; first += ARRANGED) {
        uint32_t order[ARRANGED];
        const size_t left = job->count - first, count = left < ARRANGED ? left : ARRANGED;
        for (size_t i = 0; i < count; i++) order[i] = (uint32_t)(first + i);
        arrange_points(job->narrow, order, (int)count);
        gather_points(job, order, count, channels, &a);
        part.count = points.count = count;
        sum_points(&part, sums);
        scatter_sums(job, order, count, channels, &a);
    }
}

static void light_quickly(const shd_lighting *lighting, const shd_plan_material *material,
                          const uint32_t *which, size_t n, const float (*balls)[4],
                          const shd_points32 *points, float *const diffuse[3],
                          float *const *specular, uint8_t *edges) {
    static shd_sums_function *const sums[SHD_ISA_COUNT] = SHD_VARIANTS(shd_quick32);
    shd_plan_material shown = *material;
    if (!specular) shown.lobe_count = 0;
    const shd_sums_job job = {.lighting = lighting,
                              .material = &shown,
                              .lobes =
                                  lighting->materials[material - lighting->plan->materials].lobes,
                              .which = which,
                              .n = n,
                              .count = points->count,
                              .narrow = points,
                              .diffuse = diffuse,
                              .specular = specular,
                              .edges = edges,
                              .balls = balls};
    enum { FEW = 256 /* lights for which an order does not pay */ };
    if (balls && n >= FEW)
        light_arranged(&job, sums[lighting->plan->isa]);
    else if (n)
        sum_points(&job, sums[lighting->plan->isa]);
}

void shd_light_quick32(const shd_lighting *lighting, const shd_plan_material *material,
                       const uint32_t *which, size_t n, const shd_points32 *points,
                       float *const diffuse[3], float *const *specular, uint8_t *edges) {
    light_quickly(lighting, material, which, n, NULL, points, diffuse, specular, edges);
}

/* Balls around lights that follow each other. */
static void find_balls(const shd_lighting *lighting, const uint32_t *which, size_t n,
                       float (*out)[4]) {
    for (size_t b = 0; b < n / SHD_QUICK_BALL; b++, which += SHD_QUICK_BALL) {
        double square = 0;
        for (int c = 0; c < 3; c++) {
            float low = INFINITY, high = -INFINITY;
            for (int k = 0; k < SHD_QUICK_BALL; k++) {
                const float at = lighting->lights[which[k]].at[c];
                low = at < low ? at : low;
                high = at > high ? at : high;
            }
            const double half = ((double)high - (double)low) / 2;
            out[b][c] = (float)((double)low + half);
            square += half * half;
        }
        out[b][3] = (float)(sqrt(square) * (1 + 0x1p-20));
    }
}

bool shd_find_lamps(shd_lighting *lighting, shd_arena *arena) {
    const size_t count = lighting->plan->light_count;
    shd_lamps *lamps = &lighting->lamps;
    if (!lighting->plan->bunches) return true;
    *lamps = (shd_lamps){
        .quick = shd_arena_alloc(arena, count, sizeof *lamps->quick),
        .others = shd_arena_alloc(arena, count, sizeof *lamps->others),
        .balls = shd_arena_alloc(arena, count / SHD_QUICK_BALL + 1, sizeof *lamps->balls),
        .packed = shd_arena_alloc(arena, count, sizeof *lamps->packed)};
    if (!lamps->quick || !lamps->others || !lamps->balls || !lamps->packed) return false;
    for (size_t k = 0; k < count; k++) {
        const shd_packed_light *l = &lighting->lights[k];
        lamps->packed[k] = (shd_packed_lamp){.at = {l->at[0], l->at[1], l->at[2]},
                                             .color = {l->color[0], l->color[1], l->color[2]},
                                             .quick = l->quick};
    }
    lamps->quick_count = shd_part_quick(lighting, lighting->plan->bunches->lights, count,
                                        lamps->quick, lamps->others);
    lamps->other_count = count - lamps->quick_count;
    find_balls(lighting, lamps->quick, lamps->quick_count, lamps->balls);
    return true;
}

void shd_light_lamps32(const shd_lighting *lighting, const shd_plan_material *material,
                       const uint32_t *which, size_t n, const shd_points32 *points,
                       float *const diffuse[3], float *const *specular, uint8_t *edges,
                       void *memory) {
    enum { FEW = 24 }; /* points for which balls do not pay */
    shd_lamps lamps = lighting->lamps;
    if (which) {
        /* Parts of all lights have gaps, and balls around what follows each other are large. */
        lamps = (shd_lamps){.quick = memory, .others = (uint32_t *)memory + n};
        lamps.quick_count = shd_part_quick(lighting, which, n, lamps.quick, lamps.others);
        lamps.other_count = n - lamps.quick_count;
    }
    if (points->count < FEW) lamps.balls = NULL;
    shd_light_sums32(lighting, material, lamps.others, lamps.other_count, points, diffuse, specular,
                     edges);
    light_quickly(lighting, material, lamps.quick, lamps.quick_count,
                  (const float(*)[4])lamps.balls, points, diffuse, specular, edges);
}

/* Whether a light has a shape, or comes from all around. */
static bool has_shape(const shd_plan *plan, const uint32_t *which, size_t n) {
    for (size_t j = 0; j < n; j++)
        if (plan->lights[which[j]].shape || plan->lights[which[j]].environment) return true;
    return false;
}

void shd_open_sums(const shd_lighting *lighting, const shd_plan_material *material,
                   const uint32_t *which, size_t n, const shd_points64 *points,
                   double *const diffuse[3], double *const *specular) {
    const bool extended = lighting->plan->extended;
    const shd_sums_job job = {.lighting = lighting,
                              .material = material,
                              .which = which,
                              .n = n,
                              .count = points->count,
                              .points = points,
                              .diffuse64 = diffuse,
                              .specular64 = specular};
    const bool beyond = extended && (points->sharp || material->model != SHD_MODEL_PHONG ||
                                     lighting->plan->bins || has_shape(lighting->plan, which, n));
    sum_points(&job, beyond ? lighting->brdf64 : lighting->sums64);
}
