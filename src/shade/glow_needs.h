/* What environments will take of a scene, before anything is made. */
#pragma once

#include "scene/scene.h"

/* How many tables one scene may have; further terms are summed by quadrature. */
enum { SHD_GLOWS_MOST = 64 };

/* What a scene's environments may take beside its samples, whatever is kept: tables, and their
 * bytes, and those of maps in blocks (moments.h); and terms of a material that are summed by
 * quadrature, or by walking the map, at most. */
typedef struct shd_glow_needs {
    size_t tables, summed, walked;
    uint64_t bytes;
} shd_glow_needs;

shd_glow_needs shd_glow_needs_of(const shd_scene *scene);
