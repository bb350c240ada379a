/* Mutates scene documents as trees, so that most mutants are JSON: values are changed, removed,
 * copied to other places, and members appear whose names are in the schema. */
#include <jansson.h>
#include <string.h>

#include "fuzz.h"

size_t LLVMFuzzerMutate(uint8_t *data, size_t size, size_t most);
size_t LLVMFuzzerCustomMutator(uint8_t *data, size_t size, size_t most, unsigned seed);
size_t LLVMFuzzerCustomCrossOver(const uint8_t *a, size_t a_size, const uint8_t *b, size_t b_size,
                                 uint8_t *out, size_t most, unsigned seed);

extern const unsigned char shd_embedded_schema[];
extern const unsigned long shd_embedded_schema_size;

enum { NAMES_MOST = 512, PLACES_MOST = 2048, EDITS_MOST = 4 };

static const char *names[NAMES_MOST]; /* of members and choices */
static size_t name_count;

/* A value that may be replaced: where it is, and what it is. */
typedef struct place {
    json_t *parent;
    const char *key; /* NULL: an array's item */
    size_t index;
    json_t *value;
} place;

typedef struct places {
    place list[PLACES_MOST];
    size_t count;
} places;

/* ---- Chance ---- */

static uint64_t state;

static size_t below(size_t count) {
    state = state * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return (size_t)(state >> 33) % count;
}

static void collect_names(const json_t *value) {
    const char *key;
    json_t *item;
    size_t i;
    if (json_is_object(value)) {
        json_object_foreach((json_t *)(size_t)value, key, item) {
            if (name_count < NAMES_MOST) names[name_count++] = key;
            /* Prose only grows documents. */
            if (strcmp(key, "description")) collect_names(item);
        }
    } else if (json_is_array(value)) {
        json_array_foreach(value, i, item) collect_names(item);
    } else if (json_is_string(value) && name_count < NAMES_MOST) {
        names[name_count++] = json_string_value(value);
    }
}

/* The schema's tree lives as long as the program: the names are its own. */
static const char *a_name(void) {
    static json_t *schema;
    if (!schema) {
        schema = json_loadb((const char *)shd_embedded_schema, shd_embedded_schema_size, 0, NULL);
        CHECK(schema);
        collect_names(schema);
    }
    return names[below(name_count)];
}

static double a_number(double old) {
    static const double edges[] = {0,
                                   -0.0,
                                   1,
                                   -1,
                                   0.5,
                                   2,
                                   1e-3,
                                   1e3,
                                   1e-45,
                                   1e-38,
                                   1.2e-38,
                                   3.4e38,
                                   3.5e38,
                                   -3.4e38,
                                   1e-308,
                                   5e-324,
                                   1e308,
                                   1e100,
                                   1e-100,
                                   1e15,
                                   90,
                                   180,
                                   179.999,
                                   360,
                                   255,
                                   256,
                                   65504,
                                   65520,
                                   65535,
                                   65536,
                                   8388608,
                                   16777216,
                                   16777217,
                                   2147483647,
                                   2147483648.0,
                                   4294967296.0,
                                   9007199254740993.0,
                                   64};
    switch (below(8)) {
    case 0:
        return -old;
    case 1:
        return old + (double)below(3) - 1;
    case 2:
        return old * (below(2) ? 1e-3 : 2);
    case 3:
        return old * (1 + 1e-7 * ((double)below(21) - 10));
    case 4:
        return (double)below(2001) / 1000 - 1;
    case 5:
        return (double)below(12);
    default:
        return edges[below(sizeof edges / sizeof *edges)];
    }
}

/* ---- Trees ---- */

static json_t *load(const uint8_t *data, size_t size) {
    return json_loadb((const char *)data, size, JSON_DECODE_INT_AS_REAL, NULL);
}

