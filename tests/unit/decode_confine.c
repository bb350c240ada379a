/* What the decoder cannot do once it is confined, tried in a process that is. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>
#include <errno.h>
#include <fcntl.h>
#include <linux/futex.h>
#include <sched.h>
#include <signal.h>
#include <stdbool.h>
#include <stdio.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include "decode/confine.h"

enum { LOOSE = 99 };

/* Ends with the number of the first claim that does not hold, or 0. */
static _Noreturn void try_everything(const int socket_pair[2]) {
    const struct rlimit limit = {1 << 30, 1 << 30};
    struct rlimit was;
    const size_t page = 1 << 16;
    char byte = 1;
    prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0);
    if (!shd_confine()) _exit(LOOSE);
    if (send(socket_pair[0], &byte, 1, 0) != 1 || recv(socket_pair[1], &byte, 1, 0) != 1) _exit(1);
    void *room = mmap(NULL, page, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (room == MAP_FAILED) _exit(2);
    free(malloc(8 << 20));
    if (!mprotect(room, page, PROT_READ | PROT_EXEC) || errno != EPERM) _exit(3);
    if (mmap(NULL, page, PROT_EXEC, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0) != MAP_FAILED) _exit(4);
    if (open("/dev/null", O_RDONLY) >= 0 || errno != EPERM) _exit(5);
    if (socket(AF_INET, SOCK_STREAM, 0) >= 0 || errno != EPERM) _exit(6);
    if (!kill(getppid(), 0) || errno != EPERM) _exit(7);
    if (fork() >= 0 || errno != EPERM) _exit(8);
    if (execl("/bin/true", "true", (char *)NULL) != -1 || errno != EPERM) _exit(9);
    if (!prlimit(getppid(), RLIMIT_CORE, &limit, NULL)) _exit(10);
    if (!prlimit(0, RLIMIT_CORE, &limit, NULL) || errno != EPERM) _exit(11);
    if (prlimit(0, RLIMIT_CORE, NULL, &was) || prlimit(0, RLIMIT_DATA, &limit, NULL)) _exit(13);
    if (!prctl(PR_SET_DUMPABLE, 1, 0, 0, 0) || errno != EPERM) _exit(12);
    _exit(0);
}

/* Waits for nobody, a tenth of a second. Ends with what that says. */
static _Noreturn void wait_confined(int end) {
    static int nobody;
    const struct timespec most = {0, 100000000};
    prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0);
    const bool confined = shd_confine();
    if (send(end, "", 1, 0) != 1) _exit(1);
    const long woken = syscall(SYS_futex, &nobody, FUTEX_WAIT_PRIVATE, 0, &most, NULL, 0);
    _exit(!confined ? LOOSE : woken == -1 ? errno : 0);
}

/* Whether it sleeps. */
static bool is_waiting(pid_t process) {
    char name[64], state = 0;
    snprintf(name, sizeof name, "/proc/%d/stat", (int)process);
    FILE *file = fopen(name, "re");
    if (file && fscanf(file, "%*d %*s %c", &state) != 1) state = 0;
    if (file) fclose(file);
    return state == 'S' || state == 'Z' || !state;
}

static void one_that_is_stopped_goes_on(void **state) {
    (void)state;
    int ends[2], ended;
    char byte;
    assert_int_equal(socketpair(AF_UNIX, SOCK_STREAM, 0, ends), 0);
    const pid_t child = fork();
    if (!child) wait_confined(ends[0]);
    assert_int_equal(recv(ends[1], &byte, 1, 0), 1);
    while (!is_waiting(child)) sched_yield();
    kill(child, SIGSTOP);
    assert_int_equal(waitpid(child, &ended, WUNTRACED), child);
    if (WIFSTOPPED(ended)) {
        kill(child, SIGCONT);
        assert_int_equal(waitpid(child, &ended, 0), child);
    }
    close(ends[0]);
    close(ends[1]);
    assert_true(WIFEXITED(ended));
    if (WEXITSTATUS(ended) == LOOSE) skip();
    assert_int_equal(WEXITSTATUS(ended), ETIMEDOUT);
}

static void nothing_but_decoding_is_left(void **state) {
    (void)state;
    int ends[2], ended;
    assert_int_equal(socketpair(AF_UNIX, SOCK_STREAM, 0, ends), 0);
    const pid_t child = fork();
    if (!child) try_everything(ends);
    assert_int_equal(waitpid(child, &ended, 0), child);
    close(ends[0]);
    close(ends[1]);
    assert_true(WIFEXITED(ended));
    if (WEXITSTATUS(ended) == LOOSE) {
        print_message("seccomp(2) is refused here, or the build is watched by a sanitizer\n");
        skip();
    }
    assert_int_equal(WEXITSTATUS(ended), 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(nothing_but_decoding_is_left),
                                       cmocka_unit_test(one_that_is_stopped_goes_on)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
