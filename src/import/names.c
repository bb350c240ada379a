#include "import/names.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/utf8.h"

/* Room for what makes a name the only one of its kind. */
enum { KEPT = SHD_NAME_ROOM - 12 };

/* Cut to KEPT bytes, between characters; without what names may not have, and without the mark of
 * those that were made to differ. */
static void make_plain(const char *text, size_t length, const char *usual,
                       char out[SHD_NAME_ROOM]) {
    char copy[SHD_NAME_ROOM + 4] = "";
    size_t used = 0;
    memcpy(copy, text, length < SHD_NAME_ROOM ? length : SHD_NAME_ROOM);
    for (const char *c = copy; *c;) {
        uint32_t point = 0;
        const size_t size = shd_utf8_decode(c, &point);
        const bool fits = size && point >= 0x20 && point != '#' && !(point >= 0x7f && point < 0xa0);
        if (used + (fits ? size : 1) > KEPT) break;
        if (fits)
            memcpy(out + used, c, size);
        else
            out[used] = '_';
        used += fits ? size : 1;
        c += size ? size : 1;
    }
    out[used] = 0;
    if (!used) snprintf(out, SHD_NAME_ROOM, "%s", usual);
}

static int compare_names(const void *a, const void *b) {
    const shd_plain_name *const *one = a, *const *other = b;
    const int order = strcmp((*one)->text, (*other)->text);
    return order ? order : (*one > *other) - (*one < *other);
}

bool shd_plain_names(const shd_raw_name *raw, size_t count, const char *usual,
                     shd_plain_name *out) {
    const shd_plain_name **sorted = calloc(count + 1, sizeof *sorted);
    if (!sorted) return false;
    for (size_t i = 0; i < count; i++) {
        make_plain(raw[i].text, raw[i].length, usual, out[i].text);
        sorted[i] = &out[i];
    }
    qsort(sorted, count, sizeof *sorted, compare_names);
    /* All but the first of equals, which are told apart before any is changed. */
    for (size_t i = count; i-- > 1;) {
        if (strcmp(sorted[i]->text, sorted[i - 1]->text) != 0) continue;
        shd_plain_name *name = &out[sorted[i] - out];
        const size_t length = strlen(name->text);
        snprintf(name->text + length, sizeof name->text - length, "#%zu", (size_t)(name - out));
    }
    free(sorted);
    return true;
}
