/* Any bytes as the filtered rows of a picture: the first one says how far pixels are apart and how
 * long blocks are, the rest are the rows, repeated so that there are matches from far. zlib reads
 * back what was written. */
#include "image/deflate.h"

#include <string.h>
#include <zlib.h>

#include "fuzz.h"

enum { MOST = 150000 };

static size_t compress_rows(const uint8_t *rows, size_t size, size_t pixel, bool wide, size_t step,
                            uint8_t *out) {
    void *room = malloc(shd_deflate_room());
    CHECK(room);
    size_t length = 0;
    for (size_t first = 0; first < size; first += step) {
        const size_t some = size - first < step ? size - first : step;
        const size_t made = shd_deflate_block(shd_cpu_best(), room, rows + first, first, some,
                                              pixel, wide, first + some == size, out + length);
        CHECK(made <= shd_deflate_bound(some));
        length += made;
    }
    free(room);
    return length;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    if (size < 2) return 0;
    const size_t pixel = 1 + (*data & 7), kind = *data >> 3 & 3, times = 1 + (*data >> 5) * 8;
    const size_t step = kind ? SHD_DEFLATE_BLOCK >> 3 * (kind - 1) : 100;
    const bool wide = pixel % 2 == 0 && size % 2; /* samples are of two bytes */
    const size_t part = size - 1, all = part * times < MOST ? part * times : part;
    const size_t room = (all / step + 1) * shd_deflate_bound(0) + all;
    uint8_t *rows = malloc(all), *stream = malloc(room), *back = malloc(all + 1);
    CHECK(rows && stream && back);
    for (size_t i = 0; i < all; i += part) memcpy(rows + i, data + 1, part);

    const size_t length = compress_rows(rows, all, pixel, wide, step, stream);
    z_stream z = {.next_in = stream, .avail_in = (unsigned)length};
    z.next_out = back;
    z.avail_out = (unsigned)all + 1;
    CHECK(inflateInit2(&z, -15) == Z_OK);
    CHECK(inflate(&z, Z_FINISH) == Z_STREAM_END && z.total_in == length && z.total_out == all);
    CHECK(!memcmp(rows, back, all));
    inflateEnd(&z);
    free(back);
    free(stream);
    free(rows);
    return 0;
}
