/* The axes on which colors are told apart from R'G'B', as they are displayed. Pure, any thread. */
#pragma once

/* NTSC's luma and chroma, with the digits of the first television standards: Y = .30 R + .59 G +
 * .11 B, I = .60 R - .28 G - .32 B, Q = .21 R - .52 G + .31 B. */
void shd_yiq_of(const float rgb[3], double yiq[3]);

/* A. R. Smith, "Color Gamut Transform Pairs", SIGGRAPH 1978: hue in [0,1), red is 0 and green 1/3;
 * saturation and value. Negatives are 0 first, as in the color space HSV. The hue of greys is 0. */
void shd_hsv_of(const float rgb[3], double hsv[3]);
