#include "image/filter.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "base/cpu.h"
#include "base/simd.h"

/* "Up" and "sub" suit smooth pictures, "average" edges that run aslant; Paeth's follows noise, of
 * which there is none. */
enum { SUB = 1, UP = 2, AVERAGE = 3 };

#ifdef __SSE2__
typedef uint8_t bytes __attribute__((vector_size(4 * SHD_W)));
#if SHD_W == 16
typedef __m512i vector;
#elif SHD_W == 8
typedef __m256i vector;
#else
typedef __m128i vector;
#endif
#endif

/* How far a row is from what filters expect. */
typedef struct sums {
    uint64_t up, sub, average;
} sums;

static inline unsigned char mean(unsigned char a, unsigned char b) {
    return (unsigned char)((a & b) + ((a ^ b) >> 1));
}

static inline sums sum_differences(const unsigned char *row, const unsigned char *above,
                                   size_t size, size_t pixel) {
    sums s = {0, 0, 0};
    size_t i = 0;
    for (; i < pixel; i++) { /* a row's first pixel has zeros to its left */
        s.up += (uint64_t)abs(row[i] - above[i]);
        s.sub += row[i];
        s.average += (uint64_t)abs(row[i] - above[i] / 2);
    }
#ifdef __SSE2__
    enum { BYTES = 4 * SHD_W };
    shd_vul up = {0}, sub = {0}, average = {0};
    for (; i + BYTES <= size; i += BYTES) {
        shd_vul x, a, l;
        memcpy(&x, row + i, BYTES);
        memcpy(&a, above + i, BYTES);
        memcpy(&l, row + i - pixel, BYTES);
        const bytes low = (bytes)(a ^ l) & 1; /* the instruction rounds upward */
        const bytes expected = (bytes)SHD_X86(avg_epu8)((vector)a, (vector)l) - low;
        up += (shd_vul)SHD_X86(sad_epu8)((vector)x, (vector)a);
        sub += (shd_vul)SHD_X86(sad_epu8)((vector)x, (vector)l);
        average += (shd_vul)SHD_X86(sad_epu8)((vector)x, (vector)expected);
    }
    for (int k = 0; k < SHD_W / 2; k++) s.up += up[k], s.sub += sub[k], s.average += average[k];
#endif
    for (; i < size; i++) {
        s.up += (uint64_t)abs(row[i] - above[i]);
        s.sub += (uint64_t)abs(row[i] - row[i - pixel]);
        s.average += (uint64_t)abs(row[i] - mean(row[i - pixel], above[i]));
    }
    return s;
}

static inline void subtract_bytes(const unsigned char *restrict row,
                                  const unsigned char *restrict expected, size_t size,
                                  unsigned char *restrict out) {
    for (size_t i = 0; i < size; i++) out[i] = (unsigned char)(row[i] - expected[i]);
}

static inline void subtract_means(const unsigned char *restrict row,
                                  const unsigned char *restrict above, size_t size, size_t pixel,
                                  unsigned char *restrict out) {
    for (size_t i = 0; i < pixel; i++) out[i] = (unsigned char)(row[i] - above[i] / 2);
    for (size_t i = pixel; i < size; i++)
        out[i] = (unsigned char)(row[i] - mean(row[i - pixel], above[i]));
}

/* By the filter that leaves the least, which compresses best more often than not. */
static void filter_row(const unsigned char *row, const unsigned char *above, size_t size,
                       size_t pixel, unsigned char *out) {
    *out++ = UP;
    if (!memcmp(row, above, size)) {
        memset(out, 0, size);
        return;
    }
    const sums s = sum_differences(row, above, size, pixel);
    if (s.up <= s.sub && s.up <= s.average) {
        subtract_bytes(row, above, size, out);
    } else if (s.sub <= s.average) {
        out[-1] = SUB;
        memcpy(out, row, pixel);
        subtract_bytes(row + pixel, row, size - pixel, out + pixel);
    } else {
        out[-1] = AVERAGE;
        subtract_means(row, above, size, pixel, out);
    }
}

const shd_filter_kernel SHD_VARIANT(shd_filter_kernel) = {filter_row};
