/* libmicrohttpd, whose one I/O thread runs everything here. Its handler sees an exchange once with
 * the head (SHD_BEGUN), then for every piece of the body and once at its end (SHD_READING). If a
 * worker had it, the handler sees it once more when it is resumed (SHD_WAITING). */
#include "http.h"

#include <errno.h>
#include <microhttpd.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>

#include "base/clock.h"
#include "body.h"
#include "connections.h"
#include "framing.h"
#include "head.h"
#include "linger.h"
#include "server/access/private.h"
#include "server/answer/problem.h"
#include "server/ops/log.h"
#include "server/ops/memory.h"
#include "server/ops/request_log.h"
#include "server/ops/settings.h"
#include "server/routes.h"

enum { LAST_STATUS = MHD_HTTP_SERVICE_UNAVAILABLE }; /* of the server's `last_words` */

/* Of a request's target, in bytes; and the most parameters that it may have: libmicrohttpd takes
 * memory of the connection for each, and if that ends it neither answers nor closes. */
enum { TARGET_MOST = 8000, PARAMETERS_MOST = 250 };

enum { STREAM_BLOCK = 16 << 10 }; /* bytes that are asked of a stream at once */

/* ---- Sending ---- */

static void add_common_headers(shd_exchange *exchange) {
    shd_metrics_refused(&exchange->server->metrics, exchange->reply.limit);
    shd_reply_plain(&exchange->reply, "X-Request-Id", exchange->id);
    shd_route_add_cors(exchange);
    shd_private_apply(&exchange->reply, exchange->token, exchange->expires);
    if (atomic_load(&exchange->server->draining))
        shd_reply_plain(&exchange->reply, "Connection", "close");
}

static void enter_phase(const shd_exchange *exchange, shd_phase phase) {
    shd_reaper_phase(exchange->server->reaper, shd_connection_watched(exchange->connection), phase,
                     NULL);
}

/* A 304 has the Content-Length of the 200 that it stands for, or none (RFC 9110, section 8.6).
 * libmicrohttpd writes one with every status but 1xx and 204; release 1.0 can be told not to,
 * before that it leaves it out only of what ends with its connection. */
#if MHD_VERSION >= 0x01000000
static struct MHD_Response *make_without_length(void) {
    return MHD_create_response_empty(MHD_RF_HEAD_ONLY_RESPONSE);
}
#else
static ssize_t read_nothing(void *cls, uint64_t at, char *out, size_t size) {
    (void)cls, (void)at, (void)out, (void)size;
    return MHD_CONTENT_READER_END_OF_STREAM;
}

static struct MHD_Response *make_without_length(void) {
    struct MHD_Response *response =
        MHD_create_response_from_callback(MHD_SIZE_UNKNOWN, 1, read_nothing, NULL, NULL);
    if (response) MHD_set_response_options(response, MHD_RF_HTTP_1_0_COMPATIBLE_STRICT, MHD_RO_END);
    return response;
}
#endif

/* NULL if memory is short. A stream is read for the exchange. */
static struct MHD_Response *make_response(shd_reply *reply, shd_exchange *exchange) {
    if (reply->is_short) return NULL;
    struct MHD_Response *response =
        reply->status == 304 && !reply->size ? make_without_length()
        : reply->stream ? MHD_create_response_from_callback(MHD_SIZE_UNKNOWN, STREAM_BLOCK,
                                                            shd_exchange_read, exchange, NULL)
        : reply->held   ? MHD_create_response_from_buffer_with_free_callback_cls(
                              reply->size, (void *)(size_t)reply->body, shd_bytes_drop, reply->held)
                      : MHD_create_response_from_buffer(reply->size, (void *)(size_t)reply->body,
                                                        MHD_RESPMEM_PERSISTENT);
    if (!response) return NULL;
    reply->held = NULL; /* it is libmicrohttpd's now */
    for (size_t i = 0; i < reply->header_count; i++) {
        if (MHD_add_response_header(response, reply->headers[i].name, reply->headers[i].value))
            continue;
        MHD_destroy_response(response);
        return NULL;
    }
    return response;
}

static struct MHD_Response *make_last_words(void) {
    shd_reply reply = {0};
    shd_reply_lend(&reply, "application/problem+json", shd_problem_last_words,
                   strlen(shd_problem_last_words));
    shd_reply_plain(&reply, "Cache-Control", "no-store");
    shd_reply_plain(&reply, "Retry-After", "1");
    struct MHD_Response *response = make_response(&reply, NULL);
    shd_reply_clear(&reply);
    return response;
}

