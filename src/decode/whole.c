/* What of a file can be told without decoding it. It follows the lengths that the file gives, and
 * where these lead to anything but its end it leaves judgement to who decodes. PNG: "Portable
 * Network Graphics (PNG) Specification (Second Edition)"; JPEG: ITU-T T.81, annex B; HDR: Ward,
 * "Real Pixels", Graphics Gems II. */
#include <libdeflate.h>
#include <stdio.h>
#include <string.h>

#include "decode/decode.h"

/* A progressive picture has ten or so; all of it is gone through once for each, however few bytes
 * it has. */
enum { SCANS_MOST = 64 };

static uint32_t get_u32(const unsigned char *from) {
    return (uint32_t)from[0] << 24 | (uint32_t)from[1] << 16 | (uint32_t)from[2] << 8 | from[3];
}

/* Chunks are a length, a name, the data and a sum of both. Only the end mark may be missing. */
static shd_status walk_png(const unsigned char *data, size_t size, shd_error *error) {
    bool ends = false, has_pixels = false;
    for (size_t at = 8; at < size && !ends;) {
        const size_t left = size - at;
        if (left < 12 || get_u32(data + at) > left - 12) break;
        const size_t length = get_u32(data + at);
        const unsigned char *name = data + at + 4;
        if (libdeflate_crc32(0, name, 4 + length) != get_u32(name + 4 + length))
            return shd_fail(error, SHD_SCENE, "", "PNG: a chunk is damaged: its checksum differs");
        has_pixels = has_pixels || !memcmp(name, "IDAT", 4);
        at += 12 + length;
        ends = !memcmp(name, "IEND", 4) || (has_pixels && at == size);
    }
    return ends ? SHD_OK : shd_decode_ends_early("PNG", error);
}

/* Past the data of a scan, where the next marker is. */
static size_t skip_scan(const unsigned char *data, size_t size, size_t at) {
    for (;;) {
        const unsigned char *mark = at < size ? memchr(data + at, 0xff, size - at) : NULL;
        if (!mark) return size;
        at = (size_t)(mark - data);
        const unsigned next = at + 1 < size ? data[at + 1] : 0;
        if (next && (next & 0xf8) != 0xd0 && next != 0xff) return at; /* no stuffing, no restart */
        at += next == 0xff ? 1 : 2;
    }
}

/* Segments are 0xff, a kind, and a length that counts itself. */
static shd_status walk_jpeg(const unsigned char *data, size_t size, shd_error *error) {
    int scans = 0;
    for (size_t at = 2; at + 2 <= size;) {
        const unsigned kind = data[at + 1];
        if (data[at] != 0xff || kind == 0xd9) return SHD_OK;
        if (kind == 0xff) { /* filling */
            at++;
            continue;
        }
        if (size - at < 4) break;
        at += 2 + ((size_t)data[at + 2] << 8 | data[at + 3]);
        if (kind != 0xda) continue;
        if (++scans > SCANS_MOST)
            return shd_fail(error, SHD_SCENE, "", "JPEG: it has more than %d scans", SCANS_MOST);
        at = skip_scan(data, size, at);
    }
    return shd_decode_ends_early("JPEG", error);
}

/* The rows of a file whose lines go to the right, and have pixels. False: its head is another one.
 */
static bool find_rows(const unsigned char *data, size_t size, size_t *at, size_t *width,
                      size_t *height) {
    char line[64];
    const unsigned char *empty = memmem(data, size, "\n\n", 2), *end;
    if (!empty) return false;
    const unsigned char *start = empty + 2;
    const size_t left = size - (size_t)(start - data);
    if (!(end = memchr(start, '\n', left < sizeof line ? left : sizeof line - 1))) return false;
    memcpy(line, start, (size_t)(end - start));
    line[end - start] = 0;
    *at = (size_t)(end + 1 - data);
    return sscanf(line, "%*1[+-]Y %zu +X %zu", height, width) == 2 && *width;
}

/* Past one row: more than `size` if there is no whole one, 0 if it is damaged. A row is packed if
 * it begins with two twos and its length: each of its four channels is runs (128 + count, value)
 * and counts of bytes. */
static size_t skip_row(const unsigned char *data, size_t size, size_t at, size_t width) {
    const bool may_pack = width >= 8 && width < 32768;
    if (size - at < 4) return size + 1;
    if (!may_pack || data[at] != 2 || data[at + 1] != 2 || data[at + 2] > 127)
        return width <= (size - at) / 4 ? at + 4 * width : size + 1;
    at += 4;
    for (int channel = 0; channel < 4; channel++) {
        for (size_t x = 0; x < width;) {
            if (at >= size) return size + 1;
            const size_t code = data[at], count = code > 128 ? code - 128 : code;
            if (!count || count > width - x) return 0;
            at += code > 128 ? 2 : 1 + count;
            x += count;
        }
    }
    return at;
}

static shd_status walk_hdr(const unsigned char *data, size_t size, shd_error *error) {
    size_t at, width, height;
    if (!find_rows(data, size, &at, &width, &height)) return SHD_OK;
    for (size_t y = 0; y < height; y++) {
        at = at < size ? skip_row(data, size, at, width) : size + 1;
        if (!at) return shd_fail(error, SHD_SCENE, "", "HDR: row %zu is damaged", y);
        if (at > size) return shd_decode_ends_early("HDR", error);
    }
    return SHD_OK;
}

shd_status shd_decode_walk(shd_format format, const unsigned char *data, size_t size,
                           shd_error *error) {
    switch (format) {
    case SHD_PNG:
        return walk_png(data, size, error);
    case SHD_JPEG:
        return walk_jpeg(data, size, error);
    case SHD_TIFF:
        return shd_decode_walk_tiff(data, size, error);
    case SHD_HDR:
        return walk_hdr(data, size, error);
    default:
        return SHD_OK;
    }
}
