#include "base/digest.h"

#include <nettle/base16.h>
#include <nettle/sha2.h>
#include <string.h>

shd_digest shd_digest_of(const void *data, size_t size) {
    struct sha256_ctx hash;
    shd_digest out;
    sha256_init(&hash);
    sha256_update(&hash, size, data);
    sha256_digest(&hash, sizeof out.bytes, out.bytes);
    return out;
}

bool shd_digest_read(const char *text, shd_digest *out) {
    const size_t digits = strspn(text, "0123456789abcdef");
    if (digits != SHD_DIGEST_TEXT - 1 || text[digits]) return false;
    struct base16_decode_ctx hex;
    size_t size = sizeof out->bytes;
    base16_decode_init(&hex);
    return base16_decode_update(&hex, &size, out->bytes, digits, text);
}

void shd_digest_write(const shd_digest *digest, char out[SHD_DIGEST_TEXT]) {
    base16_encode_update(out, sizeof digest->bytes, digest->bytes);
    out[SHD_DIGEST_TEXT - 1] = 0;
}

bool shd_digest_same(const shd_digest *a, const shd_digest *b) {
    return !memcmp(a->bytes, b->bytes, sizeof a->bytes);
}
