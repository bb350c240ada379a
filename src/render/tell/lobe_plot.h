/* The figure of a material's reflection: its lobe with the light held, and its albedo by angle. */
#pragma once

#include "image/draw.h"
#include "render/tell/reflectance.h"

enum { SHD_LOBE_PLOT_WIDTH = 440, SHD_LOBE_PLOT_HEIGHT = 520 }; /* of one material, in pixels */

/* Draws one with its left upper corner at (x, y), the light `angle` degrees from the normal. */
void shd_draw_lobe(shd_drawing *drawing, double x, double y, const shd_reflectance *r,
                   const char *name, double angle);
