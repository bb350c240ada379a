/* Pictures as bytes: from float RGBA pixels to a file in memory, and what formats can carry.
 *
 * PNG is written by deflate.c and, if it is to be small, through libdeflate; JPEG through
 * libjpeg-turbo and WebP through libwebp; TIFF,
 * OpenEXR and Radiance HDR go through OpenImageIO, which lives in a module of its own
 * (shaded_oiio.so) that is loaded when the first of these formats is asked for. The same picture
 * always gives the same bytes, because no date, host or thread shows in a file. All functions may
 * be called from any thread. */
#pragma once

#include "base/arena.h"
#include "base/budget.h"
#include "base/cancel.h"
#include "base/catalog.h"
#include "base/cpu.h"
#include "base/format.h"
#include "base/status.h"

/* A plane set of an EXR file: `count` float channels, interleaved. */
typedef struct shd_image_layer {
    const char *name;            /* "diffuse"; channels become "diffuse.R", ... */
    const char *const *channels; /* [count], "R", "G", "B" or "X", "Y", "Z" or "Z" ... */
    int count;
    bool full_float;     /* stored as 32 bits even if the picture is half */
    const float *values; /* [height][width][count] */
} shd_image_layer;

typedef struct shd_image {
    int width, height;
    /* Integer samples store a value v as round(v * max), ties upward, saturated to 0..max. Half and
     * float samples store v itself, half saturated to +-65504. */
    const float *rgba; /* [height][width][4]: converted color, straight alpha in 0..1, finite */
    /* NULL, or what is stored: [height][width][count] of the samples of shd_pack_of, 8 or 16 bits
     * in native byte order. `rgba` is then not looked at. */
    const void *samples;
    int channel; /* -1: all; 0..2: that one as grey, with alpha if `alpha`; 3: alpha as grey */
    bool alpha;  /* alpha is kept; false: `rgba` is opaque, or alpha is the channel */
    shd_depth depth;
    int quality; /* 1..100: jpeg, webp (100 is lossless); 0 before it is found */
    int effort;  /* 0..6: webp, 0 is fastest */
    /* EXR: as OpenEXR names it; NULL: zip, or zips if lines are long. PNG: fast, small or NULL. */
    const char *compression;
    shd_transfer transfer; /* color metadata, written if the format has a place for it */
    bool has_primaries;
    double primaries[8]; /* CIE xy of red, green, blue, white */
    const char *space;   /* NULL, or the name of the color space or view; used by EXR */
    /* NULL, or what the channels are, in UTF-8; written if the format has a place for it. */
    const char *about;
    const char *const *channel_names; /* [3] of the space: "R".. or "Y".. or "H".. ; used by EXR */
    const shd_image_layer *layers;    /* EXR: further channels */
    size_t layer_count;
    shd_isa isa; /* of the kernels; 0, the portable ones, gives the same bytes */
    /* NULL, or asked now and then on the calling thread. False ends encoding with SHD_CANCELLED. */
    bool (*go_on)(void *context);
    /* NULL, or calls run(work, index, slot) for all of [0, count), on several threads, and returns
     * when all is done. Each thread has a slot of its own in [0, slots), the calling one slot 0. */
    void (*spread)(void *context, size_t count,
                   void (*run)(void *work, size_t index, unsigned slot), void *work);
    unsigned slots;
    void *context;     /* of both */
    double *elsewhere; /* NULL; or processor seconds of threads of the encoder's own are added */
    /* NULL; or JPEG and WebP are decoded again, and it is told what became of the samples in rows
     * [first, first + rows), each [rows][width][count] of 8 bits; on several threads. Chroma is
     * then kept as well as the format can: JPEG 4:4:4, WebP chosen for edges, at any quality. */
    void (*decoded)(void *measuring, size_t first, size_t rows, const unsigned char *given,
                    const unsigned char *made);
    void *measuring;
} shd_image;

typedef struct shd_bytes {
    unsigned char *data; /* malloc: the caller frees it */
    size_t size;
} shd_bytes;

/* Encodes. SHD_INTERNAL: the format does not hold `image->depth` or `alpha`, or has `layers` and is
 * not EXR. `scratch` gives working memory, and what *out takes counts as borrowed of it.
 *
 * - channel >= 0 is grey if the format has grey (PNG, JPEG, TIFF, EXR as "Y"), else three equal
 *   channels. One channel of a space is no color, so that no primaries are written with it.
 * - In TIFF and EXR, color is multiplied by alpha (in TIFF the encoded value). Others keep it
 * straight.
 * - HDR stores three magnitudes with a shared exponent, so that negative values become 0.
 * - EXR names color R, G, B, as viewers want it. If the space has other names, or a channel is
 * shown as grey, the string attribute "shaded:channels" names it.
 * - `about` is an iTXt chunk "Description" in PNG, Exif's ImageDescription in JPEG and WebP, and
 * ImageDescription in TIFF and, as the attribute "comments", EXR. */
shd_status shd_image_encode(const shd_image *image, shd_format format, shd_arena *scratch,
                            shd_bytes *out, shd_error *error);

/* The bytes of `scratch` that encoding takes, but for the file and what depends on the pixels'
 * values. The image need not have been rendered. `samples`: whether it will have these. */
uint64_t shd_image_scratch(const shd_image *image, shd_format format, bool samples);

/* Whether the format can be written. False: it is TIFF, EXR or HDR, and the OpenImageIO module is
 * not installed, or shd_image_prepare has found its libraries missing. This looks for the module's
 * file once, and loads nothing. */
bool shd_image_writes(shd_format format);

/* Loads what the format takes, which the first picture would do otherwise: for TIFF, EXR and HDR
 * the OpenImageIO module, whose memory stays counted in `budget`. A thread of its own does that,
 * and goes on if `cancelled` is raised.
 *
 * SHD_SCENE: the module, or a library that it needs, is not installed. SHD_EXHAUSTED: there is no
 * memory or descriptor for it now. SHD_CONFIG: it is broken. SHD_CANCELLED: `cancelled` was raised.
 * SHD_LIMIT: it takes more than half of what the budget has for work. SHD_CROWDED: it takes more
 * than is left now. */
shd_status shd_image_prepare(shd_format format, shd_budget *budget, const atomic_bool *cancelled,
                             shd_error *error);

/* Threads that encode for nobody any more. libwebp can be left only where it asks whether to go on:
 * a thread of its own encodes each picture, and if that is to end before libwebp asks,
 * shd_image_encode returns, and the thread goes on until then. What it has is its own, and stays
 * counted in the budget of `scratch`. As long as there are as many as an image has slots, WebP
 * waits before it begins. */
unsigned shd_image_abandoned(void);
