#include "render/westin_tables.h"

#include <pthread.h>
#include <stdlib.h>
#include <string.h>

#include "render/rendering.h"

/* A simulation that runs; it is on the stack of the thread that does it. */
typedef struct flight {
    struct flight *next;
    shd_digest digest;
} flight;

struct shd_westin_tables {
    pthread_mutex_t mutex;
    pthread_cond_t landed;
    shd_store *store;
    shd_budget *budget;
    flight *flights;
    uint64_t simulations;
};

shd_status shd_westin_tables_new(size_t cap, shd_budget *budget, shd_westin_tables **out,
                                 shd_error *error) {
    shd_westin_tables *tables = calloc(1, sizeof *tables);
    if (!tables) return shd_fail(error, SHD_EXHAUSTED, "", "out of memory");
    const shd_status status = shd_store_new(cap, budget, &tables->store, error);
    if (status != SHD_OK) {
        free(tables);
        return status;
    }
    pthread_mutex_init(&tables->mutex, NULL);
    shd_cond_init(&tables->landed);
    tables->budget = budget;
    *out = tables;
    return SHD_OK;
}

void shd_westin_tables_drop(shd_westin_tables *tables) {
    if (!tables) return;
    shd_store_drop(tables->store);
    pthread_cond_destroy(&tables->landed);
    pthread_mutex_destroy(&tables->mutex);
    free(tables);
}

size_t shd_westin_tables_trim(void *context, size_t bytes) {
    shd_westin_tables *tables = context;
    const size_t kept = shd_store_load_of(tables->store).bytes;
    return shd_store_shrink(tables->store, kept > bytes ? kept - bytes : 0);
}

shd_westin_load shd_westin_tables_load_of(shd_westin_tables *tables) {
    const shd_store_load load = shd_store_load_of(tables->store);
    pthread_mutex_lock(&tables->mutex);
    const shd_westin_load out = {load.bytes, load.things, tables->simulations};
    pthread_mutex_unlock(&tables->mutex);
    return out;
}

/* ---- One table. ---- */

static shd_digest name_of(const shd_microgeometry *micro) {
    const double values[] = {(double)micro->type, micro->angle + 0.0, micro->warp + 0.0,
                             micro->weft + 0.0, micro->slope + 0.0};
    return shd_digest_of(values, sizeof values);
}

/* The tables' mutex is held. */
static bool is_in_flight(const shd_westin_tables *tables, const shd_digest *digest) {
    const flight *f = tables->flights;
    while (f && !shd_digest_same(&f->digest, digest)) f = f->next;
    return f;
}

/* Finds the table, waits for whoever makes it, or begins to make it, which is in flight then: *out
 * is NULL. */
static shd_status find_or_begin(shd_westin_tables *tables, flight *own,
                                const atomic_bool *cancelled, shd_stored **out, shd_error *error) {
    static const double glance = 0.01; /* how often waiting threads look at their flag */
    shd_status status = SHD_OK;
    pthread_mutex_lock(&tables->mutex);
    while (!(*out = shd_store_find(tables->store, SHD_THING_TABLE, &own->digest)) &&
           is_in_flight(tables, &own->digest)) {
        const struct timespec until = shd_timespec(shd_now() + glance);
        pthread_cond_timedwait(&tables->landed, &tables->mutex, &until);
        if (!shd_is_cancelled(cancelled)) continue;
        status = shd_fail(error, SHD_CANCELLED, "", "the simulation was cancelled");
        break;
    }
    if (!*out && status == SHD_OK) {
        own->next = tables->flights;
        tables->flights = own;
    }
    pthread_mutex_unlock(&tables->mutex);
    return status;
}

