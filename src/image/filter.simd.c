#include "image/filter.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "base/cpu.h"

/* "Up" and "sub" suit smooth pictures, "average" edges that run aslant; Paeth's follows noise, of
 * which there is none. */
enum { SUB = 1, UP = 2, AVERAGE = 3 };

/* How far two rows are apart. Compilers know this sum: most processors have it. */
static inline uint64_t sum_of_differences(const unsigned char *restrict a,
                                          const unsigned char *restrict b, size_t size) {
    uint64_t sum = 0;
    for (size_t done = 0; done < size;) {
        const size_t some = size - done < 1 << 16 ? size - done : 1 << 16;
        const unsigned char *restrict x = a + done, *restrict y = b + done;
        int part = 0;
        for (size_t i = 0; i < some; i++) part += abs(x[i] - y[i]);
        sum += (unsigned)part;
        done += some;
    }
    return sum;
}

static inline void subtract_bytes(const unsigned char *restrict row,
                                  const unsigned char *restrict expected, size_t size,
                                  unsigned char *restrict out) {
    for (size_t i = 0; i < size; i++) out[i] = (unsigned char)(row[i] - expected[i]);
}

static inline void take_averages(const unsigned char *restrict left,
                                 const unsigned char *restrict above, size_t size,
                                 unsigned char *restrict out) {
    for (size_t i = 0; i < size; i++)
        out[i] = (unsigned char)((left[i] & above[i]) + ((left[i] ^ above[i]) >> 1));
}

/* By the filter that leaves the least, which compresses best more often than not. */
static void filter_row(const unsigned char *row, const unsigned char *above, size_t size,
                       size_t pixel, unsigned char *room, unsigned char *out) {
    uint64_t up = sum_of_differences(row, above, size);
    *out++ = UP;
    if (!up) {
        memset(out, 0, size);
        return;
    }
    /* A row's first pixel has zeros to its left. */
    const size_t rest = size - pixel;
    uint64_t sub = sum_of_differences(row + pixel, row, rest);
    take_averages(row, above + pixel, rest, room);
    uint64_t average = sum_of_differences(row + pixel, room, rest);
    for (size_t i = 0; i < pixel; i++) {
        sub += row[i];
        average += (uint64_t)abs(row[i] - above[i] / 2);
    }
    if (up <= sub && up <= average) {
        subtract_bytes(row, above, size, out);
    } else if (sub <= average) {
        out[-1] = SUB;
        memcpy(out, row, pixel);
        subtract_bytes(row + pixel, row, rest, out + pixel);
    } else {
        out[-1] = AVERAGE;
        for (size_t i = 0; i < pixel; i++) out[i] = (unsigned char)(row[i] - above[i] / 2);
        subtract_bytes(row + pixel, room, rest, out + pixel);
    }
}

const shd_filter_kernel SHD_VARIANT(shd_filter_kernel) = {filter_row};
