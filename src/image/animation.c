#include "image/animation.h"

#include <assert.h>
#include <endian.h>
#include <libdeflate.h>
#include <stdlib.h>
#include <string.h>
#include <webp/mux.h>

#include "image/spread.h"

static size_t sum_frames(const shd_animation *a) {
    size_t sum = 0;
    for (size_t i = 0; i < a->count; i++) sum += a->frames[i].size;
    return sum;
}

/* ---- APNG ---- */

enum { SIGNATURE = 8, CHUNK = 12, CONTROL = 8, FRAME_CONTROL = 26 };

typedef struct writer {
    unsigned char *data;
    size_t size;
    uint32_t sequence; /* of the next fcTL or fdAT */
} writer;

static void put_u32(unsigned char *at, uint32_t v) {
    v = htobe32(v);
    memcpy(at, &v, sizeof v);
}

static uint32_t get_u32(const unsigned char *at) {
    uint32_t v;
    memcpy(&v, at, sizeof v);
    return be32toh(v);
}

/* `before` bytes of data are those of `head`. */
static void put_chunk(writer *w, const char type[4], const unsigned char *head, size_t before,
                      const unsigned char *data, size_t size) {
    unsigned char *at = w->data + w->size;
    put_u32(at, (uint32_t)(before + size));
    memcpy(at + 4, type, 4);
    if (before) memcpy(at + 8, head, before);
    if (size) memcpy(at + 8 + before, data, size);
    put_u32(at + 8 + before + size, libdeflate_crc32(0, at + 4, 4 + before + size));
    w->size += CHUNK + before + size;
}

static void put_control(writer *w, const shd_animation *a) {
    unsigned char data[CONTROL] = {0}; /* ends with 0 plays: for ever */
    put_u32(data, (uint32_t)a->count);
    put_chunk(w, "acTL", NULL, 0, data, sizeof data);
}

/* A frame covers all that was before it. */
static void put_frame_control(writer *w, const shd_animation *a) {
    unsigned char data[FRAME_CONTROL] = {0};
    put_u32(data, w->sequence++);
    put_u32(data + 4, (uint32_t)a->width);
    put_u32(data + 8, (uint32_t)a->height);
    data[20] = (unsigned char)(a->milliseconds >> 8);
    data[21] = (unsigned char)a->milliseconds;
    data[22] = 1000 >> 8;
    data[23] = 1000 & 0xff;
    put_chunk(w, "fcTL", NULL, 0, data, sizeof data);
}

/* The first frame's chunks all stay; of the others, the pixels do, in chunks of another name. */
static void put_png(writer *w, const shd_animation *a, size_t index) {
    const shd_bytes file = a->frames[index];
    bool begun = false;
    for (size_t at = SIGNATURE; at + CHUNK <= file.size;) {
        const unsigned char *chunk = file.data + at, *type = chunk + 4, *data = chunk + 8;
        const size_t size = get_u32(chunk);
        const bool pixels = !memcmp(type, "IDAT", 4);
        assert(size <= file.size - at - CHUNK);
        if (pixels && !begun) {
            if (!index) put_control(w, a);
            put_frame_control(w, a);
            begun = true;
        }
        if (!index && memcmp(type, "IEND", 4)) {
            memcpy(w->data + w->size, chunk, CHUNK + size);
            w->size += CHUNK + size;
        } else if (pixels) {
            unsigned char number[4];
            put_u32(number, w->sequence++);
            put_chunk(w, "fdAT", number, sizeof number, data, size);
        }
        at += CHUNK + size;
    }
}

static shd_status join_png(const shd_animation *a, shd_arena *scratch, shd_bytes *out,
                           shd_error *error) {
    /* A sequence number for each IDAT, which no more than every chunk is. */
    const size_t all = sum_frames(a), most = all + all / CHUNK * 4 + CHUNK + CONTROL +
                                             a->count * (CHUNK + FRAME_CONTROL);
    writer w = {NULL, 0, 0};
    if (shd_arena_borrow(scratch, most)) w.data = malloc(most);
    if (!w.data) return shd_encode_no_memory(error);
    memcpy(w.data, a->frames[0].data, SIGNATURE);
    w.size = SIGNATURE;
    for (size_t i = 0; i < a->count; i++) put_png(&w, a, i);
    put_chunk(&w, "IEND", NULL, 0, NULL, 0);
    assert(w.size <= most);
    shd_arena_repay(scratch, most - w.size);
    *out = (shd_bytes){w.data, w.size};
    return SHD_OK;
}

