#include "framing.h"

#include <microhttpd.h>
#include <string.h>

/* Release 0.9.75 tells nobody, but cuts its strings from the bytes that came, where they came: each
 * end of a line, CR LF, is two zeros, and what follows begins after them. A lone LF is one zero. A
 * NUL ends a string before its line does. A folded line's string lies elsewhere, or goes on. */

/* Past the end of a string that ends its line. */
static const char *next_line(const char *text) {
    return text + strlen(text) + 2;
}

static enum MHD_Result check_field(void *cls, enum MHD_ValueKind kind, const char *name,
                                   const char *value) {
    const char **at = cls; /* where the next field's name must be; NULL: the head is not sound */
    (void)kind;
    *at = name == *at && value ? next_line(value) : NULL;
    return *at ? MHD_YES : MHD_NO;
}

bool shd_head_is_sound(struct MHD_Connection *connection, const char *method,
                       const char *target_end, const char *version) {
    const union MHD_ConnectionInfo *info =
        MHD_get_connection_info(connection, MHD_CONNECTION_INFO_REQUEST_HEADER_SIZE);
    if (!info || target_end + 1 != version) return false;
    const char *at = next_line(version);
    MHD_get_connection_values(connection, MHD_HEADER_KIND, check_field, &at);
    return at && at + 2 == method + info->header_size; /* the empty line ends the head */
}

bool shd_has_trailers(struct MHD_Connection *connection) {
    return MHD_get_connection_values(connection, MHD_FOOTER_KIND, NULL, NULL) > 0;
}
