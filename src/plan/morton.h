/* Places in the order of Morton's curve, on which neighbors mostly lie together. Inside of plan/
 * and bound/. */
#pragma once

#include <stdint.h>

#include "base/vec3.h"

/* Ten bits of a coordinate in [low, low + size], two zeros before each. */
static inline uint32_t shd_morton_bits(double at, double low, double size) {
    enum { STEPS = 1 << 10 };
    const double part = size > 0 ? (at - low) / size * STEPS : 0;
    uint32_t bits = part >= STEPS - 1 ? STEPS - 1 : part > 0 ? (uint32_t)part : 0;
    bits = (bits | bits << 16) & 0x030000FF;
    bits = (bits | bits << 8) & 0x0300F00F;
    bits = (bits | bits << 4) & 0x030C30C3;
    return (bits | bits << 2) & 0x09249249;
}

/* Where on the curve through a box a place is. */
static inline uint32_t shd_morton(shd_vec3 at, shd_vec3 low, shd_vec3 size) {
    return shd_morton_bits(at.x, low.x, size.x) << 2 | shd_morton_bits(at.y, low.y, size.y) << 1 |
           shd_morton_bits(at.z, low.z, size.z);
}
