#include "scene/css_tokens.h"

#include <stdbool.h>
#include <string.h>

#include "scene/number.h"

static bool is_digit(char c) {
    return c >= '0' && c <= '9';
}

static bool is_letter(char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
}

static bool begins_number(const char *at) {
    if (*at == '+' || *at == '-') at++;
    return is_digit(*at) || (*at == '.' && is_digit(at[1]));
}

static bool begins_word(const char *at) {
    return is_letter(*at) || (*at == '-' && (is_letter(at[1]) || at[1] == '-'));
}

static const char *skip_space(const char *at) {
    for (;;) {
        at += strspn(at, " \t\n\r\f");
        if (at[0] != '/' || at[1] != '*') return at;
        const char *end = strstr(at + 2, "*/");
        at = end ? end + 2 : at + strlen(at);
    }
}

static const char *read_word(const char *at, shd_css_token *out) {
    size_t length = 0;
    for (; is_letter(at[length]) || is_digit(at[length]) || at[length] == '-'; length++) {
        const char c = at[length];
        if (length + 1 < sizeof out->word)
            out->word[length] = (char)(c >= 'A' && c <= 'Z' ? c + ('a' - 'A') : c);
    }
    out->word[length < sizeof out->word ? length : sizeof out->word - 1] = '\0';
    out->length = length;
    return at + length;
}

/* CSS has numbers that JSON writes in another way: +1, .5, 007. */
static const char *read_number(const char *at, shd_css_token *out) {
    char json[80];
    size_t used = 0;
    const bool negative = *at == '-';
    if (*at == '+' || *at == '-') at++;
    while (*at == '0' && is_digit(at[1])) at++;
    if (*at == '.') json[used++] = '0';
    const char *end = at + strspn(at, "0123456789");
    if (end[0] == '.' && is_digit(end[1])) end += 1 + strspn(end + 1, "0123456789");
    if (*end == 'e' || *end == 'E') {
        const size_t sign = end[1] == '+' || end[1] == '-';
        if (is_digit(end[1 + sign])) end += 1 + sign + strspn(end + 1 + sign, "0123456789");
    }
    const size_t length = (size_t)(end - at);
    const bool fits = used + length <= sizeof json;
    if (fits) memcpy(json + used, at, length);
    const char *stop = fits ? shd_number_read(json, json + used + length, &out->value) : NULL;
    out->kind = stop == json + used + length ? SHD_CSS_NUMBER : SHD_CSS_BEYOND;
    if (negative) out->value = -out->value;
    return end;
}

static const char *read_numeric(const char *at, shd_css_token *out) {
    at = read_number(at, out);
    const bool good = out->kind == SHD_CSS_NUMBER;
    if (*at == '%') {
        if (good) out->kind = SHD_CSS_PERCENT;
        return at + 1;
    }
    if (!begins_word(at)) return at;
    if (good) out->kind = SHD_CSS_DIMENSION;
    return read_word(at, out);
}

const char *shd_css_next(const char *at, shd_css_token *out) {
    *out = (shd_css_token){.kind = SHD_CSS_STRANGE};
    at = skip_space(at);
    if (begins_number(at)) return read_numeric(at, out);
    if (begins_word(at)) {
        at = read_word(at, out);
        out->kind = *at == '(' ? SHD_CSS_FUNCTION : SHD_CSS_WORD;
        return at + (*at == '(');
    }
    if (*at == '#') {
        out->kind = SHD_CSS_HASH;
        return read_word(at + 1, out);
    }
    if (!*at) out->kind = SHD_CSS_END;
    if (*at == ',') out->kind = SHD_CSS_COMMA;
    if (*at == '/') out->kind = SHD_CSS_SLASH;
    if (*at == ')') out->kind = SHD_CSS_CLOSE;
    return *at ? at + 1 : at;
}
