/* PNG's filters (ISO/IEC 15948, 9.2): a row less what its neighbors promise. */
#pragma once

#include <stddef.h>

/* One variant's functions. */
typedef struct shd_filter_kernel {
    /* Filters a row of `size` bytes, pixels of `pixel` bytes, into out[1 + size], whose first byte
     * names the filter. `above` is the row above, zeros for the first one. */
    void (*filter)(const unsigned char *row, const unsigned char *above, size_t size, size_t pixel,
                   unsigned char *out);
} shd_filter_kernel;

extern const shd_filter_kernel shd_filter_kernel_portable, shd_filter_kernel_avx2,
    shd_filter_kernel_avx512;
