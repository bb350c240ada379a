/* Who may ask, and from which pages: signatures and CORS; tokens are in tokens.c. Constant once
 * made: any thread. */
#pragma once

#include <stdbool.h>
#include <stddef.h>

#include "base/status.h"

/* The characters of names and secrets, beside a few that each says. */
#define SHD_LETTERS "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789"

/* Keys that sign. */
typedef struct shd_keys shd_keys;

/* Reads a file of keys: one a line, 32 to 255 of A-Z a-z 0-9 - . _ ~ + / =. SHD_CONFIG as of
 * shd_lines_read, and if there is none. */
shd_status shd_keys_load(const char *path, shd_keys **out, shd_error *error);
void shd_keys_drop(shd_keys *keys); /* wipes them; NULL is fine */

/* Whether `signature` is the HMAC-SHA256 (RFC 2104, FIPS 180-4) of the text by one of these keys,
 * the characters of its line being the key, in base64url without padding (RFC 4648, section 5).
 * Takes the same time whichever key it is and however much of it is right. */
bool shd_keys_signed(const shd_keys *keys, const char *text, size_t length, const char *signature);

/* Gives `take` each line of a file of secrets, without the blanks around it; blank lines and those
 * that start with # are left out. A line has at most 1000 characters, of printable ASCII and tabs,
 * and ends with LF or CRLF. SHD_CONFIG if that is not so, if `take` says what is wrong ("is no
 * key"), or if the file cannot be read: with the file and the line's number, but nothing of it. */
shd_status shd_lines_read(const char *path, const char *(*take)(void *context, char *line),
                          void *context, shd_error *error);

/* A list of origins ("https://a.example http://b.example:8080", "*", or "" for none) as
 * Timing-Allow-Origin has it, for the caller to free. SHD_CONFIG if it is no list. */
shd_status shd_origins_list(const char *origins, char **out, shd_error *error);
bool shd_origins_admit(const char *origins, const char *origin);
