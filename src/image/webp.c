/* WebP with libwebp itself: OpenImageIO 2.4 takes color as premultiplied by linear-light alpha
 * whatever "oiio:UnassociatedAlpha" says, so that straight alpha comes back wrong (200 becomes 251
 * under alpha 51), writes no profile, and always compresses at the slowest effort.
 *
 * libwebp asks whether to go on up to 66 times a picture, which is too seldom. So a thread encodes
 * while the caller waits, which leaves when it is to and abandons the thread. */
#include <stdlib.h>
#include <sys/resource.h>
#include <unistd.h>
#include <webp/decode.h>
#include <webp/encode.h>
#include <webp/mux.h>

#include "base/clock.h"
#include "image/encoders.h"
#include "image/exif.h"
#include "image/icc.h"
#include "image/pack.h"
#include "image/spread.h"

static shd_status encoder_error(int code, shd_error *error) {
    switch (code) {
    case VP8_ENC_ERROR_OUT_OF_MEMORY:
    case VP8_ENC_ERROR_BITSTREAM_OUT_OF_MEMORY:
        return shd_encode_no_memory(error);
    case VP8_ENC_ERROR_USER_ABORT:
        return shd_encode_cancelled(error);
    default:
        return shd_fail(error, SHD_INTERNAL, "", "libwebp failed with error %d", code);
    }
}

/* Coarse chroma shows at colored edges; whoever asks for high quality looks for them. */
static bool is_sharp(const shd_image *image) {
    return (image->quality >= 90 || image->decoded) && image->quality < 100;
}

/* What encoding takes: samples, then the picture as libwebp sees it, and what it compares. For
 * noise, at any effort, version 1.2.4 was seen to take at most 21 bytes a pixel for opaque lossy
 * pictures, 27 if chroma is sharp, and 55 if a plane or all of it is lossless. Smooth pictures take
 * 2 and 26. */
uint64_t shd_webp_scratch(const shd_image *image, shd_format format, bool samples) {
    (void)format, (void)samples;
    const uint64_t pixels = (uint64_t)image->width * (uint64_t)image->height;
    /* A quality that is still looked for may become 100. */
    const bool lossless = image->quality >= 100 || !image->quality || image->alpha;
    const unsigned held = image->decoded ? 4 : 0; /* the samples, for comparing */
    return pixels * (held + (lossless ? 56 : is_sharp(image) ? 32 : 24)) + (1 << 20);
}

/* What decoding takes beside the samples: a plane of alpha and its own decoder's picture. */
static size_t decoder_size(const shd_image *image) {
    return (size_t)image->width * (size_t)image->height * (image->alpha ? 6 : 1) + (1 << 20);
}

/* A picture and the thread that encodes it. */
typedef struct encoding {
    WebPConfig config;
    WebPPicture picture;
    unsigned char *samples; /* [height][stride]; NULL once libwebp has them */
    int count, stride;      /* samples of a pixel, bytes of a row */
    shd_icc icc;
    unsigned char exif[SHD_EXIF_MAX];
    size_t exif_size;
    shd_bytes file;
    shd_status status;
    shd_error error;
    double seconds; /* of a processor */
    shd_budget *budget;
    size_t working; /* bytes that an abandoned one gives back */
    pthread_mutex_t mutex;
    pthread_cond_t changed;
    /* Under the mutex. */
    pid_t thread; /* 0 until it runs */
    bool ended, abandoned;
} encoding;

/* Of the process, as the threads are. */
static atomic_uint abandoned_threads;

unsigned shd_image_abandoned(void) {
    return atomic_load(&abandoned_threads);
}

/* ---- On the thread ---- */

static bool is_abandoned(encoding *e) {
    pthread_mutex_lock(&e->mutex);
    const bool abandoned = e->abandoned;
    pthread_mutex_unlock(&e->mutex);
    return abandoned;
}

static int ask_to_go_on(int percent, const WebPPicture *picture) {
    (void)percent;
    return !is_abandoned(picture->user_data);
}

