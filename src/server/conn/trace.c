#include "trace.h"

#include <string.h>

enum { VERSION = 2, ID = 32, PARENT = 16, FLAGS = 2 };

/* So many lower-case hexadecimal digits, not all of them 0 if `zeros` may not be. */
static bool is_hex(const char *text, size_t length, bool zeros) {
    static const char digits[] = "0123456789abcdef";
    return strspn(text, digits) >= length && (zeros || strspn(text, "0") < length);
}

bool shd_trace_read(const char *field, shd_trace *out) {
    static const size_t id = VERSION + 1, parent = id + ID + 1, flags = parent + PARENT + 1,
                        end = flags + FLAGS;
    if (strlen(field) < end || field[id - 1] != '-' || field[parent - 1] != '-' ||
        field[flags - 1] != '-')
        return false;
    bool is_first = !strncmp(field, "00", VERSION);
    if (!is_hex(field, VERSION, true) || !strncmp(field, "ff", VERSION) ||
        !is_hex(field + id, ID, false) || !is_hex(field + parent, PARENT, false) ||
        !is_hex(field + flags, FLAGS, true) || (field[end] && (is_first || field[end] != '-')))
        return false;
    memcpy(out->id, field + id, ID);
    memcpy(out->parent, field + parent, PARENT);
    out->id[ID] = out->parent[PARENT] = 0;
    return true;
}
