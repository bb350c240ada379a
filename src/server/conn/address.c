#include "address.h"

#include <errno.h>
#include <linux/filter.h>
#include <netdb.h>
#include <netinet/in.h>
#include <poll.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

void shd_listen_describe(int fd, char bound[SHD_ADDRESS_SIZE]) {
    struct sockaddr_storage address = {0};
    socklen_t size = sizeof address;
    char host[INET6_ADDRSTRLEN] = "", port[8] = "";
    getsockname(fd, (struct sockaddr *)&address, &size);
    if (address.ss_family == AF_UNIX) {
        const struct sockaddr_un *place = (const void *)&address;
        const char *path = place->sun_path;
        int most = (int)size - (int)offsetof(struct sockaddr_un, sun_path);
        bool is_abstract = most > 1 && !*path;
        snprintf(bound, SHD_ADDRESS_SIZE, "unix:%s%.*s", is_abstract ? "@" : "",
                 is_abstract ? most - 1 : most, path + is_abstract);
        return;
    }
    getnameinfo((struct sockaddr *)&address, size, host, sizeof host, port, sizeof port,
                NI_NUMERICHOST | NI_NUMERICSERV);
    snprintf(bound, SHD_ADDRESS_SIZE, strchr(host, ':') ? "[%s]:%s" : "%s:%s", host, port);
}

static const char unix_prefix[] = "unix:";

static bool is_unix(const char *address) {
    return !strncmp(address, unix_prefix, sizeof unix_prefix - 1);
}

/* Where an address leads. */
typedef struct places {
    struct addrinfo *first; /* a list */
    struct addrinfo unix_place;
    struct sockaddr_un path; /* of it */
} places;

static shd_status find_unix(const char *address, places *out, shd_error *error) {
    const char *path = address + sizeof unix_prefix - 1;
    *out = (places){.first = &out->unix_place,
                    .unix_place = {.ai_family = AF_UNIX,
                                   .ai_addr = (struct sockaddr *)&out->path,
                                   .ai_addrlen = sizeof out->path},
                    .path.sun_family = AF_UNIX};
    if (*path != '/' || strlen(path) >= sizeof out->path.sun_path)
        return shd_fail(error, SHD_CONFIG, address,
                        "not of the form unix:/path, with up to %zu characters of it",
                        sizeof out->path.sun_path - 1);
    strcpy(out->path.sun_path, path);
    return SHD_OK;
}

/* `flags` are getaddrinfo's. */
static shd_status find_places(const char *address, int flags, places *out, shd_error *error) {
    if (is_unix(address)) return find_unix(address, out, error);
    const char *colon = strrchr(address, ':'), *start = address, *end = colon;
    const bool is_bracketed = colon && *start == '[' && colon > start && colon[-1] == ']';
    if (is_bracketed) {
        start++;
        end--;
    }
    char host[256];
    enum { PORT_MOST = 15 };
    size_t digits = colon ? strspn(colon + 1, "0123456789") : 0;
    if (!digits || colon[1 + digits] || digits > PORT_MOST ||
        end - start >= (ptrdiff_t)sizeof host ||
        (!is_bracketed && memchr(start, ':', (size_t)(end - start))))
        return shd_fail(error, SHD_CONFIG, address, "not of the form ADDR:PORT or [ADDR]:PORT");
    if (digits > 5 || strtoul(colon + 1, NULL, 10) > 65535)
        return shd_fail(error, SHD_CONFIG, address, "ports go from 0 to 65535");
    snprintf(host, sizeof host, "%.*s", (int)(end - start), start);
    const struct addrinfo hints = {.ai_socktype = SOCK_STREAM, .ai_flags = flags};
    int failure = getaddrinfo(*host ? host : NULL, colon + 1, &hints, &out->first);
    return failure ? shd_fail(error, SHD_CONFIG, address, "%s", gai_strerror(failure)) : SHD_OK;
}

