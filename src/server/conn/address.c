#include "address.h"

#include <errno.h>
#include <linux/filter.h>
#include <netdb.h>
#include <netinet/in.h>
#include <poll.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

static shd_status split_address(const char *address, char *host, size_t host_size, char *port,
                                size_t port_size, shd_error *error) {
    const char *colon = strrchr(address, ':'), *start = address, *end = colon;
    if (colon && *start == '[' && colon > start && colon[-1] == ']') {
        start++;
        end--;
    } else if (!colon || memchr(address, ':', (size_t)(colon - address))) {
        return shd_fail(error, SHD_CONFIG, address, "not of the form ADDR:PORT or [ADDR]:PORT");
    }
    size_t length = (size_t)(end - start), digits = strspn(colon + 1, "0123456789");
    if (length >= host_size || !digits || colon[1 + digits] || digits >= port_size)
        return shd_fail(error, SHD_CONFIG, address, "not of the form ADDR:PORT or [ADDR]:PORT");
    unsigned number = 0;
    if (digits > 5 || sscanf(colon + 1, "%u", &number) != 1 || number > 65535)
        return shd_fail(error, SHD_CONFIG, address, "ports go from 0 to 65535");
    memcpy(host, start, length);
    host[length] = 0;
    memcpy(port, colon + 1, digits + 1);
    return SHD_OK;
}

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

static shd_status read_unix(const char *address, struct sockaddr_un *place, shd_error *error) {
    const char *path = address + sizeof unix_prefix - 1;
    *place = (struct sockaddr_un){.sun_family = AF_UNIX};
    if (*path != '/' || strlen(path) >= sizeof place->sun_path)
        return shd_fail(error, SHD_CONFIG, address,
                        "not of the form unix:/path, with up to %zu characters of it",
                        sizeof place->sun_path - 1);
    memcpy(place->sun_path, path, strlen(path) + 1);
    return SHD_OK;
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

static shd_status listen_unix(const char *address, int *out, char bound[SHD_ADDRESS_SIZE],
                              shd_error *error) {
    struct sockaddr_un place;
    shd_status status = read_unix(address, &place, error);
    if (status) return status;
    const char *path = place.sun_path;
    if (is_stale(&place)) unlink(path);
    int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    bool is_bound = fd >= 0 && !bind(fd, (const struct sockaddr *)&place, sizeof place);
    if (!is_bound || listen(fd, SOMAXCONN)) {
        status = shd_fail(error, SHD_CONFIG, address, "%s", strerror(errno));
        if (is_bound) unlink(path);
        if (fd >= 0) close(fd);
        return status;
    }
    shd_listen_describe(fd, bound);
    *out = fd;
    return SHD_OK;
}

void shd_listen_remove(const char *bound) {
    if (is_unix(bound)) unlink(bound + sizeof unix_prefix - 1);
}

shd_status shd_listen(const char *address, int *out, char bound[SHD_ADDRESS_SIZE],
                      shd_error *error) {
    if (is_unix(address)) return listen_unix(address, out, bound, error);
    char host[256] = "", port[16] = "";
    shd_status status = split_address(address, host, sizeof host, port, sizeof port, error);
    if (status) return status;

    struct addrinfo hints = {.ai_socktype = SOCK_STREAM, .ai_flags = AI_PASSIVE}, *found;
    int failure = getaddrinfo(*host ? host : NULL, port, &hints, &found);
    if (failure) return shd_fail(error, SHD_CONFIG, address, "%s", gai_strerror(failure));

    int fd = socket(found->ai_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0), on = 1;
    if (fd < 0 || setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on) ||
        bind(fd, found->ai_addr, found->ai_addrlen) || listen(fd, SOMAXCONN)) {
        status = shd_fail(error, SHD_CONFIG, address, "%s", strerror(errno));
        if (fd >= 0) close(fd);
    } else {
        shd_listen_describe(fd, bound);
        *out = fd;
    }
    freeaddrinfo(found);
    return status;
}

static int try_connect(int family, const struct sockaddr *place, socklen_t size, int seconds) {
    const struct timeval patience = {.tv_sec = seconds};
    int fd = socket(family, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (fd < 0) return -1;
    if (!setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience) &&
        !setsockopt(fd, SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof patience) &&
        !connect(fd, place, size))
        return fd;
    const int reason = errno;
    close(fd);
    errno = reason;
    return -1;
}

shd_status shd_connect(const char *address, int seconds, int *out, shd_error *error) {
    int fd = -1;
    if (is_unix(address)) {
        struct sockaddr_un place;
        shd_status status = read_unix(address, &place, error);
        if (status) return status;
        fd = try_connect(AF_UNIX, (const struct sockaddr *)&place, sizeof place, seconds);
    } else {
        char host[256] = "", port[16] = "";
        shd_status status = split_address(address, host, sizeof host, port, sizeof port, error);
        if (status) return status;
        struct addrinfo hints = {.ai_socktype = SOCK_STREAM}, *found;
        int failure = getaddrinfo(*host ? host : NULL, port, &hints, &found);
        if (failure) return shd_fail(error, SHD_CONFIG, address, "%s", gai_strerror(failure));
        for (const struct addrinfo *at = found; at && fd < 0; at = at->ai_next)
            fd = try_connect(at->ai_family, at->ai_addr, at->ai_addrlen, seconds);
        freeaddrinfo(found);
    }
    if (fd < 0) return shd_fail(error, SHD_CONFIG, address, "%s", strerror(errno));
    *out = fd;
    return SHD_OK;
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
