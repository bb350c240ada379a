#include "body.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

#include "server/answer/problem.h"
#include "server/ops/memory.h"
#include "server/ops/settings.h"

enum { SMALL_BODY = 64 << 10 }; /* bytes of a body that there is always room for */

/* Bodies up to this size are read whatever memory is left: for what gives way to them this thread
 * cannot wait as workers do. */
enum { TINY_BODY = 16 << 10 };

/* All bodies together may be as many bytes as those of the requests that may wait or be worked on,
 * however many connections there are. Small ones always may: they do not come to much. */
static bool may_grow(shd_exchange *exchange, size_t capacity) {
    shd_server *server = exchange->server;
    const uint64_t more = capacity - exchange->capacity;
    const uint64_t all = atomic_fetch_add(&server->body_bytes, more) + more;
    const bool is_few =
        capacity <= SMALL_BODY || all / server->places <= exchange->settings->config.limits.body;
    if (is_few && capacity <= TINY_BODY) {
        shd_budget_count(server->budget, more);
        return true;
    }
    if (is_few && shd_budget_take(server->budget, more)) return true;
    atomic_fetch_sub(&server->body_bytes, more);
    const unsigned later = shd_jobs_retry_after(server->jobs, exchange->client);
    if (is_few)
        shd_problem_later(
            &exchange->reply, SHD_BUSY, later,
            "other requests have the memory just now: the limit `memory` leaves too little");
    else
        shd_problem_later(&exchange->reply, SHD_BUSY, later,
                          "the bodies of other requests take %llu bytes: with the limit `queue` of "
                          "%llu there is no room for this one",
                          (unsigned long long)(all - more),
                          (unsigned long long)server->config.queue);
    exchange->reply.limit = is_few ? SHD_LIMIT_MEMORY : SHD_LIMIT_QUEUE;
    return false;
}

bool shd_body_keep(shd_exchange *exchange, const char *data, size_t size) {
    const uint64_t room = shd_memory_beside(exchange->server, SHD_LEAST_REQUEST),
                   most = exchange->settings->config.limits.body, limit = most < room ? most : room;
    const size_t needed = exchange->size + size;
    assert(exchange->size <= exchange->capacity);
    if (needed > limit) {
        shd_problem_reply(&exchange->reply, SHD_TOO_LARGE,
                          "the body goes on after %llu bytes: the limit `memory` leaves no more",
                          (unsigned long long)limit);
        exchange->reply.limit = SHD_LIMIT_MEMORY;
        return false;
    }
    if (needed > exchange->capacity) {
        size_t capacity = exchange->capacity ? exchange->capacity : 4096;
        while (capacity < needed) capacity *= 2;
        if (capacity > limit) capacity = limit;
        if (!may_grow(exchange, capacity)) return false;
        unsigned char *grown = realloc(exchange->body, capacity);
        if (!grown) {
            shd_memory_return_body(exchange->server, capacity - exchange->capacity);
            shd_problem_reply(&exchange->reply, SHD_NO_MEMORY, "no memory for the body");
            return false;
        }
        exchange->body = grown;
        exchange->capacity = capacity;
    }
    memcpy(exchange->body + exchange->size, data, size);
    exchange->size = needed;
    return true;
}

void shd_body_fit(shd_exchange *exchange) {
    const size_t less = exchange->capacity - exchange->size;
    unsigned char *fit = exchange->body && less ? realloc(exchange->body, exchange->size) : NULL;
    if (!fit) return;
    shd_memory_return_body(exchange->server, less);
    exchange->body = fit;
    exchange->capacity = exchange->size;
}
