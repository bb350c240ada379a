/* Any bytes as the file of a picture, decoded here instead of in a process of its own: what
 * OpenImageIO reads is left out, which is not of this build. What is decoded has the size that its
 * head told, and all of its samples. */
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

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    shd_decoded told = {0}, picture;
    const shd_decoder decoder = {.most = MOST, .admit = admit, .context = &told};
    void *samples;
    shd_error error = {.text = ""};
    const shd_status status = shd_decode(&decoder, data, size, &picture, &samples, &error);
    if (status != SHD_OK) {
        CHECK(*error.text && !samples);
        CHECK(status == SHD_SCENE || status == SHD_LIMIT || status == SHD_EXHAUSTED);
        return 0;
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
    return 0;
}
