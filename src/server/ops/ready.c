#include "ready.h"

#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#include "server/conn/address.h"

/* Below the 3 s that the image's health check has. */
enum { PATIENCE = 2 };

/* The status, as text; "" if no answer comes. */
static void ask_status(int fd, char status[4]) {
    static const char question[] = "GET /readyz HTTP/1.0\r\n\r\n";
    char line[] = "HTTP/1.1 200";
    const size_t size = sizeof question - 1, length = sizeof line - 1;
    *status = 0;
    if (send(fd, question, size, MSG_NOSIGNAL) != (ssize_t)size) return;
    if (recv(fd, line, length, MSG_WAITALL) != (ssize_t)length) return;
    memcpy(status, line + length - 3, 4);
}

bool shd_ask_ready(const shd_config *config) {
    if (!strcmp(config->admin, "off")) {
        fprintf(stderr, "shaded: --ready asks the admin port, which is off\n");
        return false;
    }
    int fd;
    shd_error error = {0};
    if (shd_connect(config->admin, PATIENCE, &fd, &error)) {
        fprintf(stderr, "shaded: %s: %s\n", error.path, error.text);
        return false;
    }
    char status[4];
    ask_status(fd, status);
    close(fd);
    const bool is_ready = !strcmp(status, "200");
    if (!is_ready)
        fprintf(stderr, "shaded: %s: /readyz: %s\n", config->admin, *status ? status : "no answer");
    return is_ready;
}
