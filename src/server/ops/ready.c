#include "ready.h"

#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#include "server/conn/address.h"

enum { PATIENCE = 2 }; /* seconds, below the 3 that the image's health check has */

bool shd_ask_ready(const shd_config *config) {
    static const char question[] = "GET /readyz HTTP/1.0\r\n\r\n";
    char answer[] = "HTTP/1.1 200";
    const ssize_t asked = sizeof question - 1, length = sizeof answer - 1;
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
    const bool is_answered = send(fd, question, (size_t)asked, MSG_NOSIGNAL) == asked &&
                             recv(fd, answer, (size_t)length, MSG_WAITALL) == length;
    close(fd);
    const char *status = is_answered ? answer + length - 3 : "no answer";
    if (!strcmp(status, "200")) return true;
    fprintf(stderr, "shaded: %s: /readyz: %s\n", config->admin, status);
    return false;
}
