/* Text to tree: syntax errors, and the bound on what a tree may take. */
#include <stdlib.h>
#include <string.h>

#include "base/json_memory.h"
#include "scene/json.h"
#include "scene/quick.h"

/* The most values outside of packed arrays, and the most bytes of a string. A tree is freed as a
 * whole, and the escapes of a string are undone as a whole: neither can be left halfway. As many as
 * these take some hundreds of millions of instructions. */
enum { MOST_VALUES = 1 << 21, LONGEST_STRING = 1 << 20 };

/* The least bytes that simdjson reads, for what it needs once is more than it saves of fewer, and
 * the most, for it cannot be interrupted: some hundreds of millions of instructions, again. */
enum { QUICK_LEAST = 4096, QUICK_MOST = 1 << 24 };

/* Jansson's memory lies outside of the request's arena and may be 80 times the text ("{},{},"), so
 * the tree is measured before it grows. These are the bytes that a value of each kind takes on a
 * 64-bit machine, including the slack of tables that double. Punctuation in strings counts too;
 * scenes have little. */
static size_t tree_bytes(const char *text, size_t length, size_t *values) {
    enum { CHUNK = 240 }; /* bytes, which bytes can count, so that loops vectorize */
    size_t commas = 0, arrays = 0, objects = 0, members = 0;
    for (size_t i = 0; i < length;) {
        const size_t left = length - i, end = i + (left < CHUNK ? left : CHUNK);
        uint8_t c = 0, a = 0, o = 0, m = 0;
        for (; i < end; i++) {
            c += text[i] == ',';
            a += text[i] == '[';
            o += text[i] == '{';
            m += text[i] == ':';
        }
        commas += c;
        arrays += a;
        objects += o;
        members += m;
    }
    *values = 1 + commas + arrays + objects;
    return length + commas * 48 + arrays * 128 + objects * 256 + members * 96;
}

/* The key that ends at `end`, its quotes and escapes as written. Jansson names only short ones. */
static shd_quoted key_before(const char *text, size_t end) {
    char key[80] = "";
    size_t last = end < 2 ? 0 : end - 2, first = last;
    /* Counts backslashes only behind quotes: a key may be nothing but millions of them. */
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
    report->line = error->line > 0 ? error->line : 1;
    report->column = error->column > 0 ? error->column : 1;
    const size_t end = error->position > 0 ? (size_t)error->position : 0;
    const enum json_error_code code = json_error_code(error);
    const bool twice = code == json_error_duplicate_key && end <= length;
    const shd_quoted quoted = twice ? key_before(text, end) : shd_quote(error->text);
    const char *what = quoted.text;
    if (code == json_error_null_character)
        what = "\\u0000 is not allowed in strings";
    else if (!twice && length >= 3 && !memcmp(text, "\xef\xbb\xbf", 3))
        what = "a byte order mark stands before the document";
    else if (code == json_error_stack_overflow)
        what = "the document is nested too deeply";
    shd_report_error(report, SHD_SYNTAX, "", "line %d, column %d: %s%s%s", report->line,
                     report->column, twice ? "the key \"" : "", what,
                     twice ? "\" is there twice" : "");
}

/* The part of a text that is left. */
typedef struct source {
    const char *at, *end;
    const atomic_bool *cancelled;
} source;

/* Jansson reads on as long as it gets bytes, and takes an error for the text's end. */
static size_t give_some(void *buffer, size_t room, void *context) {
    source *from = context;
    const size_t left = (size_t)(from->end - from->at), some = left < room ? left : room;
    if (shd_is_cancelled(from->cancelled)) return (size_t)-1;
    memcpy(buffer, from->at, some);
    from->at += some;
    return some;
}

static json_t *load_tree(const char *text, size_t length, const atomic_bool *cancelled,
                         json_error_t *error) {
    source from = {text, text + length, cancelled};
    return json_load_callback(give_some, &from,
                              JSON_REJECT_DUPLICATES | JSON_DECODE_INT_AS_REAL | JSON_DECODE_ANY,
                              error);
}

/* Whether the tree may be made, and the bytes that it takes. */
static bool tree_fits(const char *text, size_t length, size_t longest, size_t memory, size_t *out,
                      shd_report *report) {
    size_t values;
    const size_t bytes = *out = tree_bytes(text, length, &values);
    if (longest > LONGEST_STRING) {
        shd_report_error(report, SHD_LIMIT, "", "a string has %zu bytes; at most %d are read",
                         longest, LONGEST_STRING);
    } else if (bytes > memory) {
        shd_report_error(report, SHD_LIMIT, "",
                         "reading the document takes about %zu bytes; the limit `memory` is %zu",
                         bytes, memory);
        shd_report_limit(report, SHD_LIMIT_MEMORY);
    } else if (values > MOST_VALUES) {
        shd_report_error(report, SHD_LIMIT, "",
                         "the document has about %zu values beside the numbers of meshes; at most "
                         "%d are read",
                         values, MOST_VALUES);
    } else {
        return true;
    }
    return false;
}

