/* What the tiles of a picture are kept as in records (render/tiles/reuse.h), and what their keys
 * say. Inside of render/. */
#ifndef SHD_RENDER_TILES_KEEP_H
#define SHD_RENDER_TILES_KEEP_H

#include "render/tiles/reuse.h"
#include "render/tiles/tile.h"

/* What is known of a picture before it is rendered, and the records that it will leave: NULL
 * where there are none. */
typedef struct shd_recall {
    const shd_record *light;    /* fragments of this very light, or else */
    const shd_record *geometry; /* hits */
    shd_record *keep_light, *keep_geometry;
} shd_recall;

/* Looks the picture up. Pictures of the exact tier, with layers, with faceted objects or with
 * lights that are left out within a tolerance are not kept. */
shd_recall shd_recall_open(shd_reuse *reuse, const shd_plan *plan);

/* Publishes what was kept, if the picture is complete, and lets go of all. */
void shd_recall_close(shd_recall *recall, bool complete);

/* Copies a tile's fragments into a record; does nothing where the record is full. */
void shd_keep_fragments(shd_record *record, size_t tile, const shd_plan *plan,
                        const shd_fragments *fragments);

/* The fragments of a tile that was kept: borrowed from the record. */
const shd_fragments *shd_kept_fragments(const shd_record *record, size_t tile);

/* Hits of the casts of a tile, in their order, with the shots that were asked for. */
typedef struct shd_kept_cast {
    struct shd_kept_cast *next;
    size_t shots;
    const uint16_t *shot_cell; /* [shots]: says which pixels they went to */
    int32_t object;            /* all hits', where hits.object is NULL */
    shd_hits hits;             /* shot is NULL where every shot hit */
} shd_kept_cast;

/* Copies a cast's hits to a tile's end. */
void shd_keep_cast(shd_record *record, size_t tile, const shd_plan *plan, const uint16_t *shot_cell,
                   size_t shots, const shd_hits *hits);

/* The hits as they were: borrowed from the record, and from `room`'s arrays what it does not
 * hold. */
void shd_recall_cast(const shd_kept_cast *cast, shd_hits *room, shd_hits *out);

#endif
