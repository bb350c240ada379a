/* Trees of JSON that simdjson helps to make, held against jansson's. */
#ifndef SHD_TEST_SAME_TREE_H
#define SHD_TEST_SAME_TREE_H

#include <jansson.h>
#include <stdlib.h>
#include <string.h>

#include "scene/quick.h"

/* Whether two trees are the same: members in the same order, strings of the same bytes, numbers of
 * the same kind and of the same bits. */
static bool is_same_tree(json_t *one, json_t *other) {
    if (json_typeof(one) != json_typeof(other)) return false;
    if (json_is_real(one)) {
        const double a = json_real_value(one), b = json_real_value(other);
        return !memcmp(&a, &b, sizeof a);
    }
    if (json_is_string(one))
        return json_string_length(one) == json_string_length(other) &&
               !memcmp(json_string_value(one), json_string_value(other), json_string_length(one));
    if (json_array_size(one) != json_array_size(other)) return false;
    for (size_t i = 0; i < json_array_size(one); i++)
        if (!is_same_tree(json_array_get(one, i), json_array_get(other, i))) return false;
    void *a = json_object_iter(one), *b = json_object_iter(other);
    for (; a && b; a = json_object_iter_next(one, a), b = json_object_iter_next(other, b))
        if (strcmp(json_object_iter_key(a), json_object_iter_key(b)) != 0 ||
            !is_same_tree(json_object_iter_value(a), json_object_iter_value(b)))
            return false;
    return !a && !b;
}

static bool goes_on(void *context) {
    (void)context;
    return false;
}

/* 1: the quick tree of the bytes is jansson's. 0: there is none. -1: they differ, or jansson has
 * none. Bytes with backslashes are not read quickly. */
static int hold_quick_tree(const char *text, size_t length) {
    if (length && memchr(text, '\\', length)) return 0;
    /* In a block of its own, where a sanitizer sees who reads beyond the padding. */
    char *padded = malloc(length + SHD_QUICK_PADDING);
    if (!padded) abort();
    if (length) memcpy(padded, text, length);
    memset(padded + length, '"', SHD_QUICK_PADDING);
    json_t *quick = shd_quick_tree(padded, length, goes_on, NULL);
    free(padded);
    if (!quick) return 0;
    json_t *slow = json_loadb(
        text, length, JSON_REJECT_DUPLICATES | JSON_DECODE_INT_AS_REAL | JSON_DECODE_ANY, NULL);
    const bool same = slow && is_same_tree(quick, slow) && json_equal(quick, slow);
    json_decref(quick);
    json_decref(slow);
    return same ? 1 : -1;
}

#endif
