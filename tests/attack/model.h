/* The model, evaluated anew: docs/model.md in long double or 113-bit floats, from the document's
 * text, a ray at a time, every object and every light looked at by every ray. Nothing here is of
 * src/, so that what both say is no mistake of one; only where samples lie in a pixel is told by
 * the caller.
 *
 * A sample is undecided where the model jumps within rounding of it: rays beside it, or a second
 * surface at the same distance, have another case (object, part, side, lights before or behind the
 * surface, inside or outside their cones). "Beside" is max(1e-9, 256 eps C / f) pixels, eps = 2^-52
 * the rounding of f64, C the size of the coordinates of eye, hit and object, and f what a pixel
 * covers at the hit. So is one of a round surface whose N.(light - p) is below 64 eps of these
 * coordinates. Such a sample has the range of all values that are found there; any other one
 * value.
 *
 * Models beside Phong's and lights with a shape are reflect.h's, shadows occlude.h's, environments
 * sky.h's, patterns prints.h's. Of spectra it
 * knows those for which light is the product of two colors.
 *
 * Documents are those of scenes.h: valid, their colors numbers of the working space. A thread
 * may use a model at a time. */
#ifndef SHD_ATTACK_MODEL_H
#define SHD_ATTACK_MODEL_H

#include <stdbool.h>
#include <stddef.h>

typedef struct model model;

typedef struct model_pixel {
    double low[4], high[4]; /* r, g, b, alpha; straight: those of samples that hit,
                                  where the background is transparent */
    int undecided;          /* of its samples */
} model_pixel;

/* pi f_r (N.L) / kd of a table, for facets of the reflectance kd: N, V and L are unit. */
typedef long double table_function(const void *table, const long double nvl[3][3], long double kd);

typedef struct model_program {
    /* `offsets`: [samples][2], in pixels from the pixel's top left corner. NULL: memory. */
    model *(*read)(const char *json, const double (*offsets)[2]);
    void (*evaluate)(const model *, int x, int y, model_pixel *out);
    /* What objects of microgeometry reflect, which it does not know by itself: all of them have the
     * table. */
    void (*tell)(model *, table_function *weigh, const void *table);
    /* The texels of the document's light `index`, an environment: [height][width][3]. False:
     * memory. */
    bool (*surround)(model *, size_t index, int width, int height, const float *texels);
    void (*drop)(model *);
} model_program;

/* In the compiler's long double, and in floats of 113 bits where it has others. */
extern const model_program model_long, model_quad;

#endif
