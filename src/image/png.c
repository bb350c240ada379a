/* PNG (ISO/IEC 15948, third edition). */
#include <assert.h>
#include <endian.h>
#include <libdeflate.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/primaries.h"
#include "image/encoders.h"
#include "image/filter.h"
#include "image/icc.h"
#include "image/pack.h"
#include "image/spread.h"
#include "image/zlib.h"

/* Bytes of rows between two questions whether to go on: half a millisecond. */
enum { BAND = 1 << 18 };

/* Bytes of an IDAT chunk, whose length has 31 bits; larger pictures take several. */
enum { DATA_MOST = 1 << 20 };

/* Room for all chunks but IDAT's data: the largest is the profile, whose name and data are
 * bounded by shd_icc. */
enum { CHUNK = 12, PROFILE_ROOM = SHD_ICC_MAX + 64, HEAD = 512 + PROFILE_ROOM };

typedef struct writer {
    unsigned char *data;
    size_t size;
} writer;

static void write_u32(unsigned char *at, uint32_t v) {
    v = htobe32(v);
    memcpy(at, &v, sizeof v);
}

/* A chunk is its length, its type, its data and a checksum of both. NULL: the data is in place. */
static void put_chunk(writer *w, const char type[4], const void *data, size_t size) {
    unsigned char *at = w->data + w->size;
    write_u32(at, (uint32_t)size);
    memcpy(at + 4, type, 4);
    if (data) memcpy(at + 8, data, size);
    write_u32(at + 8 + size, libdeflate_crc32(0, at + 4, 4 + size));
    w->size += CHUNK + size;
}

static void put_png_header(writer *w, const shd_image *image, const shd_pack *pack) {
    static const unsigned char signature[8] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'};
    static const unsigned char color_types[5] = {0, 0, 4, 2, 6}; /* by samples a pixel */
    unsigned char head[13] = {0}; /* ends with deflate, adaptive filters, no interlace */
    memcpy(w->data, signature, sizeof signature);
    w->size = sizeof signature;
    write_u32(head, (uint32_t)image->width);
    write_u32(head + 4, (uint32_t)image->height);
    head[8] = (unsigned char)(8 * pack->bytes);
    head[9] = color_types[pack->count];
    put_chunk(w, "IHDR", head, sizeof head);
}

static void put_code_points(writer *w, const shd_image *image) {
    unsigned char codes[4];
    if (shd_image_code_points(image, codes)) put_chunk(w, "cICP", codes, sizeof codes);
}

/* cHRM holds what lies in the triangle of real chromaticities; readers refuse others. */
static bool chromaticities_fit(const double xy[8]) {
    for (int i = 0; i < 8; i += 2)
        if (!(xy[i] >= 0 && xy[i + 1] > 0 && xy[i] + xy[i + 1] <= 1)) return false;
    return true;
}

static void put_chromaticities(writer *w, const double xy[8]) {
    unsigned char data[32];
    for (int i = 0; i < 8; i++) /* white, the last, comes first */
        write_u32(data + 4 * i, (uint32_t)lround(xy[(i + 6) % 8] * 1e5));
    put_chunk(w, "cHRM", data, sizeof data);
}

/* What the channels are, in UTF-8: no color chunk has that. */
static void put_about(writer *w, const char *about) {
    static const char keyword[] = "Description\0\0\0\0"; /* not compressed, of no language */
    const size_t length = strlen(about);
    memcpy(mempcpy(w->data + w->size + 8, keyword, sizeof keyword), about, length);
    put_chunk(w, "iTXt", NULL, sizeof keyword + length);
}

