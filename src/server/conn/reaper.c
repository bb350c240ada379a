#include "reaper.h"

#include <assert.h>
#include <math.h>
#include <netinet/in.h>
#include <poll.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <xxhash.h>

/* glibc's <netinet/tcp.h> has a tcp_info without the count of bytes. */
#include <linux/tcp.h>

#include "base/clock.h"
#include "server/conn/alarm.h"
#include "server/ops/log.h"

/* Seconds: between two looks, before room is made again, and before who leaves is looked for again;
 * what an answer gets at least before it gives way to new connections, and to work. */
static const double pause_between = 0.25, pause_for_room = 0.01, pause_for_leavers = 0.005,
                    least_sending = 2, least_taking = 0.25;

/* Connections that are one too many: how many of one address are let in to be told so, and for how
 * many seconds they are waited for. */
enum { MOST_EXCESS = 16 };
static const double excess_patience = 2;

enum { BUCKETS = 1024 };

/* An address that has connections. */
typedef struct peer {
    struct peer *next; /* in its bucket */
    uint64_t hash;
    size_t count;
    char address[];
} peer;

struct shd_connection {
    shd_connection *previous, *next;
    int socket;
    shd_phase phase;
    double since;  /* when the phase began */
    uint64_t read; /* bytes received then */
    bool had_left; /* at the last look */
    bool ended;
    size_t answer; /* SHD_AT_ANSWER: bytes that are freed with it, */
    uint64_t sent; /* and those that the client had acknowledged before */
    bool excess;   /* its address had as many as it may */
    peer *peer;    /* NULL: its address does not count */
    void *who;     /* SHD_AT_WORK */
};

struct shd_reaper {
    pthread_mutex_t mutex;
    shd_alarm alarm; /* watches those that are at work */
    pthread_t thread;
    shd_departure departure;
    shd_patience patience;
    peer *peers[BUCKETS];
    shd_connection list; /* ring */
    shd_reaped count;
    size_t open;
    double grace; /* for who has begun to send, while `finishing` */
    bool crowded, finishing, ending;
};

/* ---- What sockets tell ---- */

/* The client has closed its half or all of it, and everything that it sent was read. */
static bool has_left(int socket) {
    struct pollfd polled = {.fd = socket, .events = POLLRDHUP};
    int unread = 0;
    if (poll(&polled, 1, 0) <= 0 || polled.revents & POLLNVAL) return false;
    if (polled.revents & (POLLHUP | POLLERR)) return true;
    return polled.revents & POLLRDHUP && !ioctl(socket, FIONREAD, &unread) && !unread;
}

/* Bytes so far. False: the socket, a unix one for instance, cannot tell. */
static bool ask_tcp(int socket, struct tcp_info *out) {
    socklen_t size = sizeof *out;
    return !getsockopt(socket, IPPROTO_TCP, TCP_INFO, out, &size);
}

static bool has_read_since(const shd_connection *c) {
    struct tcp_info info = {0};
    return ask_tcp(c->socket, &info) && info.tcpi_bytes_received > c->read;
}

/* Bytes that the client has acknowledged so far. */
static uint64_t bytes_taken(int socket) {
    struct tcp_info info = {0};
    return ask_tcp(socket, &info) ? info.tcpi_bytes_acked : 0;
}

/* ---- Looking ---- */

/* With the mutex. */
static void end_connection(shd_reaper *reaper, shd_connection *c, shd_ending why) {
    assert(!c->ended && reaper->open);
    shutdown(c->socket, SHUT_RDWR);
    c->ended = true;
    reaper->open--;
    reaper->count.ended[why]++;
}

static double patience_for(const shd_reaper *reaper, const shd_connection *c) {
    const shd_patience *patience = &reaper->patience;
    const double most[SHD_PHASES] = {[SHD_AT_HEAD] = c->excess ? excess_patience : patience->head,
                                     [SHD_AT_BODY] = patience->body,
                                     [SHD_AT_ANSWER] = patience->send};
    return most[c->phase];
}

