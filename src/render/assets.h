/* Files of pictures as they are kept: decoded, and not converted. */
#pragma once

#include "assets/folder.h"
#include "decode/wire.h"
#include "image/read.h"
#include "render/request.h"

typedef struct shd_asset {
    shd_stored *thing; /* its caller drops it */
    shd_digest digest; /* of the file's bytes */
    const shd_decoded *picture;
    const void *samples; /* of `picture`; the thing's, as that is */
    /* What rules for files look at: the name of the operator's file, or one of its format. */
    char name[SHD_ASSET_NAME + 1];
} shd_asset;

/* The digest of the file that has a name, if that tells it or the file was read before. */
bool shd_asset_digest(const shd_request *request, const char *name, shd_digest *out);

/* The asset of a name, as shd_picture_wish has it and with the errors of shd_request_texels. One
 * of the operator's is read if it is not kept. */
shd_status shd_asset_open(shd_request *request, const char *name, shd_asset *out, shd_error *error);

/* Of the bytes of a file that has no name and is not kept. Its digest is zero. */
shd_status shd_asset_decode(shd_request *request, const void *data, size_t size, shd_asset *out,
                            shd_error *error);

/* How many samples it has, and these in floats, codes of integers: `values` has room for them. If
 * the work is cancelled some may be left out. */
size_t shd_asset_count(const shd_asset *asset);
shd_samples shd_asset_samples(const shd_asset *asset, float *values, const atomic_bool *cancelled);
