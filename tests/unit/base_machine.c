/* What a process may have of its machine, in made-up machines: a folder that has /proc and the
 * trees of control groups as they are in containers and outside. */
#include <errno.h>
#include <ftw.h>
#include <math.h>
#include <sched.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>

#include "base/machine.h"

#define MB         (UINT64_C(1) << 20)
#define V2         "0::"
#define V2_AT(top) "30 20 0:27 " top " /sys/fs/cgroup rw,nosuid shared:4 - cgroup2 cgroup2 rw\n"
#define V1_AT(top)                                                                                 \
    "31 20 0:28 " top " /sys/fs/cgroup/memory rw - cgroup cgroup rw,memory\n"                      \
    "32 20 0:29 " top " /sys/fs/cgroup/cpu,cpuacct rw - cgroup cgroup rw,cpu,cpuacct\n"

static char root[64];

static int remove_entry(const char *path, const struct stat *s, int type, struct FTW *walk) {
    (void)s, (void)type, (void)walk;
    return remove(path);
}

static int make_root(void **state) {
    (void)state;
    strcpy(root, "/tmp/shaded-machine-XXXXXX");
    return mkdtemp(root) ? 0 : -1;
}

static int remove_root(void **state) {
    (void)state;
    return nftw(root, remove_entry, 16, FTW_DEPTH | FTW_PHYS);
}

static void put(const char *path, const char *text) {
    char name[512];
    snprintf(name, sizeof name, "%s%s", root, path);
    for (char *slash = name + strlen(root); (slash = strchr(slash + 1, '/'));) {
        *slash = 0;
        assert_true(!mkdir(name, 0755) || errno == EEXIST);
        *slash = '/';
    }
    FILE *file = fopen(name, "w");
    assert_non_null(file);
    fputs(text, file);
    assert_int_equal(fclose(file), 0);
}

static shd_machine look(const char *groups, const char *mounts) {
    put("/proc/meminfo", "MemFree: 9 kB\nMemTotal:       1024000 kB\nMemAvailable: 9 kB\n");
    put("/proc/self/cgroup", groups);
    put("/proc/self/mountinfo", mounts);
    return shd_machine_look(root);
}

static void without_groups_the_machine_is_what_there_is(void **state) {
    (void)state;
    shd_machine m = look("", "");
    assert_int_equal(m.memory, 1000 * MB);
    assert_string_equal(m.memory_source, "/proc/meminfo");
    assert_true(isinf(m.quota));
    assert_string_equal(m.quota_source, "");
    assert_int_equal(shd_machine_threads(&m), m.processors);
    m = shd_machine_look("/nowhere");
    assert_int_equal(m.memory, UINT64_MAX);
    assert_true(m.processors >= 1);
}

/* A container that sees its own tree alone, as with cgroup namespaces. */
static void version_2_with_a_namespace(void **state) {
    (void)state;
    put("/sys/fs/cgroup/memory.max", "268435456\n");
    put("/sys/fs/cgroup/memory.high", "max\n");
    put("/sys/fs/cgroup/cpu.max", "150000 100000\n");
    const shd_machine m = look(V2 "/\n", V2_AT("/"));
    assert_int_equal(m.memory, 256 * MB);
    assert_string_equal(m.memory_source, "/sys/fs/cgroup/memory.max");
    assert_float_equal(m.quota, 1.5, 0);
    assert_string_equal(m.quota_source, "/sys/fs/cgroup/cpu.max");
}

static void the_lowest_limit_of_all_groups_above_counts(void **state) {
    (void)state;
    put("/sys/fs/cgroup/a/b/c/memory.max", "max\n");
    put("/sys/fs/cgroup/a/b/c/cpu.max", "max 100000\n");
    put("/sys/fs/cgroup/a/b/memory.max", "536870912\n");
    put("/sys/fs/cgroup/a/b/memory.high", "134217728\n");
    put("/sys/fs/cgroup/a/b/cpu.max", "50000 100000\n");
    put("/sys/fs/cgroup/a/memory.max", "268435456\n");
    put("/sys/fs/cgroup/a/cpu.max", "25000 100000\n");
    const shd_machine m = look("1:name=systemd:/x\n" V2 "/a/b/c\n", V2_AT("/"));
    assert_int_equal(m.memory, 128 * MB);
    assert_string_equal(m.memory_source, "/sys/fs/cgroup/a/b/memory.high");
    assert_float_equal(m.quota, 0.25, 0);
    assert_string_equal(m.quota_source, "/sys/fs/cgroup/a/cpu.max");
    assert_int_equal(shd_machine_threads(&m), 1);
}

/* The group's path is the host's, of which the container has mounted a part; and one of another
 * process's, which cannot be looked at. */