/* With the mutex. */
static void look_at(shd_reaper *reaper, shd_connection *c, double now) {
    /* A head begins with its first byte, of which libmicrohttpd does not tell. */
    if (c->phase == SHD_AT_REST && has_read_since(c)) {
        c->phase = SHD_AT_HEAD;
        c->since = now;
    }
    if (reaper->finishing &&
        (c->phase == SHD_AT_REST || (c->phase < SHD_AT_WORK && now - c->since > reaper->grace))) {
        shutdown(c->socket, SHUT_RD); /* what has arrived is still read */
        c->ended = true;
        reaper->open--;
        return;
    }
    double patience = patience_for(reaper, c);
    if (patience > 0 && now - c->since > patience) {
        end_connection(reaper, c, SHD_END_LATE);
        return;
    }
    /* Twice in a row: the I/O thread may have the last bytes in hand just now. */
    bool left = c->phase != SHD_AT_ANSWER && has_left(c->socket);
    if (left && c->had_left) end_connection(reaper, c, SHD_END_LEFT);
    c->had_left = left;
}

static bool may_go(const shd_reaper *reaper, const shd_connection *c, double now) {
    const double least[SHD_PHASES] = {[SHD_AT_HEAD] = reaper->patience.least_reading,
                                      [SHD_AT_BODY] = reaper->patience.least_reading,
                                      [SHD_AT_WORK] = INFINITY,
                                      [SHD_AT_ANSWER] = least_sending};
    return now - c->since >= least[c->phase];
}

/* How many connections its address has, roughly: a few more are no difference. */
static int weigh_peer(const shd_connection *c) {
    return c->peer ? ilogb((double)c->peer->count) : 0;
}

/* Whether `a` is to go before `b`. */
static bool goes_before(const shd_connection *a, const shd_connection *b) {
    if (!b) return true;
    if (weigh_peer(a) != weigh_peer(b)) return weigh_peer(a) > weigh_peer(b);
    return a->phase != b->phase ? a->phase < b->phase : a->since < b->since;
}

/* With the mutex. Ends one of those that hold their place for longest. False: there is none. */
static bool make_room(shd_reaper *reaper, double now) {
    shd_connection *first = NULL;
    for (shd_connection *c = reaper->list.next; c != &reaper->list; c = c->next)
        if (!c->ended && may_go(reaper, c, now) && goes_before(c, first)) first = c;
    if (first) end_connection(reaper, first, SHD_END_ROOM);
    return first;
}

/* What an answer has cost so far: bytes that its client has not taken, times seconds. */
static double burden_of(const shd_connection *c, double now) {
    if (c->phase != SHD_AT_ANSWER || c->ended || now - c->since < least_taking) return 0;
    const uint64_t taken = bytes_taken(c->socket) - c->sent;
    return c->answer > taken ? (double)(c->answer - taken) * (now - c->since) : 0;
}

/* One place in eight is kept free, so that who comes is let in before others have to go. */
static size_t usable_places(const shd_reaper *reaper) {
    size_t all = reaper->patience.connections;
    return all - all / 8;
}

/* With the mutex. Ends connections whose client has gone. If one waits for a job, it is noted in
 * `gone` and released later, without the mutex: libmicrohttpd may call us with its own held.
 * `leavers`: nothing else is looked at. */
static size_t look_at_all(shd_reaper *reaper, bool leavers, void *gone[], size_t most) {
    double now = shd_now();
    size_t count = 0;
    for (shd_connection *c = reaper->list.next; c != &reaper->list; c = c->next) {
        if (c->ended) continue;
        if (c->phase != SHD_AT_WORK) {
            if (!leavers) look_at(reaper, c, now);
        } else if (count < most && has_left(c->socket)) {
            end_connection(reaper, c, SHD_END_LEFT);
            if (reaper->departure.leave(c->who)) gone[count++] = c->who;
        }
    }
    if (leavers) return count;
    reaper->crowded = false;
    while (reaper->open > usable_places(reaper) && make_room(reaper, now)) continue;
    return count;
}

