/* Whether all that a TIFF file says to hold of its first picture is in it, and unpacks if it is
 * zlib's: libtiff notices what is missing or damaged only when it comes there, and does not look at
 * all sums. TIFF Revision 6.0, and BigTIFF, whose counts and places have 64
 * bits. */
#include <libdeflate.h>
#include <stdint.h>
#include <stdlib.h>

#include "decode/decode.h"

typedef struct file {
    const unsigned char *data;
    size_t size;
    bool high_first; /* of a number's bytes */
    bool big;
} file;

/* What a tag has: `count` numbers of `width` bytes at `at`. */
typedef struct list {
    uint64_t count, at;
    unsigned width;
} list;

typedef struct picture {
    list starts, sizes; /* of strips, or of tiles */
    uint64_t wide, high, bits, kind, samples, planes;
    uint64_t rows, tile_wide, tile_high, packing, fill;
    bool is_tiled;
} picture;

/* How samples are packed; two are zlib's. */
enum { PLAIN = 1, ZLIB = 8, OLD_ZLIB = 32946 };

enum {
    WIDTH = 256,
    HEIGHT = 257,
    BITS = 258, /* of each sample */
    COMPRESSION = 259,
    KIND = 262, /* what samples are */
    FILL = 266, /* 2: bits of packed bytes are the other way round */
    STRIPS = 273,
    SAMPLES = 277,
    ROWS = 278, /* of a strip */
    STRIP_SIZES = 279,
    PLANES = 284, /* 2: each sample has strips of its own */
    TILE_WIDTH = 322,
    TILE_HEIGHT = 323,
    TILES = 324,
    TILE_SIZES = 325
};

/* The caller has looked whether it is in the file. */
static uint64_t get_number(const file *f, uint64_t at, unsigned width) {
    uint64_t number = 0;
    for (unsigned i = 0; i < width; i++)
        number |= (uint64_t)f->data[at + (f->high_first ? width - 1 - i : i)] << (8 * i);
    return number;
}

static bool has(const file *f, uint64_t at, uint64_t bytes) {
    return at <= f->size && bytes <= f->size - at;
}

/* One entry of the directory: a tag, a type, a count, and what is so short or where it is. */
static void read_entry(const file *f, uint64_t at, picture *out) {
    const unsigned word = f->big ? 8 : 4;
    const uint64_t tag = get_number(f, at, 2), type = get_number(f, at + 2, 2);
    list found = {.count = get_number(f, at + 4, word),
                  .at = at + 4 + word,
                  .width = type == 3    ? 2
                           : type == 4  ? 4
                           : type == 16 ? 8
                                        : 0};
    if (!found.width) return;
    if (found.count > word / found.width) found.at = get_number(f, found.at, word);
    const uint64_t first = has(f, found.at, found.width) ? get_number(f, found.at, found.width) : 0;
    if (tag == STRIPS || tag == TILES) out->starts = found;
    if (tag == STRIP_SIZES || tag == TILE_SIZES) out->sizes = found;
    out->is_tiled |= tag == TILES;
    if (tag == COMPRESSION) out->packing = get_number(f, at + 4 + word, 2);
    if (tag == WIDTH) out->wide = first;
    if (tag == HEIGHT) out->high = first;
    if (tag == BITS) out->bits = first;
    if (tag == KIND) out->kind = first;
    if (tag == SAMPLES) out->samples = first;
    if (tag == PLANES) out->planes = first;
    if (tag == FILL) out->fill = first;
    if (tag == ROWS) out->rows = first;
    if (tag == TILE_WIDTH) out->tile_wide = first;
    if (tag == TILE_HEIGHT) out->tile_high = first;
}

