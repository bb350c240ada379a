/* Who may ask, and from which pages: bearer tokens, signatures and CORS. Constant once made: any
 * thread. */
#ifndef SHD_SERVER_ACCESS_H
#define SHD_SERVER_ACCESS_H

#include <stdbool.h>
#include <stddef.h>

#include "base/status.h"

/* Bearer tokens, or keys that sign. */
typedef struct shd_secrets shd_secrets;

/* What a file holds: the word for one of them, and the least of its characters. */
typedef struct shd_secret_kind {
    const char *name;
    size_t least;
} shd_secret_kind;

extern const shd_secret_kind shd_token_kind, shd_key_kind; /* 16 and 32 */

/* Reads a file of secrets: one a line, up to 255 of A-Z a-z 0-9 - . _ ~ + / =; blank lines and
 * those that start with # are left out. Every line has at most 1000 characters, of printable ASCII
 * and tabs; it ends with LF or CRLF. SHD_CONFIG, with the file and line but no secret, where it
 * cannot be read, holds anything else, or none at all. */
shd_status shd_secrets_load(const char *path, const shd_secret_kind *kind, shd_secrets **out,
                            shd_error *error);
void shd_secrets_drop(shd_secrets *secrets); /* wipes them; NULL is fine */

/* Both take the same time whichever secret it is and however much of it is right. */

/* Whether an Authorization field, NULL where there is none, carries one of these tokens. */
bool shd_secrets_admit(const shd_secrets *tokens, const char *authorization);

/* Whether `signature` is the HMAC-SHA256 (RFC 2104, FIPS 180-4) of the text by one of these keys,
 * the characters of its line being the key, in base64url without padding (RFC 4648, section 5). */
bool shd_secrets_signed(const shd_secrets *keys, const char *text, size_t length,
                        const char *signature);

/* A list of origins, "https://a.example http://b.example:8080", or "*", or "" for none, as
 * Timing-Allow-Origin has it, joined by ", ", for the caller to free. SHD_CONFIG where it is no
 * list. */
shd_status shd_origins_list(const char *origins, char **out, shd_error *error);
bool shd_origins_admit(const char *origins, const char *origin);

#endif
