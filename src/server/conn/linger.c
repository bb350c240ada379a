#include "linger.h"

#include <assert.h>
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <pthread.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include "base/clock.h"

/* Enough for a client to send 256 MiB over a local network, and to read the answer. */
enum { LINGER_MAX = 64 };
static const double longest = 10, longest_silence = 2;
static const uint64_t most_bytes = UINT64_C(256) << 20;

typedef struct lingering {
    int fd;
    double end, silence_end;
    uint64_t bytes;
} lingering;

struct shd_linger {
    pthread_mutex_t mutex;
    pthread_t thread;
    int wake; /* eventfd: something is in the inbox, or it is the end */
    bool ending;
    int inbox[LINGER_MAX];          /* sockets that the thread has not taken yet */
    size_t inbox_count, kept_count; /* kept: by the thread, in a list of its own */
};

/* Throws away a slice of what has arrived. False: nothing more will come, or it has had enough. */
static bool drain_socket(lingering *l) {
    char scratch[64 << 10];
    for (int slice = 0; slice < 16; slice++) {
        ssize_t got = recv(l->fd, scratch, sizeof scratch, MSG_DONTWAIT);
        if (got == 0) return false;
        if (got < 0) return errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR;
        l->bytes += (uint64_t)got;
        l->silence_end = shd_now() + longest_silence;
        if (l->bytes > most_bytes) return false;
    }
    return true;
}

/* Moves the inbox to the end of the thread's list. The mutex is held. */
static size_t take_inbox(shd_linger *linger, lingering *kept, size_t count) {
    double now = shd_now();
    assert(count + linger->inbox_count <= LINGER_MAX);
    for (size_t i = 0; i < linger->inbox_count; i++)
        kept[count++] = (lingering){
            .fd = linger->inbox[i], .end = now + longest, .silence_end = now + longest_silence};
    linger->inbox_count = 0;
    linger->kept_count = count;
    return count;
}

static void *watch_sockets(void *context) {
    shd_linger *linger = context;
    lingering kept[LINGER_MAX];
    struct pollfd polled[LINGER_MAX + 1];
    size_t count = 0;
    for (;;) {
        pthread_mutex_lock(&linger->mutex);
        count = take_inbox(linger, kept, count);
        bool ending = linger->ending;
        pthread_mutex_unlock(&linger->mutex);
        if (ending) break;

        polled[0] = (struct pollfd){.fd = linger->wake, .events = POLLIN};
        for (size_t i = 0; i < count; i++)
            polled[i + 1] = (struct pollfd){.fd = kept[i].fd, .events = POLLIN};
        poll(polled, count + 1, count ? 200 : -1);
        eventfd_t wakes;
        eventfd_read(linger->wake, &wakes);

        /* From the last to the first: what fills a gap has been looked at. */
        double now = shd_now();
        for (size_t i = count; i-- > 0;) {
            bool open = now < kept[i].end && now < kept[i].silence_end;
            if (open && polled[i + 1].revents) open = drain_socket(&kept[i]);
            if (open) continue;
            close(kept[i].fd);
            kept[i] = kept[--count];
        }
    }
    while (count) close(kept[--count].fd);
    return NULL;
}

shd_status shd_linger_new(shd_linger **out, shd_error *error) {
    shd_linger *linger = calloc(1, sizeof *linger);
    if (!linger) return shd_fail(error, SHD_EXHAUSTED, "", "no memory for lingering connections");
    linger->wake = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    pthread_mutex_init(&linger->mutex, NULL);
    if (linger->wake < 0 || pthread_create(&linger->thread, NULL, watch_sockets, linger)) {
        if (linger->wake >= 0) close(linger->wake);
        pthread_mutex_destroy(&linger->mutex);
        free(linger);
        return shd_fail(error, SHD_EXHAUSTED, "", "the system refused to start a thread");
    }
    *out = linger;
    return SHD_OK;
}

void shd_linger_keep(shd_linger *linger, int socket) {
    pthread_mutex_lock(&linger->mutex);
    bool room = linger->inbox_count + linger->kept_count < LINGER_MAX;
    int fd = room ? fcntl(socket, F_DUPFD_CLOEXEC, 0) : -1;
    if (fd >= 0) {
        linger->inbox[linger->inbox_count++] = fd;
        eventfd_write(linger->wake, 1);
    }
    pthread_mutex_unlock(&linger->mutex);
}

void shd_linger_drop(shd_linger *linger) {
    if (!linger) return;
    pthread_mutex_lock(&linger->mutex);
    linger->ending = true;
    eventfd_write(linger->wake, 1);
    pthread_mutex_unlock(&linger->mutex);
    pthread_join(linger->thread, NULL);
    close(linger->wake);
    pthread_mutex_destroy(&linger->mutex);
    free(linger);
}