static enum MHD_Result queue_reply(shd_exchange *exchange) {
    shd_reply *reply = &exchange->reply;
    exchange->state = SHD_ANSWERED;
    enter_phase(exchange, SHD_AT_ANSWER);
    add_common_headers(exchange);
    shd_reaper_answer(exchange->server->reaper, shd_connection_watched(exchange->connection),
                      shd_reply_alone(reply));
    struct MHD_Response *response = make_response(reply, exchange);
    if (!response) {
        shd_reply_clear(reply);
        reply->status = LAST_STATUS;
        return MHD_queue_response(exchange->connection, LAST_STATUS, exchange->server->last_words);
    }
    exchange->stream = reply->stream;
    shd_exchange_send(exchange);
    enum MHD_Result result = MHD_queue_response(exchange->connection, reply->status, response);
    MHD_destroy_response(response);
    return result;
}

/* Answers before the body has come, and closes the connection. libmicrohttpd can do this only at
 * the head, and then cuts off the client in mid-send. So the short message is written by hand:
 * nobody else writes to the socket now, and if that does not take it the client is not reading. */
static enum MHD_Result refuse_now(shd_exchange *exchange) {
    shd_reply *reply = &exchange->reply;
    exchange->state = SHD_ANSWERED;
    add_common_headers(exchange);
    size_t length;
    char last[512], *kept = NULL;
    if (!reply->is_short) kept = shd_reply_raw(reply, exchange->method != SHD_HEAD, &length);
    if (!kept) {
        reply->status = LAST_STATUS;
        char date[SHD_DATE_SIZE];
        shd_reply_date(date);
        length = (size_t)snprintf(last, sizeof last,
                                  "HTTP/1.1 503 Service Unavailable\r\nConnection: close\r\n"
                                  "Date: %s\r\nContent-Type: application/problem+json\r\n"
                                  "Cache-Control: no-store\r\nRetry-After: 1\r\n"
                                  "Content-Length: %zu\r\n\r\n%s",
                                  date, strlen(shd_problem_last_words), shd_problem_last_words);
    }
    const char *message = kept ? kept : last;
    const int socket = shd_connection_socket(exchange->connection);
    if (send(socket, message, length, MSG_DONTWAIT | MSG_NOSIGNAL) == (ssize_t)length)
        shd_linger_keep(exchange->server->linger, socket);
    free(kept);
    return MHD_NO;
}

static enum MHD_Result refuse_size(shd_exchange *exchange, unsigned long long size) {
    unsigned long long limit = exchange->settings->config.limits.body;
    shd_reply_clear(&exchange->reply);
    if (size)
        shd_problem_reply(&exchange->reply, SHD_TOO_LARGE,
                          "the body has %llu bytes: the limit `body` is %llu", size, limit);
    else
        shd_problem_reply(&exchange->reply, SHD_TOO_LARGE,
                          "the body goes on after %llu bytes: that is the limit `body`", limit);
    exchange->reply.limit = SHD_LIMIT_BODY;
    return refuse_now(exchange);
}

/* ---- Receiving ---- */

static bool is_too_long(const char *target) {
    size_t parameters = 1;
    for (const char *c = target; (c = strchr(c, '&')); c++) parameters++;
    return parameters > PARAMETERS_MOST || strlen(target) > TARGET_MOST;
}

/* libmicrohttpd's first word about a request: its target as it was sent. */
static void *begin_exchange(void *cls, const char *target, struct MHD_Connection *connection) {
    shd_exchange *exchange = shd_exchange_new(cls, connection);
    if (!exchange) return NULL;
    exchange->target_end = target + strlen(target);
    const bool too_long = is_too_long(target);
    target = shd_head_skip_authority(target);
    exchange->target = strdup(target);
    exchange->reply.is_short = !exchange->target;
    shd_head_set_path(exchange, target);
    if (too_long) { /* before libmicrohttpd looks into it, which cannot be told to stop */
        shd_exchange_count(exchange);
        shd_problem_reply(&exchange->reply, SHD_LONG_TARGET,
                          "the target has more than %d bytes, or more than %d parameters (PUT "
                          "/v1/scenes makes a short link of a long scene)",
                          TARGET_MOST, PARAMETERS_MOST);
        refuse_now(exchange);
        shutdown(shd_connection_socket(connection), SHUT_RDWR);
    }
    return exchange;
}

