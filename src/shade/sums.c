/* Sums by the kernels, where nothing stops light. */
#include <math.h>

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
        count += lighting->lights[index].quick;
    }
    return count;
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
    if (n) sum_points(&job, sums[lighting->plan->isa]);
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

void shd_light_lamps32(const shd_lighting *lighting, const shd_plan_material *material,
                       const uint32_t *which, size_t n, const shd_points32 *points,
                       float *const diffuse[3], float *const *specular, uint8_t *edges,
                       void *memory) {
    enum { FEW = 24 }; /* points for which balls do not pay */
    uint32_t *const room = memory;
    uint32_t *const others = room + n;
    const size_t quick = shd_part_quick(lighting, which, n, room, others);
    shd_light_sums32(lighting, material, others, n - quick, points, diffuse, specular, edges);
    /* Parts of all lights have gaps, and balls around what follows each other there are large. */
    const bool pays = n == lighting->plan->light_count && points->count >= FEW;
    float(*const balls)[4] = pays ? (float(*)[4])(room + 2 * n) : NULL;
    if (balls) find_balls(lighting, room, quick, balls);
    light_quickly(lighting, material, room, quick, (const float(*)[4])balls, points, diffuse,
                  specular, edges);
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
