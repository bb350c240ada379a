/* The documents that GET answers: made once for each configuration, and constant then. */
#pragma once

#include <stdbool.h>
#include <stddef.h>

#include "base/status.h"
#include "server/paths.h"
#include "shaded.h"

typedef struct shd_text {
    const void *data;
    size_t size; /* 0: there is none */
    char etag[20];
} shd_text;

/* A text, and the same in gzip if it is shorter so. The program's own pages have `plain.data` NULL:
 * they are kept in gzip alone. */
typedef struct shd_document {
    const char *media_type;
    bool owned; /* the text's bytes, as those in gzip always are */
    shd_text plain, gzip;
} shd_document;

/* Of a text of the program itself, which outlives the document. */
void shd_document_lend(shd_document *document, const char *media_type, const void *data,
                       size_t size);

/* Fills a table that is all zero; routes without a document keep a `plain` of size 0. If it fails,
 * the table is released like any other. */
shd_status shd_documents_make(shd_engine *engine, shd_document documents[SHD_ROUTE_COUNT],
                              shd_error *error);
void shd_documents_release(const shd_document documents[SHD_ROUTE_COUNT]);
