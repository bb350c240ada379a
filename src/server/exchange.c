#include "exchange.h"

#include <assert.h>
#include <microhttpd.h>
#include <stdio.h>
#include <stdlib.h>

#include "base/clock.h"
#include "server/conn/connections.h"
#include "server/conn/reaper.h"
#include "server/ops/memory.h"
#include "server/ops/settings.h"

shd_exchange *shd_exchange_new(shd_server *server, struct MHD_Connection *connection) {
    shd_exchange *exchange = calloc(1, sizeof *exchange);
    if (!exchange) return NULL;
    exchange->server = server;
    exchange->settings = shd_server_settings(server);
    exchange->connection = connection;
    exchange->route = SHD_ROUTE_OTHER;
    exchange->started = shd_now();
    snprintf(exchange->method_name, sizeof exchange->method_name, "-");
    snprintf(exchange->id, sizeof exchange->id, "%08x-%08x", server->run,
             atomic_fetch_add(&server->next_id, 1));
    return exchange;
}

void shd_exchange_count(shd_exchange *exchange) {
    assert(!exchange->is_counted);
    exchange->is_counted = true;
    atomic_fetch_add(&exchange->server->in_flight, 1);
    atomic_store(&exchange->server->worked, true);
}

void shd_exchange_accept(shd_exchange *exchange) {
    assert(exchange->is_counted && !exchange->is_accepted);
    exchange->is_accepted = true;
    atomic_fetch_add(&exchange->server->accepted, 1);
}

void shd_exchange_set_client(shd_exchange *exchange) {
    if (exchange->token)
        shd_client_of_token(exchange->token, exchange->authorization, exchange->client);
    else
        shd_client_of_address(shd_connection_peer(exchange->connection), exchange->forwarded_for,
                              exchange->settings->proxies, exchange->client);
}

/* ---- Waiting for a job ---- */

void shd_exchange_suspend(shd_exchange *exchange) {
    assert((exchange->state == SHD_READING || exchange->stream) && !exchange->is_suspended);
    exchange->is_suspended = true;
    shd_reaper_phase(exchange->server->reaper, shd_connection_watched(exchange->connection),
                     SHD_AT_WORK, exchange);
    atomic_fetch_add(&exchange->server->suspended, 1);
    MHD_suspend_connection(exchange->connection);
}

void shd_exchange_resume(shd_exchange *exchange) {
    MHD_resume_connection(exchange->connection);
}

void shd_exchange_wake(shd_exchange *exchange) {
    if (!exchange->is_suspended) return;
    exchange->is_suspended = false;
    atomic_fetch_sub(&exchange->server->suspended, 1);
}

/* ---- The answer ---- */

size_t shd_exchange_sends(const shd_exchange *exchange) {
    bool bodiless = exchange->method == SHD_HEAD || exchange->reply.status == 304;
    return bodiless ? 0 : exchange->reply.size;
}

void shd_exchange_send(shd_exchange *exchange) {
    assert(!exchange->unsent);
    exchange->unsent = shd_exchange_sends(exchange);
    atomic_fetch_add(&exchange->server->unsent, exchange->unsent);
}

void shd_exchange_part(shd_exchange *exchange, size_t bytes) {
    shd_reaper *reaper = exchange->server->reaper;
    shd_connection *connection = shd_connection_watched(exchange->connection);
    shd_reaper_phase(reaper, connection, SHD_AT_ANSWER, NULL);
    shd_reaper_answer(reaper, connection, bytes);
}

ssize_t shd_exchange_read(void *context, uint64_t at, char *out, size_t room) {
    shd_exchange *exchange = context;
    (void)at;
    shd_exchange_wake(exchange);
    const ssize_t size = exchange->stream->kind->read(exchange->stream, exchange, out, room);
    if (size > 0) exchange->reply.size += (size_t)size; /* which is told at the end */
    return size == SHD_STREAM_ENDS     ? MHD_CONTENT_READER_END_OF_STREAM
           : size == SHD_STREAM_BREAKS ? MHD_CONTENT_READER_END_WITH_ERROR
                                       : size;
}

void shd_exchange_drop(shd_exchange *exchange) {
    shd_server *server = exchange->server;
    assert(!exchange->is_suspended && !exchange->waiter.job);
    if (exchange->is_accepted) atomic_fetch_sub(&server->accepted, 1);
    if (exchange->is_counted) atomic_fetch_sub(&server->in_flight, 1);
    shd_memory_return_body(server, exchange->capacity);
    atomic_fetch_sub(&server->unsent, exchange->unsent);
    shd_kept_scene_drop(exchange->kept); /* before its engine goes with the settings */
    shd_settings_drop(exchange->settings);
    shd_reply_clear(&exchange->reply);
    free(exchange->target);
    free(exchange->accept);
    free(exchange->accept_encoding);
    free(exchange->content_encoding);
    free(exchange->if_none_match);
    free(exchange->forwarded_for);
    free(exchange->body);
    free(exchange);
}
