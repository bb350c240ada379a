/* GET /v1/preview/{material}: the picture of a library material, for pages to link to.
 *
 * The link becomes a scene document, and is answered as that document would be: by the same limits,
 * tags and caches. Only mistakes are told in the link's own words. */
#pragma once

#include "job.h"
#include "server/access/access.h"
#include "server/exchange.h"

/* The exchange's scene document, as if it had been sent. False: the link is wrong, and the reply
 * says so. */
bool shd_preview_document(shd_exchange *exchange);

/* Answers what is wrong with the document as what is wrong with the link. */
void shd_preview_refuse(shd_job *job);

/* How a link stands to the keys that sign. What is signed is the target as it is sent, up to
 * "&signature=" or "?signature=", which ends it. */
typedef enum shd_link {
    SHD_LINK_UNSIGNED,
    SHD_LINK_WRONG,
    SHD_LINK_EXPIRED,
    SHD_LINK_SIGNED
} shd_link;

/* `expires` gets the seconds since 1970 until which a signed link is good, 0 if it is for ever.
 */
shd_link shd_preview_link(const shd_exchange *exchange, const shd_keys *keys, long long *expires);
