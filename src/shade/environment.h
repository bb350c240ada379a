/* What an environment adds at a point of a surface by Phong's model.
 *
 * The radiance v from the solid angle dw counts as a directional light of Il = v dw / pi. So the
 * weights of a map v(L) are
 *
 *     diffuse  1/pi integral of v(L) (N.L)+ dw,
 *     a lobe   1/pi integral of v(L) (L.W)+^n [N.L > 0] dw,
 *
 * of each channel. By `integrate` they are summed over the map as it is; tables (prefilter.h) give
 * them by a look at a few numbers. Directions are of the map's own frame. Any thread. It cannot
 * fail. */
#pragma once

#include "scene/surroundings.h"

/* The integral of v(L) (L.W)+^exponent over the half sphere of N, divided by pi, in linear Rec.709.
 * Along each meridian the half sphere and the lobe are an interval, which is summed from texel to
 * texel, where radiance is linear, by Gauss' rule; meridians are summed the same way, finer where
 * the horizon or the lobe's own end comes near a pole. Its error is far below
 * SHD_ENVIRONMENT_TOLERANCE (plan/tier.h) of shd_surroundings_most. */
void shd_environment_integrate(const shd_surroundings *map, double exponent, shd_vec3 w, shd_vec3 n,
                               double out[3]);
