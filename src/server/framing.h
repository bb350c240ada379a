/* Whether the lines of a head are as HTTP writes them (RFC 9112, sections 2.2 and 5). libmicrohttpd
 * takes a lone LF for the end of a line, a NUL for the end of a field, and a line that begins with
 * a blank for more of the one before. Others do not, and what two servers read differently is how
 * requests are smuggled past one of them. */
#ifndef SHD_SERVER_FRAMING_H
#define SHD_SERVER_FRAMING_H

#include <stdbool.h>

struct MHD_Connection;

/* With the first call of libmicrohttpd's handler, which has `method` and `version`. `target_end`
 * is the end of the request's target, as the callback of its log had it. */
bool shd_head_is_sound(struct MHD_Connection *connection, const char *method,
                       const char *target_end, const char *version);

#endif