static enum MHD_Result take_head(shd_exchange *exchange, const char *method, const char *version) {
    shd_head h;
    shd_exchange_count(exchange);
    shd_head_read(exchange, method, &h);
    shd_exchange_set_client(exchange);
    if (!shd_head_is_sound(exchange->connection, method, exchange->target_end, version))
        shd_problem_reply(&exchange->reply, SHD_BAD_REQUEST,
                          "a line of the head does not end with CR LF, has a NUL, or is folded");
    if (exchange->reply.status || !shd_head_check(&h, version)) return refuse_now(exchange);

    if (shd_reaper_is_excess(exchange->server->reaper,
                             shd_connection_watched(exchange->connection))) {
        shd_problem_later(&exchange->reply, SHD_BUSY, 1,
                          "this address has more connections than one may have: the limit "
                          "`connections-each` is %llu",
                          (unsigned long long)exchange->server->config.connections_each);
        exchange->reply.limit = SHD_LIMIT_CONNECTIONS_EACH;
        return refuse_now(exchange);
    }
    exchange->is_refused = !shd_route_admit(exchange);
    if (exchange->token) shd_exchange_set_client(exchange);
    errno = 0;
    unsigned long long length = h.length ? strtoull(h.length, NULL, 10) : 0;
    if (errno || length > exchange->settings->config.limits.body)
        return refuse_size(exchange, length);
    /* A client that asks first must not be told to go on. Others send in any case: they get their
     * answer after the body, and keep the connection. */
    if (exchange->is_refused && h.expects) return refuse_now(exchange);
    exchange->state = SHD_READING;
    enter_phase(exchange, SHD_AT_BODY);
    return MHD_YES;
}

static enum MHD_Result take_body(shd_exchange *exchange, const char *data, size_t *size) {
    if (*size > exchange->settings->config.limits.body - exchange->size)
        return refuse_size(exchange, 0);
    if (exchange->is_refused || !(exchange->method & (SHD_POST | SHD_PUT))) {
        exchange->size += *size; /* read for the sake of the connection, but not kept */
    } else if (!shd_body_keep(exchange, data, *size)) {
        return refuse_now(exchange);
    }
    *size = 0;
    return MHD_YES;
}

static enum MHD_Result take_end(shd_exchange *exchange) {
    if (shd_has_trailers(exchange->connection)) {
        shd_reply_clear(&exchange->reply);
        shd_problem_reply(&exchange->reply, SHD_BAD_REQUEST, "fields follow the body");
        return refuse_now(exchange);
    }
    shd_exchange_accept(exchange);
    shd_body_fit(exchange);
    if (!exchange->is_refused) shd_route_answer(exchange);
    if (!exchange->is_suspended) return queue_reply(exchange);
    exchange->state = SHD_WAITING;
    return MHD_YES;
}

static enum MHD_Result handle_call(void *cls, struct MHD_Connection *connection, const char *url,
                                   const char *method, const char *version, const char *upload,
                                   size_t *upload_size, void **context) {
    (void)url;
    const shd_server *server = cls;
    shd_exchange *exchange = *context;
    if (!exchange) /* begin_exchange() had no memory */
        return MHD_queue_response(connection, LAST_STATUS, server->last_words);
    switch (exchange->state) {
    case SHD_BEGUN:
        return take_head(exchange, method, version);
    case SHD_READING:
        return *upload_size ? take_body(exchange, upload, upload_size) : take_end(exchange);
    case SHD_WAITING:
        shd_exchange_wake(exchange);
        return exchange->reply.status ? queue_reply(exchange) : MHD_NO; /* its client has gone */
    default:
        return MHD_NO;
    }
}

/* ---- The end of an exchange ---- */

/* What libmicrohttpd says of itself, on its I/O thread. Of some requests that it refuses by itself
 * it tells here alone: there is no exchange yet. (If a Content-Length cannot be read, release
 * 0.9.75 sends the head of its refusal twice, and asks nobody in between:
 * MHD_connection_handle_idle goes on to MHD_CONNECTION_HEADERS_PROCESSED after
 * parse_connection_headers has begun the answer.) */
static void hear_refusal(void *cls, const char *format, va_list arguments) {
    static const char refusal[] = "Error processing request (HTTP response code is %u";
    shd_server *server = cls;
    if (strncmp(format, refusal, sizeof refusal - 1) != 0) return;
    unsigned status = va_arg(arguments, unsigned);
    shd_metrics_unreadable(&server->metrics, status);
    shd_settings *settings = shd_server_settings(server);
    bool is_told = settings->config.log_requests;
    shd_settings_drop(settings);
    if (!is_told) return;
    shd_log line;
    shd_log_begin(&line, SHD_LOG_INFO, "unreadable");
    shd_log_whole(&line, "status", status);
    shd_log_end(&line);
}

