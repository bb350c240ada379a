#include "gzip.h"

#include <libdeflate.h>
#include <stdbool.h>
#include <stdlib.h>

/* Of libdeflate's 12: a megabyte of JSON takes some 10 ms. */
enum { LEVEL = 6 };

void *shd_gzip(const void *text, size_t size, size_t *out_size) {
    struct libdeflate_compressor *compressor = libdeflate_alloc_compressor(LEVEL);
    void *out = compressor && size ? malloc(size) : NULL;
    *out_size = out ? libdeflate_gzip_compress(compressor, text, size, out, size) : 0;
    libdeflate_free_compressor(compressor);
    if (*out_size) return out;
    free(out);
    return NULL;
}

void *shd_gunzip(const void *gzip, size_t size, size_t out_size) {
    struct libdeflate_decompressor *decompressor = libdeflate_alloc_decompressor();
    void *out = decompressor ? malloc(out_size) : NULL;
    const bool is_done = out && libdeflate_gzip_decompress(decompressor, gzip, size, out, out_size,
                                                           NULL) == LIBDEFLATE_SUCCESS;
    libdeflate_free_decompressor(decompressor);
    if (is_done) return out;
    free(out);
    return NULL;
}
