/* Bodies in a content coding (RFC 9110, section 8.4): gzip (RFC 1952) and zstd (RFC 8878, of which
 * RFC 9659 bounds the window to 8 MB); and documents in links: one stream of deflate (RFC 1951),
 * which no field names.
 *
 * A body is one or several gzip members or zstd frames, and nothing else. Checksums are verified
 * if there are any. Formats older than RFC 8878 and frames that want a dictionary are none.
 *
 * zlib and libzstd are opened when the first body needs them, and stay. Any thread. */
#pragma once

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/budget.h"
#include "base/status.h"
#include "shaded.h"

typedef enum shd_coding {
    SHD_CODING_NONE,
    SHD_CODING_GZIP,
    SHD_CODING_ZSTD,
    SHD_CODING_DEFLATE
} shd_coding;

/* The coding that a Content-Encoding field names, NULL if there is none: none, gzip (x-gzip is
 * the same) or zstd, in any case of letters; identity is none. False: another, or several. */
bool shd_coding_read(const char *field, shd_coding *out);

/* The codings whose libraries are there, as Accept-Encoding lists them; "identity" without any. */
const char *shd_coding_list(void);
bool shd_inflate_open(shd_coding coding); /* opens its library; false: it is not there */

typedef struct shd_inflation {
    uint64_t most, keep;        /* bytes: that it may come to, and that are decoded of it */
    shd_budget *budget;         /* of which all memory is taken; waited for, some seconds */
    uint64_t room;              /* bytes of that which it could have if nobody else had any */
    const shd_request *request; /* whose cancelling ends it; NULL: nothing does */
} shd_inflation;

/* What a body in an open coding stands for: *out, which the caller frees and then gives `*taken`
 * bytes back to the budget. It has *out_size bytes. Where these are more than `keep`, *out is NULL,
 * what follows is not looked at, and *out_size is a guess, more than `keep`: as if all of the body
 * were as dense as its beginning.
 *
 * SHD_SYNTAX: it is not what the coding says, or ends too early; SHD_LIMIT: it comes to more than
 * `most`, or never has room; SHD_CROWDED, SHD_EXHAUSTED: of memory; SHD_CANCELLED. */
shd_status shd_inflate(shd_coding coding, const void *body, size_t size, const shd_inflation *how,
                       unsigned char **out, size_t *out_size, size_t *taken, shd_error *error);
