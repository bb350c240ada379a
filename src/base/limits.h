/* What one request may ask for: checked before work is done. A refusal names the limit. */
#pragma once

#include <stdint.h>

typedef struct shd_limits {
    uint64_t pixels;    /* rendered pixels: those of `region` if there is one */
    uint64_t samples;   /* rendered pixels times samples a pixel */
    uint64_t lights;    /* entries of `lights` */
    uint64_t objects;   /* entries of `objects` */
    uint64_t triangles; /* of all meshes and tessellated shapes together */
    /* Samples times `lights` times terms: diffuse, and each specular lobe. */
    uint64_t light_samples;
    uint64_t object_lights; /* objects times lights */
    uint64_t work;          /* seconds of one processor that the plan is expected to take */
    uint64_t body;          /* bytes of a scene document */
    uint64_t memory;        /* bytes of a request's arena, and the least that the scene needs */
} shd_limits;
