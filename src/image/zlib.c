#include "image/zlib.h"

#include <libdeflate.h>
#include <string.h>

#include "image/blocks.h"
#include "image/deflate.h"
#include "image/spread.h"

/* What is usual is done by shd_deflate_block. `small` is by libdeflate: of three examples (10, 35
 * and 109 kB usually), its level 9 takes 4, 11 and 60 ms for 9.7, 34 and 95 kB; 10 takes 19, 30 and
 * 97 ms for 9.4, 32 and 88, and 12 takes 200 ms for 8.7, 31 and 87. `fast` stores the bytes. */
enum { STORED = 0, USUAL = 2, SMALL = 10 };

static int level_of(const shd_image *image) {
    if (!image->compression) return USUAL;
    return *image->compression == 'f' ? STORED : SMALL;
}

/* Bytes of a piece at most: SMALL takes 30 ms for so many. */
enum { STORED_PIECE = 400 << 10, SMALL_PIECE = 200 << 10 };

/* What libdeflate 1.14 was seen to take for a compressor of SMALL. To store takes less than 1 MB.
 */
enum { SMALL_COMPRESSOR = 9 << 20 };

/* Bytes before the pieces, behind each but the last, and behind all. */
enum { HEAD = 2, SEAM = 5, SUM = 4 };

typedef struct piece {
    unsigned char *data; /* as a stream of its own, and a seam */
    size_t size;
    uint32_t sum; /* of what is compressed in it */
    bool whole;   /* it can be joined */
} piece;

typedef struct job {
    shd_bytes data;
    shd_isa isa;
    size_t pixel;
    bool wide;
    size_t count, step; /* pieces, and bytes of each but the last */
    size_t room;        /* of a piece's stream */
    int level;
    piece *pieces;
    unsigned char *rooms;                       /* [slots] of shd_deflate_room, if USUAL */
    struct libdeflate_compressor **compressors; /* [slots] */
} job;

static job cut_pieces(const shd_image *image, shd_bytes data, size_t pixel) {
    const int level = level_of(image);
    const size_t most = level == SMALL   ? SMALL_PIECE
                        : level == USUAL ? SHD_DEFLATE_BLOCK
                                         : STORED_PIECE;
    const size_t count = data.size > most ? (data.size + most - 1) / most : 1;
    const size_t step = (data.size + count - 1) / count;
    return (job){.data = data,
                 .isa = image->isa,
                 .pixel = pixel,
                 .count = count,
                 .step = step,
                 .room = level == USUAL ? shd_deflate_bound(step)
                                        : libdeflate_deflate_compress_bound(NULL, step) + SEAM,
                 .level = level};
}

/* Of all compressors, as many as there are at once. */
static size_t find_compressors(const shd_image *image, const job *j) {
    const size_t slots = shd_encode_slots(image);
    return j->level == SMALL ? SMALL_COMPRESSOR * (j->count < slots ? j->count : slots) : 0;
}

static size_t find_rooms(const shd_image *image, const job *j) {
    return j->level == USUAL ? shd_deflate_room() * shd_encode_slots(image) : 0;
}

uint64_t shd_zlib_scratch(const shd_image *image, uint64_t size) {
    const job j = cut_pieces(image, (shd_bytes){NULL, size}, 1);
    return HEAD + j.count * (uint64_t)(j.room + sizeof *j.pieces) + SUM +
           find_compressors(image, &j) + find_rooms(image, &j);
}

/* Lets another block follow: the last one is no longer called so, and an empty stored block, which
 * ends with a whole byte, stands behind it. */
static bool open_end(piece *p) {
    static const unsigned char empty[4] = {0, 0, 0xFF, 0xFF};
    size_t last, end;
    if (!shd_find_last_block(p->data, p->size, &last, &end) || (end + 7) / 8 != p->size)
        return false;
    p->data[last / 8] &= (unsigned char)~(1u << last % 8);
    if (end % 8 == 0 || end % 8 > 5) p->data[p->size++] = 0;
    memcpy(p->data + p->size, empty, sizeof empty);
    p->size += sizeof empty;
    return true;
}

