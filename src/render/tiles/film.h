/* The film: the picture in the working space, before any output's colors, and the layers that are
 * wanted. If nobody needs these floats it has the samples of the one output instead. */
#pragma once

#include "image/pack.h"
#include "render/rendering.h"
#include "sight/sight.h"

struct shd_recall;

typedef struct shd_film {
    int width, height; /* of the region */
    float *rgba;       /* [height][width][4]: straight alpha, finite. NULL if `codes` is not */
    /* [plane_count]. Plane 0, the beauty, is NULL: it is rgba. The others are [height][width][3],
     * multiplied by coverage, without background. */
    float **planes;
    /* Of the sample that is nearest to the camera. NULL: not wanted. */
    float *normal, *position; /* [height][width][3]; 0 if nothing is hit */
    float *depth;             /* [height][width]; infinity if nothing is hit */
    float *object;            /* [height][width]; -1 if nothing is hit */
    float *bound;             /* [height][width]: of the pixel's linear error; NULL: not wanted */
    /* Set before rendering if colors go straight to codes: the opaque beauty is stored as `samples`
     * of `layout`, and no other part of the film is made. */
    const shd_color_codes *codes;
    shd_pack layout;
    unsigned char *samples;
} shd_film;

/* Renders the scene's tiles on the pool. `film` has its codes set or is zero. `sight` is NULL if
 * `recall` has the picture's light; `recall` and `options` may be NULL. Adds to r->times and
 * its counts; the story's stage is its caller's. */
shd_status shd_film_render(shd_rendering *r, const shd_sight *sight,
                           const struct shd_recall *recall, const shd_render_options *options,
                           shd_film *film, shd_error *error);

/* Bytes of a film's floats: of the planes, the beauty among them, and of the data layers. */
uint64_t shd_film_size(const shd_raster *raster, size_t plane_count,
                       const bool wants[SHD_LAYER_KINDS]);

/* Bytes that one thread works in, if the plan's light is not recalled. */
uint64_t shd_film_scratch_size(const shd_plan *plan);

/* Holds values in [least, largest], and a NaN as 0. Returns how many were changed. */
uint64_t shd_saturate(float *values, size_t count, float least, float largest);
