/* What the library and the module shaded_oiio.so say to each other. The module is opened at run
 * time and uses no symbol of its host; both come from one build, which `abi` checks. */
#pragma once

#include <stddef.h>

#include "base/format.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Interleaved channels of one sample type; the first plane is the picture itself. */
typedef struct shd_oiio_plane {
    const char *const *names; /* [count]: as the file has them, "R" or "diffuse.R" */
    int count;
    shd_depth depth;    /* half is given as float, and stored as half */
    const void *values; /* [height][width][count] */
} shd_oiio_plane;

typedef struct shd_oiio_job {
    size_t abi;         /* sizeof(shd_oiio_job) */
    const char *suffix; /* "tiff", "exr", "hdr" */
    int width, height;
    const shd_oiio_plane *planes;
    size_t plane_count;
    int alpha; /* index of the alpha channel in the first plane, or -1 */
    const unsigned char *icc;
    size_t icc_size;         /* 0: none */
    const float *primaries;  /* [8] for the attribute "chromaticities", or NULL */
    const char *space;       /* for the attribute "shaded:colorSpace", or NULL */
    const char *interop;     /* for the attribute "colorInteropID", or NULL */
    const char *compression; /* of EXR, or NULL */
    const char *shown;       /* for the attribute "shaded:channels", or NULL */
    const char *about;       /* for the attribute "ImageDescription", or NULL */
    void *pixels;            /* room for all planes' stored bytes; used if they must be woven */
    bool (*go_on)(void *context); /* NULL; or asked now and then whether to */
    void *context;
} shd_oiio_job;

/* 0, and malloc'd bytes; or -1 and a sentence. 1: out of memory; 2: it was not to go on. Any
 * thread. */
typedef int shd_oiio_encode_fn(const shd_oiio_job *job, unsigned char **data, size_t *size,
                               char *text, size_t text_size);

/* A file that is read: its first three colors and its alpha, or its one grey. */
typedef struct shd_oiio_file {
    size_t abi;        /* sizeof(shd_oiio_file) */
    const char *path;  /* of any format but WebP */
    int width, height; /* what is expected: others are not read */
    size_t most;       /* pixels, where the width is 0: any size up to that is */
    int found_width, found_height;
    int count;       /* 1 to 4 */
    bool alpha;      /* the last of them is alpha */
    bool associated; /* colors are multiplied by it */
    shd_depth depth;
    float *values; /* malloc: [height][width][count], integers in [0,1]; straight alpha where the
                    * format has that. NULL: the size is another one */
} shd_oiio_file;

/* As shd_oiio_encode_fn. */
typedef int shd_oiio_read_fn(shd_oiio_file *file, char *text, size_t text_size);
shd_oiio_read_fn shd_oiio_read;

/* A file in memory that is decoded. */
typedef struct shd_oiio_decoding {
    size_t abi; /* sizeof(shd_oiio_decoding) */
    const unsigned char *data;
    size_t size;
    const char *suffix; /* "tif", "exr", "hdr": what its first bytes say */
    /* What its head says: its red, green and blue, or its one grey, then its alpha. */
    int width, height, count;
    bool alpha, associated; /* associated: colors are multiplied by it */
    shd_depth depth;        /* SHD_U8, SHD_U16 or SHD_FLOAT, that of the samples */
    /* Called once the head is known. False ends the decoding. */
    bool (*admit)(void *context, const struct shd_oiio_decoding *decoding);
    void *context;
    void *samples; /* malloc: [height][width][count] */
} shd_oiio_decoding;

/* 0, and samples; -1 and a sentence; 1: out of memory; 2: it was not admitted. */
typedef int shd_oiio_decode_fn(shd_oiio_decoding *decoding, char *text, size_t text_size);
shd_oiio_decode_fn shd_oiio_decode;

/* Beside these the module's only symbol: sets OpenImageIO up, once, and returns the encoder. NULL:
 * out of memory. */
typedef shd_oiio_encode_fn *shd_oiio_open_fn(void);
shd_oiio_open_fn shd_oiio_open;

#ifdef __cplusplus
}
#endif
