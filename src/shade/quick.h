/* Sums of many lamps in f32, where what is left out has room for what they are off by. They are
 * some three times as fast as those of shd_light_sums32. */
#pragma once

#include "shade/lighting.h"

/* What quick sums are off by at most, more than those of shd_light_sums32, over what is seen under
 * a highlight of exponent n (0: none): 32 u, u = 2^-24, as up to 32 lights are summed in f32; and a
 * power of a cosine c is off by 6 n u / c of itself, as the cosine is by 6 u, and by 2 n u by its
 * products. Where c is below 1/2, that is less than u of what the light sends, as f32 is anyhow. */
static inline double shd_quick_off(double n) {
    return (32 + 14 * n) * 0x1p-24;
}

/* The share of what may be left out that is for it. */
#define SHD_QUICK_SHARE 0x1p-4

/* Powers of cosines below 2 to this are nothing: that is u / 256 of what the light sends. */
#define SHD_QUICK_DIM (-32.0)

/* Exponents of highlights that are powers. */
enum { SHD_QUICK_LEAST = 8, SHD_QUICK_MOST = 64 };

/* Whether points of the material may be lit so. */
bool shd_is_quick(const shd_lighting *lighting, const shd_plan_material *material);

/* Parts `which` into lights that may be summed so, and others, in their order. Returns how many of
 * the former there are. */
size_t shd_part_quick(const shd_lighting *lighting, const uint32_t *which, size_t n,
                      uint32_t *quick, uint32_t *others);

/* Adds the sums over such lights to what is in rows: as shd_light_sums32. Without `specular`,
 * diffuse light alone. */
void shd_light_quick32(const shd_lighting *lighting, const shd_plan_material *material,
                       const uint32_t *which, size_t n, const shd_points32 *points,
                       float *const diffuse[3], float *const *specular, uint8_t *edges);

/* Sets lighting->lamps, if the plan has bunches. False: memory. */
bool shd_find_lamps(shd_lighting *lighting, shd_arena *arena);

/* Writes sums over any lights, or all (`which` NULL): quick ones of those that may be, others as
 * shd_light_sums32. Of all, those that lie together are left out together, where all points face
 * away from them. `memory` is for 2 n numbers of 32 bits. */
void shd_light_lamps32(const shd_lighting *lighting, const shd_plan_material *material,
                       const uint32_t *which, size_t n, const shd_points32 *points,
                       float *const diffuse[3], float *const *specular, uint8_t *edges,
                       void *memory);
