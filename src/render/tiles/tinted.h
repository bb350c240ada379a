/* What is lit in the bins of tinted plans (shd_plan.tinted): what each bin adds to a color. */
#pragma once

#include "render/tiles/tile.h"

/* Adds what a plane shows of a smooth surface to [bins->count]. weights[field][0]: what patterns of
 * its material are there; not read if it has none. */
void shd_tinted_plane(const shd_scenery *scenery, const shd_surface *at, size_t plane,
                      double *const *weights, double (*out)[3]);

/* Fills [bins->count] with what a plane shows of hit `i`, as the eye sees it, whose patterns are in
 * s->weights. */
void shd_tinted_hit(const shd_scenery *scenery, const shd_surface *at, const shd_tile_scratch *s,
                    size_t i, size_t plane, double (*out)[3]);

/* Completes the planes of hit `i`, whose rays brought `radiance`; `local` is the beauty's local
 * light, and is overwritten. */
void shd_tinted_planes(const shd_scenery *scenery, const shd_surface *at, shd_tile_scratch *s,
                       size_t i, const double radiance[3], double (*local)[3]);
