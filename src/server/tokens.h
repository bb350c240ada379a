/* Bearer tokens (RFC 6750), of which only SHA-256 is kept. Constant once made: any thread. */
#ifndef SHD_SERVER_TOKENS_H
#define SHD_SERVER_TOKENS_H

#include "base/status.h"

typedef struct shd_tokens shd_tokens;

enum { SHD_TOKEN_NAME_SIZE = 33 };

/* Reads a file of lines, of which those that are blank or start with # are left out:
 *
 *     ci sha256:9f86...0f08 expires=2027-01-01T00:00:00Z
 *     first-token-0123456789
 *
 * A name (up to 32 of A-Z a-z 0-9 - . _, which several lines may share), the SHA-256 of the token's
 * characters in lower-case hexadecimal and, where it is not to last, the time from which it is
 * none, in UTC (RFC 3339); or a token itself, 16 to 255 of A-Z a-z 0-9 - . _ ~ + / =, without a
 * name. SHD_CONFIG as of shd_lines_read. */
shd_status shd_tokens_load(const char *path, shd_tokens **out, shd_error *error);
void shd_tokens_drop(shd_tokens *tokens); /* NULL is fine */

/* The name of the token that an Authorization field, NULL where there is none, carries; "" where it
 * has none. NULL: it carries none that is known and good still. Takes the same time whichever it is
 * and however much of it is right. */
const char *shd_tokens_admit(const shd_tokens *tokens, const char *authorization);

#endif
