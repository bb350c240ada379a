#include "tokens.h"

#include <nettle/memops.h>
#include <nettle/sha2.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <time.h>

#include "access.h"
#include "base/clock.h"
#include "base/digest.h"

enum { LEAST = 16, MOST = 255, TOKENS_MOST = 1000 };

typedef struct token {
    shd_token told;
    shd_digest digest;
    long long expires; /* seconds since 1970; 0: never */
} token;

struct shd_tokens {
    shd_quotas *quotas; /* NULL: these have no rates */
    size_t count;
    token list[TOKENS_MOST];
};

static shd_digest digest_of(const char *text, size_t length) {
    struct sha256_ctx hash;
    shd_digest digest;
    sha256_init(&hash);
    sha256_update(&hash, length, (const uint8_t *)text);
    sha256_digest(&hash, sizeof digest.bytes, digest.bytes);
    explicit_bzero(&hash, sizeof hash);
    return digest;
}

/* What follows a prefix; NULL: the text does not begin with it. */
static const char *skip_prefix(const char *text, const char *prefix) {
    const size_t length = strlen(prefix);
    return strncmp(text, prefix, length) ? NULL : text + length;
}

/* "expires=2027-01-01T00:00:00Z", of which timegm makes the same again if there is such a time. */
static bool parse_expiry(const char *text, long long *out) {
    static const char format[] = "expires=%Y-%m-%dT%H:%M:%SZ";
    struct tm parts = {0};
    char again[sizeof "expires=0000-00-00T00:00:00Z"];
    if (!strptime(text, format, &parts)) return false;
    *out = (long long)timegm(&parts);
    return strftime(again, sizeof again, format, &parts) && !strcmp(again, text) && *out > 0;
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
    if (strlen(name) >= sizeof t->told.name || name[strspn(name, SHD_LETTERS "-._")])
        return "has a name other than up to 32 of A-Z a-z 0-9 - . _";
    const char *digits = skip_prefix(digest, "sha256:");
    if (!digits || !shd_digest_read(digits, &t->digest))
        return "has no sha256: and 64 lower-case hexadecimal digits after the name";
    for (const char *word; (word = strtok_r(NULL, " \t", &rest));) {
        const char *rate = skip_prefix(word, "rate=");
        if ((t->expires || !parse_expiry(word, &t->expires)) &&
            (t->told.rate.count || !rate || !shd_rate_read(rate, &t->told.rate)))
            return "has other words than expires=2027-01-01T00:00:00Z and rate=100/minute, each "
                   "once, after the digest";
    }
    memcpy(t->told.name, name, strlen(name) + 1);
    return take_rate(tokens, t);
}

static const char *take_token(void *context, char *line) {
    shd_tokens *tokens = context;
    size_t length = strlen(line);
    if (tokens->count == TOKENS_MOST) return "is one more than 1000 tokens";
    token *t = &tokens->list[tokens->count++];
    if (strpbrk(line, " \t")) return take_named(tokens, t, line);
    if (length < LEAST || length > MOST || line[strspn(line, SHD_LETTERS "-._~+/=")])
        return "is no token: 16 to 255 of A-Z a-z 0-9 - . _ ~ + / =";
    t->digest = digest_of(line, length);
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
    const shd_digest digest = digest_of(text, length);
    /* Each is looked at as a whole, whatever the others gave. */
    const token *volatile found = NULL;
    const long long now = shd_date();
    for (size_t i = 0; i < tokens->count; i++) {
        const token *t = &tokens->list[i];
        bool is_good = !t->expires || t->expires > now;
        if (memeql_sec(&digest, &t->digest, sizeof digest) & is_good) found = t;
    }
    return found ? &found->told : NULL;
}