/* With the mutex, which is released meanwhile. */
static void look_and_release(shd_reaper *reaper, bool leavers) {
    enum { MOST = 256 };
    void *gone[MOST];
    const size_t count = look_at_all(reaper, leavers, gone, MOST);
    pthread_mutex_unlock(&reaper->mutex);
    for (size_t i = 0; i < count; i++) reaper->departure.release(gone[i]);
    pthread_mutex_lock(&reaper->mutex);
}

/* With the mutex. Waits until it is time to look at all again; who leaves is looked for at once. */
static void pause_looks(shd_reaper *reaper) {
    const double began = shd_now();
    double looked = began - pause_for_leavers;
    bool left = false;
    while (!reaper->ending) {
        const bool hurries = reaper->crowded || reaper->finishing;
        const double now = shd_now(), next = began + (hurries ? pause_for_room : pause_between);
        if (now >= next) return;
        if (left && now >= looked + pause_for_leavers) {
            look_and_release(reaper, true);
            looked = now;
            left = false;
            continue;
        }
        const double wait = left ? fmin(next, looked + pause_for_leavers) - now : next - now;
        pthread_mutex_unlock(&reaper->mutex);
        left = shd_alarm_wait(&reaper->alarm, wait) || left;
        pthread_mutex_lock(&reaper->mutex);
    }
}

static void *watch_connections(void *context) {
    shd_reaper *reaper = context;
    pthread_mutex_lock(&reaper->mutex);
    while (!reaper->ending) {
        if (reaper->list.next == &reaper->list) {
            pthread_mutex_unlock(&reaper->mutex);
            shd_alarm_wait(&reaper->alarm, INFINITY);
            pthread_mutex_lock(&reaper->mutex);
            continue;
        }
        look_and_release(reaper, false);
        pause_looks(reaper);
    }
    pthread_mutex_unlock(&reaper->mutex);
    return NULL;
}

/* ---- Memory ---- */

enum { LARGE_ANSWER = 64 << 10 }; /* smaller ones are taken by the system's buffers */

/* With the mutex. */
static shd_connection *find_heaviest(const shd_reaper *reaper) {
    const double now = shd_now();
    double most = 0;
    shd_connection *found = NULL;
    for (shd_connection *c = reaper->list.next; c != &reaper->list; c = c->next) {
        const double cost = c->answer ? burden_of(c, now) : 0;
        if (cost <= most) continue;
        most = cost;
        found = c;
    }
    return found;
}

void shd_reaper_answer(shd_reaper *reaper, shd_connection *connection, size_t bytes) {
    if (!connection || bytes < LARGE_ANSWER) return;
    const uint64_t sent = bytes_taken(connection->socket);
    pthread_mutex_lock(&reaper->mutex);
    connection->answer = bytes;
    connection->sent = sent;
    pthread_mutex_unlock(&reaper->mutex);
}

size_t shd_reaper_drop_answers(shd_reaper *reaper, size_t bytes) {
    size_t promised = 0, dropped = 0;
    pthread_mutex_lock(&reaper->mutex);
    for (shd_connection *c = reaper->list.next; c != &reaper->list; c = c->next)
        if (c->ended && c->phase == SHD_AT_ANSWER) promised += c->answer;
    while (promised < bytes) {
        shd_connection *c = find_heaviest(reaper);
        if (!c) break;
        /* The system drops what it has buffered, too. */
        const struct linger none = {.l_onoff = 1, .l_linger = 0};
        setsockopt(c->socket, SOL_SOCKET, SO_LINGER, &none, sizeof none);
        end_connection(reaper, c, SHD_END_MEMORY);
        promised += c->answer;
        dropped++;
    }
    pthread_mutex_unlock(&reaper->mutex);
    if (dropped) {
        shd_log line;
        shd_log_begin(&line, SHD_LOG_WARNING, "answers-dropped");
        shd_log_whole(&line, "count", dropped);
        shd_log_text(&line, "message", "their clients did not take them, and others wanted memory");
        shd_log_end(&line);
    }
    return promised;
}

