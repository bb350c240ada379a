#include "access.h"

#include <errno.h>
#include <nettle/base64.h>
#include <nettle/hmac.h>
#include <nettle/memops.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/regular.h"

enum { KEY_LEAST = 32, KEY_SIZE = 256, KEYS_MOST = 1000, LINE_MOST = 1000 };

struct shd_keys {
    size_t count;
    char list[KEYS_MOST][KEY_SIZE];
};

/* ---- Lines ---- */

/* What is wrong with the next line; NULL: nothing. The end of a long comment is no secret. */
static const char *read_line(FILE *file, char line[LINE_MOST + 1], bool *ended) {
    size_t length = 0;
    int c;
    while ((c = getc(file)) != EOF && c != '\n') {
        if (length == LINE_MOST) return "is longer than 1000 characters";
        line[length++] = (char)c;
    }
    *ended = c == EOF;
    if (length && line[length - 1] == '\r') length--;
    line[length] = 0;
    for (size_t i = 0; i < length; i++)
        if (line[i] != '\t' && (line[i] < 0x20 || line[i] > 0x7e))
            return "holds a character that is neither printable ASCII nor a tab";
    return NULL;
}

/* The line without the blanks around it. */
static char *trim_line(char *line) {
    char *start = line + strspn(line, " \t"), *end = start + strlen(start);
    while (end > start && (end[-1] == ' ' || end[-1] == '\t')) *--end = 0;
    return start;
}

shd_status shd_lines_read(const char *path, const char *(*take)(void *context, char *line),
                          void *context, shd_error *error) {
    int fd = shd_open_regular(path, error);
    if (fd < 0) return SHD_CONFIG;
    FILE *file = fdopen(fd, "r");
    if (!file) {
        close(fd);
        return shd_fail(error, SHD_EXHAUSTED, path, "out of memory");
    }
    char line[LINE_MOST + 1];
    shd_status status = SHD_OK;
    bool ended = false;
    for (int number = 1; !status && !ended; number++) {
        const char *wrong = read_line(file, line, &ended);
        char *text = trim_line(line);
        if (!wrong && *text && *text != '#') wrong = take(context, text);
        if (wrong) status = shd_fail(error, SHD_CONFIG, path, "line %d %s", number, wrong);
    }
    explicit_bzero(line, sizeof line);
    if (!status && ferror(file)) status = shd_fail(error, SHD_CONFIG, path, "%s", strerror(errno));
    fclose(file);
    return status;
}

/* ---- Keys ---- */

static const char *take_key(void *context, char *text) {
    shd_keys *keys = context;
    size_t length = strlen(text);
    if (length < KEY_LEAST || length >= KEY_SIZE || strspn(text, SHD_LETTERS "-._~+/=") != length)
        return "is no key: 32 to 255 of A-Z a-z 0-9 - . _ ~ + / =";
    if (keys->count == KEYS_MOST) return "is one more than 1000 keys";
    strcpy(keys->list[keys->count++], text);
    return NULL;
}

shd_status shd_keys_load(const char *path, shd_keys **out, shd_error *error) {
    shd_keys *keys = calloc(1, sizeof *keys);
    if (!keys) return shd_fail(error, SHD_EXHAUSTED, path, "out of memory");
    shd_status status = shd_lines_read(path, take_key, keys, error);
    if (!status && !keys->count) status = shd_fail(error, SHD_CONFIG, path, "there is no key");
    if (status)
        shd_keys_drop(keys);
    else
        *out = keys;
    return status;
}

void shd_keys_drop(shd_keys *keys) {
    if (!keys) return;
    explicit_bzero(keys, sizeof *keys);
    free(keys);
}

bool shd_keys_signed(const shd_keys *keys, const char *text, size_t length, const char *signature) {
    enum { ENCODED = BASE64_ENCODE_RAW_LENGTH(SHA256_DIGEST_SIZE), UNPADDED = ENCODED - 1 };
    if (strlen(signature) != UNPADDED) return false;
    volatile int found = 0;
    /* Each key is looked at, whatever the others gave. */
    for (size_t i = 0; i < keys->count; i++) {
        struct hmac_sha256_ctx hmac;
        struct base64_encode_ctx encoder;
        unsigned char digest[SHA256_DIGEST_SIZE];
        char encoded[ENCODED];
        hmac_sha256_set_key(&hmac, strlen(keys->list[i]), (const unsigned char *)keys->list[i]);
        hmac_sha256_update(&hmac, length, (const unsigned char *)text);
        hmac_sha256_digest(&hmac, sizeof digest, digest);
        base64url_encode_init(&encoder);
        size_t written = base64_encode_update(&encoder, encoded, sizeof digest, digest);
        base64_encode_final(&encoder, encoded + written);
        found |= memeql_sec(encoded, signature, UNPADDED);
        explicit_bzero(&hmac, sizeof hmac);
    }
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

shd_status shd_origins_list(const char *origins, char **out, shd_error *error) {
    char *list = malloc(2 * strlen(origins) + 1), *end = list;
    if (!list) return shd_fail(error, SHD_EXHAUSTED, "", "out of memory");
    const char *origin;
    size_t length;
    while ((origin = next_origin(&origins, &length))) {
        if (!is_origin(origin, length)) {
            free(list);
            return shd_fail(error, SHD_CONFIG, "cors-origins",
                            "'%.*s' is no origin, such as https://example.com or *", (int)length,
                            origin);
        }
        if (end != list) end = stpcpy(end, ", ");
        end = mempcpy(end, origin, length);
    }
    *end = 0;
    *out = list;
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
