/* What was measured of metals. Only for scene/metals.c. Constants. */
#pragma once

#include "scene/scene.h"

enum { SHD_METALS = 6 };

/* n and k of each metal, in the order of shd_metal_names. */
extern const shd_curve shd_metal_curves[SHD_METALS][2];