/* ---- The whole ---- */

static void free_reaper(shd_reaper *reaper) {
    shd_alarm_drop(&reaper->alarm);
    pthread_mutex_destroy(&reaper->mutex);
    free(reaper);
}

shd_status shd_reaper_new(const shd_patience *patience, const shd_departure *departure,
                          shd_reaper **out, shd_error *error) {
    shd_reaper *reaper = calloc(1, sizeof *reaper);
    if (!reaper) return shd_fail(error, SHD_EXHAUSTED, "", "no memory for the reaper");
    reaper->list.previous = reaper->list.next = &reaper->list;
    if (departure) reaper->departure = *departure;
    reaper->patience = *patience;
    pthread_mutex_init(&reaper->mutex, NULL);
    if (!shd_alarm_make(&reaper->alarm) ||
        pthread_create(&reaper->thread, NULL, watch_connections, reaper)) {
        free_reaper(reaper);
        return shd_fail(error, SHD_EXHAUSTED, "", "the system refused to start a thread");
    }
    *out = reaper;
    return SHD_OK;
}

void shd_reaper_drop(shd_reaper *reaper) {
    if (!reaper) return;
    pthread_mutex_lock(&reaper->mutex);
    assert(reaper->list.next == &reaper->list);
    reaper->ending = true;
    shd_alarm_ring(&reaper->alarm);
    pthread_mutex_unlock(&reaper->mutex);
    pthread_join(reaper->thread, NULL);
    free_reaper(reaper);
}

void shd_reaper_finish(shd_reaper *reaper, double grace) {
    pthread_mutex_lock(&reaper->mutex);
    reaper->finishing = true;
    reaper->grace = grace;
    shd_alarm_ring(&reaper->alarm);
    pthread_mutex_unlock(&reaper->mutex);
}

void shd_reaper_set_patience(shd_reaper *reaper, const shd_patience *patience) {
    pthread_mutex_lock(&reaper->mutex);
    reaper->patience = *patience;
    pthread_mutex_unlock(&reaper->mutex);
}

/* ---- Addresses ---- */

/* With the mutex. */
static peer **find_peer(shd_reaper *reaper, const char *address, uint64_t hash) {
    peer **at = &reaper->peers[hash % BUCKETS];
    while (*at && ((*at)->hash != hash || strcmp((*at)->address, address) != 0)) at = &(*at)->next;
    return at;
}

/* With the mutex. NULL if memory is short, as for an address that does not count. */
static peer *join_peer(shd_reaper *reaper, const char *address) {
    if (!address) return NULL;
    const size_t size = strlen(address) + 1;
    const uint64_t hash = XXH3_64bits(address, size - 1);
    peer **at = find_peer(reaper, address, hash);
    if (!*at) {
        *at = calloc(1, sizeof **at + size);
        if (!*at) return NULL;
        (*at)->hash = hash;
        memcpy((*at)->address, address, size);
    }
    (*at)->count++;
    return *at;
}

/* With the mutex. */
static void leave_peer(shd_reaper *reaper, peer *p) {
    assert(!p || p->count);
    if (!p || --p->count) return;
    *find_peer(reaper, p->address, p->hash) = p->next;
    free(p);
}

static bool is_over(const shd_reaper *reaper, size_t count) {
    return reaper->patience.each && count > reaper->patience.each;
}

