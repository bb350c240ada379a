#include "reply.h"

#include <assert.h>
#include <microhttpd.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

/* Longest header value, after encoding: a dozen of them fit the connection's memory. */
enum { VALUE_MAX = 1000 };

void shd_reply_strip(shd_reply *reply) {
    for (size_t i = 0; i < reply->header_count; i++) free(reply->headers[i].value);
    reply->header_count = 0;
}

void shd_reply_clear(shd_reply *reply) {
    shd_reply_strip(reply);
    shd_bytes_drop(reply->held);
    shd_stream_drop(reply->stream);
    memset(reply, 0, sizeof *reply);
}

void shd_bytes_drop(void *context) {
    shd_bytes_held *held = context;
    if (!held || atomic_fetch_sub(&held->holders, 1) > 1) return;
    assert(!atomic_load(&held->holders));
    free(held->data);
    shd_budget_give(held->budget, held->counted);
    free(held);
}

void shd_reply_plain(shd_reply *reply, const char *name, const char *value) {
    if (reply->header_count == SHD_REPLY_HEADERS) return;
    char *copy = strdup(value);
    reply->is_short |= !copy;
    if (!copy) return;
    reply->headers[reply->header_count].name = name;
    reply->headers[reply->header_count++].value = copy;
}

/* Text as printable ASCII, at most `room` bytes of it and a 0: everything else leaves
 * percent-encoded, and so do '%' and the characters of `special`. */
static size_t write_safe(char *out, size_t room, const char *text, const char *special) {
    size_t length = 0;
    for (const unsigned char *c = (const unsigned char *)text; *c; c++) {
        bool plain = *c >= 0x20 && *c < 0x7f && *c != '%' && !strchr(special, *c);
        if (length + (plain ? 1 : 3) > room) break;
        if (plain)
            out[length++] = (char)*c;
        else
            length += (size_t)snprintf(out + length, 4, "%%%02X", *c);
    }
    out[length] = 0;
    return length;
}

void shd_reply_header(shd_reply *reply, const char *name, const char *format, ...) {
    char text[VALUE_MAX + 1], safe[VALUE_MAX + 1];
    va_list args;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);

    size_t length = write_safe(safe, VALUE_MAX, text, "");
    while (length && safe[length - 1] == ' ') length--;
    safe[length] = 0;
    shd_reply_plain(reply, name, safe);
}

void shd_reply_warning(shd_reply *reply, const char *pointer, const char *detail) {
    enum { MOST = 480 };
    char safe_pointer[MOST + 1], safe_detail[MOST + 1], value[VALUE_MAX + 1];
    write_safe(safe_pointer, MOST, pointer, "\"\\");
    write_safe(safe_detail, MOST, detail, "\"\\");
    snprintf(value, sizeof value, "\"%s\";pointer=\"%s\"", safe_detail, safe_pointer);
    shd_reply_plain(reply, "Shaded-Warning", value);
}

void shd_reply_lend(shd_reply *reply, const char *media_type, const void *body, size_t size) {
    shd_bytes_drop(reply->held);
    reply->held = NULL;
    reply->body = body;
    reply->size = size;
    shd_reply_plain(reply, "Content-Type", media_type);
}

void shd_reply_give(shd_reply *reply, const char *media_type, void *body, size_t size) {
    shd_bytes_held *held = malloc(sizeof *held);
    if (!held) {
        free(body);
        reply->is_short = true;
        shd_reply_lend(reply, media_type, NULL, 0);
        return;
    }
    *held = (shd_bytes_held){.holders = 1, .data = body};
    shd_reply_lend(reply, media_type, body, size);
    reply->held = held;
}

void shd_reply_count(shd_reply *reply, shd_budget *budget, size_t bytes) {
    if (!reply->held) {
        shd_budget_give(budget, bytes);
        return;
    }
    reply->held->budget = budget;
    reply->held->counted = bytes;
}

size_t shd_reply_alone(const shd_reply *reply) {
    return reply->held ? reply->size / atomic_load(&reply->held->holders) : 0;
}

void shd_reply_share(shd_reply *reply, const shd_reply *from) {
    reply->held = from->held;
    reply->body = from->body;
    reply->size = from->size;
    if (reply->held) atomic_fetch_add(&reply->held->holders, 1);
}

void shd_reply_copy(shd_reply *reply, const shd_reply *from) {
    reply->status = from->status;
    reply->limit = from->limit;
    for (size_t i = 0; i < from->header_count; i++)
        shd_reply_plain(reply, from->headers[i].name, from->headers[i].value);
    shd_reply_share(reply, from);
    reply->stream = shd_stream_hold(from->stream);
    reply->is_short |= from->is_short;
}

void shd_reply_fit(shd_reply *reply) {
    void *fit = reply->held && reply->size ? realloc(reply->held->data, reply->size) : NULL;
    if (fit) reply->body = reply->held->data = fit;
}

void shd_reply_date(char out[SHD_DATE_SIZE]) {
    time_t now = time(NULL);
    struct tm parts;
    gmtime_r(&now, &parts);
    strftime(out, SHD_DATE_SIZE, "%a, %d %b %Y %H:%M:%S GMT", &parts);
}

char *shd_reply_raw(const shd_reply *reply, bool with_body, size_t *length) {
    char *text = NULL;
    FILE *out = open_memstream(&text, length);
    if (!out) return NULL;
    char date[SHD_DATE_SIZE];
    shd_reply_date(date);
    fprintf(out, "HTTP/1.1 %u %s\r\nDate: %s\r\nConnection: close\r\nContent-Length: %zu\r\n",
            reply->status, MHD_get_reason_phrase_for(reply->status), date, reply->size);
    for (size_t i = 0; i < reply->header_count; i++)
        if (strcmp(reply->headers[i].name, "Connection"))
            fprintf(out, "%s: %s\r\n", reply->headers[i].name, reply->headers[i].value);
    fputs("\r\n", out);
    if (with_body && reply->size) fwrite(reply->body, 1, reply->size, out);
    if (!fclose(out)) return text;
    free(text);
    return NULL;
}
