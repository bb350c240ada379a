/* The daemon's options: what a value may be, which source wins, and what a restart alone changes.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "server/ops/config.h"

enum { FLAGS_MOST = 8 };

static char message[1024];
static shd_config config;

/* `flags` end with NULL. */
static shd_config_result read_flags(const char *const flags[]) {
    char name[] = "shaded", *argv[FLAGS_MOST + 2] = {name};
    int argc = 1;
    for (; flags[argc - 1]; argc++) argv[argc] = (char *)(size_t)flags[argc - 1];
    *message = 0;
    return shd_config_read(argc, argv, &config, message, sizeof message);
}

static shd_config_result read_flag(const char *flag, const char *value) {
    return read_flags((const char *const[]){flag, value, NULL});
}

/* What a file with this text gives. */
static shd_config_result read_file(const char *text) {
    char path[] = "/tmp/shaded-config-XXXXXX";
    const int fd = mkstemp(path);
    assert_true(fd >= 0);
    assert_int_equal(write(fd, text, strlen(text)), strlen(text));
    close(fd);
    const shd_config_result result = read_flag("--config", path);
    unlink(path);
    return result;
}

static void numbers_are_whole_and_within_their_bounds(void **state) {
    (void)state;
    static const struct {
        const char *flag, *value;
        bool good;
        uint64_t number;
        size_t field;
    } cases[] = {
#define FIELD(name) offsetof(shd_config, name)
        {"--queue", "1", true, 1, FIELD(queue)},
        {"--queue", "0", false, 0, 0},
        {"--queue", "1000000", true, 1000000, FIELD(queue)},
        {"--queue", "1000001", false, 0, 0},
        {"--queue", "007", true, 7, FIELD(queue)},
        {"--queue", "", false, 0, 0},
        {"--queue", " 5", false, 0, 0},
        {"--queue", "5 ", false, 0, 0},
        {"--queue", "+5", false, 0, 0},
        {"--queue", "-5", false, 0, 0},
        {"--queue", "5K", false, 0, 0},
        {"--queue", "0x10", false, 0, 0},
        {"--queue", "1e3", false, 0, 0},
        {"--queue", "18446744073709551621", false, 0, 0}, /* 2^64 + 5 */
        {"--max-body", "1k", true, 1024, FIELD(limits.body)},
        {"--max-body", "3M", true, 3 << 20, FIELD(limits.body)},
        {"--max-body", "1024G", true, UINT64_C(1) << 40, FIELD(limits.body)},
        {"--max-body", "1025G", false, 0, 0},
        {"--max-body", "17179869185G", false, 0, 0}, /* 2^64 + 1 G */
        {"--max-body", "1T", false, 0, 0},
        {"--max-body", "1KB", false, 0, 0},
        {"--max-body", "K", false, 0, 0},
        {"--max-body", "0", false, 0, 0},
        {"--memory", "0", true, 0, FIELD(budget)},
        {"--max-memory", "1M", true, 1 << 20, FIELD(limits.memory)},
        {"--max-memory", "1023K", false, 0, 0},
        {"--drain-time", "0", true, 0, FIELD(drain_time)},
        {"--timeout", "86401", false, 0, 0},
#undef FIELD
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        const bool good = read_flag(cases[i].flag, cases[i].value) == SHD_CONFIG_RUN;
        const char *field = (const char *)&config + cases[i].field;
        if (good == cases[i].good &&
            (!good || *(const uint64_t *)(const void *)field == cases[i].number))
            continue;
        print_error("%s %s: %s\n", cases[i].flag, cases[i].value, message);
        fail();
    }
}

