#include "systemd.h"

#include <fcntl.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <sys/un.h>
#include <unistd.h>

#include "base/clock.h"

enum { FIRST_SOCKET = 3 };

/* A whole number from the environment; -1: there is none. */
static long long number_of(const char *name) {
    const char *text = getenv(name);
    char *end;
    if (!text || *text < '0' || *text > '9') return -1;
    long long value = strtoll(text, &end, 10);
    return *end ? -1 : value;
}

static bool is_listening(int fd) {
    int listening = 0;
    socklen_t size = sizeof listening;
    return !getsockopt(fd, SOL_SOCKET, SO_ACCEPTCONN, &listening, &size) && listening;
}

shd_status shd_take_sockets(shd_sockets *out, shd_error *error) {
    *out = (shd_sockets){-1, -1};
    long long count = number_of("LISTEN_PID") == getpid() ? number_of("LISTEN_FDS") : 0;
    const char *name = getenv("LISTEN_FDNAMES");
    shd_status status = SHD_OK;
    for (int fd = FIRST_SOCKET; fd < FIRST_SOCKET + count && !status; fd++) {
        size_t length = name ? strcspn(name, ":") : 0;
        bool is_admin = length == 5 && !memcmp(name, "admin", 5);
        int *place = is_admin ? &out->admin : &out->public;
        if (name) name += length + (name[length] == ':');
        if (!is_listening(fd))
            status = shd_fail(error, SHD_CONFIG, "LISTEN_FDS", "descriptor %d does not listen", fd);
        else if (*place >= 0)
            status =
                shd_fail(error, SHD_CONFIG, "LISTEN_FDS",
                         "one socket is served, and one named admin: descriptor %d is neither", fd);
        else
            *place = fd;
        fcntl(fd, F_SETFD, FD_CLOEXEC);
        fcntl(fd, F_SETFL, fcntl(fd, F_GETFL) | O_NONBLOCK);
    }
    unsetenv("LISTEN_PID");
    unsetenv("LISTEN_FDS");
    unsetenv("LISTEN_FDNAMES");
    return status;
}

void shd_notify(const char *state) {
    const char *path = getenv("NOTIFY_SOCKET");
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    size_t length = path ? strlen(path) : 0;
    if (length < 2 || length >= sizeof address.sun_path || (*path != '/' && *path != '@')) return;
    memcpy(address.sun_path, path, length);
    if (*path == '@') address.sun_path[0] = 0; /* an abstract name */
    int fd = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    if (fd < 0) return;
    socklen_t size = (socklen_t)(offsetof(struct sockaddr_un, sun_path) + length);
    /* If nobody listens, nobody misses it; if nobody reads, the caller has signals to answer. */
    const struct timeval longest = {.tv_sec = 1};
    setsockopt(fd, SOL_SOCKET, SO_SNDTIMEO, &longest, sizeof longest);
    (void)sendto(fd, state, strlen(state), MSG_NOSIGNAL, (struct sockaddr *)&address, size);
    close(fd);
}

void shd_notify_reloading(void) {
    char state[80];
    snprintf(state, sizeof state, "RELOADING=1\nMONOTONIC_USEC=%lld", (long long)(shd_now() * 1e6));
    shd_notify(state);
}

double shd_watchdog_interval(void) {
    long long microseconds = number_of("WATCHDOG_USEC");
    if (microseconds <= 0 || (getenv("WATCHDOG_PID") && number_of("WATCHDOG_PID") != getpid()))
        return 0;
    return (double)microseconds * 1e-6 / 2;
}
