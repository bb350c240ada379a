#include "render/tiles/centers.h"

/* What cells of these shots have, beside where they are. */
enum { SHARED = 0x8000, PITCH = 64 };

void shd_centers_add(shd_centers *centers, uint16_t cell, size_t width, size_t height) {
    const size_t x = cell % SHD_TILE, y = cell / SHD_TILE;
    const uint64_t bits = (((uint64_t)1 << (width + 2 * SHD_FRINGE)) - 1) << x;
    for (size_t row = y; row < y + height + 2 * SHD_FRINGE; row++) centers->rows[row] |= bits;
}

/* The next run of bits: its first one, and how many they are. 0: there is none. */
static int next_run(uint64_t *bits, int *first) {
    if (!*bits) return 0;
    *first = __builtin_ctzll(*bits);
    const int length = __builtin_ctzll(~(*bits >> *first)); /* a row has fewer than 64 */
    *bits &= ~((((uint64_t)1 << length) - 1) << *first);
    return length;
}

size_t shd_centers_list(const shd_centers *centers, int left, int top, int32_t *x, int32_t *y,
                        uint16_t *cell) {
    size_t count = 0;
    for (int row = 0; row < SHD_CENTERS_SIDE; row++) {
        uint64_t bits = centers->rows[row];
        for (int first, length; (length = next_run(&bits, &first)); count += (size_t)length)
            for (int i = 0; i < length; i++) {
                x[count + (size_t)i] = left + first + i - SHD_FRINGE;
                y[count + (size_t)i] = top + row - SHD_FRINGE;
                cell[count + (size_t)i] = (uint16_t)(SHARED | (row * PITCH + first + i));
            }
    }
    return count;
}

void shd_centers_spread(const shd_centers *centers, const float *values,
                        double plane[SHD_CENTERS_SIDE][SHD_CENTERS_SIDE]) {
    for (int row = 0; row < SHD_CENTERS_SIDE; row++) {
        uint64_t bits = centers->rows[row];
        for (int first, length; (length = next_run(&bits, &first)); values += length)
            for (int i = 0; i < length; i++) plane[row][first + i] = (double)values[i];
    }
}