/* ---- WebP ---- */

/* Chunks of the first file that are about all of them. */
static WebPMuxError copy_chunks(const shd_animation *a, WebPMux *mux) {
    static const char *const names[] = {"ICCP", "EXIF"};
    const WebPData file = {a->frames[0].data, a->frames[0].size};
    WebPMux *first = WebPMuxCreate(&file, 0);
    WebPMuxError failed = first ? WEBP_MUX_OK : WEBP_MUX_MEMORY_ERROR;
    for (size_t i = 0; i < sizeof names / sizeof *names && failed == WEBP_MUX_OK; i++) {
        WebPData chunk;
        if (WebPMuxGetChunk(first, names[i], &chunk) == WEBP_MUX_OK)
            failed = WebPMuxSetChunk(mux, names[i], &chunk, 1);
    }
    WebPMuxDelete(first);
    return failed;
}

/* A frame covers all that was before it. */
static WebPMuxError push_frames(const shd_animation *a, WebPMux *mux) {
    const WebPMuxAnimParams params = {.bgcolor = 0, .loop_count = 0};
    WebPMuxError failed = WebPMuxSetAnimationParams(mux, &params);
    for (size_t i = 0; i < a->count && failed == WEBP_MUX_OK; i++) {
        const WebPMuxFrameInfo frame = {.bitstream = {a->frames[i].data, a->frames[i].size},
                                        .duration = (int)a->milliseconds,
                                        .id = WEBP_CHUNK_ANMF,
                                        .dispose_method = WEBP_MUX_DISPOSE_NONE,
                                        .blend_method = WEBP_MUX_NO_BLEND};
        failed = WebPMuxPushFrame(mux, &frame, 0);
    }
    return failed;
}

static shd_status join_webp(const shd_animation *a, shd_arena *scratch, shd_bytes *out,
                            shd_error *error) {
    enum { FRAME_ROOM = 64, ROOM = 1 << 14 };
    const size_t most = sum_frames(a) + a->count * FRAME_ROOM + ROOM;
    if (!shd_arena_borrow(scratch, most)) return shd_encode_no_memory(error);
    WebPMux *mux = WebPMuxNew();
    WebPData file;
    WebPDataInit(&file);
    WebPMuxError failed = mux ? WEBP_MUX_OK : WEBP_MUX_MEMORY_ERROR;
    if (failed == WEBP_MUX_OK) failed = push_frames(a, mux);
    if (failed == WEBP_MUX_OK) failed = copy_chunks(a, mux);
    if (failed == WEBP_MUX_OK) failed = WebPMuxAssemble(mux, &file);
    WebPMuxDelete(mux);
    if (failed == WEBP_MUX_OK && file.size <= most) {
        shd_arena_repay(scratch, most - file.size);
        *out = (shd_bytes){(unsigned char *)file.bytes, file.size};
        return SHD_OK;
    }
    WebPDataClear(&file);
    shd_arena_repay(scratch, most);
    if (failed == WEBP_MUX_MEMORY_ERROR) return shd_encode_no_memory(error);
    return shd_fail(error, SHD_INTERNAL, "", "libwebp's muxer failed with error %d", failed);
}

shd_status shd_image_animate(const shd_animation *animation, shd_format format, shd_arena *scratch,
                             shd_bytes *out, shd_error *error) {
    if (format == SHD_PNG) return join_png(animation, scratch, out, error);
    if (format == SHD_WEBP) return join_webp(animation, scratch, out, error);
    return shd_fail(error, SHD_INTERNAL, "", "%s has no animations", shd_format_get(format)->name);
}
