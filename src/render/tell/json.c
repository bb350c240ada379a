#include "render/tell/json.h"

#include <stdio.h>
#include <stdlib.h>

#include "base/json_memory.h"

json_t *shd_tell_number(double value) {
    return isfinite(value) ? json_real(value) : json_null();
}

json_t *shd_tell_bound(const shd_bound *bound) {
    return json_pack("{so so so}", "linear", shd_tell_number(bound->linear), "code",
                     shd_tell_number(bound->code), "deltaE2000", shd_tell_number(bound->delta_e));
}

typedef struct printing {
    FILE *out;
    const atomic_bool *cancelled;
} printing;

static int print_some(const char *text, size_t size, void *context) {
    const printing *p = context;
    return shd_is_cancelled(p->cancelled) || fwrite(text, 1, size, p->out) != size ? -1 : 0;
}

char *shd_tell_print(json_t *json, unsigned digits, const atomic_bool *cancelled) {
    char *text = NULL;
    size_t size;
    printing p = {open_memstream(&text, &size), cancelled};
    bool failed = !p.out || json_dump_callback(json, print_some, &p,
                                               JSON_INDENT(2) | JSON_REAL_PRECISION(digits));
    if (p.out) failed |= fclose(p.out) != 0;
    json_decref(json);
    if (!failed && !shd_json_memory_short()) return text;
    free(text);
    return NULL;
}
