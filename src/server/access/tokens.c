#include "tokens.h"

#include <nettle/memops.h>
#include <nettle/sha2.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <time.h>

#include "access.h"

enum { LEAST = 16, MOST = 255, TOKENS_MOST = 1000 };

typedef struct token {
    shd_token told;
    uint8_t digest[SHA256_DIGEST_SIZE];
    long long expires; /* seconds since 1970; 0: never */
} token;

struct shd_tokens {
    shd_quotas *quotas; /* NULL: these have no rates */
    size_t count;
    token list[TOKENS_MOST];
};

static const char letters[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789";

static void digest_of(const char *text, size_t length, uint8_t out[SHA256_DIGEST_SIZE]) {
    struct sha256_ctx hash;
    sha256_init(&hash);
    sha256_update(&hash, length, (const uint8_t *)text);
    sha256_digest(&hash, SHA256_DIGEST_SIZE, out);
    explicit_bzero(&hash, sizeof hash);
}

/* Whether all of a text is letters, digits and what else is allowed. */
static bool is_made_of(const char *text, const char *more) {
    while (*text && (strchr(letters, *text) || strchr(more, *text))) text++;
    return !*text;
}

static bool parse_digest(const char *text, uint8_t out[SHA256_DIGEST_SIZE]) {
    static const char prefix[] = "sha256:", digits[] = "0123456789abcdef";
    if (strncmp(text, prefix, sizeof prefix - 1) != 0) return false;
    text += sizeof prefix - 1;
    if (strspn(text, digits) != 2 * SHA256_DIGEST_SIZE || text[2 * SHA256_DIGEST_SIZE])
        return false;
    for (size_t i = 0; i < SHA256_DIGEST_SIZE; i++)
        out[i] = (uint8_t)((strchr(digits, text[2 * i]) - digits) << 4 |
                           (strchr(digits, text[2 * i + 1]) - digits));
    return true;
}

/* "expires=2027-01-01T00:00:00Z", of which timegm makes the same again if there is such a time.
 */
static bool parse_expiry(const char *text, long long *out) {
    static const char shape[] = "expires=0000-00-00T00:00:00Z";
    struct tm parts = {0};
    char again[sizeof shape];
    if (strlen(text) != sizeof shape - 1) return false;
    for (size_t i = 0; i < sizeof shape - 1; i++) {
        bool is_digit = text[i] >= '0' && text[i] <= '9';
        if (shape[i] == '0' ? !is_digit : text[i] != shape[i]) return false;
    }
    sscanf(text, "expires=%4d-%2d-%2dT%2d:%2d:%2dZ", &parts.tm_year, &parts.tm_mon, &parts.tm_mday,
           &parts.tm_hour, &parts.tm_min, &parts.tm_sec);
    parts.tm_year -= 1900;
    parts.tm_mon -= 1;
    time_t when = timegm(&parts);
    strftime(again, sizeof again, "expires=%Y-%m-%dT%H:%M:%SZ", &parts);
    *out = (long long)when;
    return !strcmp(again, text) && when > 0;
}

/* "rate=100/minute". */
static bool parse_rate(const char *text, shd_rate *out) {
    static const char prefix[] = "rate=";
    return !strncmp(text, prefix, sizeof prefix - 1) &&
           shd_rate_read(text + sizeof prefix - 1, out);
}

/* The rate is the name's, of which there may be other lines; `t` is the last one. */
static const char *take_rate(shd_tokens *tokens, token *t) {
    shd_rate rate = t->told.rate;
    for (const token *o = tokens->list; o < t; o++)
        if (!strcmp(o->told.name, t->told.name) &&
            (o->told.rate.count != rate.count || o->told.rate.seconds != rate.seconds))
            return "has another rate than a line before it of the same name";
    if (!rate.count) return NULL;
    if (!tokens->quotas) return "has a rate, which these tokens cannot have";
    t->told.quota = shd_quotas_get(tokens->quotas, t->told.name);
    return t->told.quota ? NULL : "finds no memory";
}

/* A line with a name: its two to four words. */
static const char *take_named(shd_tokens *tokens, token *t, char *line) {
    char *rest, *name = strtok_r(line, " \t", &rest), *digest = strtok_r(NULL, " \t", &rest);
    if (strlen(name) >= sizeof t->told.name || !is_made_of(name, "-._"))
        return "has a name other than up to 32 of A-Z a-z 0-9 - . _";
    if (!parse_digest(digest, t->digest))
        return "has no sha256: and 64 lower-case hexadecimal digits after the name";
    for (const char *word; (word = strtok_r(NULL, " \t", &rest));)
        if ((t->expires || !parse_expiry(word, &t->expires)) &&
            (t->told.rate.count || !parse_rate(word, &t->told.rate)))
            return "has other words than expires=2027-01-01T00:00:00Z and rate=100/minute, each "
                   "once, after the digest";
    memcpy(t->told.name, name, strlen(name) + 1);
    return take_rate(tokens, t);
}

static const char *take_token(void *context, char *line) {
    shd_tokens *tokens = context;
    size_t length = strlen(line);
    if (tokens->count == TOKENS_MOST) return "is one more than 1000 tokens";
    token *t = &tokens->list[tokens->count++];
    if (strpbrk(line, " \t")) return take_named(tokens, t, line);
    if (length < LEAST || length > MOST || !is_made_of(line, "-._~+/="))
        return "is no token: 16 to 255 of A-Z a-z 0-9 - . _ ~ + / =";
    digest_of(line, length, t->digest);
    return NULL;
}

shd_status shd_tokens_load(const char *path, shd_quotas *quotas, shd_tokens **out,
                           shd_error *error) {
    shd_tokens *tokens = calloc(1, sizeof *tokens);
    if (!tokens) return shd_fail(error, SHD_EXHAUSTED, path, "out of memory");
    tokens->quotas = quotas;
    shd_status status = shd_lines_read(path, take_token, tokens, error);
    if (!status && !tokens->count) status = shd_fail(error, SHD_CONFIG, path, "there is no token");
    if (status)
        shd_tokens_drop(tokens);
    else
        *out = tokens;
    return status;
}

void shd_tokens_drop(shd_tokens *tokens) {
    free(tokens);
}

const shd_token *shd_tokens_admit(const shd_tokens *tokens, const char *authorization) {
    static const char scheme[] = "Bearer ";
    if (!authorization || strncasecmp(authorization, scheme, sizeof scheme - 1) != 0) return NULL;
    const char *text = authorization + sizeof scheme - 1;
    text += strspn(text, " ");
    size_t length = strlen(text);
    if (length > MOST) return NULL; /* known to be wrong by its length, which is no secret */
    uint8_t digest[SHA256_DIGEST_SIZE];
    digest_of(text, length, digest);
    /* Each is looked at as a whole, whatever the others gave. */
    const token *volatile found = NULL;
    const long long now = (long long)time(NULL);
    for (size_t i = 0; i < tokens->count; i++) {
        const token *t = &tokens->list[i];
        bool is_good = !t->expires || t->expires > now;
        if (memeql_sec(digest, t->digest, sizeof digest) & is_good) found = t;
    }
    return found ? &found->told : NULL;
}
