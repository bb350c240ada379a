#include "image/exif.h"

#include <string.h>

size_t shd_exif_make(const shd_image *image, unsigned char out[SHD_EXIF_MAX]) {
    /* Little-endian TIFF whose directory, at 8, has one entry: tag 0x010E, ASCII, a length, and
     * where the text is. No directory follows. */
    static const unsigned char head[26] = {'I', 'I', 42, 0, 8, 0,  0, 0, 1, 0, 0x0E, 1, 2,
                                           0,   0,   0,  0, 0, 26, 0, 0, 0, 0, 0,    0, 0};
    enum { LENGTH_AT = 14 };
    if (!image->about) return 0;
    size_t length = strnlen(image->about, SHD_EXIF_MAX - sizeof head - 1);
    memset(out, 0, SHD_EXIF_MAX);
    memcpy(out, head, sizeof head);
    memcpy(out + sizeof head, image->about, length);
    if (++length < 5) length = 5; /* a shorter text would stand in the entry itself */
    out[LENGTH_AT] = (unsigned char)length;
    out[LENGTH_AT + 1] = (unsigned char)(length >> 8);
    return sizeof head + length;
}
