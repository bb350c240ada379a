/* JPEG, in strips that may be encoded side by side.
 *
 * A large picture is cut into strips of whole rows of MCUs, each of which is a JPEG of its own. A
 * restart marker makes a decoder begin anew as at a picture's start (ITU-T T.81, F.1.1.5.1), so
 * the strips' entropy-coded data, with markers between them, are the data of the whole. Where
 * strips begin depends on the picture's size alone. */
#include <assert.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <turbojpeg.h>

#include "image/encoders.h"
#include "image/exif.h"
#include "image/icc.h"
#include "image/pack.h"
#include "image/spread.h"

static const char icc_mark[] = "ICC_PROFILE"; /* with its terminating 0, ICC.1:2010 B.4 */
static const char exif_mark[] = "Exif\0";     /* with two of them */

enum { STRIP_PIXELS = 1 << 18, RESTARTS = 8 };

/* Marker codes, T.81 table B.1. */
enum { SOF0 = 0xC0, RST0 = 0xD0, SOI = 0xD8, EOI, SOS, DRI = 0xDD, APP0 = 0xE0, APP1, APP2 };

/* A strip's JPEG: head, up to its scan; the scan's header; entropy-coded data; EOI. */
typedef struct strip {
    unsigned char *jpeg; /* in an arena, with room for the largest */
    unsigned long size;
    size_t frame, scan, data; /* where SOF0, SOS and the data are */
} strip;

/* How a picture is cut. */
typedef struct cut {
    int sampling, side, rows; /* side: of an MCU */
    size_t count;
    unsigned long bound; /* of a strip's bytes; -1UL: there is none */
} cut;

typedef struct job {
    const shd_image *image;
    const void *pixels;
    size_t samples; /* a pixel */
    cut cut;
    strip *strips;
    tjhandle *handles;   /* [slots] */
    tjhandle *readers;   /* [slots]; NULL: nothing is decoded */
    unsigned char *made; /* [slots] of a strip's samples */
    atomic_bool failed;
    char words[200]; /* libjpeg-turbo's, of the first strip that failed */
    atomic_flag told;
} job;

static size_t length_at(const unsigned char *at) {
    return at[0] * 256u + at[1];
}

/* Finds the parts of a strip. False: it is not as libjpeg-turbo writes them. */
static bool read_strip(strip *s) {
    if (s->size < 4 || s->jpeg[1] != SOI || s->jpeg[s->size - 1] != EOI) return false;
    for (size_t at = 2; at + 4 <= s->size && s->jpeg[at] == 0xFF;) {
        const unsigned char code = s->jpeg[at + 1];
        const size_t next = at + 2 + length_at(s->jpeg + at + 2);
        if (next > s->size - 2) return false;
        if (code == SOF0) s->frame = at;
        if (code == SOS) {
            s->scan = at;
            s->data = next;
            return s->frame != 0;
        }
        at = next;
    }
    return false;
}

/* With 4:4:4, no sample of a strip depends on another strip, so that the whole file's are these. */
static bool decode_strip(const job *j, const strip *s, size_t first, size_t rows, unsigned slot) {
    const shd_image *image = j->image;
    const size_t row = (size_t)image->width * j->samples;
    unsigned char *made = j->made + (size_t)slot * (size_t)j->cut.rows * row;
    if (!j->readers[slot]) j->readers[slot] = tjInitDecompress();
    if (!j->readers[slot] ||
        tjDecompress2(j->readers[slot], s->jpeg, s->size, made, image->width, 0, (int)rows,
                      j->samples == 1 ? TJPF_GRAY : TJPF_RGB, TJFLAG_ACCURATEDCT))
        return false;
    image->decoded(image->measuring, first, rows, (const unsigned char *)j->pixels + first * row,
                   made);
    return true;
}

