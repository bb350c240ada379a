/* Long arrays of numbers, which are read past jansson: it makes a thing of 32 bytes of each number.
 * Only for scene/.
 *
 * A mesh's arrays (the values of "positions", "normals" and "indices") are packed if they have at
 * least SHD_PACK_LEAST numbers. In a copy of the document, digits that tell the array's index
 * replace its numbers. Jansson reads the rest of the document as it is, and finds everything that
 * is wrong. */
#pragma once

#include <jansson.h>

#include "base/arena.h"
#include "base/cancel.h"

enum { SHD_PACK_LEAST = 32 };

typedef struct shd_numbers {
    const double *values; /* [count], finite; the arena's */
    size_t count;
    size_t from, to; /* in the document: the numbers that follow the first SHD_PACK_LEAST */
} shd_numbers;

typedef struct shd_packs {
    shd_numbers *arrays; /* [count], in the order of the document */
    size_t count, capacity;
    size_t longest; /* bytes of the longest string, its quotes and escapes as written */
    bool full;      /* the arena is full */
    bool escapes;   /* a string has some */
} shd_packs;

/* Packs the arrays of a document, which may have mistakes. `copy` has room for `length` bytes;
 * returns how many it has then. The copy is of no use if nothing was packed, or after a
 * cancellation. */
size_t shd_pack_arrays(const char *text, size_t length, char *copy, const atomic_bool *cancelled,
                       shd_arena *arena, shd_packs *out);

/* Blanks, in the document itself, the packed numbers beyond each array's first ones. Mistakes
 * elsewhere keep their line and column. */
void shd_pack_blank(const shd_packs *packs, char *text);

/* Replaces each packed array of the tree by an integer, which is the index of its pack. No document
 * has integers in its tree. False if memory is short. */
bool shd_pack_mark(json_t *tree, const shd_packs *packs);
