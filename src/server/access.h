/* Who may ask, and from which pages: bearer tokens and CORS. Constant once made: any thread. */
#ifndef SHD_SERVER_ACCESS_H
#define SHD_SERVER_ACCESS_H

#include <stdbool.h>

#include "base/status.h"

typedef struct shd_tokens shd_tokens;

/* Reads a file of tokens: one a line, of 16 to 255 of A-Z a-z 0-9 - . _ ~ + / =; blank lines and
 * those that start with # are left out. SHD_CONFIG, with the file and line but no token, where it
 * cannot be read, holds anything else, or no token at all. */
shd_status shd_tokens_load(const char *path, shd_tokens **out, shd_error *error);
void shd_tokens_drop(shd_tokens *tokens); /* wipes them; NULL is fine */

/* Whether an Authorization field, NULL where there is none, carries one of them. Takes the same
 * time whichever it is and however much of one is right. */
bool shd_tokens_admit(const shd_tokens *tokens, const char *authorization);

/* A list of origins, "https://a.example http://b.example:8080", or "*", or "" for none. SHD_CONFIG
 * where it is none. */
shd_status shd_origins_check(const char *origins, shd_error *error);
bool shd_origins_admit(const char *origins, const char *origin);

#endif
