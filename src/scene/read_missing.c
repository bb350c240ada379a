/* What documents name and is not kept: told after all that is wrong with the document itself. */
#include <string.h>

#include "scene/read.h"

void shd_note_missing(shd_reader *r, const shd_node *node, const char *what, const char *name) {
    const size_t named = r->missing_count < SHD_REPORT_KEEP ? r->missing_count : SHD_REPORT_KEEP;
    for (size_t i = 0; i < named; i++)
        if (!strcmp(r->missing[i].name, name) && r->missing[i].what == what) return;
    r->missing_count++;
    if (named == SHD_REPORT_KEEP) return;
    const char *pointer = shd_node_pointer(node, r->arena);
    shd_missing *missing = &r->missing[named];
    *missing = (shd_missing){.pointer = pointer ? pointer : "", .what = what};
    strncpy(missing->name, name, sizeof missing->name - 1);
}

void shd_report_missing(shd_reader *r) {
    for (size_t i = 0; i < r->missing_count; i++) {
        const shd_missing *m = &r->missing[i < SHD_REPORT_KEEP ? i : 0];
        shd_report_error(r->report, SHD_MISSING, m->pointer, "no %s %s is kept here", m->what,
                         m->name);
    }
}