static shd_status put_profile(writer *w, const shd_image *image, shd_icc *icc, shd_arena *scratch,
                              shd_error *error) {
    shd_bytes profile;
    shd_status status = shd_zlib_compress(image, (shd_bytes){icc->data, icc->size}, 1, false,
                                          scratch, &profile, error);
    if (status) return status;
    const size_t name = strlen(icc->name) + 1;
    unsigned char data[PROFILE_ROOM] = {0};
    assert(name + 1 + profile.size <= sizeof data);
    memcpy(data, icc->name, name);
    memcpy(data + name + 1, profile.data, profile.size); /* behind a 0: zlib */
    put_chunk(w, "iCCP", data, name + 1 + profile.size);
    return SHD_OK;
}

/* Puts code points where there are some; sRGB if the color is that, gAMA and cHRM if they say all,
 * else a profile. One channel as grey keeps its curve. Alpha as grey is no color at all. */
static shd_status put_color(writer *w, const shd_image *image, shd_arena *scratch,
                            shd_error *error) {
    static const uint32_t gammas[] = {
        [SHD_TRANSFER_LINEAR] = 100000, [SHD_TRANSFER_SRGB] = 45455,
        [SHD_TRANSFER_REC1886] = 41667, [SHD_TRANSFER_GAMMA22] = 45455,
        [SHD_TRANSFER_GAMMA26] = 38462, [SHD_TRANSFER_HLG] = 0}; /* no power says this, or PQ */
    if (image->transfer == SHD_TRANSFER_UNKNOWN || image->channel == 3) return SHD_OK;
    unsigned char gamma[4];
    write_u32(gamma, gammas[image->transfer]);
    put_code_points(w, image);
    if (gammas[image->transfer]) put_chunk(w, "gAMA", gamma, sizeof gamma);
    if (shd_image_is_srgb(image)) {
        put_chromaticities(w, shd_rec709);
        put_chunk(w, "sRGB", "\1", 1); /* relative colorimetric */
    } else if (image->channel < 0 && image->has_primaries) {
        bool fit = chromaticities_fit(image->primaries);
        if (fit) put_chromaticities(w, image->primaries);
        if (fit && gammas[image->transfer] && image->transfer != SHD_TRANSFER_SRGB) return SHD_OK;
        shd_icc icc = shd_icc_make(image);
        if (icc.size) return put_profile(w, image, &icc, scratch, error);
    }
    return SHD_OK;
}

/* ---- The picture. ---- */

/* Returns a row's samples, 16 bits big-endian. They are made in `room` if they are not ready. */
static const unsigned char *make_row(const shd_pack *pack, const shd_image *image, size_t y,
                                     unsigned char *room) {
    const size_t first = y * (size_t)image->width;
    const size_t samples = (size_t)image->width * (size_t)pack->count;
    const unsigned char *row = room;
    if (image->samples)
        row = (const unsigned char *)image->samples + y * samples * pack->bytes;
    else
        shd_pack_row(pack, image->rgba + 4 * first, image->width, room);
    if (pack->bytes == 1) return row;
    for (size_t i = 0; i < samples; i++) {
        const unsigned v = ((const uint16_t *)(const void *)row)[i];
        room[2 * i] = (unsigned char)(v >> 8);
        room[2 * i + 1] = (unsigned char)v;
    }
    return room;
}

/* Bands of rows, side by side. */
typedef struct filtering {
    const shd_image *image;
    const shd_pack *pack;
    size_t row, pixel, rows; /* bytes of a row and of a pixel, rows of a band */
    unsigned char *room;     /* [slots][2][row] */
    unsigned char *out;      /* [height][1 + row] */
} filtering;