bool shd_reaper_admits(shd_reaper *reaper, const char *address) {
    if (!address) return true;
    pthread_mutex_lock(&reaper->mutex);
    const peer *p = *find_peer(reaper, address, XXH3_64bits(address, strlen(address)));
    const size_t each = reaper->patience.each;
    bool admits = !p || !each || p->count < each + MOST_EXCESS;
    pthread_mutex_unlock(&reaper->mutex);
    return admits;
}

bool shd_reaper_is_excess(shd_reaper *reaper, const shd_connection *connection) {
    if (!connection) return false;
    pthread_mutex_lock(&reaper->mutex);
    bool excess = connection->excess && is_over(reaper, connection->peer->count);
    pthread_mutex_unlock(&reaper->mutex);
    return excess;
}

/* ---- Connections ---- */

shd_connection *shd_reaper_add(shd_reaper *reaper, int socket, const char *address) {
    shd_connection *connection = calloc(1, sizeof *connection);
    if (!connection) return NULL;
    connection->socket = socket;
    connection->phase = SHD_AT_HEAD;
    connection->since = shd_now();
    pthread_mutex_lock(&reaper->mutex);
    bool first = reaper->list.next == &reaper->list;
    connection->peer = join_peer(reaper, address);
    connection->excess = connection->peer && is_over(reaper, connection->peer->count);
    connection->next = &reaper->list;
    connection->previous = reaper->list.previous;
    connection->previous->next = connection;
    reaper->list.previous = connection;
    bool crowded = ++reaper->open > usable_places(reaper);
    if (first || (crowded && !reaper->crowded)) shd_alarm_ring(&reaper->alarm);
    reaper->crowded = crowded;
    pthread_mutex_unlock(&reaper->mutex);
    return connection;
}

bool shd_reaper_remove(shd_reaper *reaper, shd_connection *connection) {
    if (!connection) return false;
    pthread_mutex_lock(&reaper->mutex);
    assert(connection->previous->next == connection && connection->next->previous == connection);
    connection->previous->next = connection->next;
    connection->next->previous = connection->previous;
    if (!connection->ended) reaper->open--;
    if (connection->phase == SHD_AT_WORK)
        shd_alarm_watch(&reaper->alarm, connection->socket, false);
    const shd_phase phase = connection->phase;
    bool amid = !connection->ended &&
                (phase == SHD_AT_BODY || (phase <= SHD_AT_HEAD && has_read_since(connection)));
    leave_peer(reaper, connection->peer);
    pthread_mutex_unlock(&reaper->mutex);
    free(connection);
    return amid;
}

void shd_reaper_phase(shd_reaper *reaper, shd_connection *connection, shd_phase phase, void *who) {
    if (!connection) return;
    struct tcp_info info = {0};
    /* If it is not seen that a head begins, it has since the last answer. */
    if (phase == SHD_AT_REST && !ask_tcp(connection->socket, &info)) phase = SHD_AT_HEAD;
    double now = shd_now();
    pthread_mutex_lock(&reaper->mutex);
    const bool was = connection->phase == SHD_AT_WORK, is = phase == SHD_AT_WORK;
    if (was != is) shd_alarm_watch(&reaper->alarm, connection->socket, is);
    connection->answer = 0;
    connection->phase = phase;
    connection->since = now;
    connection->read = info.tcpi_bytes_received;
    connection->had_left = false;
    connection->who = who;
    pthread_mutex_unlock(&reaper->mutex);
}

shd_reaped shd_reaper_count(shd_reaper *reaper) {
    pthread_mutex_lock(&reaper->mutex);
    shd_reaped count = reaper->count;
    double now = shd_now();
    for (shd_connection *c = reaper->list.next; c != &reaper->list; c = c->next) {
        count.connections[c->phase]++;
        if (c->phase == SHD_AT_WORK && now - c->since > count.oldest) count.oldest = now - c->since;
    }
    pthread_mutex_unlock(&reaper->mutex);
    return count;
}
