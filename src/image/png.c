/* PNG (ISO/IEC 15948, third edition) with libdeflate. */
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
    write_u32(w->data + start, (uint32_t)length);
    write_u32(w->data + w->size, libdeflate_crc32(0, w->data + start + 4, length + 4));
    w->size += 4;
}

static void append_u32(writer *w, uint32_t v) {
    write_u32(w->data + w->size, v);
    w->size += 4;
}

static void put_png_header(writer *w, const shd_image *image, const shd_pack *pack) {
    static const unsigned char signature[8] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'};
    static const unsigned char color_types[5] = {0, 0, 4, 2, 6}; /* by samples a pixel */
    memcpy(w->data, signature, 8);
    w->size = 8;
    size_t chunk = open_chunk(w, "IHDR");
    append_u32(w, (uint32_t)image->width);
    append_u32(w, (uint32_t)image->height);
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
    append_u32(w, gammas[transfer]);
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
    append_u32(w, (uint32_t)lround(xy[6] * 1e5)); /* white comes first */
    append_u32(w, (uint32_t)lround(xy[7] * 1e5));
    for (int i = 0; i < 6; i++) append_u32(w, (uint32_t)lround(xy[i] * 1e5));
    close_chunk(w, chunk);
}

static shd_status put_profile(writer *w, const shd_image *image, shd_icc *icc, shd_arena *scratch,
                              shd_error *error) {
    shd_bytes profile;
    shd_status status =
        shd_zlib_compress(image, (shd_bytes){icc->data, icc->size}, scratch, &profile, error);
    if (status) return status;
    size_t chunk = open_chunk(w, "iCCP");
    size_t name = strlen(icc->name) + 1;
    memcpy(w->data + w->size, icc->name, name);
    w->size += name;
    w->data[w->size++] = 0; /* zlib */
    memcpy(w->data + w->size, profile.data, profile.size);
    w->size += profile.size;
    close_chunk(w, chunk);
    return SHD_OK;
}

/* Puts sRGB if the color is that, gAMA and cHRM if they say all, else a profile. One channel as
 * grey keeps its curve. Alpha as grey is no color at all. */