static void texts_and_switches_are_what_they_may_be(void **state) {
    (void)state;
    char long_text[300];
    memset(long_text, 'a', sizeof long_text);
    long_text[255] = 0;
    assert_int_equal(read_flag("--cache-control", long_text), SHD_CONFIG_RUN);
    assert_string_equal(config.cache_control, long_text);
    long_text[255] = 'a';
    long_text[256] = 0;
    assert_int_equal(read_flag("--cache-control", long_text), SHD_CONFIG_BAD_FLAGS);
    assert_int_equal(read_flag("--cache-control", "no-cache\r\nX-Evil: 1"), SHD_CONFIG_BAD_FLAGS);
    assert_int_equal(read_flag("--cache-control", "caf\xc3\xa9"), SHD_CONFIG_BAD_FLAGS);
    assert_int_equal(read_flag("--cache-control", "  "), SHD_CONFIG_BAD_FLAGS);
    assert_int_equal(read_flag("--tokens", ""), SHD_CONFIG_RUN);
    assert_int_equal(read_flag("--log-requests", "off"), SHD_CONFIG_RUN);
    assert_false(config.log_requests);
    assert_int_equal(read_flag("--log-requests", "no"), SHD_CONFIG_BAD_FLAGS);
    assert_int_equal(read_flag("--log-requests", "ON"), SHD_CONFIG_BAD_FLAGS);
}

static void flags_that_are_none_are_refused(void **state) {
    (void)state;
    assert_int_equal(read_flag("--queues", "5"), SHD_CONFIG_BAD_FLAGS);
    assert_non_null(strstr(message, "--queues"));
    assert_int_equal(read_flags((const char *const[]){"--queue", NULL}), SHD_CONFIG_BAD_FLAGS);
    assert_int_equal(read_flags((const char *const[]){"-q", NULL}), SHD_CONFIG_BAD_FLAGS);
    assert_non_null(strstr(message, "-q"));
    assert_int_equal(read_flags((const char *const[]){"scene.json", NULL}), SHD_CONFIG_BAD_FLAGS);
    assert_int_equal(read_flags((const char *const[]){"--ready", "--queue", "9", NULL}),
                     SHD_CONFIG_READY);
    assert_int_equal(config.queue, 9);
}

static void addresses_add_up_and_other_flags_replace(void **state) {
    (void)state;
    assert_int_equal(read_flags((const char *const[]){"--listen", "a:1", "--listen", "b:2",
                                                      "--listen", "c:3", NULL}),
                     SHD_CONFIG_RUN);
    assert_string_equal(config.listen, "a:1 b:2 c:3");
    assert_int_equal(read_flags((const char *const[]){"--admin", "a:1", "--admin", "off", NULL}),
                     SHD_CONFIG_RUN);
    assert_string_equal(config.admin, "off");
    char half[700];
    memset(half, 'x', sizeof half);
    half[sizeof half - 1] = 0;
    assert_int_equal(read_flags((const char *const[]){"--listen", half, "--listen", half, NULL}),
                     SHD_CONFIG_BAD_FLAGS);
}

static void flags_win_over_the_environment_and_that_over_the_file(void **state) {
    (void)state;
    static const char file[] = "queue = 11\nmax-lights = 12\ntimeout = 13\n";
    setenv("SHADED_MAX_LIGHTS", "22", 1);
    setenv("SHADED_TIMEOUT", "", 1); /* as if it were not there */
    assert_int_equal(read_file(file), SHD_CONFIG_RUN);
    assert_int_equal(config.queue, 11);
    assert_int_equal(config.limits.lights, 22);
    assert_int_equal(config.timeout, 13);
    assert_int_equal(read_flag("--max-lights", "33"), SHD_CONFIG_RUN);
    assert_int_equal(config.limits.lights, 33);
    setenv("SHADED_MAX_LIGHTS", "many", 1);
    assert_int_equal(read_flag("--max-lights", "33"), SHD_CONFIG_BAD);
    assert_non_null(strstr(message, "SHADED_MAX_LIGHTS"));
    unsetenv("SHADED_MAX_LIGHTS");
    unsetenv("SHADED_TIMEOUT");
}

