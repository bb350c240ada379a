#include "private.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"

static const char blanks[] = " \t,";

/* The end of a directive: its comma, or the end of the text. Commas in quotes are part of it. */
static const char *directive_end(const char *c) {
    for (bool quoted = false; *c && (quoted || *c != ','); c++)
        if (*c == '"') quoted = !quoted;
    return c;
}

static bool is_named(const char *directive, size_t length, const char *name) {
    size_t named = strcspn(directive, "=, \t");
    return named == strlen(name) && named <= length && !strncasecmp(directive, name, named);
}

/* What a private answer has no use for, or must not say. */
static bool is_dropped(const char *directive, size_t length) {
    static const char *const names[] = {"public",          "private",
                                        "s-maxage",        "proxy-revalidate",
                                        "must-understand", "stale-while-revalidate",
                                        "stale-if-error"};
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++)
        if (is_named(directive, length, names[i])) return true;
    return false;
}

/* Seconds of max-age, in quotes or without. */
static long long age_of(const char *directive) {
    const char *value = strchr(directive, '=');
    return value ? strtoll(value + 1 + (value[1] == '"'), NULL, 10) : 0;
}

void shd_private_policy(const char *policy, long long left, char out[SHD_POLICY_SIZE]) {
    const bool ends = left >= 0;
    size_t length = (size_t)snprintf(out, SHD_POLICY_SIZE, "private");
    const char *end;
    for (const char *c = policy + strspn(policy, blanks); *c; c = end + strspn(end, blanks)) {
        end = directive_end(c);
        size_t size = (size_t)(end - c);
        while (size && strchr(blanks, c[size - 1])) size--;
        if (is_dropped(c, size)) continue;
        bool is_age = is_named(c, size, "max-age");
        if (is_age && ends && age_of(c) < left) left = age_of(c);
        if (ends && (is_age || is_named(c, size, "must-revalidate"))) continue; /* they follow */
        length += (size_t)snprintf(out + length, SHD_POLICY_SIZE - length, ", %.*s", (int)size, c);
    }
    if (ends)
        snprintf(out + length, SHD_POLICY_SIZE - length, ", max-age=%lld, must-revalidate", left);
}

void shd_private_apply(shd_reply *reply, bool has_token, long long expires) {
    if (reply->status >= 400 || (!has_token && !expires)) return;
    long long left = expires ? expires - shd_date() : -1;
    if (expires && left < 0) left = 0;
    for (size_t i = 0; i < reply->header_count; i++) {
        if (strcmp(reply->headers[i].name, "Cache-Control") != 0) continue;
        char policy[SHD_POLICY_SIZE];
        shd_private_policy(reply->headers[i].value, left, policy);
        char *copy = strdup(policy);
        reply->is_short = reply->is_short || !copy;
        if (!copy) return;
        free(reply->headers[i].value);
        reply->headers[i].value = copy;
        /* A link's signature is part of what is asked for; a token is not. */
        if (has_token) shd_reply_plain(reply, "Vary", "Authorization");
        return;
    }
}
