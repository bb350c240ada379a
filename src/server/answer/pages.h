/* The pages at /docs, which the build makes of docs/ (docs/site/build) and embeds in gzip. They are
 * constant, and take no memory until somebody asks for one. */
#pragma once

#include "documents.h"

typedef struct shd_page {
    const char *name; /* below "/docs/", such as "requests"; "" is what "/docs/" answers */
    shd_document document;
} shd_page;

/* The page or file at a path, such as "/docs/requests" or "/docs". NULL: there is none. */
const shd_document *shd_page_find(const char *path);
