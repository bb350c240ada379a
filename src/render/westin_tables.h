/* The tables of microgeometries (shade/westin.h), kept between requests by what they are made of.
 *
 * Tables hold no color, so that all materials of a microgeometry share one. They are kept in the
 * order of their last use, and stay while a request holds them. Requests that want a table at once
 * wait for the one that simulates it; if that one is cancelled, another one begins. Any thread. */
#pragma once

#include "assets/store.h"
#include "shade/westin.h"

typedef struct shd_westin_tables shd_westin_tables;

/* Keeps `cap` bytes at most, as far as `budget` gives them, which outlives it. */
shd_status shd_westin_tables_new(size_t cap, shd_budget *budget, shd_westin_tables **out,
                                 shd_error *error);
void shd_westin_tables_drop(shd_westin_tables *tables); /* nobody holds any; NULL is fine */

/* The table of a microgeometry, found or simulated; its bytes are a shd_westin, and the caller
 * drops it. SHD_CANCELLED soon after `cancelled` (or NULL) is raised. SHD_CROWDED, SHD_EXHAUSTED.
 */
shd_status shd_westin_tables_get(shd_westin_tables *tables, const shd_microgeometry *micro,
                                 const atomic_bool *cancelled, shd_stored **out, shd_error *error);

/* Gives way (base/budget.h): forgets the oldest tables. */
size_t shd_westin_tables_trim(void *tables, size_t bytes);

typedef struct shd_westin_load {
    size_t bytes, count;  /* kept */
    uint64_t simulations; /* that were finished */
} shd_westin_load;

shd_westin_load shd_westin_tables_load_of(shd_westin_tables *tables);

struct shd_rendering;

/* Finds the tables of all of the scene's materials that want one, which the request holds from then
 * on: [material_count], NULL where none is wanted; *out is NULL if none is at all. SHD_SCENE: they
 * are more than SHD_WESTIN_MOST. */
enum { SHD_WESTIN_MOST = 16 };
shd_status shd_rendering_simulate(struct shd_rendering *r, const shd_scene *scene,
                                  const shd_westin *const **out, shd_error *error);

/* A table that a request holds. */
typedef struct shd_held_table {
    struct shd_held_table *next;
    bool glow; /* of an environment, by this name; else of a microgeometry */
    shd_digest name;
    shd_microgeometry micro;
    shd_stored *stored;
} shd_held_table;

/* Ends all holds of a request. */
void shd_held_tables_drop(shd_held_table *held);
