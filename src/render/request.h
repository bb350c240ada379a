/* A request's inside. */
#pragma once

#include "assets/store.h"
#include "render/rendering.h"

/* A mesh of the store that the request's scene has, so that it stays. */
typedef struct shd_held_mesh {
    struct shd_held_mesh *next;
    shd_digest digest;
    shd_stored *stored;
} shd_held_mesh;

/* A picture that its documents name (render/pictures.h). */
typedef struct shd_held_picture shd_held_picture;
/* A map of an environment that is a picture (render/maps.h). */
typedef struct shd_held_map shd_held_map;

struct shd_request {
    shd_rendering rendering; /* the engine, the arena, the plan, the times */
    shd_limits limits;       /* the engine's, the memory within the budget */
    atomic_bool cancelled;
    atomic_bool loose_decoder; /* one ran without its filter of system calls */
    shd_color_lease *lease;
    bool full, crowded; /* as another arena of it has been */
    shd_report report;
    const shd_scene *scene;          /* NULL: it has a sheet */
    struct shd_contact_sheet *sheet; /* NULL: it has a scene */
    shd_batch *batch;                /* the sheet's, owned */
    struct shd_side *side;           /* the picture that is compared, or NULL */
    struct shd_pair *pair;           /* NULL: it is of one scene; in the arena */
    shd_held_mesh *held;
    shd_held_picture *held_pictures;
    uint64_t held_bytes;       /* of pictures and maps, as the limit `memory` counts them */
    struct shd_wished *wished; /* pictures that the scene names */
    shd_held_map *held_maps;
    struct shd_held_table *tables;
    bool held_full; /* the arena had no room to hold more */
    char etag[33];
    shd_picture *pictures; /* one an output */
    size_t picture_count;
    shd_reused reused;
};

/* The status with which a request ends. Stages say SHD_MEMORY whenever an arena gives nothing. If
 * its cap was not the reason, that becomes SHD_CROWDED or SHD_EXHAUSTED, in `error` or the report
 * too. */
shd_status shd_request_blame(const shd_request *request, shd_status status, shd_error *error);
shd_status shd_request_blame_report(shd_request *request, shd_status status);

/* Loads what the formats of the pictures take. Errors are those of shd_image_prepare, at the place
 * where the document names the format. */
shd_status shd_request_prepare_formats(shd_request *request, shd_error *error);

/* Of all that the request has read or made, makes the mesh alone a thing of the store: see
 * shd_request_keep_mesh. */
shd_status shd_request_keep_made(shd_request *request, const shd_mesh *mesh,
                                 const shd_digest *digest, const char *client, bool *known,
                                 shd_error *error);

/* For reading the request's scene: meshes of the engine's store, pictures, and maps of these, which
 * it then holds. */
shd_shelf shd_shelf_of(shd_request *request);

/* Whether the request may have so many bytes more, by its limit `memory`. `what`: "picture". */
shd_status shd_request_room_for(const shd_request *request, const char *what, uint64_t bytes,
                                shd_error *error);

/* Ends its hold of pictures. */
void shd_request_drop_pictures(shd_request *request);

/* Seconds of one processor that the plan is expected to take, by the table of its kernels. */
double shd_rendering_seconds(const shd_rendering *r);

struct shd_film;

/* Reserves memory for what the plan takes: what is not prepared of the film, the outputs (unless
 * `film` is NULL) and, if light is to be found, what each thread works in that may help. SHD_LIMIT
 * if there never is so much, SHD_CROWDED if there is not at the moment. */
shd_status shd_rendering_admit(shd_rendering *r, const struct shd_film *film, bool lights,
                               shd_error *error);