static void end_exchange(void *cls, struct MHD_Connection *connection, void **context,
                         enum MHD_RequestTerminationCode code) {
    (void)cls;
    shd_exchange *exchange = *context;
    *context = NULL;
    if (!exchange) return;
    shd_server *server = exchange->server;
    /* Before that, libmicrohttpd has refused it, or lost its client, and closes the connection. */
    if (exchange->state == SHD_WAITING || exchange->state == SHD_ANSWERED)
        enter_phase(exchange, SHD_AT_REST);
    shd_exchange_wake(exchange);
    if (exchange->stream) exchange->stream->kind->leave(exchange->stream);
    if (exchange->state == SHD_BEGUN || exchange->state == SHD_READING) {
        /* libmicrohttpd has answered it by itself, or nobody has. */
        const union MHD_ConnectionInfo *info =
            MHD_get_connection_info(connection, MHD_CONNECTION_INFO_HTTP_STATUS);
        shd_reply_clear(&exchange->reply);
        exchange->reply.status = info ? info->http_status : 0;
    }
    if (!exchange->is_counted && exchange->reply.status) {
        shd_exchange_count(exchange);
        shd_exchange_set_client(exchange);
    }
    if (exchange->is_counted) {
        double seconds = shd_now() - exchange->started;
        unsigned status = exchange->state == SHD_WAITING ? 0 : exchange->reply.status;
        /* What was refused in mid-body ends as an error, but was answered. */
        bool aborted =
            !status || (exchange->is_accepted && code != MHD_REQUEST_TERMINATED_COMPLETED_OK);
        const size_t bytes = shd_exchange_sends(exchange);
        if (status) shd_metrics_request(&server->metrics, exchange->route, status, seconds, bytes);
        if (aborted) atomic_fetch_add(&server->metrics.aborted, 1);
        if (exchange->settings->config.log_requests)
            shd_log_request(exchange, seconds, bytes, aborted);
    }
    shd_exchange_drop(exchange);
}

shd_status shd_http_start(shd_server *server, int socket, struct MHD_Daemon **out,
                          shd_error *error) {
    server->places = server->config.queue + shd_engine_load(server->engine).threads;
    server->last_words = make_last_words();
    if (!server->last_words) return shd_fail(error, SHD_EXHAUSTED, "", "out of memory");
    struct MHD_Daemon *daemon = MHD_start_daemon(
        MHD_USE_EPOLL_INTERNAL_THREAD | MHD_ALLOW_SUSPEND_RESUME | MHD_USE_ITC | MHD_USE_ERROR_LOG,
        0, shd_connection_accept, server, handle_call, server, MHD_OPTION_EXTERNAL_LOGGER,
        hear_refusal, server, MHD_OPTION_LISTEN_SOCKET, socket, MHD_OPTION_URI_LOG_CALLBACK,
        begin_exchange, server, MHD_OPTION_NOTIFY_COMPLETED, end_exchange, NULL,
        MHD_OPTION_NOTIFY_CONNECTION, shd_connection_notify, server, MHD_OPTION_CONNECTION_LIMIT,
        (unsigned)server->config.connections, MHD_OPTION_CONNECTION_TIMEOUT,
        (unsigned)server->config.idle_timeout, MHD_OPTION_CONNECTION_MEMORY_LIMIT,
        (size_t)SHD_CONNECTION_HEADS, MHD_OPTION_END);
    if (!daemon) return shd_fail(error, SHD_INTERNAL, "", "libmicrohttpd did not start");
    *out = daemon;
    return SHD_OK;
}

/* A connection that is closed at once: the I/O thread takes new ones on between its other work. */
int shd_http_turn(struct MHD_Daemon *daemon) {
    const struct sockaddr_un address = {.sun_family = AF_UNIX};
    int pair[2];
    if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, pair)) return -1;
    shutdown(pair[1], SHUT_WR);
    /* Its end is closed by libmicrohttpd, also if that cannot take it on. */
    MHD_add_connection(daemon, pair[0], (const struct sockaddr *)&address, sizeof address);
    return pair[1];
}

void shd_http_stop(shd_server *server, struct MHD_Daemon *daemon) {
    if (daemon) MHD_stop_daemon(daemon);
    if (server->last_words) MHD_destroy_response(server->last_words);
    server->last_words = NULL;
}