static void drop_places(places *p) {
    if (p->first != &p->unix_place) freeaddrinfo(p->first);
}

/* Whether the path is a socket that nobody listens on: what a daemon that was killed has left. */
static bool is_stale(const struct sockaddr_un *place) {
    struct stat info;
    if (lstat(place->sun_path, &info) || !S_ISSOCK(info.st_mode)) return false;
    int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    bool refused = fd >= 0 && connect(fd, (const struct sockaddr *)place, sizeof *place) &&
                   errno == ECONNREFUSED;
    if (fd >= 0) close(fd);
    return refused;
}

void shd_listen_remove(const char *bound) {
    if (is_unix(bound)) unlink(bound + sizeof unix_prefix - 1);
}

shd_status shd_listen(const char *address, int *out, char bound[SHD_ADDRESS_SIZE],
                      shd_error *error) {
    places found;
    shd_status status = find_places(address, AI_PASSIVE, &found, error);
    if (status) return status;
    const struct addrinfo *place = found.first;
    if (is_unix(address) && is_stale(&found.path)) unlink(found.path.sun_path);
    int fd = socket(place->ai_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0), on = 1;
    if (fd < 0 || setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on) ||
        bind(fd, place->ai_addr, place->ai_addrlen) || listen(fd, SOMAXCONN)) {
        status = shd_fail(error, SHD_CONFIG, address, "%s", strerror(errno));
        if (fd >= 0) close(fd);
    } else {
        shd_listen_describe(fd, bound);
        *out = fd;
    }
    drop_places(&found);
    return status;
}

static int try_connect(const struct addrinfo *place, int seconds) {
    const struct timeval patience = {.tv_sec = seconds};
    int fd = socket(place->ai_family, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (fd < 0) return -1;
    if (!setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience) &&
        !setsockopt(fd, SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof patience) &&
        !connect(fd, place->ai_addr, place->ai_addrlen))
        return fd;
    const int reason = errno;
    close(fd);
    errno = reason;
    return -1;
}

shd_status shd_connect(const char *address, int seconds, int *out, shd_error *error) {
    places found;
    shd_status status = find_places(address, 0, &found, error);
    if (status) return status;
    int fd = -1;
    for (const struct addrinfo *at = found.first; at && fd < 0; at = at->ai_next)
        fd = try_connect(at, seconds);
    if (fd < 0)
        status = shd_fail(error, SHD_CONFIG, address, "%s", strerror(errno));
    else
        *out = fd;
    drop_places(&found);
    return status;
}

/* A filter that drops the first packet of every connection (SYN without ACK; the flags are byte 13
 * of TCP's header, with which a packet begins here), which its sender sends again a second later.
 * Who has been answered is let in: if its last packet were dropped too, it would take itself for
 * connected, and be reset at the end. Accepted connections inherit the filter, and do not notice.
 * If the system refuses it, who connects between the last accept() and the end is reset. */
void shd_listen_seal(int fd) {
    char bound[SHD_ADDRESS_SIZE];
    shd_listen_describe(fd, bound);
    shd_listen_remove(bound); /* who finds no socket does not connect */
    struct sock_filter filter[] = {
        BPF_STMT(BPF_LD | BPF_B | BPF_ABS, 13), BPF_STMT(BPF_ALU | BPF_AND | BPF_K, 0x12),
        BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, 0x02, 0, 1), BPF_STMT(BPF_RET | BPF_K, 0),
        BPF_STMT(BPF_RET | BPF_K, UINT32_MAX)};
    const struct sock_fprog program = {.len = sizeof filter / sizeof *filter, .filter = filter};
    (void)setsockopt(fd, SOL_SOCKET, SO_ATTACH_FILTER, &program, sizeof program);
}

bool shd_listen_has_waiting(int fd) {
    struct pollfd polled = {.fd = fd, .events = POLLIN};
    return poll(&polled, 1, 0) > 0 && polled.revents & POLLIN;
}
