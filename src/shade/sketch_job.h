/* What the kernels of sketches read. Inside of shade/. */
#pragma once

#include "shade/packed.h"
#include "shade/sketch.h"

/* A light on a group's material. */
typedef struct shd_sketch_light {
    const shd_packed_light *from;
    float diffuse[3], specular[SHD_SKETCH_LOBES][3]; /* its color times the material's */
} shd_sketch_light;

struct shd_sketch_group {
    bool fits; /* false: it is not sketched, and the rest is not set */
    float constant[3];
    const shd_packed_lobe *lobes;
    size_t lobe_count, light_count;
    float reach; /* the largest of the lobes */
    const shd_sketch_light *lights;
    /* Where they are, in the world, or the direction toward them; 1, or 0 of directional ones; what
     * makes lengths of the plan's frame of that. As many as vectors take. */
    const double *at[3], *point, *scale;
};

/* What lights meet at a block. */
typedef struct shd_sketch_view {
    double point[3], normal[3], mirror[3]; /* in the middle, in the world: P, N, W */
    double moved;                          /* no point is farther from the middle */
    double turned;                         /* nor N from that by more, */
    double chord; /* and of L that is nearer to W than that, lobes are not nothing */
    double near;  /* lights that are nearer to a point are not for sketches */
} shd_sketch_view;

/* More than chords of f32 are off by. */
static const double SHD_SKETCH_OFF = 1e-4;

typedef enum shd_sketch_form {
    SHD_SKETCH_PLANE,
    SHD_SKETCH_BALL,
    SHD_SKETCH_ELLIPSOID,
    SHD_SKETCH_RIM,
    SHD_SKETCH_FACES
} shd_sketch_form;

/* What is linear in the picture of a face: its normal's direction and its point's way from the
 * block's, times a weight, and that. In each row, the value in the middle, and what it grows by to
 * the right and down. */
enum { SHD_SKETCH_WEIGHT = 6, SHD_SKETCH_ROWS };

typedef struct shd_sketch_face {
    float row[SHD_SKETCH_ROWS][3];
} shd_sketch_face;

typedef struct shd_sketch_job {
    const shd_sketch_group *group;
    shd_sketch_form form;
    int blocks;    /* each way */
    float turned2; /* the square of what N.L is off by at most */
    /* As shd_block_rays, rounded: */
    float middle[3], way[3], way_x[3], way_y[3], at_x[3], at_y[3];
    float scale; /* from the unit of rays to the plan's frame */
    /* Of an ellipsoid: from the frame of the rays to the plan's, and to normals, which are unit in
     * the middle; N there, and the rays in the world, `along` times which is -N.w for b = -1. */
    float to_frame[3][3], to_normal[3][3], normal[3], seen[3], seen_x[3], seen_y[3], along;
    /* Of a rim (shd_rim): rays miss where the square is below -unsure and hit where it is above
     * `sure`; and the color behind it. */
    float square[6], unsure, sure, beyond[3];
    shd_sketch_view view;
    /* Of faces, of which the rays are all that is set above: these, and which of them each pixel
     * shows. */
    const shd_sketch_face *faces;
    const float *face_of;
} shd_sketch_job;

/* Blocks are drawn if f32 tells of all their pixels on which side of an edge they are. False: none
 * is. */
typedef bool shd_sketch_function(const shd_sketch_job *job, size_t stride, float *const rgb[3],
                                 bool *drawn);
shd_sketch_function shd_sketch_portable, shd_sketch_avx2, shd_sketch_avx512;
