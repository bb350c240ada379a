/* JSON as a tree with places: the part of the reader that knows nothing of scenes.
 *
 * A node is a value and the way to it. Nodes live on the stack, linked to their parents. The JSON
 * Pointer (RFC 6901) is spelled out only if there is something to say about the place. */
#pragma once

#include <jansson.h>

#include "base/arena.h"
#include "base/cancel.h"
#include "base/report.h"
#include "scene/pack.h"

typedef struct shd_node {
    const struct shd_node *parent; /* NULL: the document */
    const char *key;               /* in the parent; NULL: `index` counts */
    size_t index;
    json_t *value; /* NULL: the member is absent */
} shd_node;

/* The member or the item of a node. The value of an absent member is NULL. */
shd_node shd_node_member(const shd_node *parent, const char *key);
shd_node shd_node_item(const shd_node *parent, size_t index);

/* A document. Every number in its tree is a finite real. An integer there stands for a long array
 * of numbers: it is the index of one of `packs`. */
typedef struct shd_json {
    json_t *tree;    /* owned; the rest is the arena's */
    void *block;     /* owned: where the tree is, which nothing is freed of alone; or NULL */
    size_t borrowed; /* bytes that the arena counts for the tree */
    shd_packs packs;
} shd_json;

/* Parses `length` bytes. On failure the answer is false, and the report has a problem with line and
 * column, or with the name of the limit `memory`, which bounds what the tree may take. On success
 * the caller ends the document with shd_json_drop. `cancelled` (or NULL) ends the parsing with
 * SHD_CANCELLED. `constant`: the caller changes nothing of the tree and refers to nothing of it
 * when it is dropped, so that it may be in a block. */
bool shd_json_parse(const char *text, size_t length, size_t memory, bool constant,
                    const atomic_bool *cancelled, shd_arena *arena, shd_json *out,
                    shd_report *report);
void shd_json_drop(shd_json *json, shd_arena *arena);

/* The numbers of a long array. `values` is NULL if the value is none; `count` is then the number of
 * its items. */
shd_numbers shd_json_numbers(const shd_json *json, const json_t *value);

/* The place's JSON Pointer, in the arena; NULL: memory. */
const char *shd_node_pointer(const shd_node *node, shd_arena *arena);

/* Adds an error about the place, or a warning if the status is SHD_OK. */
void shd_node_report(shd_report *report, const shd_node *node, shd_status status,
                     const char *format, ...) SHD_PRINTF(4, 5);

/* "expected a number, got a string" */
void shd_node_expect(shd_report *report, const shd_node *node, const char *expected);

/* A client's text made fit for a message: at most 60 bytes and a mark if it was cut, without
 * control characters. */
typedef struct shd_quoted {
    char text[72];
} shd_quoted;

shd_quoted shd_quote(const char *text);

/* Whether a name from the client may be shown whole: it has up to 64 characters, and no control
 * characters. */
bool shd_is_plain_name(const char *name);

/* ": did you mean \"radius\"?" if a name is close to one of `names` (one edit, and one more for
 * every six letters). Otherwise the names that there are, ": there is sphere, plane, ...", as far
 * as they fit. Nothing if the report is full: only messages that somebody will see are made. */
typedef struct shd_hint {
    char text[320];
} shd_hint;

shd_hint shd_suggest(const shd_report *report, const char *name, const char *const *names,
                     size_t count);
