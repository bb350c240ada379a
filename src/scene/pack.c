#include "scene/pack.h"

#include <string.h>

#include "scene/number.h"

/* ---- In the text ---- */

static inline const char *skip_space(const char *at, const char *end) {
    if (at != end && *at > ' ') return at; /* mostly there is none */
    while (at < end && (*at == ' ' || *at == '\t' || *at == '\n' || *at == '\r')) at++;
    return at;
}

static bool may_be_packed(const char *key, size_t length) {
    static const char *const names[] = {"positions", "normals", "indices"};
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++)
        if (strlen(names[i]) == length && !memcmp(names[i], key, length)) return true;
    return false;
}

/* Room for one more. */
static bool make_room(shd_packs *packs, shd_arena *arena) {
    if (packs->count < packs->capacity) return true;
    const size_t capacity = packs->capacity ? 2 * packs->capacity : 8;
    shd_numbers *arrays = shd_arena_alloc(arena, capacity, sizeof *arrays);
    if (!arrays) return false;
    if (packs->count) memcpy(arrays, packs->arrays, packs->count * sizeof *arrays);
    packs->arrays = arrays;
    packs->capacity = capacity;
    return true;
}

/* Reads numbers and commas up to the array's end. NULL: the array has something else. `rest` is the
 * end of the numbers that stay. */
static const char *read_items(const char *at, const char *end, const atomic_bool *cancelled,
                              double *out, size_t count, const char **rest) {
    enum { ROW = 4096 }; /* numbers between looks at `cancelled` */
    for (size_t i = 0, step = 0; i < count; i++, step++) {
        if (shd_is_cancelled_at(cancelled, step)) return NULL;
        if (i >= SHD_PACK_LEAST && i + 1 < count) {
            const size_t left = count - 1 - i;
            size_t read;
            at = shd_number_read_row(skip_space(at, end), end, out + i, left < ROW ? left : ROW,
                                     &read);
            i += read;
            if (read == ROW && shd_is_cancelled(cancelled)) return NULL;
        }
        at = shd_number_read(skip_space(at, end), end, &out[i]);
        if (!at) return NULL;
        if (i + 1 == SHD_PACK_LEAST) *rest = at;
        at = skip_space(at, end);
        if (at == end || *at != (i + 1 < count ? ',' : ']')) return NULL;
        at++;
    }
    return at;
}

typedef struct packer {
    const char *text, *end, *copied; /* the document, and up to where the copy has it */
    char *out;                       /* the copy's end */
    const atomic_bool *cancelled;
    shd_arena *arena;
    shd_packs *packs;
} packer;

static void copy_until(packer *p, const char *at) {
    memcpy(p->out, p->copied, (size_t)(at - p->copied));
    p->out += at - p->copied;
    p->copied = at;
}

/* In the copy an array has the digits of its index, from the last digit on. They are no longer than
 * the array's numbers. */
static void write_index(packer *p, size_t index) {
    for (int i = 0; i < SHD_PACK_LEAST; i++, index /= 10) {
        if (i) *p->out++ = ',';
        *p->out++ = (char)('0' + index % 10);
    }
}

/* The end of an array of numbers that begins at `at`, if `*at` is its bracket then, else where it
 * has something else or was cancelled. Counts its commas. */
static const char *find_close(const packer *p, const char *at, size_t *commas) {
    enum { CHUNK = 240 }; /* bytes, which bytes can count, so that loops vectorize */
    for (; p->end - at >= CHUNK && !shd_is_cancelled(p->cancelled); at += CHUNK) {
        uint8_t counted = 0, ends = 0;
        for (int i = 0; i < CHUNK; i++) {
            counted += at[i] == ',';
            ends |= (at[i] == ']') | (at[i] == '"') | (at[i] == '[');
        }
        if (ends) break;
        *commas += counted;
    }
    for (; at < p->end && *at != ']' && *at != '"' && *at != '['; at++) {
        *commas += *at == ',';
        if (shd_is_cancelled_at(p->cancelled, (size_t)(p->end - at))) break;
    }
    return at;
}

