/* Light without a material: what a scene's objects show with coefficients of 1. */
#pragma once

#include "render/rendering.h"

typedef struct shd_bases {
    shd_rendering *r;
    const shd_scene *scene; /* with the materials below, which are black */
    shd_object *objects;
    shd_material *materials; /* that of the objects in question, and that of the others */
    shd_lobe *lobes;
    shd_layer *layers;
    shd_output *output;
    const shd_render_options *options; /* or NULL */
    int done;                          /* renderings */
} shd_bases;

/* Prepares the bases of objects ([object_count] of `chosen`) under the model of their material. All
 * other objects are black, but stop light where the scene traces shadows; mirrors and glass are
 * left out. The tier is the exact one. *out is of r->arena. SHD_LIMIT: `lobes` exponents at once,
 * or the whole, is more than may be asked for. */
shd_status shd_bases_prepare(shd_rendering *r, const shd_scene *scene, const bool *chosen,
                             shd_model model, const shd_render_options *options, shd_bases *out,
                             shd_error *error);

/* Renders how much of each pixel the objects are, coverage[pixels], and the light of kd = 1,
 * diffuse[pixels][3]. */
shd_status shd_bases_diffuse(shd_bases *bases, float *coverage, float *diffuse, shd_error *error);

/* Renders the light of ks = 1 for up to SHD_FIT_LOBES exponents: out[lobe] is [count][3], of
 * `pixels`. */
shd_status shd_bases_lobes(shd_bases *bases, const double *exponents, size_t lobes,
                           const uint32_t *pixels, size_t count, float **out, shd_error *error);
