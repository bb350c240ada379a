#include "pages.h"

#include <string.h>

extern const shd_page shd_embedded_pages[];
extern const size_t shd_embedded_pages_count;

const shd_document *shd_page_find(const char *path) {
    /* Links of the index begin with "docs/" where its own address does not end so. */
    const char *name = strcmp(path, "/docs") != 0 ? path + strlen("/docs/") : "docs";
    for (size_t i = 0; i < shd_embedded_pages_count; i++)
        if (!strcmp(shd_embedded_pages[i].name, name)) return &shd_embedded_pages[i].document;
    return NULL;
}