static void filter_band(void *context, size_t index, unsigned slot) {
    static const shd_filter_kernel *const kernels[SHD_ISA_COUNT] = SHD_VARIANTS(shd_filter_kernel);
    const filtering *f = context;
    const bool plain = f->image->compression && !strcmp(f->image->compression, "fast");
    const size_t first = index * f->rows, height = (size_t)f->image->height;
    const size_t end = height - first < f->rows ? height : first + f->rows;
    unsigned char *const room = f->room + 2 * slot * f->row, *samples[2] = {room, room + f->row};
    const unsigned char *above = samples[1];
    if (first)
        above = make_row(f->pack, f->image, first - 1, samples[(first - 1) & 1]);
    else
        memset(samples[1], 0, f->row); /* zeros are above the first row */
    for (size_t y = first; y < end; y++) {
        const unsigned char *row = make_row(f->pack, f->image, y, samples[y & 1]);
        unsigned char *out = f->out + y * (f->row + 1);
        if (plain) {
            *out = 0;
            memcpy(out + 1, row, f->row);
        } else
            kernels[f->image->isa]->filter(row, above, f->row, f->pixel, out);
        above = row;
    }
}

/* All rows as PNG wants them, each after its filter's name. */
static shd_status filter_rows(const shd_image *image, const shd_pack *pack, shd_arena *scratch,
                              shd_bytes *rows, shd_error *error) {
    const size_t height = (size_t)image->height;
    const size_t pixel = (size_t)pack->count * pack->bytes;
    const size_t row = (size_t)image->width * pixel, band = BAND / (row + 1) + 1;
    filtering f = {.image = image, .pack = pack, .row = row, .pixel = pixel, .rows = band};
    f.out = shd_arena_alloc(scratch, height, row + 1);
    f.room = shd_arena_alloc(scratch, 2 * (size_t)shd_encode_slots(image), row);
    if (!f.out || !f.room) return shd_encode_no_memory(error);
    if (!shd_encode_spread(image, (height + band - 1) / band, filter_band, &f))
        return shd_encode_cancelled(error);
    *rows = (shd_bytes){f.out, height * (row + 1)};
    return SHD_OK;
}

/* ---- The file. ---- */

static shd_status put_data(writer *w, const shd_image *image, shd_bytes data, shd_error *error) {
    for (size_t done = 0, some; done < data.size; done += some) {
        if (!shd_encode_goes_on(image)) return shd_encode_cancelled(error);
        some = data.size - done < DATA_MOST ? data.size - done : DATA_MOST;
        put_chunk(w, "IDAT", data.data + done, some);
    }
    return SHD_OK;
}

uint64_t shd_png_scratch(const shd_image *image, shd_format format, bool samples) {
    (void)samples;
    const shd_pack pack = shd_pack_of(image, format);
    const uint64_t row = (uint64_t)image->width * (uint64_t)pack.count * pack.bytes;
    const uint64_t rows = (uint64_t)image->height * (row + 1);
    return rows + shd_zlib_scratch(image, rows) + 2 * row * shd_encode_slots(image) +
           shd_zlib_scratch(image, SHD_ICC_MAX);
}

shd_status shd_encode_png(const shd_image *image, shd_format format, shd_arena *scratch,
                          shd_bytes *out, shd_error *error) {
    const shd_pack pack = shd_pack_of(image, format);
    shd_bytes rows = {NULL, 0}, data = {NULL, 0};
    shd_status status = filter_rows(image, &pack, scratch, &rows, error);
    const size_t pixel = (size_t)pack.count * pack.bytes;
    if (!status)
        status = shd_zlib_compress(image, rows, pixel, pack.bytes > 1, scratch, &data, error);
    if (status) return status;
    writer w = {NULL, 0};
    const size_t about = image->about ? strlen(image->about) : 0;
    const size_t most = HEAD + about + data.size + CHUNK * (data.size / DATA_MOST + 2);
    if (shd_arena_borrow(scratch, most)) w.data = malloc(most);
    if (!w.data) return shd_encode_no_memory(error);
    put_png_header(&w, image, &pack);
    status = put_color(&w, image, scratch, error);
    if (about) put_about(&w, image->about);
    if (!status) status = put_data(&w, image, data, error);
    put_chunk(&w, "IEND", NULL, 0);
    assert(w.size <= most);
    shd_arena_repay(scratch, status ? most : most - w.size);
    if (status)
        free(w.data);
    else
        *out = (shd_bytes){w.data, w.size};
    return status;
}
