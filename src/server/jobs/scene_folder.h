/* Scenes that are kept for links in a folder that the operator names, beside those in memory.
 *
 * A scene's file has its digest's digits and ".json" as name, and the bytes that the digest is of.
 * It appears whole, by a rename, and is on the disk before its client is told so. What is read is
 * held against its name. Any number of daemons may share a folder, and any file may be deleted at
 * any time; nothing but digests ever becomes a name, and symbolic links are not followed. A name
 * that ends in ".new" is of a file that is being written or, if it is old, of a daemon that was
 * killed then.
 *
 * Files are for workers, never for the I/O thread; but for shd_scene_folder_lacks, any thread. */
#pragma once

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/digest.h"
#include "server/answer/reply.h"
#include "server/ops/metrics.h"
#include "shaded.h"

typedef struct shd_scene_folder shd_scene_folder;

/* Counts in `metrics`, which outlives it. SHD_CONFIG if there is no such folder, or nobody may read
 * in it; that nothing can be written there is a warning in the log. */
shd_status shd_scene_folder_open(const char *path, shd_metrics *metrics, shd_scene_folder **out,
                                 shd_error *error);
void shd_scene_folder_drop(shd_scene_folder *folder); /* NULL is fine */

/* Writes the file of a text's digest, unless it is there with just these bytes, which `known`
 * tells. SHD_INTERNAL if it cannot be written; the log tells why. */
shd_status shd_scene_folder_keep(shd_scene_folder *folder, const shd_digest *digest,
                                 const char *text, size_t length, bool *known, shd_error *error);

/* The scene of a digest's file, which is kept in memory from now on as the client's, if there is
 * room. The caller drops it. SHD_MISSING: there is no such file, or its bytes are others than its
 * name says. SHD_LIMIT: it is longer than `most`. SHD_INTERNAL: it cannot be read. Errors of
 * memory. The log tells the operator's part of it. */
shd_status shd_scene_folder_find(shd_scene_folder *folder, shd_engine *engine,
                                 const shd_digest *digest, uint64_t most, const char *client,
                                 shd_kept_scene **out, const char **text, size_t *length,
                                 shd_error *error);

/* The 404 of a digest by which nothing is kept. Returns false. */
bool shd_scene_folder_lacks(shd_reply *reply);
