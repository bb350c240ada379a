/* Long arrays of numbers, read past jansson, which makes a thing of 32 bytes of each number. Inside
 * of scene/.
 *
 * In a copy of the document an array that a mesh may have (the value of "positions", "normals" or
 * "indices") of at least SHD_PACK_LEAST numbers has as many digits instead, which count it. Jansson
 * reads the rest of the document as it is, and everything that is wrong is left to it. */
#ifndef SHD_SCENE_PACK_H
#define SHD_SCENE_PACK_H

#include <jansson.h>
#include <stdbool.h>
#include <stddef.h>

#include "base/arena.h"
#include "base/cancel.h"

enum { SHD_PACK_LEAST = 32 };

typedef struct shd_numbers {
    const double *values; /* [count], finite; the arena's */
    size_t count;
    size_t from, to; /* in the document: what follows the first SHD_PACK_LEAST */
} shd_numbers;

typedef struct shd_packs {
    shd_numbers *arrays; /* [count], in the order of the document */
    size_t count, capacity;
    size_t longest; /* string, in bytes, its quotes and escapes as written */
    bool full;      /* the arena is */
} shd_packs;

/* Packs the arrays of a document, which need not be right. `copy` has room for `length` bytes;
 * returns how many it has then. Where there are no packs, or once it is cancelled, it is of no
 * use. */
size_t shd_pack_arrays(const char *text, size_t length, char *copy, const atomic_bool *cancelled,
                       shd_arena *arena, shd_packs *out);

/* Blanks, in the document itself, what is packed beyond each array's first numbers: what is wrong
 * elsewhere keeps its line and column. */
void shd_pack_blank(const shd_packs *packs, char *text);

/* Makes integers, which are of no document, of the arrays that count themselves: the indices of
 * packs. False where memory is short. */
bool shd_pack_mark(json_t *tree, const shd_packs *packs);

#endif
