/* Tiles of traced scenes: shadows, and what rays beyond the eye's add to what was lit. */
#pragma once

#include "render/tiles/tile.h"

/* Sets scenery->traced if the scene is traced; the scenery is borrowed, and its lighting and facets
 * may come later. False: the arena is full, or it was cancelled. */
bool shd_traced_make(const shd_plan *plan, const shd_sight *sight, shd_arena *arena,
                     shd_scenery *scenery);

/* What stops light. NULL: nothing does. `traced` may be NULL. */
const shd_shadows *shd_traced_shadows(const struct shd_traced *traced);

/* How far off is what the eye sees, but for what further rays bring: 0 if there are none. `traced`
 * may be NULL. */
double shd_traced_seen(const struct shd_traced *traced);

/* Completes the radiance of lit hits, s->sums of s->runs, by what their rays meet, and fills the
 * layers of shadows and bounces, and s->alpha. Layers of the light model's parts are multiplied by
 * the opacity, so that they and the bounces add up to the beauty. Ends the stages shade, trace and
 * shadow if there is anything to do. */
void shd_trace_hits(const shd_scenery *scenery, const shd_hits *hits, shd_tile_scratch *s,
                    shd_stopwatch *watch);
