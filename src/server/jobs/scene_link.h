/* Links to whole scenes, for <img src>:
 *
 *     GET /v1/scene/{document}.{format}   the document, in deflate (RFC 1951) and base64url
 *     PUT /v1/scenes                      keeps a document that is too long for that
 *     GET /v1/scenes/{digest}.{format}    one that is kept
 *
 * A link is answered as its document would be if it was posted: by the same limits, tags and
 * caches. It has one picture, in the format that its path ends in. */
#pragma once

#include "job.h"
#include "server/exchange.h"

/* What a link's path says: the format and, of a document that is kept, its digest. On the I/O
 * thread, as the next one. False: the reply refuses it. */
bool shd_scene_link_admit(shd_exchange *exchange);

/* The exchange's document, in deflate or kept, as if it had been sent. False: the link is wrong, or
 * nothing is kept by its digest, and the reply says so. */
bool shd_scene_link_read(shd_exchange *exchange);

/* Refuses a document that was read and that its link cannot show. */
void shd_scene_link_check(shd_job *job);
