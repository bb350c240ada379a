/* The kept meshes that a request holds, so that they stay. Inside of render/. */
#pragma once

#include "assets/store.h"
#include "base/arena.h"
#include "scene/scene.h"

typedef struct shd_held {
    shd_store *store;
    shd_arena *arena; /* of the list */
    struct shd_held_thing *first;
    bool full; /* the arena had no room to hold more */
} shd_held;

/* The meshes that are kept, of which `held` gets those that a scene finds there. NULL: none are
 * kept. */
const shd_mesh_shelf *shd_held_shelf(shd_held *held, shd_mesh_shelf *out);
size_t shd_held_bytes(const shd_held *held);
void shd_held_drop(shd_held *held);
