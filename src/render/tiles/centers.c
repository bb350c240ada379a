#include "render/tiles/centers.h"

/* What cells of these shots have, beside where they are. */
enum { SHARED = 0x8000, PITCH = 64 };

void shd_centers_add(shd_centers *centers, uint16_t cell, uint64_t pixels, int rim) {
    uint64_t *row = &centers->rows[cell / SHD_TILE + SHD_FRINGE];
    if (pixels == ~(uint64_t)0) { /* almost always */
        const uint64_t bits = (((uint64_t)1 << (SHD_BLOCK_SIDE + 2 * rim)) - 1)
                              << (cell % SHD_TILE + SHD_FRINGE - (size_t)rim);
        for (int i = -rim; i < SHD_BLOCK_SIDE + rim; i++) row[i] |= bits;
        return;
    }
    for (; pixels; pixels >>= SHD_BLOCK_SIDE, row++) {
        const uint64_t bits = (pixels & SHD_ROW) << (cell % SHD_TILE + SHD_FRINGE);
        uint64_t wide = bits;
        for (int i = 1; i <= rim; i++) wide |= bits << i | bits >> i;
        for (int i = -rim; i <= rim; i++) row[i] |= wide;
    }
}

/* The next run of bits: its first one, and how many they are. 0: there is none. */
static int next_run(uint64_t *bits, int *first) {
    if (!*bits) return 0;
    *first = __builtin_ctzll(*bits);
    const int length = __builtin_ctzll(~(*bits >> *first)); /* a row has fewer than 64 */
    *bits &= ~((((uint64_t)1 << length) - 1) << *first);
    return length;
}

size_t shd_centers_list(const shd_centers *centers, int left, int top, int32_t *restrict x,
                        int32_t *restrict y, uint16_t *restrict cell) {
    size_t count = 0;
    for (int row = 0; row < SHD_CENTERS_SIDE; row++) {
        uint64_t bits = centers->rows[row];
        for (int first, length; (length = next_run(&bits, &first)); count += (size_t)length) {
            for (int i = 0; i < length; i++) x[count + (size_t)i] = left + first + i - SHD_FRINGE;
            for (int i = 0; i < length; i++) y[count + (size_t)i] = top + row - SHD_FRINGE;
            for (int i = 0; i < length; i++)
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
