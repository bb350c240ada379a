#include "request_log.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "log.h"

static const char *header_of(const shd_reply *reply, const char *name) {
    for (size_t i = 0; i < reply->header_count; i++)
        if (!strcmp(reply->headers[i].name, name)) return reply->headers[i].value;
    return NULL;
}

/* How much of a picture was there already; NULL: it is none. `timing` is its Server-Timing. */
static const char *cache_of(const shd_exchange *exchange, const char *timing) {
    if (exchange->reply.status == 304) return "304";
    if (exchange->waiter.joined) return "join";
    if (!timing) return NULL;
    if (strstr(timing, "reuse;desc=picture")) return "hit";
    return strstr(timing, "reuse;desc=nothing") ? "miss" : "reuse";
}

/* Milliseconds by stage, as the answer itself tells them: "queue;dur=0.012, parse;dur=0.1, ...". */
static void add_stages(shd_log *line, const char *timing) {
    for (const char *c = timing; c; c = strchr(c, ',')) {
        c += strspn(c, ", ");
        size_t length = strcspn(c, ";,");
        char name[32];
        if (strncmp(c + length, ";dur=", 5) != 0 || length > sizeof name - 4) continue;
        snprintf(name, sizeof name, "%.*s_ms", (int)length, c);
        shd_log_milliseconds(line, name, strtod(c + length + 5, NULL) * 1e-3);
    }
}

/* The name in a problem's `type`, which is its first member. */
static void add_problem(shd_log *line, const shd_reply *reply) {
    static const char start[] = "{\"type\":\"urn:shaded:problem:";
    char name[32];
    const size_t skipped = sizeof start - 1;
    if (reply->status < 400 || reply->size <= skipped || memcmp(reply->body, start, skipped) != 0)
        return;
    const char *text = (const char *)reply->body + skipped;
    const char *end = memchr(text, '"', reply->size - skipped);
    if (!end) return;
    snprintf(name, sizeof name, "%.*s", (int)(end - text), text);
    shd_log_text(line, "problem", name);
}

/* The path without what is long between its slashes, which may be a whole scene: of that its
 * beginning is told. Digests, of 64 digits and an ending, are told whole. */
static void add_path(shd_log *line, const char *path) {
    enum { LONG = 80, BEGINNING = 8 };
    char text[SHD_PATH_SIZE] = "", *end = text;
    for (const char *c = path; *c;) {
        const size_t part = strcspn(c + 1, "/") + 1; /* its slash, and what follows */
        const bool is_cut = part > LONG;
        end += sprintf(end, "%.*s%s", is_cut ? BEGINNING + 1 : (int)part, c, is_cut ? "..." : "");
        c += part;
    }
    shd_log_text(line, "path", text);
}

void shd_log_request(const shd_exchange *exchange, double seconds, size_t bytes, bool aborted) {
    const shd_reply *reply = &exchange->reply;
    const char *timing = header_of(reply, "Server-Timing"), *cache = cache_of(exchange, timing);
    shd_log line;
    shd_log_begin(&line, SHD_LOG_INFO, "request");
    shd_log_text(&line, "id", exchange->id);
    if (*exchange->trace.id) {
        shd_log_text(&line, "trace", exchange->trace.id);
        shd_log_text(&line, "parent", exchange->trace.parent);
    }
    if (*exchange->client) shd_log_text(&line, "client", exchange->client);
    shd_log_text(&line, "method", exchange->method_name);
    add_path(&line, exchange->path);
    shd_log_whole(&line, "status", reply->status);
    add_problem(&line, reply);
    if (exchange->reply.limit) shd_log_text(&line, "limit", shd_limit_names[exchange->reply.limit]);
    shd_log_whole(&line, "bytes", bytes);
    if (cache) shd_log_text(&line, "cache", cache);
    shd_log_milliseconds(&line, "ms", seconds);
    add_stages(&line, timing);
    if (aborted) shd_log_flag(&line, "aborted", true);
    shd_log_end(&line);
}
