#include "render/held.h"

typedef struct shd_held_thing {
    struct shd_held_thing *next;
    shd_digest digest;
    shd_stored *stored;
} thing;

static const shd_mesh *find_mesh(void *context, const shd_digest *digest) {
    shd_held *held = context;
    for (const thing *t = held->first; t; t = t->next)
        if (shd_digest_same(&t->digest, digest)) return shd_stored_bytes(t->stored);
    thing *added = shd_arena_alloc(held->arena, 1, sizeof *added);
    held->full = held->full || !added;
    shd_stored *stored = added ? shd_store_find(held->store, digest) : NULL;
    if (!stored) return NULL;
    *added = (thing){held->first, *digest, stored};
    held->first = added;
    return shd_stored_bytes(stored);
}

const shd_mesh_shelf *shd_held_shelf(shd_held *held, shd_mesh_shelf *out) {
    if (!shd_store_load_of(held->store).cap) return NULL;
    *out = (shd_mesh_shelf){find_mesh, held};
    return out;
}

size_t shd_held_bytes(const shd_held *held) {
    size_t bytes = 0;
    for (const thing *t = held->first; t; t = t->next) bytes += shd_stored_size(t->stored);
    return bytes;
}

void shd_held_drop(shd_held *held) {
    for (const thing *t = held->first; t; t = t->next) shd_stored_drop(t->stored);
    held->first = NULL;
}
