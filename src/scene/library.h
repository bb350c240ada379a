/* The inside of the material library: entries as the reader of materials takes them. Only for
 * scene/. */
#pragma once

#include "scene/read.h"
#include "scene/scene.h"

typedef struct shd_library_entry {
    shd_preset told;
    json_t *material;     /* as a document has it, but for `preset` */
    const shd_json *json; /* the file that it is of */
    bool codes;           /* plain numbers of colors are display codes */
} shd_library_entry;

/* The library, for a name that a document has. It may be empty, or NULL for none. False: memory is
 * short, which is reported. */
bool shd_reach_library(shd_reader *r, const shd_node *node, const shd_library **out);

/* By name. NULL: there is none. */
const shd_library_entry *shd_library_find(const shd_library *library, const char *name);

enum { SHD_LIBRARY_BYTES = 256 << 20 }; /* the most of all files together, most of it jansson's */

/* A file that was read. */
typedef struct shd_library_file {
    struct shd_library_file *next;
    shd_json json;
} shd_library_file;

struct shd_library {
    shd_arena *arena;
    shd_library_file *files;
    shd_library_entry *entries; /* sorted by name */
    size_t count;
};

/* An empty one. NULL: there is no memory. */
shd_library *shd_library_make(void);

/* Copies entries into the library. False: there is no memory. */
bool shd_library_append(shd_library *library, const shd_library_entry *added, size_t more);
