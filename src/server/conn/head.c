#include "head.h"

#include <microhttpd.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "server/answer/problem.h"

/* ---- The target ---- */

const char *shd_head_skip_authority(const char *target) {
    const char *authority = strstr(target, "://");
    if (*target == '/' || !authority || authority == target) return target;
    const char *path = strchr(authority + 3, '/');
    return path ? path : "/";
}

void shd_head_set_path(shd_exchange *exchange, const char *target) {
    size_t length = 0;
    for (const char *c = target; *c && *c != '?'; c++) {
        unsigned byte = (unsigned char)*c;
        char digits[3] = {0};
        if (*c == '%' && c[1] && c[2]) {
            char *end;
            memcpy(digits, c + 1, 2);
            unsigned long value = strtoul(digits, &end, 16);
            bool is_coded = !*end && digits[0] != '+' && digits[0] != '-' && digits[0] != ' ';
            bool hides = is_coded && (!value || value == '/');
            exchange->path_hides = exchange->path_hides || hides;
            if (is_coded && !hides) {
                byte = (unsigned)value;
                c += 2;
            }
        }
        if (length == sizeof exchange->path - 1) {
            exchange->path_cut = true;
            break;
        }
        exchange->path[length++] = (char)byte;
    }
    exchange->path[length] = 0;
}

/* ---- Fields ---- */

/* Appends a field that may be repeated, as a list. */
static void join_field(char **list, const char *value, shd_reply *reply) {
    size_t old = *list ? strlen(*list) : 0, size = old + strlen(value) + 3;
    char *joined = realloc(*list, size);
    if (!joined) {
        reply->is_short = true; /* without the field it might be another answer */
        return;
    }
    snprintf(joined + old, size - old, "%s%s", old ? ", " : "", value);
    *list = joined;
}

static enum MHD_Result read_field(void *cls, enum MHD_ValueKind kind, const char *name,
                                  const char *value) {
    shd_head *h = cls;
    (void)kind;
    if (strpbrk(name, " \t")) h->blanks = true;
    if (!value) value = "";
    if (!strcasecmp(name, "Accept")) {
        join_field(&h->exchange->accept, value, &h->exchange->reply);
    } else if (!strcasecmp(name, "Accept-Encoding")) {
        join_field(&h->exchange->accept_encoding, value, &h->exchange->reply);
    } else if (!strcasecmp(name, "If-None-Match")) {
        join_field(&h->exchange->if_none_match, value, &h->exchange->reply);
    } else if (!strcasecmp(name, "X-Forwarded-For")) {
        join_field(&h->exchange->forwarded_for, value, &h->exchange->reply);
    } else if (!strcasecmp(name, "Content-Type")) {
        h->exchange->content_type = value;
        h->types++;
    } else if (!strcasecmp(name, "Content-Encoding")) {
        join_field(&h->exchange->content_encoding, value, &h->exchange->reply);
    } else if (!strcasecmp(name, "Authorization")) {
        h->exchange->authorization = h->authorizations++ ? NULL : value;
    } else if (!strcasecmp(name, "Origin")) {
        h->exchange->origin = value;
    } else if (!strcasecmp(name, "Access-Control-Request-Method")) {
        h->exchange->is_preflight = h->exchange->method == SHD_OPTIONS;
    } else if (!strcasecmp(name, "X-Request-Id")) {
        h->request_id = value;
    } else if (!strcasecmp(name, "traceparent")) {
        h->trace = value;
        h->traces++;
    } else if (!strcasecmp(name, "Expect")) {
        h->expects = true;
    } else if (!strcasecmp(name, "Host")) {
        h->hosts++;
    } else if (!strcasecmp(name, "Content-Length")) {
        h->length = value;
        h->lengths++;
    } else if (!strcasecmp(name, "Transfer-Encoding")) {
        h->transfer_coding = value;
        h->transfer_codings++;
    }
    return MHD_YES;
}

static void adopt_id(shd_exchange *exchange, const char *id) {
    static const char allowed[] =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789._-";
    size_t length = id ? strspn(id, allowed) : 0;
    if (length && length < SHD_ID_SIZE && !id[length]) memcpy(exchange->id, id, length + 1);
}

void shd_head_read(shd_exchange *exchange, const char *method, shd_head *head) {
    *head = (shd_head){.exchange = exchange};
    snprintf(exchange->method_name, sizeof exchange->method_name, "%s", method);
    exchange->method = shd_method_find(method);
    MHD_get_connection_values(exchange->connection, MHD_HEADER_KIND, read_field, head);
    adopt_id(exchange, head->request_id);
    if (head->traces == 1) shd_trace_read(head->trace, &exchange->trace);
}

bool shd_head_check(const shd_head *h, const char *version) {
    shd_reply *reply = &h->exchange->reply;
    if (h->lengths > 1)
        shd_problem_reply(reply, SHD_BAD_REQUEST, "Content-Length is given %u times", h->lengths);
    else if (h->lengths && h->transfer_codings)
        shd_problem_reply(reply, SHD_BAD_REQUEST, "both Content-Length and Transfer-Encoding");
    else if (h->transfer_codings &&
             (h->transfer_codings > 1 || strcasecmp(h->transfer_coding, "chunked")))
        shd_problem_reply(reply, SHD_BAD_REQUEST, "the only Transfer-Encoding taken is chunked");
    else if (h->blanks) /* "Content-Length : 5", of which others see a Content-Length */
        shd_problem_reply(reply, SHD_BAD_REQUEST, "a field's name holds blanks");
    else if (h->hosts > 1 || (!h->hosts && !strcmp(version, "HTTP/1.1")))
        shd_problem_reply(reply, SHD_BAD_REQUEST, "%u Host fields: one is needed", h->hosts);
    else if (h->exchange->path_hides)
        shd_problem_reply(reply, SHD_BAD_REQUEST, "the path has %%2F or %%00");
    else if (h->types > 1)
        shd_problem_reply(reply, SHD_BAD_REQUEST, "Content-Type is given %u times", h->types);
    else
        return true;
    return false;
}
