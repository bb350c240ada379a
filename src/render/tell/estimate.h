/* What a scene will take, estimated before anything is made from it. */
#pragma once

#include "scene/scene.h"

/* The least bytes that rendering the scene takes from its arena: the film, its layers, and what the
 * largest output is made in. It is never more than what is taken, so that nothing is refused that
 * would fit. The plan tells what threads work in (shd_film_scratch_size). */
uint64_t shd_estimate_memory(const shd_scene *scene);

/* Samples times lights times terms of the material that has the most; and objects times lights.
 * They saturate. */
uint64_t shd_estimate_light_samples(const shd_scene *scene);
uint64_t shd_estimate_object_lights(const shd_scene *scene);

/* The part of the work below that a plan alone takes: tables of environments, unless they are kept.
 */
uint64_t shd_estimate_planning(const shd_scene *scene);

/* How much there is to compute, in units of about one light on one sample in single precision:
 * right to a factor of a few. Saturates. */
uint64_t shd_estimate_work(const shd_scene *scene);
