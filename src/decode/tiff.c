/* Whether all that a TIFF file says to hold of its first picture is in it: libtiff notices what is
 * missing only when it comes there. TIFF Revision 6.0, and BigTIFF, whose counts and places have 64
 * bits. */
#include <stdint.h>

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
    bool is_packed, is_tiled;
} picture;

enum {
    WIDTH = 256,
    HEIGHT = 257,
    BITS = 258, /* of each sample */
    COMPRESSION = 259,
    KIND = 262, /* what samples are */
    STRIPS = 273,
    SAMPLES = 277,
    STRIP_SIZES = 279,
    PLANES = 284, /* 2: each sample has strips of its own */
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
    if (tag == COMPRESSION) out->is_packed = get_number(f, at + 4 + word, 2) != 1;
    if (tag == WIDTH) out->wide = first;
    if (tag == HEIGHT) out->high = first;
    if (tag == BITS) out->bits = first;
    if (tag == KIND) out->kind = first;
    if (tag == SAMPLES) out->samples = first;
    if (tag == PLANES) out->planes = first;
}

/* False: there is none where it is to be. */
static bool read_directory(const file *f, picture *out) {
    const unsigned word = f->big ? 8 : 4, counter = f->big ? 8 : 2, entry = f->big ? 20 : 12;
    if (!has(f, word, word)) return false;
    const uint64_t start = get_number(f, word, word);
    if (!has(f, start, counter)) return false;
    const uint64_t count = get_number(f, start, counter);
    if (count > f->size / entry || !has(f, start + counter, count * entry)) return false;
    *out = (picture){.bits = 1, .samples = 1, .planes = 1};
    for (uint64_t i = 0; i < count; i++) read_entry(f, start + counter + i * entry, out);
    return true;
}

static bool has_list(const file *f, const list *l) {
    return l->width && l->count <= f->size && has(f, l->at, l->count * l->width);
}

/* Bytes of all rows that are not packed. 0: that is not known, or more than any file has. */
static uint64_t count_bytes(const picture *p) {
    enum { YCBCR = 6 }; /* of which some samples are for several pixels */
    const uint64_t most = UINT32_MAX;
    if (p->kind == YCBCR || (p->planes != 1 && p->samples != 1) || p->wide > most ||
        p->high > most || p->bits > 64 || p->samples > UINT16_MAX)
        return 0;
    const uint64_t row = (p->wide * p->samples * p->bits + 7) / 8;
    return row && p->high <= UINT64_MAX / row ? row * p->high : 0;
}

shd_status shd_decode_walk_tiff(const unsigned char *data, size_t size, shd_error *error) {
    file f = {.data = data, .size = size, .high_first = *data == 'M'};
    f.big = get_number(&f, 2, 2) == 43;
    picture p;
    if (!read_directory(&f, &p)) return shd_decode_ends_early("TIFF", error);
    /* One strip that is not packed is as long as its pixels are, whatever is said of it. */
    if (p.starts.count == 1 && !p.is_packed && p.starts.width) {
        if (!has_list(&f, &p.starts)) return shd_decode_ends_early("TIFF", error);
        const uint64_t start = get_number(&f, p.starts.at, p.starts.width);
        return p.is_tiled || has(&f, start, count_bytes(&p)) ? SHD_OK
                                                             : shd_decode_ends_early("TIFF", error);
    }
    if (!p.starts.width || !p.sizes.width) return SHD_OK;
    if (!has_list(&f, &p.starts) || !has_list(&f, &p.sizes))
        return shd_decode_ends_early("TIFF", error);
    for (uint64_t i = 0; i < p.starts.count && i < p.sizes.count; i++)
        if (!has(&f, get_number(&f, p.starts.at + i * p.starts.width, p.starts.width),
                 get_number(&f, p.sizes.at + i * p.sizes.width, p.sizes.width)))
            return shd_decode_ends_early("TIFF", error);
    return SHD_OK;
}