static void encode_strip(void *context, size_t index, unsigned slot) {
    job *j = context;
    const shd_image *image = j->image;
    if (atomic_load(&j->failed)) return;
    strip *s = &j->strips[index];
    const int most = j->cut.rows, first = (int)index * most, left = image->height - first,
              rows = left < most ? left : most;
    const unsigned char *pixels = j->pixels;
    if (!j->handles[slot]) j->handles[slot] = tjInitCompress();
    const int failed =
        !j->handles[slot] ||
        tjCompress2(j->handles[slot], pixels + (size_t)first * (size_t)image->width * j->samples,
                    image->width, 0, rows, j->samples == 1 ? TJPF_GRAY : TJPF_RGB, &s->jpeg,
                    &s->size, j->cut.sampling, image->quality,
                    TJFLAG_NOREALLOC | TJFLAG_ACCURATEDCT);
    const bool known = !failed && read_strip(s);
    if (known && !image->decoded) return;
    if (known && decode_strip(j, s, (size_t)first, (size_t)rows, slot)) return;
    if (!atomic_flag_test_and_set(&j->told))
        snprintf(j->words, sizeof j->words, "%s",
                 failed  ? tjGetErrorStr2(j->handles[slot])
                 : known ? tjGetErrorStr2(j->readers[slot])
                         : "an unknown form");
    atomic_store(&j->failed, true);
}

static unsigned char *put_u16(unsigned char *at, size_t value) {
    *at++ = (unsigned char)(value >> 8);
    *at++ = (unsigned char)value;
    return at;
}

static unsigned char *put_marker(unsigned char *at, size_t code) {
    return put_u16(at, 0xFF00 | code);
}

/* libturbojpeg 2.1 cannot write a profile or Exif: their segments go behind the JFIF segment, which
 * the standard wants first. */
static shd_status join_strips(const job *j, const shd_icc *icc, shd_arena *scratch, shd_bytes *out,
                              shd_error *error) {
    const strip *first = &j->strips[0];
    const size_t count = j->cut.count, side = (size_t)j->cut.side;
    const size_t interval =
        ((size_t)j->image->width + side - 1) / side * ((size_t)j->cut.rows / side);
    const size_t profile = icc->size ? 2 + sizeof icc_mark + 2 + icc->size : 0;
    unsigned char exif[SHD_EXIF_MAX];
    const size_t told = shd_exif_make(j->image, exif);
    size_t size = first->size + (profile ? 2 + profile : 0) + 6, head = 2;
    if (told) size += 4 + sizeof exif_mark + told;
    for (size_t i = 1; i < count; i++) size += j->strips[i].size;
    unsigned char *data = shd_arena_borrow(scratch, size) ? malloc(size) : NULL, *at = data;
    if (!data) return shd_encode_no_memory(error);

    if (first->jpeg[3] == APP0) head += 2 + length_at(first->jpeg + 4);
    at = mempcpy(at, first->jpeg, head);
    if (told) {
        at = put_u16(put_marker(at, APP1), 2 + sizeof exif_mark + told);
        at = mempcpy(at, exif_mark, sizeof exif_mark);
        at = mempcpy(at, exif, told);
    }
    if (profile) {
        at = put_u16(put_marker(at, APP2), profile);
        at = mempcpy(at, icc_mark, sizeof icc_mark);
        at = put_u16(at, 0x0101); /* the first of one */
        at = mempcpy(at, icc->data, icc->size);
    }
    at = mempcpy(at, first->jpeg + head, first->scan - head);
    put_u16(at - first->scan + first->frame + 5, (size_t)j->image->height);
    if (count > 1) at = put_u16(put_u16(put_marker(at, DRI), 4), interval);
    at = mempcpy(at, first->jpeg + first->scan, first->data - first->scan);
    for (size_t i = 0; i < count; i++) {
        const strip *s = &j->strips[i];
        if (i) at = put_marker(at, RST0 + (i - 1) % RESTARTS);
        at = mempcpy(at, s->jpeg + s->data, s->size - 2 - s->data);
    }
    at = put_marker(at, EOI);
    assert((size_t)(at - data) <= size);
    shd_arena_repay(scratch, size - (size_t)(at - data));
    *out = (shd_bytes){data, (size_t)(at - data)};
    return SHD_OK;
}

