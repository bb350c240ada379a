/* What environments make of a surface, anew from docs/model.md: a sum over directions, twice, with
 * parts of texels that are half as wide the second time. */
#ifndef SHD_ATTACK_SKY_H
#define SHD_ATTACK_SKY_H

#include "attack/document.h"

/* Directions of a map and their light, [count][7]: x, y, z, and radiance of three channels and the
 * solid angle. NULL: memory. free()d by the caller. `side`: parts of a texel, in both directions;
 * `turn`: radians about y. */
double *sky_cut(const sky_map *map, int side, real turn, size_t *count);

/* Adds what the lamp makes of the stuff to a range as wide as both sums are apart. */
void sky_light(const lamp *l, const stuff *m, point n, point v, real low[3], real high[3]);

#endif