/* Wraps the stream into an extended file with the profile and Exif, if there are any. */
static shd_status extend_file(const encoding *e, const WebPMemoryWriter *stream, shd_bytes *out,
                              shd_error *error) {
    WebPMux *mux = WebPMuxNew();
    if (!mux) return shd_encode_no_memory(error);
    WebPData image = {stream->mem, stream->size}, profile = {e->icc.data, e->icc.size},
             exif = {e->exif, e->exif_size}, file;
    WebPDataInit(&file);
    WebPMuxError failed = WebPMuxSetImage(mux, &image, 0);
    if (failed == WEBP_MUX_OK && profile.size) failed = WebPMuxSetChunk(mux, "ICCP", &profile, 0);
    if (failed == WEBP_MUX_OK && exif.size) failed = WebPMuxSetChunk(mux, "EXIF", &exif, 0);
    if (failed == WEBP_MUX_OK) failed = WebPMuxAssemble(mux, &file);
    WebPMuxDelete(mux);
    if (failed == WEBP_MUX_MEMORY_ERROR) return shd_encode_no_memory(error);
    if (failed != WEBP_MUX_OK)
        return shd_fail(error, SHD_INTERNAL, "", "libwebp's muxer failed with error %d", failed);
    *out = (shd_bytes){(unsigned char *)file.bytes, file.size};
    return SHD_OK;
}

static shd_status encode_stream(encoding *e, WebPMemoryWriter *stream, shd_error *error) {
    WebPPicture *picture = &e->picture;
    picture->writer = WebPMemoryWrite;
    picture->custom_ptr = stream;
    const int imported = e->count == 4 ? WebPPictureImportRGBA(picture, e->samples, e->stride)
                                       : WebPPictureImportRGB(picture, e->samples, e->stride);
    free(e->samples);
    e->samples = NULL;
    if (!imported) return shd_encode_no_memory(error);
    return WebPEncode(&e->config, picture) ? SHD_OK : encoder_error(picture->error_code, error);
}

static shd_status encode_file(encoding *e, shd_error *error) {
    WebPMemoryWriter stream;
    WebPMemoryWriterInit(&stream);
    shd_status status = encode_stream(e, &stream, error);
    if (!status && (e->icc.size || e->exif_size)) {
        status = extend_file(e, &stream, &e->file, error);
    } else if (!status) {
        /* Allocated by libwebp with malloc: the caller's free ends it. */
        e->file = (shd_bytes){stream.mem, stream.size};
        stream.mem = NULL;
    }
    WebPMemoryWriterClear(&stream);
    return status;
}

static void drop_encoding(encoding *e) {
    WebPPictureFree(&e->picture);
    free(e->samples);
    free(e->file.data);
    pthread_cond_destroy(&e->changed);
    pthread_mutex_destroy(&e->mutex);
    free(e);
}

static void *encode_aside(void *context) {
    encoding *e = context;
    pthread_mutex_lock(&e->mutex);
    e->thread = gettid();
    pthread_mutex_unlock(&e->mutex);
    e->status = is_abandoned(e) ? SHD_CANCELLED : encode_file(e, &e->error);
    e->seconds = shd_thread_seconds();
    pthread_mutex_lock(&e->mutex);
    e->ended = true;
    const bool abandoned = e->abandoned;
    pthread_cond_signal(&e->changed);
    pthread_mutex_unlock(&e->mutex);
    if (!abandoned) return NULL;
    shd_budget *budget = e->budget;
    const size_t working = e->working;
    drop_encoding(e);
    shd_budget_give(budget, working);
    shd_budget_drop(budget);
    atomic_fetch_sub(&abandoned_threads, 1);
    return NULL;
}

/* ---- The caller ---- */

enum { LOOK = 10 * 1000 * 1000 }; /* nanoseconds between two questions whether to go on */

