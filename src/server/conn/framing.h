/* Whether the lines of a head are as HTTP writes them (RFC 9112, sections 2.2 and 5). libmicrohttpd
 * takes a lone LF for the end of a line, a NUL for the end of a field, and a line that begins with
 * a blank for more of the one before. Others do not, and what two servers read differently is how
 * requests are smuggled past one of them.
 *
 * Of a chunked body it shows neither the lines of sizes nor what follows chunks. So this is not
 * seen, and taken as if CR were there or the rest were not: a lone LF after a size or its
 * extension, after a chunk's data, and for the empty line at the end; what an extension is, up to
 * the first LF; and a line after the last chunk that begins with a NUL, which is taken for the
 * empty one. */
#pragma once

#include <stdbool.h>

struct MHD_Connection;

/* With the first call of libmicrohttpd's handler, which has `method` and `version`. `target_end`
 * is the end of the request's target, as the callback of its log had it. */
bool shd_head_is_sound(struct MHD_Connection *connection, const char *method,
                       const char *target_end, const char *version);

/* With its last call: whether fields follow the body, whose lines are as little seen. */
bool shd_has_trailers(struct MHD_Connection *connection);
