/* How what is seen through a block of pixels bends: its points, normals and views are smooth
 * functions of the place in the picture, of which the block's middle and the most of the
 * derivatives are known. Steps are pixels. */
#pragma once

#include <stdbool.h>

#include "base/vec3.h"

enum { SHD_BLOCK_SIDE = 8, SHD_ROW = 0xff }; /* pixels of blocks, and of a row, as bits */

/* The most that a vector's first and second derivative are in any direction. */
typedef struct shd_slopes {
    double first, second;
} shd_slopes;

typedef struct shd_bend {
    size_t object;                /* all of the block's rays hit it, and nothing else */
    shd_vec3 point, normal, view; /* at the block's middle: world frame, unit, unit */
    shd_slopes points, normals, views;
    double reach; /* pixels: no ray is farther from the middle */
} shd_bend;

/* Sketches' rays (shade/sketch.c) begin no farther from the middle's point than LOW c, with c the
 * least N.V, and in radii of a ball. */
static const double SHD_SKETCH_LOW = 0.5;

/* The rays through a block's pixels, as they meet the surface that bends. In units of `size`, with
 * the middle's point as the origin, the ray through the pixel that is x to the right and y below
 * the middle begins at x at_x + y at_y, and goes along way + x way_x + y way_y. */
typedef struct shd_block_rays {
    bool curved;                            /* a ball of radius 1; else a plane */
    double size, cosine;                    /* a unit's length; N.V is no less than `cosine` */
    shd_vec3 way, way_x, way_y, at_x, at_y; /* `way` is unit */
    shd_vec3 middle;                        /* the normal there */
    int blocks;                             /* each way */
    /* An ellipsoid is a ball, and all this is so, in a frame of its own, which these map; NULL:
     * this is the world's. The transpose of from_world times `to_normal` makes N of `middle`, and
     * no other vector more than `stretch` times as long. */
    const shd_affine *to_world, *from_world;
    double to_normal, stretch;
} shd_block_rays;

/* A pattern of samples, whose mean is the pixel's center: the mean of their squared distances from
 * it, and the most of it along any one direction. */
typedef struct shd_pattern_spread {
    double square, along;
} shd_pattern_spread;

/* Where `draft` takes one sample at the center of a pixel, its value is off the mean of all of its
 * samples by no more than a + r v in a component of that mean v, in linear light. The second part
 * is what eyes and codes tell of light, the first one keeps the dark from being sampled for
 * nothing. */
typedef struct shd_mean_room {
    double absolute, relative;
} shd_mean_room;

static const shd_mean_room SHD_DRAFT_ROOM = {0x1p-13, 0x1p-8};

/* What a light's weights may be off by in the standard tier, of its attenuation, where pixels take
 * the mean of few nodes for that of their samples (bound/light/rules.h): about as much as f32 has
 * them off. 0 is the diffuse weight's exponent. */
static inline double shd_nodes_room(double exponent) {
    return 0x1p-23 * fmax(1, sqrt(exponent) / 3);
}

/* Beside it, what tells how much more is known if places in the picture, two numbers of pixels, are
 * complex: points, normals and views are functions of them that can be expanded into power series.
 */

/* How far they are at most from those of the block's middle: the norm of complex vectors. */
typedef struct shd_moves {
    double point, normal, view; /* world frame, unit, unit */
} shd_moves;

enum { SHD_DISCS = 12 };
/* Pixels: the radii of discs begin here, and grow by such a ratio. */
static const double SHD_DISC_LEAST = 5, SHD_DISC_STEP = 1.25;
/* Pixels: no center of a rule is farther from the pixel's own. */
static const double SHD_BESIDE = 2.8284271248;

/* What the ray through the middle of a block meets: a ball of radius 1, or a plane at height 1. */
typedef struct shd_strike {
    bool ball, orthographic;
    double size;          /* a unit of lengths here, in the world */
    double pace;          /* what a pixel moves the ray's unit direction by, or its origin, in the
                           * world */
    double t;             /* the way to it */
    double along, beside; /* ball: of the way, to where the ray is nearest to the center, and how
                           * far that is from it */
    double cosine;        /* plane: N.V */
} shd_strike;

typedef struct shd_analytic {
    size_t object;                /* all of the rays hit it, and nothing else in the block */
    shd_vec3 point, normal, view; /* at the block's middle: world frame, unit, unit */
    shd_strike strike, worst;     /* there; and at pixels' centers, the one that moves most */
    shd_vec3 right, down;         /* what the point moves by there for each pixel */
    int side;                     /* pixels of the part */
    double centers;               /* no pixel's center is farther from the middle */
    shd_moves near, around;       /* through the block; and through centers of pixels beside it */
} shd_analytic;

/* The strike of rays up to so many pixels from the middle, of which none is moved by more than what
 * is told of it. False: nothing is known of them. */
bool shd_worst_strike(const shd_strike *strike, double reach, shd_strike *out);

/* How much is moved in all complex places that are so many pixels from the middle. False: nothing
 * is known of them. The proof is in moves.c. */
bool shd_move(const shd_strike *strike, double reach, shd_moves *out);
