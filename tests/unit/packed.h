/* Bodies as clients pack them, and what comes of them. */
#ifndef SHD_TEST_PACKED_H
#define SHD_TEST_PACKED_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <zlib.h>
#include <zstd.h>

#include <cmocka.h>

#include "server/conn/inflate.h"

enum { MB = 1 << 20 };

/* Bytes that are owned, in a block of exactly their size, so that a sanitizer sees who reads on. */
typedef struct bytes {
    unsigned char *data;
    size_t size;
} bytes;

static inline bytes copy_of(const void *data, size_t size) {
    bytes b = {malloc(size ? size : 1), size};
    assert_non_null(b.data);
    if (size) memcpy(b.data, data, size);
    return b;
}

static inline bytes join(bytes a, bytes b) {
    bytes all = {malloc(a.size + b.size), a.size + b.size};
    assert_non_null(all.data);
    memcpy(all.data, a.data, a.size);
    memcpy(all.data + a.size, b.data, b.size);
    free(a.data);
    free(b.data);
    return all;
}

static inline bytes pack_zlib(const void *data, size_t size, int window_bits) {
    z_stream z = {0};
    assert_int_equal(deflateInit2(&z, 6, Z_DEFLATED, window_bits, 8, Z_DEFAULT_STRATEGY), Z_OK);
    bytes b = {malloc(deflateBound(&z, size)), 0};
    assert_non_null(b.data);
    z.next_in = (unsigned char *)(size_t)data;
    z.avail_in = (unsigned)size;
    z.next_out = b.data;
    z.avail_out = (unsigned)deflateBound(&z, size);
    assert_int_equal(deflate(&z, Z_FINISH), Z_STREAM_END);
    b.size = z.total_out;
    deflateEnd(&z);
    bytes fit = copy_of(b.data, b.size);
    free(b.data);
    return fit;
}

static inline bytes pack_gzip(const void *data, size_t size) {
    return pack_zlib(data, size, 15 + 16);
}

/* With a checksum; `streamed`: its head does not tell its size. */
static inline bytes pack_frame(const void *data, size_t size, int level, bool streamed) {
    ZSTD_CCtx *context = ZSTD_createCCtx();
    bytes b = {malloc(ZSTD_compressBound(size)), 0};
    assert_true(context && b.data);
    ZSTD_CCtx_setParameter(context, ZSTD_c_compressionLevel, level);
    ZSTD_CCtx_setParameter(context, ZSTD_c_checksumFlag, 1);
    ZSTD_CCtx_setParameter(context, ZSTD_c_contentSizeFlag, !streamed);
    b.size = ZSTD_compress2(context, b.data, ZSTD_compressBound(size), data, size);
    assert_false(ZSTD_isError(b.size));
    ZSTD_freeCCtx(context);
    bytes fit = copy_of(b.data, b.size);
    free(b.data);
    return fit;
}

static inline bytes pack_zstd(const void *data, size_t size) {
    return pack_frame(data, size, 3, false);
}

static const struct {
    shd_coding coding;
    bytes (*pack)(const void *data, size_t size);
} packers[] = {{SHD_CODING_GZIP, pack_gzip}, {SHD_CODING_ZSTD, pack_zstd}};

enum { PACKERS = sizeof packers / sizeof packers[0] };

/* What a body comes to: `*got` where it is SHD_OK. Whatever it is, all memory is given back. */
static inline shd_status unpack(shd_coding coding, bytes body, uint64_t most, uint64_t budget_size,
                                bytes *got, char *text) {
    shd_budget *budget = shd_budget_new(budget_size);
    const shd_inflation how = {.most = most, .keep = most, .budget = budget, .room = UINT64_MAX};
    size_t taken = 0;
    shd_error error = {0};
    assert_true(budget && shd_inflate_open(coding));
    const shd_status status =
        shd_inflate(coding, body.data, body.size, &how, &got->data, &got->size, &taken, &error);
    assert_int_equal(shd_budget_load_of(budget).used, status == SHD_OK ? taken : 0);
    assert_true(status != SHD_OK || taken >= got->size);
    if (text) snprintf(text, sizeof error.text, "%s", error.text);
    shd_budget_drop(budget);
    return status;
}

static inline void assert_comes_to(shd_coding coding, bytes body, const void *data, size_t size) {
    bytes got;
    assert_int_equal(unpack(coding, body, size, 64 * MB, &got, NULL), SHD_OK);
    assert_int_equal(got.size, size);
    assert_memory_equal(got.data, data, size);
    free(got.data);
    if (!size) return;
    assert_int_equal(unpack(coding, body, size - 1, 64 * MB, &got, NULL), SHD_LIMIT);
}

static inline void assert_wrong(shd_coding coding, bytes body, const char *word) {
    char text[512] = "";
    bytes got;
    assert_int_equal(unpack(coding, body, MB, 64 * MB, &got, text), SHD_SYNTAX);
    if (!strstr(text, word)) fail_msg("\"%s\" is not in \"%s\"", word, text);
}

/* Half of it repeats. */
static inline bytes make_text(size_t size) {
    bytes text = {malloc(size ? size : 1), size};
    assert_non_null(text.data);
    uint32_t state = 1;
    for (size_t i = 0; i < size; i++) {
        state = state * 1664525u + 1013904223u;
        text.data[i] = i / 1000 % 2 ? (unsigned char)(state >> 24) : "{\"a\": 1}, "[i % 10];
    }
    return text;
}

#endif
