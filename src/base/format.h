/* Picture formats and their sample types, by the names that clients use. */
#pragma once

#include <stdbool.h>
#include <stddef.h>

typedef enum shd_format {
    SHD_PNG,
    SHD_JPEG,
    SHD_WEBP,
    SHD_TIFF,
    SHD_EXR,
    SHD_HDR,
    SHD_FORMAT_COUNT
} shd_format;

/* Bits of shd_format_info.depths. */
typedef enum shd_depth { SHD_U8 = 1, SHD_U16 = 2, SHD_HALF = 4, SHD_FLOAT = 8 } shd_depth;

typedef struct shd_format_info {
    const char *name;       /* "png" */
    const char *media_type; /* "image/png" */
    unsigned depths;        /* shd_depth bits that the format can hold */
    shd_depth depth;        /* used if the request names none */
    bool alpha;             /* whether it can hold alpha */
    bool premultiplied;     /* whether its alpha is associated, as EXR and TIFF have it */
    bool grey;              /* whether it has pictures of one channel */
    bool linear;            /* whether its samples are scene-linear by convention */
    int side;               /* the longest that a picture may have, in pixels */
} shd_format_info;

const shd_format_info *shd_format_get(shd_format format);

/* By name or file suffix ("png", "jpg", "jpeg", "tif", ...), in any case. False: unknown. */
bool shd_format_find(const char *name, shd_format *out);

/* The format of a file that begins with these bytes; SHD_FORMAT_COUNT: none of these. */
shd_format shd_format_sniff(const unsigned char *data, size_t size);

/* Whether OpenImageIO reads and writes it here. */
bool shd_format_takes_oiio(shd_format format);

/* "8", "16", "half", "float". */
const char *shd_depth_name(shd_depth depth);
