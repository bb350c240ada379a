#include "reaper.h"

#include <linux/sockios.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <time.h>

struct shd_connection {
    shd_connection *previous, *next;
    int socket;
    bool had_left; /* at the last look */
    atomic_bool awaits;
};

struct shd_reaper {
    pthread_mutex_t mutex;
    pthread_cond_t changed;
    pthread_t thread;
    shd_connection list; /* ring */
    bool ending;
};

/* The client has closed its half, and all that it sent was read. */
static bool has_left(int socket) {
    struct tcp_info info;
    socklen_t size = sizeof info;
    int unread = 0;
    return !getsockopt(socket, IPPROTO_TCP, TCP_INFO, &info, &size) &&
           info.tcpi_state == TCP_CLOSE_WAIT && !ioctl(socket, SIOCINQ, &unread) && !unread;
}

/* Twice in a row, a second apart: the I/O thread may have the last bytes in hand just now. */
static void look(shd_connection *connection) {
    bool left = atomic_load(&connection->awaits) && has_left(connection->socket);
    if (left && connection->had_left) shutdown(connection->socket, SHUT_RDWR);
    connection->had_left = left;
}

static void *run(void *context) {
    shd_reaper *reaper = context;
    pthread_mutex_lock(&reaper->mutex);
    while (!reaper->ending) {
        if (reaper->list.next == &reaper->list) {
            pthread_cond_wait(&reaper->changed, &reaper->mutex);
            continue;
        }
        for (shd_connection *c = reaper->list.next; c != &reaper->list; c = c->next) look(c);
        struct timespec next;
        clock_gettime(CLOCK_MONOTONIC, &next);
        next.tv_sec++;
        while (!reaper->ending && !pthread_cond_timedwait(&reaper->changed, &reaper->mutex, &next))
            continue;
    }
    pthread_mutex_unlock(&reaper->mutex);
    return NULL;
}

shd_status shd_reaper_new(shd_reaper **out, shd_error *error) {
    shd_reaper *reaper = calloc(1, sizeof *reaper);
    if (!reaper) return shd_fail(error, SHD_MEMORY, "", "no memory for the reaper");
    reaper->list.previous = reaper->list.next = &reaper->list;
    pthread_condattr_t monotonic;
    pthread_condattr_init(&monotonic);
    pthread_condattr_setclock(&monotonic, CLOCK_MONOTONIC);
    pthread_mutex_init(&reaper->mutex, NULL);
    pthread_cond_init(&reaper->changed, &monotonic);
    pthread_condattr_destroy(&monotonic);
    if (pthread_create(&reaper->thread, NULL, run, reaper)) {
        pthread_cond_destroy(&reaper->changed);
        pthread_mutex_destroy(&reaper->mutex);
        free(reaper);
        return shd_fail(error, SHD_MEMORY, "", "the system refused to start a thread");
    }
    *out = reaper;
    return SHD_OK;
}

void shd_reaper_drop(shd_reaper *reaper) {
    if (!reaper) return;
    pthread_mutex_lock(&reaper->mutex);
    reaper->ending = true;
    pthread_cond_signal(&reaper->changed);
    pthread_mutex_unlock(&reaper->mutex);
    pthread_join(reaper->thread, NULL);
    pthread_cond_destroy(&reaper->changed);
    pthread_mutex_destroy(&reaper->mutex);
    free(reaper);
}

shd_connection *shd_reaper_add(shd_reaper *reaper, int socket) {
    shd_connection *connection = calloc(1, sizeof *connection);
    if (!connection) return NULL;
    connection->socket = socket;
    atomic_init(&connection->awaits, true);
    pthread_mutex_lock(&reaper->mutex);
    bool first = reaper->list.next == &reaper->list;
    connection->next = &reaper->list;
    connection->previous = reaper->list.previous;
    connection->previous->next = connection;
    reaper->list.previous = connection;
    if (first) pthread_cond_signal(&reaper->changed);
    pthread_mutex_unlock(&reaper->mutex);
    return connection;
}

void shd_reaper_remove(shd_reaper *reaper, shd_connection *connection) {
    if (!connection) return;
    pthread_mutex_lock(&reaper->mutex);
    connection->previous->next = connection->next;
    connection->next->previous = connection->previous;
    pthread_mutex_unlock(&reaper->mutex);
    free(connection);
}

void shd_connection_awaits(shd_connection *connection, bool awaits) {
    if (connection) atomic_store(&connection->awaits, awaits);
}