/* False: there is none where it is to be. */
static bool read_directory(const file *f, picture *out) {
    const unsigned word = f->big ? 8 : 4, counter = f->big ? 8 : 2, entry = f->big ? 20 : 12;
    if (!has(f, word, word)) return false;
    const uint64_t start = get_number(f, word, word);
    if (!has(f, start, counter)) return false;
    const uint64_t count = get_number(f, start, counter);
    if (count > f->size / entry || !has(f, start + counter, count * entry)) return false;
    *out = (picture){
        .bits = 1, .samples = 1, .planes = 1, .packing = PLAIN, .fill = 1, .rows = UINT64_MAX};
    for (uint64_t i = 0; i < count; i++) read_entry(f, start + counter + i * entry, out);
    return true;
}

static bool has_list(const file *f, const list *l) {
    return l->width && l->count <= f->size && has(f, l->at, l->count * l->width);
}

/* Bytes of so many rows and columns, not packed, of the samples that are together. 0: that is not
 * known, or more than any file has. */
static uint64_t count_bytes(const picture *p, uint64_t wide, uint64_t high) {
    enum { YCBCR = 6 }; /* of which some samples are for several pixels */
    const uint64_t most = UINT32_MAX;
    if (p->kind == YCBCR || wide > most || high > most || p->bits > 64 || p->samples > UINT16_MAX)
        return 0;
    const uint64_t samples = p->planes == 1 ? p->samples : 1,
                   row = (wide * samples * p->bits + 7) / 8;
    return row && high <= UINT64_MAX / row ? row * high : 0;
}

/* The place and length of a strip or a tile. False: they are not in the file. */
static bool find_piece(const file *f, const picture *p, uint64_t i, uint64_t *at, uint64_t *size) {
    *at = get_number(f, p->starts.at + i * p->starts.width, p->starts.width);
    *size = get_number(f, p->sizes.at + i * p->sizes.width, p->sizes.width);
    return has(f, *at, *size);
}

shd_status shd_decode_walk_tiff(const unsigned char *data, size_t size, shd_error *error) {
    file f = {.data = data, .size = size, .high_first = *data == 'M'};
    f.big = get_number(&f, 2, 2) == 43;
    picture p;
    if (!read_directory(&f, &p)) return shd_decode_ends_early("TIFF", error);
    /* One strip that is not packed is as long as its pixels are, whatever is said of it. */
    if (p.starts.count == 1 && p.packing == PLAIN && p.starts.width) {
        if (!has_list(&f, &p.starts)) return shd_decode_ends_early("TIFF", error);
        const uint64_t start = get_number(&f, p.starts.at, p.starts.width),
                       bytes =
                           p.planes == 1 || p.samples == 1 ? count_bytes(&p, p.wide, p.high) : 0;
        return p.is_tiled || has(&f, start, bytes) ? SHD_OK : shd_decode_ends_early("TIFF", error);
    }
    if (!p.starts.width || !p.sizes.width) return SHD_OK;
    if (!has_list(&f, &p.starts) || !has_list(&f, &p.sizes))
        return shd_decode_ends_early("TIFF", error);
    for (uint64_t i = 0, at, length; i < p.starts.count && i < p.sizes.count; i++)
        if (!find_piece(&f, &p, i, &at, &length)) return shd_decode_ends_early("TIFF", error);
    return SHD_OK;
}

/* How many strips or tiles the picture has; a file may list more, which nobody reads. */
static uint64_t count_pieces(const picture *p, uint64_t rows) {
    const uint64_t planes = p->planes == 1 ? 1 : p->samples;
    if (!p->is_tiled) return planes * ((p->high + rows - 1) / rows);
    return planes * ((p->high + p->tile_high - 1) / p->tile_high) *
           ((p->wide + p->tile_wide - 1) / p->tile_wide);
}

/* A whole tile is unpacked, however little of it is the picture's: 70 kB can name 32 GB. */
static bool has_vast_tiles(const picture *p) {
    if (!p->is_tiled || !p->tile_wide || !p->tile_high) return false;
    const double wide = (double)p->wide, high = (double)p->high, whole = wide * high,
                 all = (wide + (double)p->tile_wide - 1) * (high + (double)p->tile_high - 1);
    return all > 1 << 27 && all > 64 * whole;
}

