/* LDR-FLIP: how much two pictures differ for somebody who flips between them.
 *
 * Source: P. Andersson, J. Nilsson, T. Akenine-Moller, M. Oskarsson, K. Astrom, M. D. Fairchild,
 * "FLIP: A Difference Evaluator for Alternating Images", Proc. ACM Comput. Graph. Interact. Tech.
 * 3(2), 2020; sections in flip.c are its. An error is in [0,1], 0 for equal pictures.
 *
 * Pictures are linear light in sRGB's primaries, [height][width][3], held in [0,1]; beyond their
 * edges the nearest pixel goes on. Pure functions, any thread. */
#pragma once

#include <stddef.h>

#include "base/cancel.h"

/* Pixels a degree of sight; the paper's is a display 0.7 m wide of 3840 pixels at 0.7 m. */
#define SHD_FLIP_USUAL 67.0206432765823
#define SHD_FLIP_LEAST 10.0
#define SHD_FLIP_MOST  400.0

enum { SHD_FLIP_REACH = 54 }; /* pixels that filters reach at most */

typedef struct shd_taps {
    int reach;
    float weights[2 * SHD_FLIP_REACH + 1]; /* those within `reach` of it come first */
} shd_taps;

/* Filters, all of which are sums of products of one in x and one in y. */
typedef struct shd_flip {
    int reach;                         /* the largest one's */
    shd_taps light, red, blue[2];      /* of contrast: achromatic, red-green, blue-yellow */
    float blue_shares[2];              /* of the two of blue-yellow */
    shd_taps smooth, edge, point;      /* of features */
    double to_xyz[3][3], to_rgb[3][3]; /* divided by the white, and back */
    double most;                       /* c_max */
} shd_flip;

/* `density`: pixels a degree, from SHD_FLIP_LEAST to SHD_FLIP_MOST. */
void shd_flip_make(double density, shd_flip *out);

/* Floats that a band of so many rows works in. */
size_t shd_flip_scratch(const shd_flip *flip, int width, int rows);

/* The errors of rows [first, first + rows), at out[rows][width]. Looks at `cancelled` (or NULL) at
 * each row. */
void shd_flip_band(const shd_flip *flip, const float *a, const float *b, int width, int height,
                   int first, int rows, const atomic_bool *cancelled, float *scratch, float *out);
