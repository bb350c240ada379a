/* The files of src/studio, which the build embeds: the page, its element and what they load. Made
 * once for each configuration, and constant then. */
#pragma once

#include <stddef.h>

#include "documents.h"

/* A file as the build embeds it. */
typedef struct shd_embedded_file {
    const char *name; /* below src/studio, such as "studio/main.js" */
    const unsigned char *data;
    size_t size;
} shd_embedded_file;

typedef struct shd_studio shd_studio;

shd_status shd_studio_make(shd_studio **out, shd_error *error);
void shd_studio_drop(shd_studio *studio); /* NULL is fine */

/* The file at a path, such as "/studio/main.js"; "/" is the page. NULL: there is none. */
const shd_document *shd_studio_find(const shd_studio *studio, const char *path);

/* What the page may do: nothing but what comes from the daemon that it came from. Pictures are
 * shown from memory (blob:). */
extern const char shd_studio_policy[];