static bool is_cancelled(void *cancelled) {
    return shd_is_cancelled(cancelled);
}

/* The tree of a document that is as most are, which takes up to `bytes`. NULL: jansson has to make
 * it. */
static json_t *make_quickly(const char *text, size_t length, size_t bytes, bool constant,
                            const atomic_bool *cancelled, shd_arena *arena, shd_json *json) {
    const size_t working = shd_quick_working(length);
    if (length < QUICK_LEAST || length > QUICK_MOST || json->packs.escapes ||
        !shd_arena_try_borrow(arena, working))
        return NULL;
    json->block = constant ? malloc(bytes) : NULL;
    if (json->block) shd_json_memory_enter(json->block, bytes);
    json_t *tree = shd_quick_tree(text, length, is_cancelled, (void *)cancelled);
    if (tree && json->packs.count && !shd_pack_mark(tree, &json->packs)) {
        json_decref(tree);
        tree = NULL;
    }
    if (json->block) shd_json_memory_leave();
    if (!tree) {
        free(json->block);
        json->block = NULL;
    }
    shd_arena_repay(arena, working);
    return tree;
}

/* Makes the tree of a document; `copy` has room for it. Nothing is reported of a cancellation, or
 * if the system has no room for the tree. */
static json_t *make_tree(const char *text, size_t length, char *copy, size_t memory, bool constant,
                         const atomic_bool *cancelled, shd_arena *arena, shd_json *json,
                         shd_report *report) {
    shd_packs *packs = &json->packs;
    const size_t packed = shd_pack_arrays(text, length, copy, cancelled, arena, packs);
    const char *const given = packs->count || !packs->escapes ? copy : text;
    const size_t size = packs->count ? packed : length;
    size_t bytes = 0;
    if (!packs->full && !tree_fits(given, size, packs->longest, memory, &bytes, report))
        return NULL;
    if (packs->full || !shd_arena_borrow(arena, length + bytes)) {
        shd_report_error(report, SHD_MEMORY, "", "the limit `memory` is reached by the document");
        return NULL;
    }
    json->borrowed = length + bytes;
    json_t *tree = make_quickly(given, size, bytes, constant, cancelled, arena, json);
    if (tree) return tree;
    json_error_t error;
    tree = load_tree(given, size, cancelled, &error);
    const bool marked = !tree || !packs->count || shd_pack_mark(tree, packs);
    /* Reading may have gone on without memory: numbers are then other ones. */
    if (tree && (!marked || shd_json_memory_short())) {
        json_decref(tree);
        tree = NULL;
    } else if (!tree && packs->count && !shd_json_memory_short()) {
        /* Finds in the document itself where it is wrong. */
        memcpy(copy, text, length);
        shd_pack_blank(packs, copy);
        json_decref(load_tree(copy, length, cancelled, &error));
    }
    if (!tree && !shd_is_cancelled(cancelled) && !shd_json_memory_short())
        report_syntax(text, length, &error, report);
    return tree;
}

bool shd_json_parse(const char *text, size_t length, size_t memory, bool constant,
                    const atomic_bool *cancelled, shd_arena *arena, shd_json *out,
                    shd_report *report) {
    size_t first = 0;
    while (first < length && memchr(" \t\r\n", text[first], 4)) first++;
    if (first == length) {
        report->line = report->column = 1;
        shd_report_error(report, SHD_SYNTAX, "", "line 1, column 1: the document is empty");
        return false;
    }
    shd_json_memory_watch();
    char *copy = length > SIZE_MAX - SHD_QUICK_PADDING ? NULL : malloc(length + SHD_QUICK_PADDING);
    shd_json json = {.tree = NULL};
    if (copy)
        json.tree =
            make_tree(text, length, copy, memory, constant, cancelled, arena, &json, report);
    free(copy);
    if (json.tree) {
        *out = json;
        return true;
    }
    shd_json_drop(&json, arena);
    if (shd_is_cancelled(cancelled))
        shd_report_error(report, SHD_CANCELLED, "", "the reading was cancelled");
    else if (report->status == SHD_OK)
        shd_report_error(report, SHD_MEMORY, "", "there is not enough memory for the document");
    return false;
}

void shd_json_drop(shd_json *json, shd_arena *arena) {
    if (!json->block) json_decref(json->tree);
    free(json->block);
    shd_arena_repay(arena, json->borrowed);
}
