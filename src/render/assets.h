/* Files of pictures as they are kept: decoded, and not converted. */
#pragma once

#include "assets/folder.h"
#include "decode/wire.h"
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
