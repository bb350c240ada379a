#include "import/respell.h"

#include <ctype.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

#include "import/mtl.h"

/* Writes a line in another spelling. False: it is well as it is, and nothing was written. `out` is
 * NULL to ask only. */
typedef bool respell_line(char *line, FILE *out);

static bool is_blank(char c) {
    return c == ' ' || c == '\t';
}

static bool respell_obj(char *line, FILE *out) {
    const char *from = line + strspn(line, " \t");
    bool any = false;
    if (*from != 'v') return false;
    for (const char *c = from + 1; *c; c++) {
        if (*c != '.' || !is_blank(c[-1]) || !isdigit((unsigned char)c[1])) continue;
        any = true;
        if (!out) return true;
        fwrite(from, 1, (size_t)(c - from), out);
        fputc('0', out);
        from = c;
    }
    if (any) fputs(from, out);
    return any;
}

static bool respell_mtl(char *line, FILE *out) {
    if (shd_mtl_beyond(line)) {
        if (out) fputc('\n', out);
        return true;
    }
    char *halo = strstr(line, "-halo");
    const char *start = line + strspn(line, " \t");
    if (*start != 'd' || !is_blank(start[1]) || !halo) return false;
    if (out) fprintf(out, "d %s", halo + strlen("-halo"));
    return true;
}

/* Whether a line was respelled; `out` gets all of them. */
static bool respell_lines(FILE *file, respell_line *respell, FILE *out) {
    char *line = NULL;
    size_t room = 0;
    bool any = false;
    rewind(file);
    ssize_t length;
    while (!(any && !out) && (length = getline(&line, &room, file)) >= 0) {
        const bool changed = respell(line, out);
        any |= changed;
        if (out && !changed) fwrite(line, 1, (size_t)length, out);
    }
    free(line);
    rewind(file);
    return any;
}

FILE *shd_respell(FILE *file, const char *path) {
    const char *suffix = strrchr(path, '.');
    const bool obj = suffix && !strcasecmp(suffix, ".obj"),
               mtl = suffix && !strcasecmp(suffix, ".mtl");
    respell_line *respell = obj ? respell_obj : respell_mtl;
    if (!(obj || mtl) || !respell_lines(file, respell, NULL)) return file;
    const int descriptor = memfd_create("respelled", MFD_CLOEXEC);
    FILE *out = descriptor >= 0 ? fdopen(descriptor, "w+") : NULL;
    if (!out && descriptor >= 0) close(descriptor);
    if (out) respell_lines(file, respell, out);
    fclose(file);
    if (!out || fflush(out) || ferror(out)) {
        if (out) fclose(out);
        return NULL;
    }
    rewind(out);
    return out;
}
