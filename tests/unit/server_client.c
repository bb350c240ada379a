/* Who a request is from, and who is not believed. */
#include <arpa/inet.h>
#include <netinet/in.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <cmocka.h>

#include "server/access/client.h"

typedef union peer {
    struct sockaddr any;
    struct sockaddr_in four;
    struct sockaddr_in6 six;
    struct sockaddr_un local;
} peer;

/* NULL: a unix socket. */
static peer peer_of(const char *address) {
    peer p = {.local = {.sun_family = AF_UNIX}};
    if (!address) return p;
    if (strchr(address, ':')) {
        p.six = (struct sockaddr_in6){.sin6_family = AF_INET6};
        assert_int_equal(inet_pton(AF_INET6, address, &p.six.sin6_addr), 1);
    } else {
        p.four = (struct sockaddr_in){.sin_family = AF_INET};
        assert_int_equal(inet_pton(AF_INET, address, &p.four.sin_addr), 1);
    }
    return p;
}

static shd_networks *networks_of(const char *list) {
    shd_networks *networks = NULL;
    shd_error error = {0};
    assert_int_equal(shd_networks_new(list, &networks, &error), SHD_OK);
    return networks;
}

static void assert_client(const char *address, const char *forwarded, const char *proxies,
                          const char *expected) {
    char client[SHD_CLIENT_SIZE];
    peer p = peer_of(address);
    shd_networks *networks = networks_of(proxies);
    shd_client_of_address(&p.any, forwarded, networks, client);
    assert_string_equal(client, expected);
    shd_networks_drop(networks);
}

static void connections_tell_their_own_address(void **state) {
    (void)state;
    assert_client("192.0.2.7", NULL, "", "192.0.2.7");
    assert_client("::ffff:192.0.2.7", NULL, "", "192.0.2.7");
    assert_client("2001:db8:1:2:3:4:5:6", NULL, "", "2001:db8:1:2::/64");
    assert_client("2001:db8:1:2::9", NULL, "", "2001:db8:1:2::/64");
    assert_client("::1", NULL, "", "::/64");
    assert_client(NULL, NULL, "", "unix");
    char client[SHD_CLIENT_SIZE];
    shd_client_of_address(NULL, "192.0.2.1", NULL, client);
    assert_string_equal(client, "unknown");
}

static void what_unnamed_peers_forward_is_not_believed(void **state) {
    (void)state;
    assert_client("192.0.2.7", "198.51.100.1", "", "192.0.2.7");
    assert_client("192.0.2.7", "198.51.100.1", "192.0.2.8 10.0.0.0/8", "192.0.2.7");
    assert_client(NULL, "198.51.100.1", "127.0.0.1", "unix");
}

static void named_proxies_are_believed_and_nobody_before_them(void **state) {
    (void)state;
    static const char proxies[] = "127.0.0.1, 10.0.0.0/8 2001:db8::/32 unix";
    assert_client("127.0.0.1", "198.51.100.1", proxies, "198.51.100.1");
    assert_client(NULL, "198.51.100.1", proxies, "198.51.100.1");
    assert_client("::ffff:10.9.8.7", "198.51.100.1", proxies, "198.51.100.1");
    assert_client("127.0.0.1", NULL, proxies, "127.0.0.1");
    assert_client("127.0.0.1", "", proxies, "127.0.0.1");
    /* The client sends a field of its own, to which the proxies append. */
    assert_client("127.0.0.1", "203.0.113.5, 198.51.100.1, 10.1.1.1", proxies, "198.51.100.1");
    assert_client("127.0.0.1", "10.0.0.1, 198.51.100.1", proxies, "198.51.100.1");
    assert_client("127.0.0.1", "junk, 10.0.0.1", proxies, "10.0.0.1");
    assert_client("127.0.0.1", "junk", proxies, "127.0.0.1");
    assert_client("127.0.0.1", "198.51.100.1,", proxies, "127.0.0.1");
    assert_client("127.0.0.1", "10.0.0.1,10.0.0.2", proxies, "10.0.0.1");
}

static void entries_may_have_ports_quotes_and_blanks(void **state) {
    (void)state;
    assert_client("10.0.0.1", "\t198.51.100.1 \t,10.0.0.1 ", "10.0.0.1", "198.51.100.1");
    assert_client("10.0.0.1", "198.51.100.1:4711", "10.0.0.1", "198.51.100.1");
    assert_client("10.0.0.1", " \"[2001:db9:1:2::3]:80\" ", "10.0.0.1", "2001:db9:1:2::/64");
    assert_client("10.0.0.1", "2001:db9:1:2::3", "10.0.0.1", "2001:db9:1:2::/64");
    assert_client("10.0.0.1", "::ffff:198.51.100.1", "10.0.0.1", "198.51.100.1");
}

static bool has(const char *list, const char *address) {
    shd_networks *networks = networks_of(list);
    peer p = peer_of(address);
    bool found = shd_networks_have(networks, &p.any);
    shd_networks_drop(networks);
    return found;
}

static void networks_end_where_their_bits_do(void **state) {
    (void)state;
    assert_true(has("10.0.0.0/9", "10.127.255.255"));
    assert_false(has("10.0.0.0/9", "10.128.0.0"));
    assert_true(has("0.0.0.0/0", "203.0.113.1"));
    assert_false(has("0.0.0.0/0", "2001:db8::1"));
    assert_true(has("::/0", "2001:db8::1"));
    assert_true(has("2001:db8::/33", "2001:db8:7fff::"));
    assert_false(has("2001:db8::/33", "2001:db8:8000::"));
    assert_true(has("fe80::1", "fe80::1"));
    assert_false(has("fe80::1", "fe80::2"));
    assert_false(has("127.0.0.1", NULL));
    assert_true(has("unix", NULL));
    assert_false(has("unix", "127.0.0.1"));
    assert_false(shd_networks_have(NULL, NULL));
}

static void what_is_no_network_is_an_error(void **state) {
    (void)state;
    static const char *const bad[] = {"localhost",   "10.0.0.0/33", "10.0.0.0/",    "::/129",
                                      "10.0.0.0/-1", "10.0.0/8",    "127.0.0.1:80", "1/2/3"};
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        shd_networks *networks = NULL;
        shd_error error = {0};
        assert_int_equal(shd_networks_new(bad[i], &networks, &error), SHD_CONFIG);
        assert_non_null(strstr(error.text, bad[i]));
        assert_null(networks);
    }
}

static void tokens_are_told_by_a_hash(void **state) {
    (void)state;
    char client[SHD_CLIENT_SIZE];
    /* printf %s abc | sha256sum */
    shd_client_of_token("", "Bearer  abc", client);
    assert_string_equal(client, "token:ba7816bf8f01cfea");
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(connections_tell_their_own_address),
        cmocka_unit_test(what_unnamed_peers_forward_is_not_believed),
        cmocka_unit_test(named_proxies_are_believed_and_nobody_before_them),
        cmocka_unit_test(entries_may_have_ports_quotes_and_blanks),
        cmocka_unit_test(networks_end_where_their_bits_do),
        cmocka_unit_test(what_is_no_network_is_an_error),
        cmocka_unit_test(tokens_are_told_by_a_hash),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
