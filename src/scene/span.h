/* Pieces of the text of a JSON document, which is known to be sound. Only for scene/. Pure
 * functions, any thread. */
#pragma once

#include <stdbool.h>
#include <stddef.h>

/* A value as it is written, without blanks around it. */
typedef struct shd_span {
    const char *at, *end; /* at == end: there is none */
} shd_span;

/* The value that begins at `at` or behind blanks there. */
shd_span shd_span_of(const char *at, const char *end);

/* The next member of an object, or item of an array, whose key is empty. *at is NULL before the
 * first one. False: there is no other. */
bool shd_span_next(shd_span whole, const char **at, shd_span *key, shd_span *value);

/* Whether two keys, with their quotes, are the same string; or one and a text. */
bool shd_span_same(shd_span a, shd_span b);
bool shd_span_is(shd_span key, const char *text);

/* A string's text, which the caller frees. NULL: memory is short. */
char *shd_span_text(shd_span string);
