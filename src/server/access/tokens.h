/* Bearer tokens (RFC 6750), of which only SHA-256 is kept. Constant once made: any thread. */
#pragma once

#include "base/status.h"
#include "quota.h"

typedef struct shd_tokens shd_tokens;

enum { SHD_TOKEN_NAME_SIZE = 33 };

/* A token, as whoever has it is known. */
typedef struct shd_token {
    char name[SHD_TOKEN_NAME_SIZE]; /* "": it has none */
    shd_rate rate;
    shd_quota *quota; /* NULL: it may be used any number of times */
} shd_token;

/* Reads a file (shd_lines_read) of lines such as
 *
 *     ci sha256:9f86...0f08 expires=2027-01-01T00:00:00Z rate=100/minute
 *     first-token-0123456789
 *
 * A name (up to 32 of A-Z a-z 0-9 - . _, which several lines may share), the SHA-256 of the token's
 * characters in lower-case hexadecimal and, in any order, the time from which it is none, in UTC
 * (RFC 3339), and how often it may be used, which is the same in each line of this name. Both may
 * be missing. Or a token without a name: 16 to 255 of A-Z a-z 0-9 - . _ ~ + / =.
 *
 * Rates are held to in `quotas`, which outlives the tokens; if that is NULL there are none. */
shd_status shd_tokens_load(const char *path, shd_quotas *quotas, shd_tokens **out,
                           shd_error *error);
void shd_tokens_drop(shd_tokens *tokens); /* NULL is fine */

/* The token that an Authorization field (NULL if there is none) carries. NULL: it carries none that
 * is known and still good. Takes the same time whichever it is and however much of it is right. */
const shd_token *shd_tokens_admit(const shd_tokens *tokens, const char *authorization);
