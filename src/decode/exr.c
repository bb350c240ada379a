/* Whether the blocks of an OpenEXR file's rows are where its table says, and unpack as zlib has
 * them, which takes a twentieth of what it takes to decode them. OpenEXR comes to a damaged block
 * only behind all before it. "OpenEXR File Layout" (openexr.com); RFC 1950.
 *
 * Of one part in rows. Others, and what cannot be told here, are left to OpenEXR: a table with
 * gaps, which it makes anew, among them. */
#include <libdeflate.h>
#include <stdlib.h>
#include <string.h>

#include "decode/decode.h"

enum { TILED = 0x200, DEEP = 0x800, PARTS = 0x1000 };
enum { ZIPS = 2, ZIP = 3, COMPRESSIONS = 10 };

/* Of a block, unpacked: larger ones are left to OpenEXR. */
enum { BLOCK_MOST = 32 << 20 };

typedef struct blocks {
    const unsigned char *data;
    size_t size, table; /* where the table is */
    int64_t left, top, right, bottom;
    int compression;
    size_t pixel; /* bytes; 0: rows differ, or that is not known */
} blocks;

static uint32_t get_u32(const unsigned char *from) {
    return from[0] | (uint32_t)from[1] << 8 | (uint32_t)from[2] << 16 | (uint32_t)from[3] << 24;
}

static uint64_t get_u64(const unsigned char *from) {
    return get_u32(from) | (uint64_t)get_u32(from + 4) << 32;
}

/* ---- The head ---- */

/* Past a text and its 0. More than `size`: there is none. */
static size_t skip_text(const blocks *b, size_t at) {
    const unsigned char *end = at < b->size ? memchr(b->data + at, 0, b->size - at) : NULL;
    return end ? (size_t)(end + 1 - b->data) : b->size + 1;
}

/* Of each channel: its name, type (u32), four bytes, and each how many columns and rows it is. */
static size_t find_pixel(const blocks *b, size_t at, size_t end) {
    static const size_t widths[] = {4, 2, 4}; /* u32, half, float */
    size_t pixel = 0;
    while (at < end && b->data[at]) {
        at = skip_text(b, at);
        if (at > end || end - at < 16) return 0;
        const uint32_t type = get_u32(b->data + at);
        if (type > 2 || get_u32(b->data + at + 8) != 1 || get_u32(b->data + at + 12) != 1) return 0;
        pixel += widths[type];
        at += 16;
    }
    return pixel;
}

static void take_attribute(blocks *b, const char *name, size_t at, size_t length) {
    const unsigned char *value = b->data + at;
    if (!strcmp(name, "channels")) b->pixel = find_pixel(b, at, at + length);
    if (!strcmp(name, "compression") && length == 1) b->compression = *value;
    if (strcmp(name, "dataWindow") != 0 || length != 16) return;
    b->left = (int32_t)get_u32(value);
    b->top = (int32_t)get_u32(value + 4);
    b->right = (int32_t)get_u32(value + 8);
    b->bottom = (int32_t)get_u32(value + 12);
}

/* Attributes are a name, a type, a length and a value; nothing is behind the last. */
static bool read_head(blocks *b) {
    if (b->size < 8 || get_u32(b->data + 4) & (TILED | DEEP | PARTS)) return false;
    size_t at = 8;
    while (at < b->size && b->data[at]) {
        const char *name = (const char *)b->data + at;
        at = skip_text(b, at);
        if (at < b->size) at = skip_text(b, at);
        if (at > b->size || b->size - at < 4) return false;
        const size_t length = get_u32(b->data + at);
        at += 4;
        if (length > b->size - at) return false;
        take_attribute(b, name, at, length);
        at += length;
    }
    b->table = at + 1;
    return at < b->size && b->right >= b->left && b->bottom >= b->top &&
           b->compression < COMPRESSIONS;
}

/* ---- Blocks ---- */

