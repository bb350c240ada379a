/* Times requests over HTTP/1.1: client ADDRESS PORT ROUNDS < JOBS (see jobs.h), all on one
 * connection that is kept open. Samples are seconds: "wall" from before the request is sent until
 * its last byte is there, and the daemon's own figures from Server-Timing. A job may say "save", a
 * file for the last picture. */
#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include "jobs.h"

enum { ANSWER_SIZE = 64 << 20 };

static int connection;
static char *answer; /* [ANSWER_SIZE]: head and body of the last one */

static void open_connection(const char *address, const char *port) {
    struct sockaddr_in place = {.sin_family = AF_INET, .sin_port = htons((uint16_t)atoi(port))};
    int yes = 1;
    connection = socket(AF_INET, SOCK_STREAM, 0);
    if (inet_pton(AF_INET, address, &place.sin_addr) != 1 ||
        connect(connection, (struct sockaddr *)&place, sizeof place) ||
        setsockopt(connection, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes))
        quit("cannot connect to", address);
}

static void send_all(const char *data, size_t size) {
    while (size > 0) {
        ssize_t sent = send(connection, data, size, MSG_NOSIGNAL);
        if (sent <= 0) quit("cannot send", "");
        data += sent;
        size -= (size_t)sent;
    }
}

/* The rest of the head's line after `name`, or NULL. */
static const char *header(const char *name) {
    const char *at = strcasestr(answer, name);
    return at ? at + strlen(name) : NULL;
}

/* Reads head and body; returns where the body begins. */
static char *receive(size_t *size) {
    size_t have = 0, want = 0;
    char *body = NULL;
    while (!body || have < want) {
        ssize_t got = recv(connection, answer + have, ANSWER_SIZE - 1 - have, 0);
        if (got <= 0) quit("no answer", "");
        have += (size_t)got;
        answer[have] = 0;
        char *end = body ? NULL : strstr(answer, "\r\n\r\n");
        if (!end) continue;
        *end = 0;
        body = end + 4;
        const char *length = header("\r\nContent-Length:");
        if (!length) quit("an answer without a length:", answer);
        *size = strtoul(length, NULL, 10);
        want = (size_t)(body - answer) + *size;
    }
    return body;
}

/* Server-Timing: queue;dur=0.012, parse;dur=0.034, ... in milliseconds. */
static void add_timings(json_t *samples) {
    const char *at = header("\r\nServer-Timing:");
    while (at && *at) {
        while (*at == ' ' || *at == ',') at++;
        char name[32];
        double duration;
        if (sscanf(at, "%31[a-z];dur=%lf", name, &duration) == 2)
            add_sample(samples, name, 1e-3 * duration);
        at = strpbrk(at, ",\r");
        if (at && *at == '\r') break;
    }
}

static void run(const json_t *job, unsigned serial, json_t *samples) {
    char *text = numbered(job, serial), head[256];
    int length = snprintf(head, sizeof head,
                          "POST /v1/render HTTP/1.1\r\nHost: bench\r\n"
                          "Content-Type: application/json\r\nContent-Length: %zu\r\n\r\n",
                          strlen(text));
    char *request = malloc((size_t)length + strlen(text) + 1);
    if (!request) quit("out of memory", "");
    strcpy(request, head);
    strcat(request, text);

    double began = wall_seconds();
    send_all(request, strlen(request));
    size_t size;
    char *body = receive(&size);
    add_sample(samples, "wall", wall_seconds() - began);
    if (strncmp(answer, "HTTP/1.1 200", 12)) quit("refused:", body);
    add_timings(samples);
    json_object_set_new(samples, "bytes", json_integer((json_int_t)size));
    const char *path = text_of(job, "save", NULL);
    FILE *file = path ? fopen(path, "wb") : NULL;
    if (path && (!file || fwrite(body, 1, size, file) != size || fclose(file)))
        quit("cannot write", path);
    free(request);
    free(text);
}

int main(int argc, char **argv) {
    int rounds = argc == 4 ? atoi(argv[3]) : 0;
    if (rounds < 1) {
        fputs("usage: client ADDRESS PORT ROUNDS < JOBS\n", stderr);
        return 2;
    }
    answer = malloc(ANSWER_SIZE);
    if (!answer) quit("out of memory", "");
    open_connection(argv[1], argv[2]);
    json_t *jobs = read_jobs();
    run_rounds(jobs, rounds, run);
    json_decref(jobs);
    close(connection);
    free(answer);
    return 0;
}
