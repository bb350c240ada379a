/* Hits of a chunk in runs, each of one group of the plan's. */
#pragma once

#include "render/tiles/shots.h"

/* Makes s->runs of hits. Returns the hits that they are runs of: these, or s->sorted. */
const shd_hits *shd_make_runs(const shd_scenery *scenery, const shd_hits *hits,
                              shd_tile_scratch *s);
