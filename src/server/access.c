#include "access.h"

#include <errno.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

enum { TOKEN_SIZE = 256, TOKENS_MOST = 1000, TOKEN_LEAST = 16 };

/* Padded with zeros, so that all are compared at one length. */
typedef struct token {
    unsigned char bytes[TOKEN_SIZE];
} token;

struct shd_tokens {
    size_t count;
    token list[TOKENS_MOST];
};

/* ---- Tokens ---- */

static bool add_token(shd_tokens *tokens, const char *text) {
    static const char allowed[] =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-._~+/=";
    size_t length = strlen(text);
    if (length < TOKEN_LEAST || length >= TOKEN_SIZE || strspn(text, allowed) != length)
        return false;
    memcpy(tokens->list[tokens->count++].bytes, text, length);
    return true;
}

static shd_status read_tokens(FILE *file, const char *path, shd_tokens *tokens, shd_error *error) {
    char line[TOKEN_SIZE + 64];
    shd_status status = SHD_OK;
    for (int number = 1; !status && fgets(line, sizeof line, file); number++) {
        line[strcspn(line, "\r\n")] = 0;
        char *start = line + strspn(line, " \t"), *end = start + strlen(start);
        while (end > start && (end[-1] == ' ' || end[-1] == '\t')) *--end = 0;
        if (!*start || *start == '#') continue;
        if (tokens->count == TOKENS_MOST)
            status = shd_fail(error, SHD_CONFIG, path, "more than %d tokens", TOKENS_MOST);
        else if (!add_token(tokens, start))
            status = shd_fail(error, SHD_CONFIG, path,
                              "line %d is no token: %d to %d of A-Z a-z 0-9 - . _ ~ + / =", number,
                              TOKEN_LEAST, TOKEN_SIZE - 1);
    }
    explicit_bzero(line, sizeof line);
    if (!status && ferror(file)) status = shd_fail(error, SHD_CONFIG, path, "%s", strerror(errno));
    if (!status && !tokens->count) status = shd_fail(error, SHD_CONFIG, path, "there is no token");
    return status;
}

shd_status shd_tokens_load(const char *path, shd_tokens **out, shd_error *error) {
    FILE *file = fopen(path, "re");
    if (!file) return shd_fail(error, SHD_CONFIG, path, "%s", strerror(errno));
    shd_tokens *tokens = calloc(1, sizeof *tokens);
    shd_status status = tokens ? read_tokens(file, path, tokens, error)
                               : shd_fail(error, SHD_MEMORY, path, "out of memory");
    fclose(file);
    if (status)
        shd_tokens_drop(tokens);
    else
        *out = tokens;
    return status;
}

void shd_tokens_drop(shd_tokens *tokens) {
    if (!tokens) return;
    explicit_bzero(tokens, sizeof *tokens);
    free(tokens);
}

/* Each token is looked at as a whole, whatever the others gave. */
bool shd_tokens_admit(const shd_tokens *tokens, const char *authorization) {
    static const char scheme[] = "Bearer ";
    if (!authorization || strncasecmp(authorization, scheme, sizeof scheme - 1)) return false;
    const char *text = authorization + sizeof scheme - 1;
    text += strspn(text, " ");
    size_t length = strlen(text);
    if (length >= TOKEN_SIZE)
        return false; /* known to be wrong by its length, which is no secret */
    token given = {{0}};
    memcpy(given.bytes, text, length);
    volatile unsigned char found = 0;
    for (size_t i = 0; i < tokens->count; i++) {
        volatile unsigned char differs = 0;
        for (size_t k = 0; k < TOKEN_SIZE; k++)
            differs |= (unsigned char)(given.bytes[k] ^ tokens->list[i].bytes[k]);
        found |= (unsigned char)(((unsigned)differs - 1) >> 8 & 1);
    }
    explicit_bzero(&given, sizeof given);
    return found;
}

/* ---- Origins ---- */

static const char blanks[] = " ,\t";

/* The next entry of a list; NULL at its end. */
static const char *next_origin(const char **list, size_t *length) {
    *list += strspn(*list, blanks);
    const char *start = *list;
    *length = strcspn(start, blanks);
    *list += *length;
    return *length ? start : NULL;
}

/* scheme://host or scheme://host:port, as browsers send it (RFC 6454, section 6.1). */
static bool is_origin(const char *text, size_t length) {
    if (length == 1 && *text == '*') return true;
    const char *authority = memmem(text, length, "://", 3), *end = text + length;
    if (!authority || authority == text || authority + 3 == end) return false;
    for (const char *c = text; c < end; c++)
        if (*c >= 'A' && *c <= 'Z') return false;
    return !memchr(authority + 3, '/', (size_t)(end - authority - 3));
}

shd_status shd_origins_check(const char *origins, shd_error *error) {
    const char *origin;
    size_t length;
    while ((origin = next_origin(&origins, &length)))
        if (!is_origin(origin, length))
            return shd_fail(error, SHD_CONFIG, "cors-origins",
                            "'%.*s' is no origin, such as https://example.com or *", (int)length,
                            origin);
    return SHD_OK;
}

bool shd_origins_admit(const char *origins, const char *origin) {
    const char *entry;
    size_t length;
    while ((entry = next_origin(&origins, &length)))
        if ((length == 1 && *entry == '*') ||
            (strlen(origin) == length && !memcmp(entry, origin, length)))
            return true;
    return false;
}