static int64_t rows_of(const blocks *b) {
    static const int rows[COMPRESSIONS] = {1, 1, 1, 16, 32, 16, 32, 32, 32, 256};
    return rows[b->compression];
}

static size_t count_blocks(const blocks *b) {
    return (size_t)((b->bottom - b->top) / rows_of(b) + 1);
}

typedef enum place { IN_PLACE, ELSEWHERE, BEYOND } place;

/* A block is its first row, its length, and so many bytes, which is where *block is. */
static place find_block(const blocks *b, size_t index, const unsigned char **block,
                        size_t *length) {
    const uint64_t at = get_u64(b->data + b->table + 8 * index);
    if (at > b->size || b->size - at < 8) return BEYOND;
    *block = b->data + at + 8;
    *length = get_u32(b->data + at + 4);
    const int64_t row = b->top + (int64_t)index * rows_of(b);
    if ((int32_t)get_u32(b->data + at) != row) return ELSEWHERE;
    return *length <= b->size - at - 8 ? IN_PLACE : BEYOND;
}

/* A table with gaps is in place: OpenEXR is to look at it. */
static place find_all(const blocks *b, size_t count) {
    place worst = IN_PLACE;
    for (size_t i = 0; i < count; i++) {
        const unsigned char *block;
        size_t length;
        if ((int64_t)get_u64(b->data + b->table + 8 * i) <= 0) return IN_PLACE;
        const place here = find_block(b, i, &block, &length);
        if (here > worst) worst = here;
    }
    return worst;
}

/* What did not become shorter is as it was. Blocks may be within others: once so much was read as
 * there is in the file, or unpacked as all pictures have that are read, the rest is OpenEXR's to
 * judge. */
static bool unpack_all(const blocks *b, size_t count, struct libdeflate_decompressor *unpacker,
                       void *room, uint64_t bytes) {
    uint64_t left = b->size, room_left = (uint64_t)2 << 30;
    for (size_t i = 0; i < count; i++) {
        const unsigned char *block;
        size_t length, made;
        const int64_t rows =
            i + 1 < count ? rows_of(b) : b->bottom - b->top + 1 - (int64_t)i * rows_of(b);
        const size_t whole = (size_t)(bytes * (uint64_t)rows);
        if (find_block(b, i, &block, &length) != IN_PLACE || length >= whole) continue;
        if (length > left || whole > room_left) break;
        left -= length;
        room_left -= whole;
        if (libdeflate_zlib_decompress(unpacker, block, length, room, whole, &made) !=
            LIBDEFLATE_SUCCESS)
            return false;
    }
    return true;
}

static bool do_unpack(const blocks *b, size_t count) {
    const uint64_t wide = (uint64_t)(b->right - b->left) + 1, row = wide * b->pixel,
                   block = row * (uint64_t)rows_of(b);
    if ((b->compression != ZIPS && b->compression != ZIP) || !b->pixel || wide > BLOCK_MOST ||
        block > BLOCK_MOST)
        return true;
    struct libdeflate_decompressor *unpacker = libdeflate_alloc_decompressor();
    void *room = malloc((size_t)block);
    const bool good = !unpacker || !room || unpack_all(b, count, unpacker, room, row);
    free(room);
    libdeflate_free_decompressor(unpacker);
    return good;
}

shd_status shd_decode_check_exr(const unsigned char *data, size_t size, shd_error *error) {
    blocks b = {.data = data, .size = size, .compression = COMPRESSIONS};
    if (!read_head(&b)) return SHD_OK;
    const size_t count = count_blocks(&b);
    if (count > (size - b.table) / 8) return shd_decode_ends_early("EXR", error);
    const place all = find_all(&b, count);
    if (all == BEYOND) return shd_decode_ends_early("EXR", error);
    if (all == ELSEWHERE)
        return shd_fail(error, SHD_SCENE, "", "EXR: a block of rows is not where it is to be");
    return do_unpack(&b, count)
               ? SHD_OK
               : shd_fail(error, SHD_SCENE, "", "EXR: a block of rows does not unpack");
}
