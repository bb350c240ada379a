#include "import/respell.h"

#include <ctype.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

#include "import/mtl.h"

/* Writes a line in another spelling. False: it is well as it is, and nothing was written. `out` is
 * NULL to ask only. *goes_on: the line is the rest of one of numbers; set if the next one is. */
typedef bool respell_line(const char *line, bool *goes_on, FILE *out);

static bool is_blank(char c) {
    return c == ' ' || c == '\t';
}

static bool respell_obj(const char *line, bool *goes_on, FILE *out) {
    const char *from = line + strspn(line, " \t");
    const size_t length = strcspn(line, "\r\n");
    const bool has_numbers = *goes_on || *from == 'v';
    bool any = false;
    *goes_on = has_numbers && length > 0 && line[length - 1] == '\\';
    if (!has_numbers) return false;
    for (const char *c = from; *c; c++) {
        if (*c != '.' || (c > line && !is_blank(c[-1])) || !isdigit((unsigned char)c[1])) continue;
        any = true;
        if (!out) return true;
        fwrite(from, 1, (size_t)(c - from), out);
        fputc('0', out);
        from = c;
    }
    if (any) fputs(from, out);
    return any;
}

static bool respell_mtl(const char *line, bool *goes_on, FILE *out) {
    (void)goes_on;
    if (shd_mtl_beyond(line)) {
        if (out) fputc('\n', out);
        return true;
    }
    static const char halo[] = "-halo";
    const size_t length = sizeof halo - 1;
    const char *start = line + strspn(line, " \t");
    if (*start != 'd' || !is_blank(start[1])) return false;
    start += 1 + strspn(start + 1, " \t");
    if (strncmp(start, halo, length) || !is_blank(start[length])) return false;
    if (out) fprintf(out, "d %s", start + length);
    return true;
}

/* Whether a line was respelled; `out` gets all of them. */
static bool respell_lines(FILE *file, respell_line *respell, FILE *out) {
    char *line = NULL;
    size_t room = 0;
    bool any = false, goes_on = false;
    rewind(file);
    ssize_t length;
    while (!(any && !out) && (length = getline(&line, &room, file)) >= 0) {
        const bool changed = respell(line, &goes_on, out);
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
