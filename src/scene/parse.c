/* Text to tree: syntax errors, and the bound on what a tree may take. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/json_memory.h"
#include "scene/json.h"

/* Jansson's memory lies outside of the request's arena and may be 80 times the text ("{},{},"),
 * so the tree is measured before it grows: bytes a value of each kind takes on a 64-bit machine,
 * the slack of doubling tables included. Punctuation in strings counts too; scenes have little. */
static size_t tree_bytes(const char *text, size_t length) {
    size_t commas = 0, arrays = 0, objects = 0, members = 0;
    for (size_t i = 0; i < length; i++) {
        commas += text[i] == ',';
        arrays += text[i] == '[';
        objects += text[i] == '{';
        members += text[i] == ':';
    }
    return length + commas * 48 + arrays * 128 + objects * 256 + members * 96;
}

/* The key that ends at `end`, its quotes and escapes as written; jansson names short ones only. */
static shd_quoted key_before(const char *text, size_t end) {
    char key[80] = "";
    size_t last = end < 2 ? 0 : end - 2, first = last;
    /* Backslashes are counted behind quotes alone: a key may be nothing but millions of them. */
    for (; first > 0; first--) {
        if (text[first] != '"') continue;
        size_t backslashes = 0;
        while (backslashes < first && text[first - 1 - backslashes] == '\\') backslashes++;
        if (backslashes % 2 == 0) break;
    }
    size_t length = last - first;
    if (length >= sizeof key) length = sizeof key - 1;
    memcpy(key, text + first + 1, length);
    return shd_quote(key);
}

static void report_syntax(const char *text, size_t length, const json_error_t *error,
                          shd_report *report) {
    /* A tree that the system has no room for is not the client's mistake. */
    if (shd_json_memory_short()) {
        shd_report_error(report, SHD_MEMORY, "", "there is not enough memory for the document");
        return;
    }
    int line = error->line > 0 ? error->line : 1;
    int column = error->column > 0 ? error->column : 1;
    report->line = line;
    report->column = column;
    size_t end = error->position > 0 ? (size_t)error->position : 0;
    if (json_error_code(error) == json_error_duplicate_key && end <= length)
        shd_report_error(report, SHD_SYNTAX, "",
                         "line %d, column %d: the key \"%s\" is there twice", line, column,
                         key_before(text, end).text);
    else if (json_error_code(error) == json_error_null_character)
        shd_report_error(report, SHD_SYNTAX, "",
                         "line %d, column %d: \\u0000 is not allowed in strings", line, column);
    else if (length >= 3 && !memcmp(text, "\xef\xbb\xbf", 3))
        shd_report_error(report, SHD_SYNTAX, "",
                         "line %d, column %d: a byte order mark stands before the document", line,
                         column);
    else if (json_error_code(error) == json_error_stack_overflow)
        shd_report_error(report, SHD_SYNTAX, "",
                         "line %d, column %d: the document is nested too deeply", line, column);
    else
        shd_report_error(report, SHD_SYNTAX, "", "line %d, column %d: %s", line, column,
                         shd_quote(error->text).text);
}

static json_t *load(const char *text, size_t length, json_error_t *error) {
    return json_loadb(text, length,
                      JSON_REJECT_DUPLICATES | JSON_DECODE_INT_AS_REAL | JSON_DECODE_ANY, error);
}

/* The tree of a document; `copy` has room for it. */
static json_t *make_tree(const char *text, size_t length, char *copy, size_t memory,
                         shd_arena *arena, shd_json *json, shd_report *report) {
    shd_packs *packs = &json->packs;
    const size_t packed = shd_pack_arrays(text, length, copy, arena, packs);
    if (packs->full) {
        shd_report_error(report, SHD_MEMORY, "", "the limit `memory` is reached by the document");
        return NULL;
    }
    const size_t bytes = packs->count ? tree_bytes(copy, packed) : tree_bytes(text, length);
    if (bytes > memory) {
        shd_report_error(report, SHD_LIMIT, "",
                         "reading the document takes about %zu bytes; the limit `memory` is %zu",
                         bytes, memory);
        return NULL;
    }
    json->borrowed = length + bytes;
    if (!shd_arena_borrow(arena, json->borrowed)) {
        json->borrowed = 0;
        shd_report_error(report, SHD_MEMORY, "", "the limit `memory` is reached by the document");
        return NULL;
    }
    json_error_t error;
    json_t *tree = packs->count ? load(copy, packed, &error) : load(text, length, &error);
    const bool marked = !tree || shd_pack_mark(tree, packs);
    /* It may have gone on without: numbers are then other ones. */
    if (tree && (!marked || shd_json_memory_short())) {
        json_decref(tree);
        tree = NULL;
    } else if (!tree && packs->count && !shd_json_memory_short()) {
        /* Where it is wrong, told by the document. */
        memcpy(copy, text, length);
        shd_pack_blank(packs, copy);
        json_decref(load(copy, length, &error));
    }
    if (!tree) report_syntax(text, length, &error, report);
    return tree;
}

bool shd_json_parse(const char *text, size_t length, size_t memory, shd_arena *arena, shd_json *out,
                    shd_report *report) {
    size_t first = 0;
    while (first < length && strchr(" \t\r\n", text[first]) && text[first]) first++;
    if (first == length) {
        report->line = report->column = 1;
        shd_report_error(report, SHD_SYNTAX, "", "line 1, column 1: the document is empty");
        return false;
    }
    shd_json_memory_watch();
    char *copy = malloc(length);
    shd_json json = {.tree = NULL};
    if (copy)
        json.tree = make_tree(text, length, copy, memory, arena, &json, report);
    else
        shd_report_error(report, SHD_MEMORY, "", "there is not enough memory for the document");
    const bool made = copy && json.tree;
    free(copy);
    if (made)
        *out = json;
    else
        shd_json_drop(&json, arena);
    return made;
}

void shd_json_drop(shd_json *json, shd_arena *arena) {
    json_decref(json->tree);
    shd_arena_repay(arena, json->borrowed);
}
