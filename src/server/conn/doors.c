#include "doors.h"

#include <assert.h>
#include <errno.h>
#include <microhttpd.h>
#include <poll.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

struct shd_doors {
    size_t count;
    struct {
        int fd;
        char bound[SHD_ADDRESS_SIZE];
    } list[SHD_DOORS_MOST];
    bool is_given, serves, is_sealed;
    struct MHD_Daemon *daemon; /* which has the first one; NULL: not yet */
    pthread_t thread;
    int wake;              /* eventfd: it is the end */
    pthread_mutex_t mutex; /* held from an accept() until its connection is handed over */
};

/* ---- Opening ---- */

static shd_status open_all(shd_doors *doors, const char *addresses, shd_error *error) {
    static const char blanks[] = " ,\t";
    for (const char *c = addresses + strspn(addresses, blanks); *c; c += strspn(c, blanks)) {
        char address[256];
        size_t length = strcspn(c, blanks);
        if (doors->count == SHD_DOORS_MOST)
            return shd_fail(error, SHD_CONFIG, "listen", "more than %d addresses", SHD_DOORS_MOST);
        if (length >= sizeof address)
            return shd_fail(error, SHD_CONFIG, "listen", "an address is too long");
        snprintf(address, sizeof address, "%.*s", (int)length, c);
        c += length;
        const size_t i = doors->count;
        shd_status status = shd_listen(address, &doors->list[i].fd, doors->list[i].bound, error);
        if (status) return status;
        doors->count++;
    }
    if (doors->count) return SHD_OK;
    return shd_fail(error, SHD_CONFIG, "listen", "there is no address");
}

shd_status shd_doors_open(const char *addresses, int given, shd_doors **out,
                          char bound[SHD_DOORS_SIZE], shd_error *error) {
    shd_doors *doors = calloc(1, sizeof *doors);
    if (!doors) return shd_fail(error, SHD_EXHAUSTED, "", "out of memory");
    pthread_mutex_init(&doors->mutex, NULL);
    doors->wake = -1;
    doors->is_given = given >= 0;
    shd_status status = SHD_OK;
    if (doors->is_given) {
        doors->list[doors->count++].fd = given;
        shd_listen_describe(given, doors->list[0].bound);
    } else {
        status = open_all(doors, addresses, error);
    }
    if (status) {
        shd_doors_drop(doors);
        return status;
    }
    size_t length = 0;
    for (size_t i = 0; i < doors->count; i++)
        length += (size_t)snprintf(bound + length, SHD_DOORS_SIZE - length, "%s%s", i ? " " : "",
                                   doors->list[i].bound);
    *out = doors;
    return SHD_OK;
}

int shd_doors_first(const shd_doors *doors) {
    return doors->list[0].fd;
}

/* ---- Serving ---- */

/* Everybody who waits at one socket. libmicrohttpd closes what it does not take on. */
static void hand_over(shd_doors *doors, int fd) {
    for (;;) {
        struct sockaddr_storage peer = {0};
        socklen_t size = sizeof peer;
        pthread_mutex_lock(&doors->mutex);
        int socket = accept4(fd, (struct sockaddr *)&peer, &size, SOCK_NONBLOCK | SOCK_CLOEXEC);
        int why = errno;
        if (socket >= 0) MHD_add_connection(doors->daemon, socket, (struct sockaddr *)&peer, size);
        pthread_mutex_unlock(&doors->mutex);
        if (socket >= 0 || why == EINTR || why == ECONNABORTED) continue;
        /* Without descriptors or memory it is tried again, a little later. */
        if (why != EAGAIN) poll(NULL, 0, 50);
        return;
    }
}

static void *run_doors(void *context) {
    shd_doors *doors = context;
    struct pollfd polled[SHD_DOORS_MOST];
    polled[0] = (struct pollfd){.fd = doors->wake, .events = POLLIN};
    for (size_t i = 1; i < doors->count; i++)
        polled[i] = (struct pollfd){.fd = doors->list[i].fd, .events = POLLIN};
    while (!polled[0].revents) {
        poll(polled, doors->count, -1);
        for (size_t i = 1; i < doors->count; i++)
            if (polled[i].revents) hand_over(doors, doors->list[i].fd);
    }
    return NULL;
}

shd_status shd_doors_serve(shd_doors *doors, struct MHD_Daemon *daemon, shd_error *error) {
    doors->daemon = daemon;
    if (doors->count == 1) return SHD_OK;
    doors->wake = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    doors->serves = doors->wake >= 0 && !pthread_create(&doors->thread, NULL, run_doors, doors);
    if (doors->serves) return SHD_OK;
    return shd_fail(error, SHD_EXHAUSTED, "", "the system refused to start a thread");
}

/* ---- Closing ---- */

void shd_doors_seal(shd_doors *doors) {
    assert(doors->daemon);
    doors->is_sealed = !doors->is_given;
    if (doors->is_given)
        MHD_quiesce_daemon(doors->daemon);
    else
        for (size_t i = 0; i < doors->count; i++) shd_listen_seal(doors->list[i].fd);
}

bool shd_doors_have_waiting(shd_doors *doors) {
    bool waiting = false;
    if (doors->is_given) return false;
    pthread_mutex_lock(&doors->mutex);
    for (size_t i = 0; i < doors->count; i++)
        waiting = waiting || shd_listen_has_waiting(doors->list[i].fd);
    pthread_mutex_unlock(&doors->mutex);
    return waiting;
}

void shd_doors_stop(shd_doors *doors) {
    if (!doors || !doors->serves) return;
    eventfd_write(doors->wake, 1);
    pthread_join(doors->thread, NULL);
    doors->serves = false;
}

void shd_doors_drop(shd_doors *doors) {
    if (!doors) return;
    shd_doors_stop(doors);
    for (size_t i = 0; i < doors->count; i++) {
        /* What was sealed is gone, and may be the next daemon's by now. */
        if (!doors->is_given && !doors->is_sealed) shd_listen_remove(doors->list[i].bound);
        if (i || !doors->daemon) close(doors->list[i].fd);
    }
    if (doors->wake >= 0) close(doors->wake);
    pthread_mutex_destroy(&doors->mutex);
    free(doors);
}
