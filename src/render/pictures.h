/* Pictures that documents name: files that clients have put under their digest, and those of the
 * operator's folder.
 *
 * A picture is decoded once, by a process of its own (assets/decoder.h), and converted once for
 * each space that it is taken in. Both are kept in the engine's store under its one cap; what is
 * too large to be kept is made for the request alone. */
#pragma once

#include "base/pyramid.h"
#include "render/request.h"

/* The picture, decoded and converted, which the request holds until it is dropped. A picture that
 * the request has is found again at once. The request's thread; it may take as long as decoding
 * does, which the request's cancelling ends.
 *
 * `key` of what it gives tells one wish from another that has other texels, and is the same in all
 * processes: entity tags and keys of what is kept take it. Of a wish whose spaces say the same in
 * other words it is the same.
 *
 * error->path is "", for the caller to say where in the document it is.
 * SHD_SCENE: the operator's folder has no such name, the text is no digest, or the folder's file
 * cannot be read as a picture. SHD_MISSING: nothing is kept by that digest. SHD_LIMIT: it has more
 * pixels than the limit `pixels`, or takes more than the limit `memory` leaves of the request.
 * SHD_MEMORY, SHD_CROWDED, SHD_EXHAUSTED, SHD_CANCELLED; SHD_INTERNAL: no process could be
 * started. */
shd_status shd_request_texels(shd_request *request, const shd_picture_wish *wish,
                              const shd_texels **out, shd_error *error);

/* The same of an asset that its caller has opened. */
struct shd_asset;
shd_status shd_request_texels_of(shd_request *request, const struct shd_asset *asset,
                                 const shd_picture_wish *wish, const shd_texels **out,
                                 shd_error *error);

/* The pyramid of texels that shd_request_texels gave to this request, made and kept as these are.
 * The request holds it, too. Statuses are the same. */
shd_status shd_request_pyramid(shd_request *request, const shd_texels *texels,
                               const shd_pyramid **out, shd_error *error);

/* The same as members of a shelf: of one scene each wish is fulfilled or refused once, and there
 * are 256 of them at most. `request` is a shd_request. */
shd_status shd_wished_texels(void *request, const shd_picture_wish *wish, const shd_texels **out,
                             shd_error *error);
shd_status shd_wished_pyramid(void *request, const shd_texels *texels, const shd_pyramid **out,
                              shd_error *error);

/* Lets go of the picture that the request has taken last. */
void shd_request_forget_texels(shd_request *request);
