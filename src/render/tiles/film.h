/* The film: the picture in the working space before any output's colors, and the layers that
 * outputs want; or, where nobody needs these floats, one output's samples at once. Filled tile by
 * tile on the pool. */
#ifndef SHD_RENDER_TILES_FILM_H
#define SHD_RENDER_TILES_FILM_H

#include "image/image.h"
#include "render/rendering.h"
#include "sight/sight.h"

struct shd_recall;

typedef struct shd_film {
    int width, height; /* of the region */
    float *rgba;       /* [height][width][4]: straight alpha, finite. NULL where `codes` is not */
    float **planes;    /* [plane_count]; plane 0 (the beauty) is NULL: it is rgba. Others are
                          [height][width][3], multiplied by coverage, without background */
    float *normal;     /* [height][width][3] or NULL; of the sample nearest to the camera, as */
    float *position;   /* are these; where nothing is hit: 0, 0, */
    float *depth;      /* [height][width]: infinity, */
    float *object;     /* and -1 */
    /* Set before rendering where colors go straight to codes: the opaque beauty is stored as
     * `samples` of `layout`, and no other part of the film is made. */
    const shd_color_codes *codes;
    shd_layout layout;
    unsigned char *samples;
} shd_film;

/* Renders the scene. `film` has its codes set or is zero. `sight` is NULL if `recall` has the
 * picture's light; `recall` and `options` may be NULL. Adds to r->times and r->saturated, and
 * leaves the stage of the story to its caller. */
shd_status shd_film_render(shd_rendering *r, const shd_sight *sight,
                           const struct shd_recall *recall, const shd_render_options *options,
                           shd_film *film, shd_error *error);

/* Bytes of a film's floats: of the beauty and the other planes, and of the data layers among those
 * that are wanted. */
uint64_t shd_film_size(const shd_raster *raster, size_t plane_count,
                       const bool wants[SHD_LAYER_KINDS]);

/* Bytes of working memory that one thread takes for it from the rendering's arena, where the plan's
 * light is not recalled. */
uint64_t shd_film_scratch_size(const shd_plan *plan);

/* Holds values in [least, largest]; not-a-number becomes 0. Returns how many were changed. */
uint64_t shd_saturate(float *values, size_t count, float least, float largest);

#endif
