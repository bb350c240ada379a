/* The engine's and the request's insides, shared within render/. */
#ifndef SHD_RENDER_ENGINE_H
#define SHD_RENDER_ENGINE_H

#include <stdatomic.h>

#include "assets/store.h"
#include "base/pool.h"
#include "base/spares.h"
#include "color/color.h"
#include "plan/plan.h"
#include "render/tiles/reuse.h"
#include "scene/scene.h"
#include "shaded.h"
#include "sight/sight.h"

struct shd_engine {
    bool borrows; /* all but colors and limits is another engine's */
    shd_pool *pool;
    shd_budget *budget; /* NULL: memory is counted by the request only */
    shd_spares *spares; /* of requests' arenas */
    shd_color_config *color;
    shd_reuse *reuse;
    shd_store *store; /* of meshes */
    shd_limits limits;
    shd_isa isa;      /* of the kernels */
    bool floats_only; /* for tests: colors never go straight to codes, which gives the same bytes */
};

struct shd_request {
    shd_engine *engine;
    shd_arena *arena;
    shd_report report;
    const shd_scene *scene;
    struct shd_held *held; /* what the scene has of the engine's store */
    bool unheld;           /* there was no memory to hold more */
    char etag[33];
    atomic_bool cancelled;
    bool full, crowded; /* as another arena of it has been */
    shd_limits limits;  /* the engine's, its memory within the budget */
    shd_times times;
    const shd_plan *plan;
    shd_picture *pictures; /* one an output */
    size_t picture_count;
    uint64_t saturated;
    shd_reused reused;
};

/* A thing of the engine's store that a request holds, so that it stays. */
typedef struct shd_held {
    struct shd_held *next;
    shd_digest digest;
    shd_stored *thing;
} shd_held;

/* The meshes that are kept, for a scene of the request: it holds those that are found. NULL: none
 * are kept. */
const shd_mesh_shelf *shd_request_shelf(shd_request *request, shd_mesh_shelf *out);
size_t shd_request_held(const shd_request *request); /* bytes of what it holds */
void shd_request_let_go(shd_request *request);

/* The status of a request's report: where the arena's cap was not the reason for SHD_MEMORY it
 * becomes SHD_EXHAUSTED, and so does the report. */
shd_status shd_request_blame_report(shd_request *request, shd_status status);

/* The status with which a request ends. Stages say SHD_MEMORY wherever an arena gives nothing:
 * where its cap was not the reason it becomes SHD_CROWDED or SHD_EXHAUSTED, in `error` too. */
shd_status shd_request_blame(const shd_request *request, shd_status status, shd_error *error);

/* Loads what its pictures' formats take, before anything is rendered; errors as of
 * shd_image_prepare, where the document names the format. */
shd_status shd_request_prepare_formats(shd_request *request, shd_error *error);

struct shd_film;

/* Whether there is memory for what request->plan takes: what is not prepared of the film, the
 * outputs, unless `film` is NULL, and, where light is to be found, what each thread works in that
 * may help. SHD_LIMIT where there never is, SHD_CROWDED where there is not just now; else it is
 * reserved. */
shd_status shd_request_admit(shd_request *request, const struct shd_film *film, bool lights,
                             shd_error *error);

#endif
