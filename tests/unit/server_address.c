/* Listening sockets that let nobody in any more. */
#include <arpa/inet.h>
#include <errno.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cmocka.h>

#include "server/conn/address.h"

static int listen_somewhere(struct sockaddr_in *address) {
    int fd;
    char bound[SHD_ADDRESS_SIZE];
    shd_error error = {0};
    assert_int_equal(shd_listen("127.0.0.1:0", &fd, bound, &error), SHD_OK);
    socklen_t size = sizeof *address;
    assert_int_equal(getsockname(fd, (struct sockaddr *)address, &size), 0);
    return fd;
}

/* A client's socket; `status` is connect's. */
static int try_to_connect(const struct sockaddr_in *address, int *status) {
    int fd = socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK, 0);
    assert_true(fd >= 0);
    *status = connect(fd, (const struct sockaddr *)address, sizeof *address);
    if (*status) *status = errno;
    return fd;
}

static void exchange_a_byte(int client, int listener) {
    struct pollfd waiting = {.fd = listener, .events = POLLIN};
    char byte = 'x';
    assert_int_equal(send(client, &byte, 1, 0), 1);
    assert_int_equal(poll(&waiting, 1, 60000), 1);
    int accepted = accept(listener, NULL, NULL);
    assert_true(accepted >= 0);
    byte = 0;
    assert_int_equal(recv(accepted, &byte, 1, 0), 1);
    assert_int_equal(byte, 'x');
    close(accepted);
}

static void whoever_has_begun_to_connect_is_let_in_and_nobody_after(void **state) {
    (void)state;
    struct sockaddr_in address;
    int listener = listen_somewhere(&address), status, on = 60;
    int waiting = try_to_connect(&address, &status);
    assert_true(status == 0 || status == EINPROGRESS);
    /* With this the last packet of a handshake is not counted, but the first one with data is. */
    assert_int_equal(setsockopt(listener, IPPROTO_TCP, TCP_DEFER_ACCEPT, &on, sizeof on), 0);
    int beginning = try_to_connect(&address, &status);
    struct pollfd connected = {.fd = beginning, .events = POLLOUT};
    assert_int_equal(poll(&connected, 1, 60000), 1);

    shd_listen_seal(listener);
    int late = try_to_connect(&address, &status);
    assert_int_equal(status, EINPROGRESS);
    exchange_a_byte(waiting, listener);
    assert_false(shd_listen_has_waiting(listener));
    exchange_a_byte(beginning, listener);
    assert_false(shd_listen_has_waiting(listener));
    struct pollfd refused = {.fd = late, .events = POLLOUT};
    assert_int_equal(poll(&refused, 1, 0), 0);
    close(late);
    close(waiting);
    close(beginning);
    close(listener);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(whoever_has_begun_to_connect_is_let_in_and_nobody_after),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
