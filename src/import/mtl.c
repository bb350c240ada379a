/* By Wavefront's "Advanced Visualizer" manual, appendix B4: options stand before the file's name.
 * As three.js and Blender have it, a coordinate is multiplied by `-s` and then moved by `-o`. */
#include "import/mtl.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "import/files.h"

enum { PATH_ROOM = 4096 };

static const char blanks[] = " \t\r\n";

/* The next word of a line, which is cut there. NULL: there is none. */
static char *take_word(char **line) {
    char *word = *line + strspn(*line, blanks);
    if (!*word) return NULL;
    char *end = word + strcspn(word, blanks);
    *line = *end ? end + 1 : end;
    *end = 0;
    return word;
}

/* The rest of a line without the blanks around it. */
static char *take_rest(char *line) {
    char *rest = line + strspn(line, blanks);
    size_t length = strlen(rest);
    while (length && strchr(blanks, rest[length - 1])) length--;
    rest[length] = 0;
    return rest;
}

/* Up to `most` numbers, and no word that is none. Returns how many. */
static int take_numbers(char **line, float *out, int most) {
    int count = 0;
    while (count < most) {
        char *start = *line + strspn(*line, blanks), *end;
        const float value = strtof(start, &end);
        if (end == start || (*end && !strchr(blanks, *end))) break;
        out[count++] = value;
        *line = end;
    }
    return count;
}

/* ---- Statements ---- */

typedef struct reading {
    shd_mtl *mtl;
    shd_losses *losses;
    char *material; /* NULL: before the first */
} reading;

static void lose_option(const reading *r, const char *option, const char *statement) {
    shd_lose(r->losses, "material \"%s\": %s of its %s is left out", r->material, option,
             statement);
}

/* `-t`, `-mm` and the like, whose usual numbers change nothing. */
static void pass_numbers(const reading *r, char **line, const char *option, const char *statement,
                         const float usual[3]) {
    float values[3];
    const int count = take_numbers(line, values, 3);
    for (int i = 0; i < count; i++) {
        if (values[i] == usual[i]) continue;
        lose_option(r, option, statement);
        break;
    }
}

static void pass_word(const reading *r, char **line, const char *option, const char *statement,
                      const char *usual) {
    const char *word = take_word(line);
    if (word && usual && strcasecmp(word, usual) != 0) lose_option(r, option, statement);
}

static void take_options(const reading *r, char **line, shd_mtl_map *map) {
    static const float none[3] = {0, 0, 0}, plain[3] = {0, 1, 0};
    const char *statement = map->statement;
    for (;;) {
        char *start = *line + strspn(*line, blanks);
        if (*start != '-') break;
        const char *option = take_word(line);
        float values[3] = {0, 0, 0};
        if (!strcasecmp(option, "-s")) {
            const int count = take_numbers(line, values, 3);
            for (int i = 0; i < count && i < 2; i++) map->scale[i] = values[i];
        } else if (!strcasecmp(option, "-o")) {
            take_numbers(line, values, 3);
            map->offset[0] = values[0], map->offset[1] = values[1];
        } else if (!strcasecmp(option, "-bm")) {
            take_numbers(line, &map->bump, 1);
        } else if (!strcasecmp(option, "-clamp")) {
            const char *word = take_word(line);
            map->clamp = word && !strcasecmp(word, "on");
        } else if (!strcasecmp(option, "-t") || !strcasecmp(option, "-boost")) {
            pass_numbers(r, line, option, statement, none);
        } else if (!strcasecmp(option, "-mm")) {
            pass_numbers(r, line, option, statement, plain);
        } else if (!strcasecmp(option, "-cc")) {
            pass_word(r, line, option, statement, "off");
        } else if (!strcasecmp(option, "-imfchan")) {
            pass_word(r, line, option, statement, "");
        } else { /* -blendu, -blendv, -texres, -type */
            pass_word(r, line, option, statement, NULL);
        }
    }
}

static void read_map(const reading *r, const char *statement, char *line) {
    shd_mtl *mtl = r->mtl;
    if (mtl->count == mtl->capacity) {
        const size_t capacity = mtl->capacity ? 2 * mtl->capacity : 16;
        shd_mtl_map *more = realloc(mtl->maps, capacity * sizeof *more);
        if (!more) return;
        mtl->maps = more;
        mtl->capacity = capacity;
    }
    shd_mtl_map map = {
        .material = r->material, .statement = strdup(statement), .scale = {1, 1}, .bump = 1};
    if (!map.statement) return;
    take_options(r, &line, &map);
    map.file = strdup(take_rest(line));
    if (map.file) mtl->maps[mtl->count++] = map;
}