/* One piece that is longer than `bytes`, which libtiff reads as far as it wants: a whole one has
 * the sum that it ends with all the same, and a spoilt one seldom. *spare is how much may be
 * unpacked for that, of all pieces. */
static bool is_whole(struct libdeflate_decompressor *unpacker, const unsigned char *from,
                     size_t length, size_t *spare) {
    enum { EXPANSION = 1032 }; /* the most of deflate */
    const size_t most = length < *spare / EXPANSION ? length * EXPANSION : *spare;
    size_t made;
    void *room = most ? malloc(most) : NULL;
    if (!room) return true;
    *spare -= most;
    const enum libdeflate_result result =
        libdeflate_zlib_decompress(unpacker, from, length, room, most, &made);
    free(room);
    return result != LIBDEFLATE_BAD_DATA;
}

enum { PIECE_MOST = 64 << 20 };

/* Of `count` pieces of `bytes`, as far as these are not more than all pictures' that are read.
 * Pieces may be where others are: once so much was read as there is in the file, all others are
 * libtiff's to judge, and so is one that is shorter than it is to be, or longer, as which some
 * write the last strip. */
static bool unpack_all(const file *f, const picture *p, struct libdeflate_decompressor *unpacker,
                       uint64_t count, void *room, size_t bytes) {
    const uint64_t all_most = (uint64_t)2 << 30;
    uint64_t left = f->size;
    size_t spare = PIECE_MOST;
    for (uint64_t i = 0, at, length; i < count && i <= all_most / bytes; i++) {
        size_t made;
        if (!find_piece(f, p, i, &at, &length) || !length) continue;
        if (length > left) break;
        left -= length;
        const unsigned char *from = f->data + at;
        const enum libdeflate_result result =
            libdeflate_zlib_decompress(unpacker, from, (size_t)length, room, bytes, &made);
        if (result == LIBDEFLATE_BAD_DATA) return false;
        if (result == LIBDEFLATE_INSUFFICIENT_SPACE &&
            !is_whole(unpacker, from, (size_t)length, &spare))
            return false;
    }
    return true;
}

shd_status shd_decode_check_tiff(const unsigned char *data, size_t size, shd_error *error) {
    file f = {.data = data, .size = size, .high_first = *data == 'M'};
    f.big = get_number(&f, 2, 2) == 43;
    picture p;
    if (!read_directory(&f, &p)) return SHD_OK;
    if (has_vast_tiles(&p))
        return shd_fail(error, SHD_SCENE, "", "TIFF: its tiles are far larger than the picture");
    if ((p.packing != ZLIB && p.packing != OLD_ZLIB) || p.fill != 1 || !has_list(&f, &p.starts) ||
        !has_list(&f, &p.sizes))
        return SHD_OK;
    const uint64_t rows = p.rows < p.high ? p.rows : p.high,
                   bytes = p.is_tiled ? count_bytes(&p, p.tile_wide, p.tile_high)
                                      : count_bytes(&p, p.wide, rows);
    if (!bytes || bytes > PIECE_MOST || p.wide > UINT32_MAX || p.high > UINT32_MAX) return SHD_OK;
    uint64_t count = count_pieces(&p, rows);
    if (p.starts.count < count) count = p.starts.count;
    if (p.sizes.count < count) count = p.sizes.count;
    struct libdeflate_decompressor *unpacker = libdeflate_alloc_decompressor();
    void *room = malloc((size_t)bytes);
    const bool good =
        !unpacker || !room || unpack_all(&f, &p, unpacker, count, room, (size_t)bytes);
    free(room);
    libdeflate_free_decompressor(unpacker);
    return good ? SHD_OK : shd_fail(error, SHD_SCENE, "", "TIFF: its rows do not unpack");
}