/* What to encode, and how; without pixels. False: libwebp is another version. */
static bool set_up(const shd_image *image, encoding *e) {
    WebPConfig *config = &e->config;
    WebPPicture *picture = &e->picture;
    if (!WebPPictureInit(picture) ||
        !WebPConfigPreset(config, WEBP_PRESET_DEFAULT, (float)image->quality))
        return false;
    config->method = image->effort;
    if (image->quality >= 100) {
        WebPConfigLosslessPreset(config, image->effort);
        config->exact = 1; /* color under alpha 0 stays too */
        picture->use_argb = 1;
    } else if (is_sharp(image)) {
        config->use_sharp_yuv = 1;
        picture->use_argb = 1;
    }
    picture->progress_hook = ask_to_go_on;
    picture->user_data = e;
    picture->width = image->width;
    picture->height = image->height;
    e->icc = shd_icc_make(image);
    e->exif_size = shd_exif_make(image, e->exif);
    return true;
}

/* Until the thread has ended or, false, it is to be left. */
static bool wait_for_thread(encoding *e, const shd_image *image) {
    bool goes_on = true;
    pthread_mutex_lock(&e->mutex);
    while (!e->ended && goes_on) {
        const struct timespec until = shd_timespec(shd_now() + 1e-9 * LOOK);
        pthread_cond_clockwait(&e->changed, &e->mutex, CLOCK_MONOTONIC, &until);
        if (e->ended) break;
        pthread_mutex_unlock(&e->mutex);
        goes_on = shd_encode_goes_on(image);
        pthread_mutex_lock(&e->mutex);
    }
    const bool ended = e->ended;
    pthread_mutex_unlock(&e->mutex);
    return ended;
}

/* Leaves the thread to itself, unless it has ended meanwhile. It gives way to others from then on,
 * but not so much that a busy machine would keep its memory for long. */
static bool abandon_thread(encoding *e, pthread_t thread, shd_arena *scratch) {
    enum { NICE = 10 };
    pthread_mutex_lock(&e->mutex);
    if (!e->ended) {
        e->abandoned = true;
        e->budget = shd_budget_keep(shd_arena_release(scratch, e->working));
        atomic_fetch_add(&abandoned_threads, 1);
        if (e->thread) setpriority(PRIO_PROCESS, (id_t)e->thread, NICE);
        pthread_detach(thread);
    }
    const bool abandoned = e->abandoned;
    pthread_mutex_unlock(&e->mutex);
    return abandoned;
}

/* Has a thread encode. *abandoned: the encoding is the thread's. */
static shd_status run_thread(encoding *e, const shd_image *image, shd_arena *scratch,
                             bool *abandoned, shd_error *error) {
    pthread_t thread;
    if (pthread_create(&thread, NULL, encode_aside, e))
        return shd_fail(error, SHD_EXHAUSTED, "", "there is no thread to encode the picture");
    const bool left = !wait_for_thread(e, image);
    *abandoned = left && abandon_thread(e, thread, scratch);
    if (*abandoned) return shd_encode_cancelled(error);
    pthread_join(thread, NULL);
    if (image->elsewhere) *image->elsewhere += e->seconds;
    if (left) return shd_encode_cancelled(error);
    if (e->status && error) *error = e->error;
    return e->status;
}

static bool wait_for_abandoned(const shd_image *image) {
    bool goes_on = true;
    while (goes_on && shd_image_abandoned() >= shd_encode_slots(image)) {
        const struct timespec some = {0, LOOK};
        nanosleep(&some, NULL);
        goes_on = shd_encode_goes_on(image);
    }
    return goes_on;
}

static shd_status encode_picture(encoding *e, const shd_image *image, shd_arena *scratch,
                                 shd_bytes *file, bool *abandoned, shd_error *error) {
    if (!set_up(image, e))
        return shd_fail(error, SHD_INTERNAL, "", "libwebp is not the version built against");
    const shd_pack pack = shd_pack_of(image, SHD_WEBP);
    e->count = pack.count;
    e->stride = image->width * pack.count;
    e->samples = malloc((size_t)e->stride * (size_t)image->height);
    if (!e->samples) return shd_encode_no_memory(error);
    shd_status status = shd_pack_rows(&pack, image, e->samples, error);
    if (!status) status = run_thread(e, image, scratch, abandoned, error);
    if (status) return status;
    *file = e->file;
    e->file.data = NULL;
    return SHD_OK;
}

/* ---- Decoded again ---- */