/* Packs the array that begins at `open`. Returns where reading goes on. */
static const char *pack_array(packer *p, const char *open) {
    shd_packs *packs = p->packs;
    size_t commas = 0;
    const char *const close = find_close(p, open + 1, &commas), *rest = open;
    const size_t count = commas + 1;
    if (close == p->end || *close != ']' || count < SHD_PACK_LEAST) return close;
    double *values = shd_arena_alloc(p->arena, count, sizeof *values);
    packs->full = !values || !make_room(packs, p->arena);
    if (packs->full ||
        read_items(open + 1, p->end, p->cancelled, values, count, &rest) != close + 1)
        return close;
    copy_until(p, open + 1);
    write_index(p, packs->count);
    p->copied = close;
    packs->arrays[packs->count++] =
        (shd_numbers){values, count, (size_t)(rest - p->text), (size_t)(close - p->text)};
    return close;
}

/* The end of the string that begins at `at`, past its quote. */
static const char *skip_string(const char *at, const char *end, bool *escaped) {
    *escaped = false;
    for (at++; at < end && *at != '"'; at++) {
        if (*at != '\\') continue;
        *escaped = true;
        if (++at == end) return end;
    }
    return at < end ? at + 1 : end;
}

size_t shd_pack_arrays(const char *text, size_t length, char *copy, const atomic_bool *cancelled,
                       shd_arena *arena, shd_packs *out) {
    packer p = {text, text + length, text, copy, cancelled, arena, out};
    *out = (shd_packs){.arrays = NULL};
    bool is_plain = true;
    for (const char *at = text; at < p.end && !out->full && !shd_is_cancelled(cancelled);) {
        const char *key = memchr(at, '"', (size_t)(p.end - at));
        if (!key) break;
        bool escaped;
        const char *past = skip_string(key, p.end, &escaped), *colon = skip_space(past, p.end);
        const size_t bytes = (size_t)(past - key);
        out->escapes |= escaped;
        if (past < p.end && bytes > out->longest) out->longest = bytes;
        at = past;
        if (colon == p.end || *colon != ':') continue;
        at = skip_space(colon + 1, p.end);
        if (escaped) is_plain = false; /* it may be one of the names in other letters */
        if (is_plain && at < p.end && *at == '[' && may_be_packed(key + 1, bytes - 2))
            at = pack_array(&p, at);
    }
    copy_until(&p, p.end);
    if (is_plain) return (size_t)(p.out - copy);
    out->count = 0;
    return 0;
}

void shd_pack_blank(const shd_packs *packs, char *text) {
    for (size_t i = 0; i < packs->count; i++)
        for (char *c = text + packs->arrays[i].from; c < text + packs->arrays[i].to; c++)
            if (*c != '\n') *c = ' ';
}

/* ---- In the tree ---- */

/* The index that an array's items tell; SIZE_MAX: the array was not packed. Every array of such a
 * key that is as long and has only numbers is packed, so no other array looks like one by chance or
 * by malice. */
static size_t index_of(const json_t *array, const shd_packs *packs) {
    size_t index = 0;
    if (json_array_size(array) != SHD_PACK_LEAST) return SIZE_MAX;
    for (size_t i = SHD_PACK_LEAST; i > 0; i--) {
        const json_t *item = json_array_get(array, i - 1);
        const double digit = json_is_real(item) ? json_real_value(item) : -1;
        if (!(digit >= 0 && digit <= 9)) return SIZE_MAX;
        index = 10 * index + (size_t)digit;
    }
    return index < packs->count ? index : SIZE_MAX;
}

bool shd_pack_mark(json_t *tree, const shd_packs *packs) {
    if (json_is_array(tree)) {
        size_t i;
        json_t *item;
        json_array_foreach(tree, i, item) if (!shd_pack_mark(item, packs)) return false;
        return true;
    }
    for (void *at = json_object_iter(tree); at; at = json_object_iter_next(tree, at)) {
        json_t *value = json_object_iter_value(at);
        const char *key = json_object_iter_key(at);
        const size_t index = may_be_packed(key, strlen(key)) ? index_of(value, packs) : SIZE_MAX;
        if (index == SIZE_MAX) {
            if (!shd_pack_mark(value, packs)) return false;
        } else if (json_object_iter_set_new(tree, at, json_integer((json_int_t)index))) {
            return false;
        }
    }
    return true;
}
