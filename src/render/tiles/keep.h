/* How the tiles of a picture are kept in records (reuse.h), and what the keys of these say. */
#pragma once

#include "render/tiles/fragments.h"
#include "render/tiles/reuse.h"
#include "sight/gbuffer.h"

/* What is known of a picture before it is rendered, and what it will leave. NULL: there is none. */
typedef struct shd_recall {
    const shd_record *light;    /* fragments of this very light */
    const shd_record *geometry; /* hits, if there is no `light` */
    shd_record *keep_light, *keep_geometry;
} shd_recall;

/* Looks the picture up. Pictures are not kept if they are of the exact tier, have layers or faceted
 * objects, or leave out lights within a tolerance. */
shd_recall shd_recall_open(shd_reuse *reuse, const shd_plan *plan);

/* Publishes what was kept if the picture is complete, and lets go of everything. */
void shd_recall_close(shd_recall *recall, bool complete);

/* Copies a tile's fragments into a record, as the tile's content. Does nothing if the record is
 * full. */
void shd_keep_fragments(shd_record *record, size_t tile, const shd_plan *plan,
                        const shd_fragments *fragments);

/* The content of a record of hits: those of a tile's casts, in their order, with the shots that
 * were asked for. */
typedef struct shd_kept_cast {
    struct shd_kept_cast *next;
    size_t shots;
    const uint16_t *shot_cell; /* [shots]: says which pixels they went to */
    int32_t object;            /* of all hits, if hits.object is NULL */
    shd_hits hits;             /* shot is NULL if every shot hit */
} shd_kept_cast;

/* Appends a cast's hits to those of a tile. */
void shd_keep_cast(shd_record *record, size_t tile, const shd_plan *plan, const uint16_t *shot_cell,
                   size_t shots, const shd_hits *hits);

/* The hits as they were. They are borrowed from the record and, as far as that does not hold them,
 * from `room`. */
void shd_recall_cast(const shd_kept_cast *cast, shd_hits *room, shd_hits *out);
