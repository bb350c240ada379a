/* What a place of a surface looks like under a document's lights, anew from docs/model.md: no ray
 * goes on from it (model.c). A thread may ask at a time for a document. */
#ifndef SHD_ATTACK_LIGHT_H
#define SHD_ATTACK_LIGHT_H

#include "attack/document.h"

static const real EPS = (real)0x1p-52; /* of f64 */

/* A color, and the range of what it is where that is undecided. */
typedef struct shade {
    real low[3], high[3];
} shade;

/* Keys tell cases apart. */
static inline void note(uint64_t *key, uint64_t value) {
    *key = (*key ^ value) * 0x9e3779b97f4a7c15u;
    *key ^= *key >> 29;
}

/* A triangle's own normal, outward where its mirror image would be inward. */
static inline point face_of(const thing *t, size_t triangle) {
    const point *p = t->placed + 3 * triangle;
    return times(cross(sub(p[1], p[0]), sub(p[2], p[0])), t->mirrored ? -1 : 1);
}

/* `m`: the thing's stuff, or what is seen of it there. `face`: the geometric normal, which decides
 * on the side; it and `normal` outward, not unit. `ray`: unit, along which it is seen. `triangle`:
 * of a mesh, on which rays to lights start. */
shade light_place(const document *d, const thing *t, const stuff *m, point at, point face,
                  point normal, point ray, bool flat, size_t triangle, uint64_t *key);

/* Lights with a shape are left out while this thread only asks which cases a sample has: their
 * integrals take a thousand times as long. */
void light_cases_only(bool only);

#endif