static void lines_of_the_file_are_read_whole_or_refused(void **state) {
    (void)state;
    char line[400];
    static const struct {
        const char *text, *wrong; /* NULL: nothing */
        uint64_t queue;
    } cases[] = {
        {"queue=5", NULL, 5},
        {"\xef\xbb\xbfqueue = 5\n", NULL, 5}, /* libinih leaves a byte order mark out */
        {"  queue = 5\n", NULL, 5},
        {"# queue = 4\n; queue = 3\n\nqueue = 5\r\n", NULL, 5},
        {"queue = 4\nqueue = 5\n", NULL, 5},
        {"listen = a:1\n  queue = 6\n", NULL, 6}, /* indented, and no more of the value before */
        {"queue = 5 ; as many as that\n", NULL, 5},
        {"queue: 5\n", NULL, 5},
        {"queue\n", ":1:", 0},
        {"\n\nqueue = x\n", ":3: queue: 'x' is not", 0},
        {"[daemon]\nqueue = 5\n", ":2: there are no sections: '[daemon]'", 0},
        {"Queue = 5\n", ":1: unknown key 'Queue'", 0},
        {"queue = 0\nqueues = 1\n", ":1: queue: '0'", 0},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        const shd_config_result result = read_file(cases[i].text);
        if (cases[i].wrong ? result == SHD_CONFIG_BAD && strstr(message, cases[i].wrong)
                           : result == SHD_CONFIG_RUN && config.queue == cases[i].queue)
            continue;
        print_error("%s: %s\n", cases[i].text, message);
        fail();
    }
    /* 198 characters are one line; the tail of a longer one is no line of its own. */
    for (int length = 198; length <= 199; length++) {
        snprintf(line, sizeof line, "#%*s\nqueue = 5\n", length - 1, "queue = 6");
        assert_int_equal(read_file(line), length == 198 ? SHD_CONFIG_RUN : SHD_CONFIG_BAD);
        if (length == 198) assert_int_equal(config.queue, 5);
    }
    assert_non_null(strstr(message, "longer than 198"));
    assert_int_equal(read_flag("--config", "/tmp"), SHD_CONFIG_BAD);
    assert_int_equal(read_flag("--config", "/tmp/there/is/none"), SHD_CONFIG_BAD);
}

static void what_a_restart_alone_changes_is_kept_and_named(void **state) {
    (void)state;
    const shd_config running = shd_config_defaults();
    char names[64];
    shd_config next = running;
    next.timeout = 77;
    assert_false(shd_config_keep(&next, &running, names, sizeof names));
    assert_int_equal(next.timeout, 77);
    next.queue = 78;
    strcpy(next.listen, "127.0.0.1:1");
    assert_true(shd_config_keep(&next, &running, names, sizeof names));
    assert_string_equal(names, "listen, queue");
    assert_int_equal(next.queue, running.queue);
    assert_string_equal(next.listen, running.listen);
    assert_int_equal(next.timeout, 77);
    /* What stands behind a text's end is no change. */
    next = running;
    next.listen[sizeof next.listen - 1] = 'x';
    assert_false(shd_config_keep(&next, &running, names, sizeof names));
    /* Names that do not fit are cut, but all is kept. */
    next.queue = 78;
    strcpy(next.listen, "127.0.0.1:1");
    assert_true(shd_config_keep(&next, &running, names, 5));
    assert_string_equal(names, "list");
    assert_int_equal(next.queue, running.queue);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(numbers_are_whole_and_within_their_bounds),
        cmocka_unit_test(texts_and_switches_are_what_they_may_be),
        cmocka_unit_test(flags_that_are_none_are_refused),
        cmocka_unit_test(addresses_add_up_and_other_flags_replace),
        cmocka_unit_test(flags_win_over_the_environment_and_that_over_the_file),
        cmocka_unit_test(lines_of_the_file_are_read_whole_or_refused),
        cmocka_unit_test(what_a_restart_alone_changes_is_kept_and_named),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