/* In pieces, between which it asks whether to go on. */
static shd_status decode_file(const shd_image *image, const shd_bytes *file, int count,
                              unsigned char *made, size_t size, shd_error *error) {
    enum { PIECES = 256 };
    WebPIDecoder *decoder =
        WebPINewRGB(count == 4 ? MODE_RGBA : MODE_RGB, made, size, image->width * count);
    if (!decoder) return shd_encode_no_memory(error);
    const size_t step = file->size / PIECES + 1;
    VP8StatusCode code = VP8_STATUS_SUSPENDED;
    bool goes_on = true;
    for (size_t end = step; code == VP8_STATUS_SUSPENDED; end += step) {
        goes_on = shd_encode_goes_on(image);
        if (!goes_on) break;
        code = WebPIUpdate(decoder, file->data, end < file->size ? end : file->size);
        if (end >= file->size) break;
    }
    WebPIDelete(decoder);
    if (!goes_on) return shd_encode_cancelled(error);
    if (code == VP8_STATUS_OUT_OF_MEMORY) return shd_encode_no_memory(error);
    if (code != VP8_STATUS_OK)
        return shd_fail(error, SHD_INTERNAL, "", "libwebp cannot read what it wrote: %d", code);
    return SHD_OK;
}

typedef struct comparing {
    const shd_image *image;
    const unsigned char *given, *made;
    size_t row, rows; /* bytes of a row, rows of a band */
} comparing;

static void compare_band(void *context, size_t index, unsigned slot) {
    (void)slot;
    const comparing *c = context;
    const size_t first = index * c->rows, left = (size_t)c->image->height - first;
    c->image->decoded(c->image->measuring, first, left < c->rows ? left : c->rows,
                      c->given + first * c->row, c->made + first * c->row);
}

static shd_status read_back(const shd_image *image, const shd_bytes *file, shd_arena *scratch,
                            shd_error *error) {
    enum { BAND = 1 << 14 }; /* pixels */
    const shd_pack pack = shd_pack_of(image, SHD_WEBP);
    const size_t height = (size_t)image->height, row = (size_t)image->width * (size_t)pack.count;
    const void *given;
    shd_status status = shd_pack_samples(&pack, image, scratch, &given, error);
    if (status) return status;
    unsigned char *made = shd_arena_alloc(scratch, height, row);
    if (!made || !shd_arena_borrow(scratch, decoder_size(image)))
        return shd_encode_no_memory(error);
    status = decode_file(image, file, pack.count, made, height * row, error);
    shd_arena_repay(scratch, decoder_size(image));
    if (status) return status;
    comparing c = {image, given, made, row, 1 + BAND / (size_t)image->width};
    return shd_encode_spread(image, (height + c.rows - 1) / c.rows, compare_band, &c)
               ? SHD_OK
               : shd_encode_cancelled(error);
}

static shd_status check_file(const shd_image *image, shd_bytes *file, shd_arena *scratch,
                             shd_error *error) {
    const shd_status status = image->decoded ? read_back(image, file, scratch, error) : SHD_OK;
    if (status == SHD_OK) return SHD_OK;
    shd_arena_repay(scratch, file->size);
    free(file->data);
    return status;
}

shd_status shd_encode_webp(const shd_image *image, shd_format format, shd_arena *scratch,
                           shd_bytes *out, shd_error *error) {
    if (!wait_for_abandoned(image)) return shd_encode_cancelled(error);
    const size_t working = shd_webp_scratch(image, format, false);
    encoding *e = calloc(1, sizeof *e);
    if (!e || !shd_arena_borrow(scratch, working)) {
        free(e);
        return shd_encode_no_memory(error);
    }
    shd_bytes file;
    bool abandoned = false;
    e->working = working;
    pthread_mutex_init(&e->mutex, NULL);
    pthread_cond_init(&e->changed, NULL);
    const shd_status status = encode_picture(e, image, scratch, &file, &abandoned, error);
    if (abandoned) return status;
    drop_encoding(e);
    shd_arena_repay(scratch, working);
    if (status) return status;
    if (!shd_arena_borrow(scratch, file.size)) {
        free(file.data);
        return shd_encode_no_memory(error);
    }
    *out = file;
    return check_file(image, out, scratch, error);
}
