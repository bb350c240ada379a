/* What pictures share: G-buffers and sums of light, kept between requests.
 *
 * Two kinds of records, each of all tiles of a picture:
 * - geometry: what rays hit. Its key is all that rays depend on (camera, raster, samples, objects),
 *   so that another light or shininess casts no ray;
 * - light: fragments. Its key adds lights and exponents, so that another color of a material leaves
 *   only multiplications, the output's colors and the file.
 *
 * A picture has the same bytes with records and without. Records are constant once published, live
 * while somebody uses them, and are forgotten in the order of their last use. Any thread. */
#pragma once

#include "shaded.h"

typedef struct shd_reuse shd_reuse;
typedef struct shd_record shd_record;

typedef struct shd_reuse_key {
    uint64_t low, high;
} shd_reuse_key;

typedef enum shd_record_kind { SHD_RECORD_GEOMETRY, SHD_RECORD_LIGHT } shd_record_kind;

/* Keeps `cap` bytes at most, as far as `budget` gives them, which outlives it. 0 keeps nothing. */
shd_status shd_reuse_new(size_t cap, shd_budget *budget, shd_reuse **out, shd_error *error);

/* Gives way (base/budget.h): forgets the oldest records that nobody uses. */
size_t shd_reuse_trim(void *reuse, size_t bytes);
void shd_reuse_drop(shd_reuse *reuse); /* when nobody uses a record any more; NULL is fine */

/* Whether anything may be kept. Else there is no need to make keys. */
bool shd_reuse_keeps(const shd_reuse *reuse);

/* The record of a key, which the caller drops. NULL: there is none. Counts hits and misses. */
shd_record *shd_reuse_find(shd_reuse *reuse, shd_record_kind kind, shd_reuse_key key);

/* A new record. Any number of threads may fill it, one a tile. NULL: nothing is kept, or memory is
 * short. */
shd_record *shd_record_new(shd_reuse *reuse, shd_record_kind kind, shd_reuse_key key,
                           size_t tile_count);

/* Memory for a tile of a record that is being filled, aligned to 64 bytes. NULL: the record, or
 * this piece with more than a mebibyte, is too large, and the record will not be published. */
void *shd_record_alloc(shd_record *record, size_t size);

/* A tile's content is whatever was put there, and NULL before. */
void shd_record_put(shd_record *record, size_t tile, void *content);
const void *shd_record_get(const shd_record *record, size_t tile);

/* Lets others find the record, if it is complete. The caller still drops it. */
void shd_record_publish(shd_record *record);
void shd_record_drop(shd_record *record); /* NULL is fine */

/* A step of idle workers (base/pool.h): makes a little memory ready that records will take next. */
bool shd_reuse_touch(void *reuse);

shd_reuse_load shd_reuse_load_of(shd_reuse *reuse);
