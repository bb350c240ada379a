/* PNG (ISO/IEC 15948, third edition). Pictures are compressed by deflate.c, which takes a third of
 * libdeflate's time at its fastest; profiles and checksums are libdeflate's. */
#include <libdeflate.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "image/deflate.h"
#include "image/encoders.h"
#include "image/icc.h"
#include "image/png_rows.h"

enum { PROFILE_LEVEL = 3 };

/* Room for all chunks but IDAT's data: the largest is the profile, whose name and data are
 * bounded by shd_icc. */
enum { CHUNK = 12, PROFILE_ROOM = SHD_ICC_MAX + 64, HEAD = 512 + PROFILE_ROOM };

typedef struct writer {
    unsigned char *data;
    size_t size;
} writer;

static void put32(unsigned char *at, uint32_t v) {
    for (int i = 0; i < 4; i++) at[i] = (unsigned char)(v >> (24 - 8 * i));
}

/* A chunk is: room for the length, the type, what the caller appends, and a checksum. */
static size_t open_chunk(writer *w, const char type[4]) {
    size_t start = w->size;
    memcpy(w->data + start + 4, type, 4);
    w->size += 8;
    return start;
}

static void close_chunk(writer *w, size_t start) {
    size_t length = w->size - start - 8;
    put32(w->data + start, (uint32_t)length);
    put32(w->data + w->size, libdeflate_crc32(0, w->data + start + 4, length + 4));
    w->size += 4;
}

static void append32(writer *w, uint32_t v) {
    put32(w->data + w->size, v);
    w->size += 4;
}

static void put_header(writer *w, const shd_image *image, const shd_pack *pack) {
    static const unsigned char signature[8] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'};
    static const unsigned char color_types[5] = {0, 0, 4, 2, 6}; /* by samples a pixel */
    memcpy(w->data, signature, 8);
    w->size = 8;
    size_t chunk = open_chunk(w, "IHDR");
    append32(w, (uint32_t)image->width);
    append32(w, (uint32_t)image->height);
    w->data[w->size++] = pack->max == 255 ? 8 : 16;
    w->data[w->size++] = color_types[pack->count];
    memset(w->data + w->size, 0, 3); /* deflate, adaptive filters, no interlace */
    w->size += 3;
    close_chunk(w, chunk);
}

static void put_gamma(writer *w, shd_transfer transfer) {
    static const uint32_t gammas[] = {[SHD_TRANSFER_LINEAR] = 100000,
                                      [SHD_TRANSFER_SRGB] = 45455,
                                      [SHD_TRANSFER_REC1886] = 41667};
    size_t chunk = open_chunk(w, "gAMA");
    append32(w, gammas[transfer]);
    close_chunk(w, chunk);
}

/* cHRM holds what lies in the triangle of real chromaticities; readers refuse others. */
static bool chromaticities_fit(const double xy[8]) {
    for (int i = 0; i < 8; i += 2)
        if (!(xy[i] >= 0 && xy[i + 1] > 0 && xy[i] + xy[i + 1] <= 1)) return false;
    return true;
}

static void put_chromaticities(writer *w, const double xy[8]) {
    size_t chunk = open_chunk(w, "cHRM");
    append32(w, (uint32_t)lround(xy[6] * 1e5)); /* white comes first */
    append32(w, (uint32_t)lround(xy[7] * 1e5));
    for (int i = 0; i < 6; i++) append32(w, (uint32_t)lround(xy[i] * 1e5));
    close_chunk(w, chunk);
}

static bool put_profile(writer *w, const shd_icc *icc) {
    struct libdeflate_compressor *compressor = libdeflate_alloc_compressor(PROFILE_LEVEL);
    if (!compressor) return false;
    size_t chunk = open_chunk(w, "iCCP");
    size_t name = strlen(icc->name) + 1;
    memcpy(w->data + w->size, icc->name, name);
    w->size += name;
    w->data[w->size++] = 0; /* zlib */
    w->size +=
        libdeflate_zlib_compress(compressor, icc->data, icc->size, w->data + w->size, PROFILE_ROOM);
    close_chunk(w, chunk);
    libdeflate_free_compressor(compressor);
    return true;
}

/* sRGB where it is that; gAMA and cHRM where they say all; else a profile. One channel as grey
 * keeps its curve; alpha as grey is no color at all. False: no memory. */
static bool put_color(writer *w, const shd_image *image) {
    static const double rec709[8] = {0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290};
    if (image->transfer == SHD_TRANSFER_UNKNOWN || image->channel == 3) return true;
    put_gamma(w, image->transfer);
    if (shd_image_is_srgb(image)) {
        put_chromaticities(w, rec709);
        size_t chunk = open_chunk(w, "sRGB");
        w->data[w->size++] = 1; /* relative colorimetric */
        close_chunk(w, chunk);
    } else if (image->channel < 0 && image->has_primaries) {
        bool fit = chromaticities_fit(image->primaries);
        if (fit) put_chromaticities(w, image->primaries);
        if (fit && image->transfer != SHD_TRANSFER_SRGB) return true;
        shd_icc icc = shd_icc_make(image);
        return !icc.size || put_profile(w, &icc);
    }
    return true;
}

/* ---- The file. ---- */

static const unsigned char zlib_head[2] = {0x78, 0x01}; /* a window of 32 KiB, the fastest level */

/* A chunk for each piece, so that none is too long for its 31 bits. */
static void put_rows(writer *w, const shd_png_rows *rows) {
    for (size_t i = 0; i < rows->count; i++) {
        size_t chunk = open_chunk(w, "IDAT");
        if (i == 0) {
            memcpy(w->data + w->size, zlib_head, sizeof zlib_head);
            w->size += sizeof zlib_head;
        }
        memcpy(w->data + w->size, rows->data + i * rows->stride, rows->sizes[i]);
        w->size += rows->sizes[i];
        if (i + 1 == rows->count) {
            shd_deflate_end(w->data + w->size);
            w->size += SHD_DEFLATE_END;
            append32(w, rows->checksum);
        }
        close_chunk(w, chunk);
    }
}

shd_status shd_encode_png(const shd_image *image, shd_arena *scratch, shd_bytes *out,
                          shd_error *error) {
    shd_pack pack = shd_pack_of(image, SHD_PNG);
    shd_png_rows rows;
    writer head = {.data = shd_arena_alloc(scratch, HEAD, 1)};
    if (!head.data) return shd_encode_no_memory(error);
    put_header(&head, image, &pack);
    if (!put_color(&head, image)) return shd_encode_no_memory(error);
    shd_status status = shd_png_rows_make(image, &pack, scratch, &rows, error);
    if (status) return status;

    size_t size = head.size + sizeof zlib_head + SHD_DEFLATE_END + 4 + CHUNK;
    for (size_t i = 0; i < rows.count; i++) size += CHUNK + rows.sizes[i];
    writer w = {.data = malloc(size), .size = head.size};
    if (!w.data) return shd_encode_no_memory(error);
    memcpy(w.data, head.data, head.size);
    put_rows(&w, &rows);
    close_chunk(&w, open_chunk(&w, "IEND"));
    *out = (shd_bytes){w.data, w.size};
    return SHD_OK;
}
