/* Any bytes as the file of a picture, decoded here instead of in a process of its own: what
 * OpenImageIO reads is looked through, but not decoded: it is not of this build. What is decoded
 * has the size that its head told, and all of its samples. */
#include <libdeflate.h>
#include <stdlib.h>
#include <string.h>

#include "decode/decode.h"
#include "fuzz.h"

enum { MOST = 1 << 16 /* pixels */ };

static bool admit(void *context, const shd_decoded *picture) {
    shd_decoded *told = context;
    CHECK(!told->width);
    *told = *picture;
    return true;
}

static uint32_t get_u32(const uint8_t *from) {
    return (uint32_t)from[0] << 24 | (uint32_t)from[1] << 16 | (uint32_t)from[2] << 8 | from[3];
}

/* Mends the sums of a PNG's chunks, without which no mutant would come any farther. */
static void mend_sums(uint8_t *data, size_t size) {
    if (shd_format_sniff(data, size) != SHD_PNG || data[size - 1] & 1) return;
    for (size_t at = 8; size - at >= 12;) {
        const size_t length = get_u32(data + at);
        if (length > size - at - 12) return;
        const uint32_t sum = libdeflate_crc32(0, data + at + 4, 4 + length);
        for (int i = 0; i < 4; i++) data[at + 8 + length + i] = (uint8_t)(sum >> (24 - 8 * i));
        at += 12 + length;
    }
}

static void decode(const uint8_t *data, size_t size) {
    shd_decoded told = {0}, picture;
    const shd_decoder decoder = {.most = MOST, .admit = admit, .context = &told};
    void *samples;
    shd_error error = {.text = ""};
    const shd_status status = shd_decode(&decoder, data, size, &picture, &samples, &error);
    if (status != SHD_OK) {
        CHECK(*error.text && !samples);
        CHECK(status == SHD_SCENE || status == SHD_LIMIT || status == SHD_EXHAUSTED);
        return;
    }
    CHECK(!memcmp(&told, &picture, sizeof told));
    CHECK(told.width >= 1 && told.height >= 1 && told.width <= MOST / told.height);
    CHECK(told.count - told.alpha == 1 || told.count - told.alpha == 3);
    CHECK(told.depth == SHD_U8 || told.depth == SHD_U16);
    /* Each is there: AddressSanitizer sees if one is not. */
    const size_t bytes = (size_t)told.width * (size_t)told.height * (size_t)told.count *
                         shd_decoded_sample(told.depth);
    unsigned sum = 0;
    for (size_t i = 0; i < bytes; i++) sum += ((const uint8_t *)samples)[i];
    CHECK(sum <= 255 * bytes);
    free(samples);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    uint8_t *copy = malloc(size ? size : 1);
    if (!copy) return 0;
    if (size) memcpy(copy, data, size);
    mend_sums(copy, size);
    decode(copy, size);
    shd_error error;
    if (shd_format_sniff(copy, size) == SHD_EXR) shd_decode_check_exr(copy, size, &error);
    if (shd_format_sniff(copy, size) == SHD_TIFF) shd_decode_check_tiff(copy, size, &error);
    free(copy);
    return 0;
}
