#include "image/png_rows.h"

#include <libdeflate.h>
#include <stdatomic.h>
#include <string.h>
#include <time.h>

#include "image/deflate.h"
#include "image/encoders.h"
#include "image/filter.h"

/* What a thread works with. */
typedef struct desk {
    unsigned char *rows[2]; /* packed, where the picture is not, this one and the one above */
    unsigned char *room;    /* of a row, for its filter */
    unsigned char *filtered;
    void *runs;
    double seconds;
} desk;

typedef struct job {
    const shd_image *image;
    const shd_pack *pack;
    const unsigned char *zeros; /* above the first row */
    size_t row_bytes, pixel_bytes, piece_rows;
    desk *desks; /* as many as threads can find pieces */
    unsigned desk_count;
    atomic_uint taken; /* desks */
    desk **own;        /* [slot]: NULL until its thread has a first piece */
    shd_png_rows *out;
    uint32_t *checksums; /* [piece] */
} job;

/* A row's samples, 16 bits big-endian; where they are not ready in that form, in `room`. */
static const unsigned char *make_row(const job *j, size_t y, unsigned char *room) {
    const shd_image *image = j->image;
    const size_t first = y * (size_t)image->width;
    const size_t samples = (size_t)image->width * (size_t)j->pack->count;
    if (shd_pack_bytes(j->pack) == 1) {
        if (image->samples) return (const unsigned char *)image->samples + y * samples;
        shd_pack_u8(j->pack, image->rgba + 4 * first, image->width, room);
        return room;
    }
    const uint16_t *wide = (const void *)room;
    if (image->samples)
        wide = (const uint16_t *)image->samples + y * samples;
    else
        shd_pack_u16(j->pack, image->rgba + 4 * first, image->width, (void *)room);
    for (size_t i = 0; i < samples; i++) {
        unsigned v = wide[i];
        room[2 * i] = (unsigned char)(v >> 8);
        room[2 * i + 1] = (unsigned char)v;
    }
    return room;
}

/* ---- Pieces. ---- */

static double thread_seconds(void) {
    struct timespec now;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static void make_piece(void *context, size_t index, unsigned slot) {
    static const shd_filter_kernel *const kernels[SHD_ISA_COUNT] = SHD_VARIANTS(shd_filter_kernel);
    job *j = context;
    if (!j->own[slot]) j->own[slot] = &j->desks[atomic_fetch_add(&j->taken, 1)];
    desk *d = j->own[slot];
    double began = slot ? thread_seconds() : 0;
    const size_t height = (size_t)j->image->height, first = index * j->piece_rows;
    const size_t end = height - first < j->piece_rows ? height : first + j->piece_rows;
    const unsigned char *above = first ? make_row(j, first - 1, d->rows[1]) : j->zeros;
    for (size_t y = first; y < end; y++) {
        const unsigned char *row = make_row(j, y, d->rows[(y - first) & 1]);
        kernels[j->image->isa]->filter(row, above, j->row_bytes, j->pixel_bytes, d->room,
                                       d->filtered + (y - first) * (j->row_bytes + 1));
        above = row;
    }
    const size_t size = (end - first) * (j->row_bytes + 1);
    j->checksums[index] = libdeflate_adler32(1, d->filtered, size);
    j->out->sizes[index] = shd_deflate_piece(d->filtered, size, (unsigned)j->pixel_bytes, d->runs,
                                             j->out->data + index * j->out->stride);
    if (slot) d->seconds += thread_seconds() - began;
}

/* Of two texts' Adler-32 that of both, the second being `size` bytes long (RFC 1950, 9: the second
 * sum has grown by the first one at each byte). */
static uint32_t join_checksums(uint32_t a, uint32_t b, uint64_t size) {
    const uint64_t base = 65521;
    uint64_t low = ((a & 0xffff) + (b & 0xffff) + base - 1) % base;
    uint64_t high = ((a >> 16) + (b >> 16) + size % base * ((a & 0xffff) + base - 1)) % base;
    return (uint32_t)(high << 16 | low);
}

static bool make_desks(job *j, unsigned slots, shd_arena *scratch) {
    const size_t piece = j->piece_rows * (j->row_bytes + 1);
    unsigned char *zeros = shd_arena_zalloc(scratch, j->row_bytes, 1);
    j->zeros = zeros;
    j->desk_count = slots < j->out->count ? slots : (unsigned)j->out->count;
    j->desks = shd_arena_zalloc(scratch, j->desk_count, sizeof *j->desks);
    j->own = shd_arena_zalloc(scratch, slots, sizeof(desk *));
    if (!zeros || !j->desks || !j->own) return false;
    for (unsigned i = 0; i < j->desk_count; i++) {
        desk *d = &j->desks[i];
        for (int k = 0; k < 2; k++)
            if (!(d->rows[k] = shd_arena_alloc(scratch, j->row_bytes, 1))) return false;
        d->room = shd_arena_alloc(scratch, j->row_bytes, 1);
        d->filtered = shd_arena_alloc(scratch, piece, 1);
        d->runs = shd_arena_alloc(scratch, shd_deflate_scratch(piece), 1);
        if (!d->room || !d->filtered || !d->runs) return false;
    }
    return true;
}

shd_status shd_png_rows_make(const shd_image *image, const shd_pack *pack, shd_arena *scratch,
                             shd_png_rows *out, shd_error *error) {
    const size_t height = (size_t)image->height;
    job j = {.image = image,
             .pack = pack,
             .pixel_bytes = (size_t)pack->count * shd_pack_bytes(pack),
             .out = out};
    j.row_bytes = (size_t)image->width * j.pixel_bytes;
    j.piece_rows = 1 + (SHD_DEFLATE_PIECE - 1) / (j.row_bytes + 1);
    if (j.piece_rows > height) j.piece_rows = height;
    *out = (shd_png_rows){.count = (height + j.piece_rows - 1) / j.piece_rows};
    out->stride = shd_deflate_bound(j.piece_rows * (j.row_bytes + 1));
    out->data = shd_arena_alloc(scratch, out->count, out->stride);
    out->sizes = shd_arena_alloc(scratch, out->count, sizeof *out->sizes);
    j.checksums = shd_arena_alloc(scratch, out->count, sizeof *j.checksums);

    shd_pool *pool = out->count > 1 ? image->pool : NULL;
    unsigned slots = pool ? shd_pool_slots(pool) : 1;
    if (!out->data || !out->sizes || !j.checksums || !make_desks(&j, slots, scratch))
        return shd_encode_no_memory(error);
    double lent = 0;
    if (pool)
        lent = shd_pool_for(pool, out->count, make_piece, &j);
    else
        for (size_t i = 0; i < out->count; i++) make_piece(&j, i, 0);

    out->checksum = 1;
    for (size_t i = 0; i < out->count; i++) {
        size_t rows = height - i * j.piece_rows;
        if (rows > j.piece_rows) rows = j.piece_rows;
        out->checksum = join_checksums(out->checksum, j.checksums[i], rows * (j.row_bytes + 1));
    }
    for (unsigned i = 0; i < j.desk_count && image->helpers_seconds; i++)
        *image->helpers_seconds += j.desks[i].seconds;
    if (image->helpers_seconds) *image->helpers_seconds -= lent;
    return SHD_OK;
}