/* Past a word that a line goes on with. NULL: it is another one. */
static const char *pass_over(const char *line, const char *word) {
    const size_t length = strlen(word);
    line += strspn(line, blanks);
    return !strncasecmp(line, word, length) && strspn(line + length, blanks) ? line + length : NULL;
}

const char *shd_mtl_beyond(const char *line) {
    static const char *const statements[] = {"decal", "aniso", "anisor"};
    static const char *const colors[] = {"Ka", "Kd", "Ks", "Ke", "Tf"};
    for (size_t i = 0; i < sizeof statements / sizeof *statements; i++)
        if (pass_over(line, statements[i])) return statements[i];
    for (size_t i = 0; i < sizeof colors / sizeof *colors; i++) {
        const char *rest = pass_over(line, colors[i]);
        if (rest && (pass_over(rest, "spectral") || pass_over(rest, "xyz")))
            return "color that is no RGB";
    }
    return NULL;
}

static void read_statement(reading *r, char *line) {
    static const char *const unknown[] = {"Pr", "Pm", "Ps", "Pc", "Pcr", "sharpness", "refl"};
    const char *beyond = shd_mtl_beyond(line);
    if (beyond && r->material)
        shd_lose(r->losses, "material \"%s\": its %s is left out", r->material, beyond);
    const char *statement = take_word(&line);
    if (!statement || *statement == '#') return;
    if (!strcasecmp(statement, "newmtl")) {
        r->material = strdup(take_rest(line));
        return;
    }
    if (!r->material) return;
    for (size_t i = 0; i < sizeof unknown / sizeof *unknown; i++)
        if (!strcasecmp(statement, unknown[i]))
            shd_lose(r->losses, "material \"%s\": its %s is left out", r->material, unknown[i]);
    if (!strncasecmp(statement, "map_", 4) || !strcasecmp(statement, "norm") ||
        !strcasecmp(statement, "bump"))
        read_map(r, statement, line);
}

/* ---- Files ---- */

/* False: there is no such file. */
static bool read_library(const char *path, shd_mtl *out, shd_losses *losses) {
    FILE *file = shd_open_regular(path);
    reading r = {out, losses, NULL};
    char *line = NULL;
    size_t room = 0;
    while (file && getline(&line, &room, file) >= 0) read_statement(&r, line);
    free(line);
    if (file) fclose(file);
    return file;
}

/* The library of a name in the folder of `path`. */
static bool read_beside(const char *path, const char *name, shd_mtl *out, shd_losses *losses) {
    char beside[PATH_ROOM];
    const char *slash = strrchr(path, '/');
    const int length = slash ? (int)(slash + 1 - path) : 0;
    const int wrote = snprintf(beside, sizeof beside, "%.*s%s", length, path, name);
    return *name && *name != '/' && wrote < PATH_ROOM && read_library(beside, out, losses);
}

/* Where a model names a library that is not there, assimp takes the one that is called as itself.
 */
static void read_own(const char *path, shd_mtl *out, shd_losses *losses) {
    char own[PATH_ROOM];
    const int stem = (int)(strrchr(path, '.') - path);
    if (snprintf(own, sizeof own, "%.*s.mtl", stem, path) < PATH_ROOM)
        read_library(own, out, losses);
}

void shd_mtl_read(const char *path, shd_mtl *out, shd_losses *losses) {
    const char *suffix = strrchr(path, '.');
    FILE *file = suffix && !strcasecmp(suffix, ".obj") ? shd_open_regular(path) : NULL;
    char *line = NULL;
    size_t room = 0;
    while (file && getline(&line, &room, file) >= 0) {
        char *at = line;
        if (strncasecmp(line + strspn(line, blanks), "mtllib", 6) != 0) continue;
        take_word(&at);
        if (!read_beside(path, take_rest(at), out, losses)) read_own(path, out, losses);
    }
    free(line);
    if (file) fclose(file);
}

const shd_mtl_map *shd_mtl_find(const shd_mtl *mtl, const char *material, const char *statement) {
    for (size_t i = mtl->count; i > 0; i--) {
        const shd_mtl_map *map = &mtl->maps[i - 1];
        if (!strcmp(map->material, material) && !strcasecmp(map->statement, statement)) return map;
    }
    return NULL;
}
