/* A photo as light: what the scene's output would have been made of. */
#pragma once

#include "image/read.h"
#include "render/rendering.h"

/* Of the pixels that are asked for, those that tell something. */
typedef struct shd_photo {
    size_t count;
    uint32_t *pixels;  /* [count] */
    float *light;      /* [count][3]: in the working space */
    float *weight;     /* [count][3]: 1 / standard deviation of what rounding to the samples' depth
                        * leaves unknown; 0: the channel is clipped. 1 if they are `exact` */
    bool codes, exact; /* samples are integers; they are f32 */
    size_t clipped, transparent; /* pixels with a clipped channel; pixels with an alpha below 1 */
    size_t outside;              /* that have a color which the output does not make */
} shd_photo;

/* Undoes the output's colors at `count` pixels of the samples, by Newton's method on the transform:
 * any that can be inverted there. *out is of r->arena. SHD_SCENE, with the output's place: it shows
 * no color, or codes where the photo has floats. SHD_MEMORY, SHD_CANCELLED. */
shd_status shd_photo_undo(shd_rendering *r, const shd_scene *scene, const shd_samples *samples,
                          shd_format format, const uint32_t *pixels, size_t count, shd_photo *out,
                          shd_error *error);
