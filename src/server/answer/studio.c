#include "studio.h"

#include <stdlib.h>
#include <string.h>

extern const shd_embedded_file shd_embedded_studio[];
extern const size_t shd_embedded_studio_count;

struct shd_studio {
    shd_document *files; /* in the order of shd_embedded_studio */
};

const char shd_studio_policy[] =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; "
    "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

static const char *find_media_type(const char *name) {
    static const struct {
        const char *suffix, *media_type;
    } types[] = {{".html", "text/html; charset=utf-8"},
                 {".css", "text/css; charset=utf-8"},
                 {".svg", "image/svg+xml"}};
    const char *suffix = strrchr(name, '.');
    for (size_t i = 0; suffix && i < sizeof types / sizeof types[0]; i++)
        if (!strcmp(suffix, types[i].suffix)) return types[i].media_type;
    return "text/javascript; charset=utf-8";
}

shd_status shd_studio_make(shd_studio **out, shd_error *error) {
    shd_studio *studio = calloc(1, sizeof *studio);
    if (studio) studio->files = calloc(shd_embedded_studio_count, sizeof *studio->files);
    if (!studio || !studio->files) {
        free(studio);
        return shd_fail(error, SHD_EXHAUSTED, "", "no memory for the files of the studio");
    }
    for (size_t i = 0; i < shd_embedded_studio_count; i++) {
        const shd_embedded_file *file = &shd_embedded_studio[i];
        shd_document_lend(&studio->files[i], find_media_type(file->name), file->data, file->size);
    }
    *out = studio;
    return SHD_OK;
}

void shd_studio_drop(shd_studio *studio) {
    if (!studio) return;
    for (size_t i = 0; i < shd_embedded_studio_count; i++)
        free((void *)(size_t)studio->files[i].gzip.data);
    free(studio->files);
    free(studio);
}

const shd_document *shd_studio_find(const shd_studio *studio, const char *path) {
    const char *name = strcmp(path, "/") != 0 ? path + 1 : "index.html";
    for (size_t i = 0; i < shd_embedded_studio_count; i++)
        if (!strcmp(shd_embedded_studio[i].name, name)) return &studio->files[i];
    return NULL;
}