static shd_status put_color(writer *w, const shd_image *image, shd_arena *scratch,
                            shd_error *error) {
    if (image->transfer == SHD_TRANSFER_UNKNOWN || image->channel == 3) return SHD_OK;
    put_gamma(w, image->transfer);
    if (shd_image_is_srgb(image)) {
        put_chromaticities(w, shd_rec709);
        size_t chunk = open_chunk(w, "sRGB");
        w->data[w->size++] = 1; /* relative colorimetric */
        close_chunk(w, chunk);
    } else if (image->channel < 0 && image->has_primaries) {
        bool fit = chromaticities_fit(image->primaries);
        if (fit) put_chromaticities(w, image->primaries);
        if (fit && image->transfer != SHD_TRANSFER_SRGB) return SHD_OK;
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
    if (shd_pack_bytes(pack) == 1) {
        if (image->samples) return (const unsigned char *)image->samples + y * samples;
        shd_pack_u8(pack, image->rgba + 4 * first, image->width, room);
        return room;
    }
    const uint16_t *wide = (const void *)room;
    if (image->samples)
        wide = (const uint16_t *)image->samples + y * samples;
    else
        shd_pack_u16(pack, image->rgba + 4 * first, image->width, (void *)room);
    for (size_t i = 0; i < samples; i++) {
        unsigned v = wide[i];
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
    unsigned char *room;     /* [slots][3][row] */
    unsigned char *out;      /* [height][1 + row] */
} filtering;

static size_t rows_of_band(size_t row) {
    return BAND / (row + 1) + 1;
}

static void filter_band(void *context, size_t index, unsigned slot) {
    static const shd_filter_kernel *const kernels[SHD_ISA_COUNT] = SHD_VARIANTS(shd_filter_kernel);
    const filtering *f = context;
    const size_t first = index * f->rows, height = (size_t)f->image->height;
    const size_t end = height - first < f->rows ? height : first + f->rows;
    unsigned char *room = f->room + 3 * slot * f->row,
                  *samples[2] = {room + f->row, room + 2 * f->row};
    const unsigned char *above = samples[1];
    if (first)
        above = make_row(f->pack, f->image, first - 1, samples[(first - 1) & 1]);
    else
        memset(samples[1], 0, f->row); /* zeros are above the first row */
    for (size_t y = first; y < end; y++) {
        const unsigned char *row = make_row(f->pack, f->image, y, samples[y & 1]);
        kernels[f->image->isa]->filter(row, above, f->row, f->pixel, room,
                                       f->out + y * (f->row + 1));
        above = row;
    }
}

/* All rows as PNG wants them, each after its filter's name. */
static shd_status filter_rows(const shd_image *image, const shd_pack *pack, shd_arena *scratch,
                              shd_bytes *rows, shd_error *error) {
    const size_t height = (size_t)image->height;
    const size_t pixel = (size_t)pack->count * shd_pack_bytes(pack);
    const size_t row = (size_t)image->width * pixel, band = rows_of_band(row);
    filtering f = {.image = image, .pack = pack, .row = row, .pixel = pixel, .rows = band};
    f.out = shd_arena_alloc(scratch, height, row + 1);
    f.room = shd_arena_alloc(scratch, 3 * (size_t)shd_encode_slots(image), row);
    if (!f.out || !f.room) return shd_encode_no_memory(error);
    if (!shd_encode_spread(image, (height + band - 1) / band, filter_band, &f))
        return shd_encode_cancelled(error);
    *rows = (shd_bytes){f.out, height * (row + 1)};
    return SHD_OK;
}

/* ---- The file. ---- */

static shd_status put_data(writer *w, const shd_image *image, shd_bytes data, shd_error *error) {
    for (size_t done = 0; done < data.size;) {
        if (!shd_encode_goes_on(image)) return shd_encode_cancelled(error);
        size_t some = data.size - done < DATA_MOST ? data.size - done : DATA_MOST;
        size_t chunk = open_chunk(w, "IDAT");
        memcpy(w->data + w->size, data.data + done, some);
        w->size += some;
        close_chunk(w, chunk);
        done += some;
    }
    return SHD_OK;
}

uint64_t shd_png_scratch(const shd_image *image) {
    const shd_pack pack = shd_pack_of(image, SHD_PNG);
    const uint64_t row = (uint64_t)image->width * (uint64_t)pack.count * shd_pack_bytes(&pack);
    const uint64_t rows = (uint64_t)image->height * (row + 1);
    return rows + shd_zlib_scratch(rows) + 3 * row * shd_encode_slots(image) +
           shd_zlib_scratch(SHD_ICC_MAX);
}

shd_status shd_encode_png(const shd_image *image, shd_arena *scratch, shd_bytes *out,
                          shd_error *error) {
    shd_pack pack = shd_pack_of(image, SHD_PNG);
    shd_bytes rows = {NULL, 0}, data = {NULL, 0};
    shd_status status = filter_rows(image, &pack, scratch, &rows, error);
    if (!status) status = shd_zlib_compress(image, rows, scratch, &data, error);
    if (status) return status;
    writer w = {NULL, 0};
    const size_t most = HEAD + data.size + CHUNK * (data.size / DATA_MOST + 2);
    if (shd_arena_borrow(scratch, most)) w.data = malloc(most);
    if (!w.data) return shd_encode_no_memory(error);
    put_png_header(&w, image, &pack);
    status = put_color(&w, image, scratch, error);
    if (!status) status = put_data(&w, image, data, error);
    close_chunk(&w, open_chunk(&w, "IEND"));
    shd_arena_repay(scratch, status ? most : most - w.size);
    if (status)
        free(w.data);
    else
        *out = (shd_bytes){w.data, w.size};
    return status;
}
