/* What the library holds, and looking it up. */
#include "scene/library.h"

#include <stdlib.h>
#include <string.h>

shd_library *shd_library_make(void) {
    shd_library *library = calloc(1, sizeof *library);
    if (!library) return NULL;
    library->arena = shd_arena_new(SHD_LIBRARY_BYTES);
    if (library->arena) return library;
    free(library);
    return NULL;
}

bool shd_reach_library(shd_reader *r, const shd_node *node, const shd_library **out) {
    *out = NULL;
    if (r->in_library || !r->catalog->library) return true;
    *out = r->catalog->library(r->catalog);
    if (!*out) shd_node_report(r->report, node, SHD_EXHAUSTED, "out of memory");
    return *out;
}

static int compare_entries(const void *a, const void *b) {
    return strcmp(((const shd_library_entry *)a)->told.name,
                  ((const shd_library_entry *)b)->told.name);
}

bool shd_library_append(shd_library *library, const shd_library_entry *added, size_t more) {
    const size_t count = library->count + more;
    shd_library_entry *all = shd_arena_alloc(library->arena, count, sizeof *all);
    if (!all) return false;
    if (library->count) memcpy(all, library->entries, library->count * sizeof *all);
    if (more) memcpy(all + library->count, added, more * sizeof *all);
    qsort(all, count, sizeof *all, compare_entries);
    library->entries = all;
    library->count = count;
    return true;
}

void shd_library_drop(shd_library *library) {
    if (!library) return;
    for (shd_library_file *file = library->files; file; file = file->next)
        shd_json_drop(&file->json, library->arena);
    shd_arena_drop(library->arena);
    free(library);
}

size_t shd_preset_count(const shd_library *library) {
    return library ? library->count : 0;
}

const shd_preset *shd_preset_at(const shd_library *library, size_t index) {
    return &library->entries[index].told;
}

static int compare_key(const void *key, const void *entry) {
    return strcmp(key, ((const shd_library_entry *)entry)->told.name);
}

const shd_library_entry *shd_library_find(const shd_library *library, const char *name) {
    if (!library || !library->count) return NULL;
    return bsearch(name, library->entries, library->count, sizeof *library->entries, compare_key);
}

size_t shd_preset_find(const shd_library *library, const char *name) {
    const shd_library_entry *found = shd_library_find(library, name);
    return found ? (size_t)(found - library->entries) : SIZE_MAX;
}
