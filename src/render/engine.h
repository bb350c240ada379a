/* The engine's inside: what all requests share. */
#pragma once

#include <pthread.h>
#include <stdatomic.h>

#include "base/pool.h"
#include "base/spares.h"
#include "color/color.h"
#include "scene/scene.h"
#include "shaded.h"

struct shd_reuse;
struct shd_store;
struct shd_westin_tables;
struct shd_asset_folder;

struct shd_engine {
    bool borrows; /* all but colors, materials, named pictures and limits belongs to another engine
                   */
    shd_pool *pool;
    shd_budget *budget; /* NULL: only requests count their memory */
    shd_spares *spares; /* of requests' arenas */
    shd_color_config *color;
    pthread_mutex_t reading;         /* of the library */
    shd_library *library;            /* NULL: nobody asked for it yet */
    shd_catalog catalog;             /* that of `color`, with the library */
    struct shd_reuse *reuse;         /* what earlier pictures have left */
    struct shd_store *store;         /* of meshes, scenes and pictures */
    struct shd_asset_folder *assets; /* the operator's pictures; NULL: none */
    struct shd_westin_tables *westin;
    struct shd_store *glows; /* of tables of environments */
    shd_limits limits;
    atomic_ullong *tiles;  /* [2] of this engine and those that borrow: wanted when done, or not */
    shd_isa isa;           /* of the kernels */
    bool scenes_elsewhere; /* see shd_engine_options */
    bool floats_only; /* for tests: no colors go straight to codes, which gives the same bytes */
};

/* The materials that documents may name. NULL: memory is short. Any thread. */
const shd_library *shd_engine_library(const shd_engine *engine);
