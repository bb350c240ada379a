#include "head.h"

#include <ctype.h>
#include <microhttpd.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "server/access/access.h"
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
        if (*c == '%' && isxdigit((unsigned char)c[1]) && isxdigit((unsigned char)c[2])) {
            const char digits[] = {c[1], c[2], 0};
            const unsigned value = (unsigned)strtoul(digits, NULL, 16);
            if (value && value != '/') {
                byte = value;
                c += 2;
            } else {
                exchange->path_hides = true;
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
    shd_exchange *exchange = h->exchange;
    (void)kind;
    if (strpbrk(name, " \t")) h->blanks = true;
    if (!value) value = "";
    char **list = !strcasecmp(name, "Accept")             ? &exchange->accept
                  : !strcasecmp(name, "Accept-Encoding")  ? &exchange->accept_encoding
                  : !strcasecmp(name, "If-None-Match")    ? &exchange->if_none_match
                  : !strcasecmp(name, "X-Forwarded-For")  ? &exchange->forwarded_for
                  : !strcasecmp(name, "Content-Encoding") ? &exchange->content_encoding
                                                          : NULL;
    if (list) {
        join_field(list, value, &exchange->reply);
    } else if (!strcasecmp(name, "Content-Type")) {
        exchange->content_type = value;
        h->types++;
    } else if (!strcasecmp(name, "Authorization")) {
        exchange->authorization = h->authorizations++ ? NULL : value;
    } else if (!strcasecmp(name, "Origin")) {
        exchange->origin = value;
    } else if (!strcasecmp(name, "Access-Control-Request-Method")) {
        exchange->is_preflight = exchange->method == SHD_OPTIONS;
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
    size_t length = id ? strspn(id, SHD_LETTERS "._-") : 0;
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
    const struct {
        bool is_wrong;
        unsigned times;
        const char *why;
    } checks[] = {
        {h->lengths > 1, h->lengths, "Content-Length is given %u times"},
        {h->lengths && h->transfer_codings, 0, "both Content-Length and Transfer-Encoding"},
        {h->transfer_codings > 1 ||
             (h->transfer_codings && strcasecmp(h->transfer_coding, "chunked")),
         0, "the only Transfer-Encoding taken is chunked"},
        /* "Content-Length : 5", of which others see a Content-Length */
        {h->blanks, 0, "a field's name holds blanks"},
        {h->hosts > 1 || (!h->hosts && !strcmp(version, "HTTP/1.1")), h->hosts,
         "%u Host fields: one is needed"},
        {h->exchange->path_hides, 0, "the path has %%2F or %%00"},
        {h->types > 1, h->types, "Content-Type is given %u times"}};
    for (size_t i = 0; i < sizeof checks / sizeof checks[0]; i++) {
        if (!checks[i].is_wrong) continue;
        shd_problem_reply(&h->exchange->reply, SHD_BAD_REQUEST, checks[i].why, checks[i].times);
        return false;
    }
    return true;
}
