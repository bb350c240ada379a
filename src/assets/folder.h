/* The operator's pictures: the files of one folder, which documents name.
 *
 * The folder is listed when it is opened, and files are read when somebody asks for them, never
 * written. Names are those of files: of the formats that are read here, up to 72 letters, digits
 * and . _ - (and no . in front). Others are passed over, and folders in it are not looked into; so
 * no text from a client ever becomes a path. A file that has changed is noticed when the folder is
 * opened again, or its bytes are read again. Any thread. */
#pragma once

#include <stdbool.h>
#include <stddef.h>

#include "base/digest.h"
#include "base/status.h"

typedef struct shd_asset_folder shd_asset_folder;

enum { SHD_ASSET_NAME = 72 }; /* the longest name: 64 digits of a SHA-256 and a suffix fit */

/* SHD_CONFIG, with the path: there is no such folder, it cannot be read, or it has more than 10,000
 * pictures. */
shd_status shd_asset_folder_open(const char *path, shd_asset_folder **out, shd_error *error);
void shd_asset_folder_drop(shd_asset_folder *folder); /* NULL is fine */

/* The names, sorted. */
const char *const *shd_asset_names(const shd_asset_folder *folder, size_t *count);

/* Where in that list a name is. False: it is not there. */
bool shd_asset_find(const shd_asset_folder *folder, const char *name, size_t *index);

/* The same of a file that is called as a digest, by its 64 digits, and any suffix. Whether it holds
 * what it is called is not looked at. */
bool shd_asset_find_digits(const shd_asset_folder *folder, const char *digits, size_t *index);

/* The digest of a file as it was read last. False: it was not. */
bool shd_asset_known(shd_asset_folder *folder, size_t index, shd_digest *out);

/* Reads a file of `most` bytes at most, which the caller frees, and notes its digest. SHD_SCENE: it
 * cannot be read (any more). SHD_LIMIT: it is longer. SHD_EXHAUSTED. */
shd_status shd_asset_read(shd_asset_folder *folder, size_t index, size_t most, void **data,
                          size_t *size, shd_digest *digest, shd_error *error);