static void compress_piece(void *context, size_t index, unsigned slot) {
    job *j = context;
    piece *p = &j->pieces[index];
    const bool last = index + 1 == j->count;
    const size_t first = index * j->step, size = last ? j->data.size - first : j->step;
    const unsigned char *data = j->data.data + first;
    p->sum = libdeflate_adler32(1, data, size);
    if (j->level == USUAL) {
        p->size = shd_deflate_block(j->isa, j->rooms + slot * shd_deflate_room(), data, first, size,
                                    j->pixel, j->wide, last, p->data);
        p->whole = true;
        return;
    }
    if (!j->compressors[slot]) j->compressors[slot] = libdeflate_alloc_compressor(j->level);
    if (!j->compressors[slot]) return;
    p->size =
        libdeflate_deflate_compress(j->compressors[slot], data, size, p->data, j->room - SEAM);
    p->whole = last || open_end(p);
}

/* The sum of bytes and `size` more behind them. Its halves are 1 and all bytes, and what that was
 * after each byte, modulo the largest prime of 16 bits (RFC 1950). */
static uint32_t join_sums(uint32_t sum, uint32_t more, uint64_t size) {
    enum { PRIME = 65521, HALF = 16, LOW = 0xffff };
    const uint64_t before = (sum & LOW) + PRIME - 1, low = before + (more & LOW),
                   high = (sum >> HALF) + (more >> HALF) + size % PRIME * (before % PRIME);
    return (uint32_t)(high % PRIME << HALF | low % PRIME);
}

/* Moves the pieces together, in place. */
static shd_status join_pieces(const shd_image *image, const job *j, unsigned char *stream,
                              shd_bytes *out, shd_error *error) {
    /* By RFC 1950: a window of 32 kB, and how much was compressed: not, fast or most. */
    unsigned char *at = stream;
    *at++ = 0x78;
    *at++ = j->level == STORED ? 0x01 : j->level == USUAL ? 0x5E : 0xDA;
    uint32_t sum = 1; /* of nothing */
    for (size_t i = 0; i < j->count; i++) {
        if (!shd_encode_goes_on(image)) return shd_encode_cancelled(error);
        const piece *p = &j->pieces[i];
        if (!p->size) return shd_encode_no_memory(error);
        if (!p->whole) return shd_fail(error, SHD_INTERNAL, "", "libdeflate made no stream");
        const size_t first = i * j->step, left = j->data.size - first;
        sum = join_sums(sum, p->sum, left < j->step ? left : j->step);
        memmove(at, p->data, p->size);
        at += p->size;
    }
    for (int shift = 24; shift >= 0; shift -= 8) *at++ = (unsigned char)(sum >> shift);
    *out = (shd_bytes){stream, (size_t)(at - stream)};
    return SHD_OK;
}

shd_status shd_zlib_compress(const shd_image *image, shd_bytes data, size_t pixel, bool wide,
                             shd_arena *scratch, shd_bytes *out, shd_error *error) {
    job j = cut_pieces(image, data, pixel);
    j.wide = wide;
    const size_t compressors = find_compressors(image, &j);
    const unsigned slots = shd_encode_slots(image);
    j.pieces = shd_arena_zalloc(scratch, j.count, sizeof *j.pieces);
    j.compressors = shd_arena_zalloc(scratch, slots, sizeof *j.compressors);
    j.rooms = shd_arena_alloc(scratch, find_rooms(image, &j), 1);
    unsigned char *stream = shd_arena_alloc(scratch, HEAD + j.count * j.room + SUM, 1);
    if (!j.pieces || !j.compressors || !j.rooms || !stream ||
        !shd_arena_borrow(scratch, compressors))
        return shd_encode_no_memory(error);
    for (size_t i = 0; i < j.count; i++) j.pieces[i].data = stream + HEAD + i * j.room;
    const bool done = shd_encode_spread(image, j.count, compress_piece, &j);
    for (unsigned i = 0; i < slots; i++) libdeflate_free_compressor(j.compressors[i]);
    shd_arena_repay(scratch, compressors);
    if (!done) return shd_encode_cancelled(error);
    return join_pieces(image, &j, stream, out, error);
}
