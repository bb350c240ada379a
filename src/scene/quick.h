/* Trees of documents without mistakes, by simdjson: from four kilobytes on in a sixth of the
 * instructions that jansson takes. Only for scene/; pure functions, any thread. */
#pragma once

#include <jansson.h>
#include <stdbool.h>
#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Bytes that have to be readable, whatever they are, behind a text. */
#define SHD_QUICK_PADDING 64

/* The most bytes of memory that `length` bytes of text take while the tree is made, beside it. */
size_t shd_quick_working(size_t length);

/* The tree that jansson makes of `length` bytes with JSON_REJECT_DUPLICATES,
 * JSON_DECODE_INT_AS_REAL and JSON_DECODE_ANY; the caller owns it. The text has no backslashes
 * within strings. NULL: jansson has to read it. That is so if anything is wrong with it, if an
 * integer has more than 64 bits or is -0, if values are nested more than 64 deep, if memory is
 * short, or if `stops` says so, which is asked now and then. */
json_t *shd_quick_tree(const char *text, size_t length, bool stops(void *context), void *context);

#ifdef __cplusplus
}
#endif
