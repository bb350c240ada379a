/* What a scene will take, told before anything is made from it. */
#ifndef SHD_RENDER_TELL_ESTIMATE_H
#define SHD_RENDER_TELL_ESTIMATE_H

#include "scene/scene.h"

/* Bytes that rendering the scene takes from its arena at least: the film, its layers, and what the
 * largest output is made in. Never more than it really takes, so that what would fit is not
 * refused; what threads work in depends on the plan (shd_film_scratch_size), and what is small
 * beside a large picture is left to the arena's cap. */
uint64_t shd_estimate_memory(const shd_scene *scene);

/* Samples times lights times terms, of the material that has most; and objects times lights. They
 * saturate. */
uint64_t shd_estimate_light_samples(const shd_scene *scene);
uint64_t shd_estimate_object_lights(const shd_scene *scene);

/* How much there is to compute, in units of about one light on one sample in single precision:
 * tells large work from small, to a factor of a few. Saturates. */
uint64_t shd_estimate_work(const shd_scene *scene);

#endif
