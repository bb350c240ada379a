/* A request's inside. Within render/. */
#pragma once

#include "render/held.h"
#include "render/rendering.h"

struct shd_request {
    shd_rendering rendering; /* the engine, the arena, the plan, the times */
    shd_limits limits;       /* the engine's, the memory within the budget */
    atomic_bool cancelled;
    bool full, crowded; /* as another arena of it has been */
    shd_report report;
    const shd_scene *scene;
    shd_held held; /* what the scene has of the engine's store */
    char etag[33];
    shd_picture *pictures; /* one an output */
    size_t picture_count;
    shd_reused reused;
};

/* The status of a request's report. It becomes SHD_EXHAUSTED, and so does the report, if the
 * arena's cap was not the reason for SHD_MEMORY. */
shd_status shd_request_blame_report(shd_request *request, shd_status status);

/* The status with which a request ends. Stages say SHD_MEMORY whenever an arena gives nothing. If
 * its cap was not the reason, that becomes SHD_CROWDED or SHD_EXHAUSTED, in `error` too. */
shd_status shd_request_blame(const shd_request *request, shd_status status, shd_error *error);

/* Loads what the formats of the pictures take, before anything is rendered. Errors are those of
 * shd_image_prepare, at the place where the document names the format. */
shd_status shd_request_prepare_formats(shd_request *request, shd_error *error);

struct shd_film;

/* Whether there is memory for what the plan takes: what is not prepared of the film, the outputs
 * (unless `film` is NULL) and, if light is to be found, what each thread works in that may help.
 * Reserves it. SHD_LIMIT if there never is so much, SHD_CROWDED if there is not at the moment. */
shd_status shd_rendering_admit(shd_rendering *r, const struct shd_film *film, bool lights,
                               shd_error *error);