static cut cut_strips(const shd_image *image, bool grey) {
    /* Coarse chroma shows at colored edges; whoever asks for high quality looks for them. */
    const bool sharp = image->quality >= 90 || image->decoded;
    const int sampling = grey ? TJSAMP_GRAY : sharp ? TJSAMP_444 : TJSAMP_420;
    const int side = sampling == TJSAMP_420 ? 16 : 8;
    int rows = STRIP_PIXELS / image->width / side * side;
    rows = rows < side ? side : rows < image->height ? rows : image->height;
    return (cut){.sampling = sampling,
                 .side = side,
                 .rows = rows,
                 .count = ((size_t)image->height + (size_t)rows - 1) / (size_t)rows,
                 .bound = tjBufSize(image->width, rows, sampling)};
}

uint64_t shd_jpeg_scratch(const shd_image *image, shd_format format, bool samples) {
    const shd_pack pack = shd_pack_of(image, format);
    const cut s = cut_strips(image, pack.count == 1);
    const uint64_t pixels = (uint64_t)image->width * (uint64_t)image->height;
    const uint64_t made = (uint64_t)shd_encode_slots(image) * (uint64_t)image->width *
                          (uint64_t)s.rows * (uint64_t)pack.count;
    return (samples ? 0 : pixels * (uint64_t)pack.count) + s.count * (uint64_t)s.bound +
           (image->decoded ? made : 0);
}

static bool prepare_readers(job *j, unsigned slots, shd_arena *scratch) {
    j->readers = shd_arena_zalloc(scratch, slots, sizeof *j->readers);
    j->made = shd_arena_alloc(scratch, (size_t)slots * (size_t)j->cut.rows,
                              (size_t)j->image->width * j->samples);
    return j->readers && j->made;
}

shd_status shd_encode_jpeg(const shd_image *image, shd_format format, shd_arena *scratch,
                           shd_bytes *out, shd_error *error) {
    const shd_pack pack = shd_pack_of(image, format);
    const unsigned slots = shd_encode_slots(image);
    job j = {.image = image,
             .samples = (size_t)pack.count,
             .cut = cut_strips(image, pack.count == 1),
             .told = ATOMIC_FLAG_INIT};
    if (j.cut.bound == (unsigned long)-1) return shd_encode_no_memory(error);
    const shd_status packed = shd_pack_samples(&pack, image, scratch, &j.pixels, error);
    if (packed) return packed;
    j.strips = shd_arena_zalloc(scratch, j.cut.count, sizeof *j.strips);
    j.handles = shd_arena_zalloc(scratch, slots, sizeof *j.handles);
    if (!j.strips || !j.handles) return shd_encode_no_memory(error);
    for (size_t i = 0; i < j.cut.count; i++) {
        j.strips[i].size = j.cut.bound;
        j.strips[i].jpeg = shd_arena_alloc(scratch, j.cut.bound, 1);
        if (!j.strips[i].jpeg) return shd_encode_no_memory(error);
    }
    if (image->decoded && !prepare_readers(&j, slots, scratch)) return shd_encode_no_memory(error);
    const bool done = shd_encode_spread(image, j.cut.count, encode_strip, &j);
    for (unsigned i = 0; i < slots; i++) {
        if (j.handles[i]) tjDestroy(j.handles[i]);
        if (j.readers && j.readers[i]) tjDestroy(j.readers[i]);
    }
    if (!done) return shd_encode_cancelled(error);
    if (atomic_load(&j.failed))
        return shd_fail(error, SHD_INTERNAL, "", "libjpeg-turbo: %s", j.words);

    const shd_icc icc = shd_icc_make(image);
    return join_strips(&j, &icc, scratch, out, error);
}
