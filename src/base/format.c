#include "base/format.h"

#include <string.h>
#include <strings.h>

/* JPEG's side is libjpeg's JPEG_MAX_DIMENSION, WebP's follows from the 14 bits of its header. The
 * others are limited to what readers take. */
enum { LONG = 1 << 24 };

static const shd_format_info formats[SHD_FORMAT_COUNT] = {
    [SHD_PNG] = {"png", "image/png", SHD_U8 | SHD_U16, SHD_U8, true, false, true, false, LONG},
    [SHD_JPEG] = {"jpeg", "image/jpeg", SHD_U8, SHD_U8, false, false, true, false, 65500},
    [SHD_WEBP] = {"webp", "image/webp", SHD_U8, SHD_U8, true, false, false, false, 16383},
    [SHD_TIFF] = {"tiff", "image/tiff", SHD_U8 | SHD_U16 | SHD_HALF | SHD_FLOAT, SHD_U8, true, true,
                  true, false, LONG},
    [SHD_EXR] = {"exr", "image/x-exr", SHD_HALF | SHD_FLOAT, SHD_HALF, true, true, true, true,
                 LONG},
    [SHD_HDR] = {"hdr", "image/vnd.radiance", SHD_FLOAT, SHD_FLOAT, false, false, false, true,
                 LONG},
};

static const struct {
    const char *suffix;
    shd_format format;
} suffixes[] = {{"png", SHD_PNG},   {"jpeg", SHD_JPEG}, {"jpg", SHD_JPEG}, {"webp", SHD_WEBP},
                {"tiff", SHD_TIFF}, {"tif", SHD_TIFF},  {"exr", SHD_EXR},  {"hdr", SHD_HDR}};

const shd_format_info *shd_format_get(shd_format format) {
    return &formats[format];
}

bool shd_format_find(const char *name, shd_format *out) {
    for (size_t i = 0; i < sizeof suffixes / sizeof suffixes[0]; i++) {
        if (strcasecmp(name, suffixes[i].suffix)) continue;
        *out = suffixes[i].format;
        return true;
    }
    return false;
}

const char *shd_depth_name(shd_depth depth) {
    return depth == SHD_U8 ? "8" : depth == SHD_U16 ? "16" : depth == SHD_HALF ? "half" : "float";
}

shd_format shd_format_sniff(const unsigned char *data, size_t size) {
    static const struct {
        shd_format format;
        unsigned char at, length;
        const char *bytes;
    } marks[] = {{SHD_PNG, 0, 8, "\x89PNG\r\n\x1a\n"},
                 {SHD_JPEG, 0, 3, "\xff\xd8\xff"},
                 {SHD_WEBP, 8, 4, "WEBP"},
                 {SHD_TIFF, 0, 4, "II*\0"},
                 {SHD_TIFF, 0, 4, "MM\0*"},
                 {SHD_TIFF, 0, 4, "II+\0"},
                 {SHD_TIFF, 0, 4, "MM\0+"},
                 {SHD_EXR, 0, 4, "v/1\x01"},
                 {SHD_HDR, 0, 10, "#?RADIANCE"},
                 {SHD_HDR, 0, 6, "#?RGBE"}};
    for (size_t i = 0; i < sizeof marks / sizeof *marks; i++)
        if (size >= (size_t)marks[i].at + marks[i].length &&
            !memcmp(data + marks[i].at, marks[i].bytes, marks[i].length))
            return marks[i].format;
    return SHD_FORMAT_COUNT;
}

bool shd_format_takes_oiio(shd_format format) {
    return format == SHD_TIFF || format == SHD_EXR || format == SHD_HDR;
}
