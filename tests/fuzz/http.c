/* The daemon's HTTP layer, as bytes on a connection: everything of the daemon runs but main(), in
 * this process, behind a socket that needs no port. */
#include <errno.h>
#include <linux/sockios.h>
#include <sched.h>
#include <signal.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <sys/un.h>
#include <unistd.h>

#include "fuzz.h"
#include "server/conn/http.h"
#include "server/conn/linger.h"
#include "server/jobs/work.h"
#include "server/ops/settings.h"
#include "server/server.h"

static shd_server server;
static struct MHD_Daemon *daemon_of_server;
static struct sockaddr_un address;
static socklen_t address_size;

static int open_socket(void) {
    int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    CHECK(fd >= 0);
    return fd;
}

static void stop(void) {
    shd_http_stop(&server, daemon_of_server);
    shd_reaper_drop(server.reaper);
    shd_linger_drop(server.linger);
    shd_engine_drop(server.engine);
    shd_jobs_drop(server.jobs);
    shd_cache_drop(server.cache);
    shd_settings_drop(server.settings);
}

/* As main.c does it, with limits that keep answers quick. */
static void start(void) {
    signal(SIGPIPE, SIG_IGN);
    pthread_mutex_init(&server.settings_mutex, NULL);
    shd_config *config = &server.config;
    *config = shd_config_defaults();
    config->threads = 1;
    config->limits.pixels = config->limits.samples = 64;
    config->limits.lights = config->limits.objects = 8;
    config->limits.triangles = 200;
    config->limits.body = 4096;
    config->limits.memory = 16 << 20;
    config->reuse = 1 << 20;
    config->response_cache = 1 << 16;
    config->connections = 16;
    config->log_requests = false;
    strcpy(config->cors_origins, "https://a.example http://b.example:8080");
    const shd_patience patience = {.head = 5, .body = 5, .send = 5, .connections = 16};
    shd_engine_options options = shd_settings_engine(config);

    /* Linux finds a name of its own for a socket that is bound to none. */
    int fd = open_socket();
    address.sun_family = AF_UNIX;
    CHECK(!bind(fd, (struct sockaddr *)&address, sizeof(sa_family_t)) && !listen(fd, 16));
    address_size = sizeof address;
    CHECK(!getsockname(fd, (struct sockaddr *)&address, &address_size));

    shd_error error;
    CHECK(!shd_engine_new(&options, &server.engine, &error));
    CHECK(!shd_settings_new(config, server.engine, false, NULL, &server.settings, &error));
    CHECK(!shd_cache_new(config->response_cache, NULL, &server.cache, &error));
    CHECK(!shd_server_start_jobs(&server, &error));
    CHECK(!shd_linger_new(&server.linger, &error));
    CHECK(!shd_reaper_new(&patience, &shd_exchange_departure, &server.reaper, &error));
    CHECK(!shd_http_start(&server, fd, &daemon_of_server, &error));
    atexit(stop);
}

/* Sends the bytes and the end of them; the answers up to the end of the connection. */
static char *exchange(const uint8_t *data, size_t size, size_t *length) {
    const struct timeval patience = {.tv_sec = 20};
    int fd = open_socket();
    CHECK(!setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience));
    CHECK(!connect(fd, (struct sockaddr *)&address, address_size));
    /* A connection may be closed before it has taken everything. */
    for (size_t sent = 0; sent < size;) {
        ssize_t took = send(fd, data + sent, size - sent, MSG_NOSIGNAL);
        if (took < 0 && errno != EINTR) break; /* libFuzzer's alarm interrupts */
        if (took > 0) sent += (size_t)took;
    }
    /* libmicrohttpd does not tell an end from the bytes that it comes with, and the daemon sees it
     * later: once everything is taken the end comes alone. */
    int left = 1;
    for (int i = 0; i < 2000 && left && !ioctl(fd, SIOCOUTQ, &left); i++) sched_yield();
    shutdown(fd, SHUT_WR);

    size_t capacity = 1 << 16;
    char *answers = malloc(capacity);
    CHECK(answers);
    *length = 0;
    for (;;) {
        if (*length == capacity) CHECK(answers = realloc(answers, capacity *= 2));
        ssize_t got = recv(fd, answers + *length, capacity - *length, 0);
        if (got < 0 && errno == EINTR) continue;
        CHECK(got >= 0 || errno == ECONNRESET); /* else it hangs */
        if (got <= 0) break;
        *length += (size_t)got;
    }
    close(fd);
    return answers;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    if (!daemon_of_server) start();
    size_t length;
    char *answers = exchange(data, size, &length);
    if (length) CHECK(length > 12 && !memcmp(answers, "HTTP/1.", 7));
    if (length) CHECK(memcmp(answers + 9, "500", 3) != 0);
    free(answers);
    /* What this input did belongs to it: the next one waits for its end. */
    while (atomic_load(&server.in_flight)) sched_yield();
    return 0;
}