static void collect(json_t *parent, const char *key, size_t index, json_t *value, places *out) {
    if (out->count < PLACES_MOST) out->list[out->count++] = (place){parent, key, index, value};
    const char *name;
    json_t *item;
    size_t i;
    if (json_is_object(value))
        json_object_foreach(value, name, item) collect(value, name, 0, item, out);
    if (json_is_array(value)) json_array_foreach(value, i, item) collect(value, NULL, i, item, out);
}

static const place *find(json_t *tree, places *out) {
    out->count = 0;
    collect(NULL, NULL, 0, tree, out);
    return out->count > 1 ? &out->list[1 + below(out->count - 1)] : NULL;
}

/* Takes the reference to `value`. JSON has no infinite numbers, and NULL changes nothing. */
static void replace(const place *at, json_t *value) {
    if (!value) return;
    if (at->key)
        json_object_set_new(at->parent, at->key, value);
    else
        json_array_set_new(at->parent, at->index, value);
}

static json_t *a_scalar(void) {
    switch (below(5)) {
    case 0:
        return json_string(a_name());
    case 1:
        return below(2) ? json_null() : json_boolean(below(2));
    case 2:
        return below(2) ? json_array() : json_object();
    default:
        return json_real(a_number(1));
    }
}

static void edit(json_t *tree, places *all) {
    const place *at = find(tree, all);
    if (!at) return;
    const place *other = &all->list[1 + below(all->count - 1)];
    switch (below(json_is_real(at->value) ? 4 : 12)) {
    case 4:
        if (at->key)
            json_object_del(at->parent, at->key);
        else
            json_array_remove(at->parent, at->index);
        break;
    case 5:
        replace(at, a_scalar());
        break;
    case 6:
        replace(at, json_deep_copy(other->value));
        break;
    case 7:
        if (json_is_array(at->value))
            json_array_append_new(at->value, json_deep_copy(other->value));
        break;
    case 8:
        if (json_is_object(at->value) && other->key)
            json_object_set_new(at->value, other->key, json_deep_copy(other->value));
        break;
    case 9:
        if (json_is_object(at->value)) json_object_set_new(at->value, a_name(), a_scalar());
        break;
    case 10:
        json_object_set_new(tree, a_name(), a_scalar());
        break;
    default:
        if (json_is_real(at->value))
            replace(at, json_real(a_number(json_real_value(at->value))));
        else if (json_is_string(at->value))
            replace(at, json_string(a_name()));
    }
}

/* 0 where the tree does not fit. */
static size_t dump(const json_t *tree, uint8_t *out, size_t most) {
    size_t size = json_dumpb(tree, (char *)out, most, JSON_COMPACT | JSON_ENCODE_ANY);
    return size <= most ? size : 0;
}

size_t LLVMFuzzerCustomMutator(uint8_t *data, size_t size, size_t most, unsigned seed) {
    static places all;
    state = seed;
    json_t *tree = below(BYTES_EVERY) ? load(data, size) : NULL;
    if (!json_is_object(tree)) {
        json_decref(tree);
        return LLVMFuzzerMutate(data, size, most);
    }
    for (size_t edits = 1 + below(EDITS_MOST); edits; edits--) edit(tree, &all);
    size_t used = dump(tree, data, most);
    json_decref(tree);
    return used ? used : LLVMFuzzerMutate(data, size, most);
}

/* A value of the second document takes a place in the first one, of the same name where it can. */
size_t LLVMFuzzerCustomCrossOver(const uint8_t *a, size_t a_size, const uint8_t *b, size_t b_size,
                                 uint8_t *out, size_t most, unsigned seed) {
    static places to, from;
    state = seed;
    json_t *first = load(a, a_size), *second = load(b, b_size);
    const place *at = find(first, &to), *source = find(second, &from);
    size_t used = 0;
    for (size_t i = 0; at && source && i < to.count; i++)
        if (source->key && to.list[i].key && !strcmp(source->key, to.list[i].key)) at = &to.list[i];
    if (at && source) {
        replace(at, json_deep_copy(source->value));
        used = dump(first, out, most);
    }
    json_decref(first);
    json_decref(second);
    return used;
}
