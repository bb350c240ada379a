/* The film: the picture in the working space before any output's colors, and the layers that
 * outputs want. Filled tile by tile on the pool. */
#ifndef SHD_RENDER_FILM_H
#define SHD_RENDER_FILM_H

#include "render/engine.h"

typedef struct shd_film {
    int width, height; /* of the region */
    float *rgba;       /* [height][width][4]: straight alpha, finite */
    float **planes;    /* [plane_count]; plane 0 (the beauty) is NULL: it is rgba. Others are
                          [height][width][3], multiplied by coverage, without background */
    float *normal;     /* [height][width][3] or NULL; of the sample nearest to the camera, as */
    float *position;   /* are these; where nothing is hit: 0, 0, */
    float *depth;      /* [height][width]: infinity, */
    float *object;     /* and -1 */
} shd_film;

/* Samples of a tile: enough work to share, small enough to stay in a core's cache. A tile of one
 * sample a pixel has sides of SHD_TILE_SIDE. */
enum { SHD_TILE_SAMPLES = 4096, SHD_TILE_SIDE = 64 };

/* Renders the scene. `progress` may be NULL. Adds to request->times and ->saturated. */
shd_status shd_film_render(shd_request *request, const shd_sight *sight,
                           const shd_render_options *options, shd_film *film, shd_error *error);

/* Puts a tile into the film: the beauty over its background, the layers. `radiance` is
 * [plane][channel][sample], undefined where nothing is hit. Returns the saturated values. */
uint64_t shd_filter_tile(const shd_plan *plan, const shd_gbuffer *seen, const double *radiance,
                         shd_tile tile, shd_film *film);

/* Holds values in [least, largest]; not-a-number becomes 0. Returns how many were changed. */
uint64_t shd_saturate(float *values, size_t count, float least, float largest);

#endif