static shd_status simulate(shd_westin_tables *tables, const shd_digest *digest,
                           const shd_microgeometry *micro, const atomic_bool *cancelled,
                           shd_stored **out, shd_error *error) {
    shd_stored *made = NULL;
    if (!shd_budget_take(tables->budget, SHD_WESTIN_SCRATCH))
        return shd_fail(error, SHD_CROWDED, "", "the process may take no more memory just now");
    shd_status status =
        shd_stored_new(tables->store, SHD_THING_TABLE, digest, sizeof(shd_westin), &made, error);
    if (status == SHD_OK) {
        status = shd_westin_make(micro, cancelled, shd_stored_bytes(made), error);
        if (status != SHD_OK) shd_stored_drop(made);
    }
    shd_budget_give(tables->budget, SHD_WESTIN_SCRATCH);
    if (status != SHD_OK) return status;
    /* A table that cannot be kept is as good for the one who made it. */
    bool known;
    shd_error unkept;
    shd_store_put(tables->store, made, "", &known, &unkept);
    *out = made;
    return SHD_OK;
}

static void land(shd_westin_tables *tables, const flight *own, bool finished) {
    pthread_mutex_lock(&tables->mutex);
    flight **at = &tables->flights;
    while (*at != own) at = &(*at)->next;
    *at = own->next;
    tables->simulations += finished;
    pthread_cond_broadcast(&tables->landed);
    pthread_mutex_unlock(&tables->mutex);
}

shd_status shd_westin_tables_get(shd_westin_tables *tables, const shd_microgeometry *micro,
                                 const atomic_bool *cancelled, shd_stored **out, shd_error *error) {
    flight own = {NULL, name_of(micro)};
    shd_stored *found = NULL;
    shd_status status = find_or_begin(tables, &own, cancelled, &found, error);
    if (status == SHD_OK && !found) {
        status = simulate(tables, &own.digest, micro, cancelled, &found, error);
        land(tables, &own, status == SHD_OK);
    }
    if (status == SHD_OK) *out = found;
    return status;
}

/* ---- A request's tables. ---- */

void shd_held_tables_drop(shd_held_table *held) {
    while (held) {
        shd_held_table *next = held->next;
        shd_stored_drop(held->stored);
        free(held);
        held = next;
    }
}

static shd_status hold_table(shd_rendering *r, const shd_microgeometry *micro,
                             const shd_westin **out, shd_error *error) {
    size_t count = 0;
    for (const shd_held_table *h = *r->tables; h; count += !h->glow, h = h->next)
        if (!h->glow && shd_same_microgeometry(&h->micro, micro)) {
            *out = shd_stored_bytes(h->stored);
            return SHD_OK;
        }
    if (count == SHD_WESTIN_MOST)
        return shd_fail(error, SHD_SCENE, "/materials",
                        "the scene has more than %d different microgeometries", SHD_WESTIN_MOST);
    /* The request may outlive the rendering, and its arena. */
    shd_held_table *held = calloc(1, sizeof *held);
    if (!held) return shd_fail(error, SHD_EXHAUSTED, "", "out of memory");
    const shd_status status =
        shd_westin_tables_get(r->engine->westin, micro, r->cancelled, &held->stored, error);
    if (status != SHD_OK) {
        free(held);
        return status;
    }
    held->micro = *micro;
    held->next = *r->tables;
    *r->tables = held;
    *out = shd_stored_bytes(held->stored);
    return SHD_OK;
}

shd_status shd_rendering_simulate(shd_rendering *r, const shd_scene *scene,
                                  const shd_westin *const **out, shd_error *error) {
    const shd_westin **tables = NULL;
    for (size_t m = 0; m < scene->material_count; m++) {
        const shd_microgeometry *micro = scene->materials[m].microgeometry;
        if (!micro) continue;
        if (!tables) tables = shd_arena_zalloc(r->arena, scene->material_count, sizeof *tables);
        if (!tables) return shd_rendering_full(r, "plan", error);
        const shd_status status = hold_table(r, micro, &tables[m], error);
        if (status != SHD_OK) return status;
    }
    *out = tables;
    return SHD_OK;
}
