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
    static const char digits[] = "0123456789abcdef";
    shd_digest read = {{0}};
    for (size_t i = 0; i < 2 * sizeof read.bytes; i++) {
        const char *digit = text[i] ? strchr(digits, text[i]) : NULL;
        if (!digit) return false;
        read.bytes[i / 2] = (unsigned char)(16 * read.bytes[i / 2] + (digit - digits));
    }
    if (text[2 * sizeof read.bytes]) return false;
    *out = read;
    return true;
}

void shd_digest_write(const shd_digest *digest, char out[SHD_DIGEST_TEXT]) {
    base16_encode_update(out, sizeof digest->bytes, digest->bytes);
    out[SHD_DIGEST_TEXT - 1] = 0;
}

bool shd_digest_same(const shd_digest *a, const shd_digest *b) {
    return !memcmp(a->bytes, b->bytes, sizeof a->bytes);
}