static void what_is_mounted_is_looked_at(void **state) {
    (void)state;
    put("/sys/fs/cgroup/memory/memory.limit_in_bytes", "134217728\n");
    put("/sys/fs/cgroup/memory/in/memory.limit_in_bytes", "67108864\n");
    put("/sys/fs/cgroup/cpu,cpuacct/cpu.cfs_quota_us", "200000\n");
    put("/sys/fs/cgroup/cpu,cpuacct/cpu.cfs_period_us", "100000\n");
    const char *const paths[] = {"/docker/1f", "/", "/elsewhere", "/docker/1f/../2",
                                 "/docker/1f/in"};
    for (size_t i = 0; i < sizeof paths / sizeof paths[0]; i++) {
        char groups[200];
        snprintf(groups, sizeof groups, "9:cpu,cpuacct:%s\n4:hugetlb,memory:%s\n1:cpuset:/no\n",
                 paths[i], paths[i]);
        const shd_machine m = look(groups, V1_AT("/docker/1f"));
        assert_int_equal(m.memory, (i == 4 ? 64 : 128) * MB);
        assert_float_equal(m.quota, 2, 0);
    }
}

static void unlimited_groups_of_version_1_bound_nothing(void **state) {
    (void)state;
    put("/sys/fs/cgroup/memory/memory.limit_in_bytes", "9223372036854771712\n");
    put("/sys/fs/cgroup/cpu,cpuacct/cpu.cfs_quota_us", "-1\n");
    put("/sys/fs/cgroup/cpu,cpuacct/cpu.cfs_period_us", "100000\n");
    const shd_machine m = look("4:memory:/\n5:cpu,cpuacct:/\n", V1_AT("/"));
    assert_int_equal(m.memory, 1000 * MB);
    assert_true(isinf(m.quota));
}

/* Controllers in version 1 beside a tree of version 2, which has others; the memory's is asked in
 * either. */
static void both_versions_side_by_side(void **state) {
    (void)state;
    put("/sys/fs/cgroup/memory/job/memory.limit_in_bytes", "400000000\n");
    put("/sys/fs/cgroup/cpu,cpuacct/cpu.cfs_quota_us", "300000\n");
    put("/sys/fs/cgroup/cpu,cpuacct/cpu.cfs_period_us", "200000\n");
    put("/sys/fs/cgroup/unified/job/cpu.max", "max\n");
    const shd_machine m =
        look("4:memory:/job\n5:cpu,cpuacct:/\n0::/job\n",
             V1_AT("/") "33 20 0:30 / /sys/fs/cgroup/unified rw - cgroup2 cgroup2 rw\n");
    assert_int_equal(m.memory, 400000000);
    assert_float_equal(m.quota, 1.5, 0);
}

static void mounts_with_blanks_in_their_names(void **state) {
    (void)state;
    put("/sys/fs/c g/memory.max", "134217728\n");
    const shd_machine m = look(V2 "/\n", "30 20 0:27 / /sys/fs/c\\040g rw - cgroup2 cgroup2 rw\n");
    assert_int_equal(m.memory, 128 * MB);
    assert_string_equal(m.memory_source, "/sys/fs/c g/memory.max");
}

static void parts_of_a_processor_count_as_one(void **state) {
    (void)state;
    shd_machine m = {.processors = 4, .quota = INFINITY};
    assert_int_equal(shd_machine_threads(&m), 4);
    m.quota = 0.01;
    assert_int_equal(shd_machine_threads(&m), 1);
    m.quota = 1;
    assert_int_equal(shd_machine_threads(&m), 1);
    m.quota = 1.01;
    assert_int_equal(shd_machine_threads(&m), 2);
    m.quota = 9.5;
    assert_int_equal(shd_machine_threads(&m), 4);
}

static void affinity_is_the_threads_own(void **state) {
    (void)state;
    cpu_set_t all, one;
    assert_int_equal(sched_getaffinity(0, sizeof all, &all), 0);
    int first = 0;
    while (!CPU_ISSET(first, &all)) first++;
    CPU_ZERO(&one);
    CPU_SET(first, &one);
    assert_int_equal(sched_setaffinity(0, sizeof one, &one), 0);
    assert_int_equal(shd_machine_look(root).processors, 1);
    assert_int_equal(sched_setaffinity(0, sizeof all, &all), 0);
    assert_int_equal(shd_machine_look(root).processors, CPU_COUNT(&all));
}

#define IN_ROOT(test) cmocka_unit_test_setup_teardown(test, make_root, remove_root)

int main(void) {
    const struct CMUnitTest tests[] = {
        IN_ROOT(without_groups_the_machine_is_what_there_is),
        IN_ROOT(version_2_with_a_namespace),
        IN_ROOT(the_lowest_limit_of_all_groups_above_counts),
        IN_ROOT(what_is_mounted_is_looked_at),
        IN_ROOT(unlimited_groups_of_version_1_bound_nothing),
        IN_ROOT(both_versions_side_by_side),
        IN_ROOT(mounts_with_blanks_in_their_names),
        cmocka_unit_test(parts_of_a_processor_count_as_one),
        IN_ROOT(affinity_is_the_threads_own),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
