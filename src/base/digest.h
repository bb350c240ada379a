/* SHA-256 (FIPS 180-4), which names bytes. Pure functions, any thread. */
#pragma once

#include <stdbool.h>
#include <stddef.h>

typedef struct shd_digest {
    unsigned char bytes[32];
} shd_digest;

enum { SHD_DIGEST_TEXT = 65 }; /* its digits and a 0 */

shd_digest shd_digest_of(const void *data, size_t size);

/* Reads 64 lower-case hexadecimal digits and nothing after them. False: it is something else. */
bool shd_digest_read(const char *text, shd_digest *out);
void shd_digest_write(const shd_digest *digest, char out[SHD_DIGEST_TEXT]);
bool shd_digest_same(const shd_digest *a, const shd_digest *b);
