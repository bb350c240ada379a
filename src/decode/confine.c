#include "decode/confine.h"

#include <errno.h>
#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <stddef.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

/* Sanitizers ask the system for more than what they watch does. */
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define IS_WATCHED 1
#else
#define IS_WATCHED 0
#endif

#if defined(__x86_64__)
#define MACHINE AUDIT_ARCH_X86_64
#elif defined(__aarch64__)
#define MACHINE AUDIT_ARCH_AARCH64
#endif

#if defined(MACHINE) && !IS_WATCHED

/* The lower half of an argument, and its upper one: both machines have the lower one first. */
#define LOAD(member) BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(struct seccomp_data, member))
#define LOAD_HIGH(member)                                                                          \
    BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(struct seccomp_data, member) + 4)
#define SKIP_UNLESS(k, n) BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, (k), 0, (n))
#define SKIP_IF(k, n)     BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, (k), (n), 0)
#define SKIP_IF_BIT(k, n) BPF_JUMP(BPF_JMP | BPF_JSET | BPF_K, (k), (n), 0)
#define ANSWER(action)    BPF_STMT(BPF_RET | BPF_K, (action))
#define ALLOW(name)       SKIP_UNLESS(__NR_##name, 1), ANSWER(SECCOMP_RET_ALLOW)

/* To talk over the socket, take and give memory, wait for a thread, know the time, and end. Numbers
 * are of the machine's own calls: those of others (i386, x32) are none of these. Memory is never to
 * be executed. Of limits it may read its own, and set that of its memory. What is not allowed
 * fails, and does not end the process: libraries ask for this and that which they can do without.
 */
static struct sock_filter rules[] = {
    LOAD(arch),
    SKIP_IF(MACHINE, 1),
    ANSWER(SECCOMP_RET_KILL_PROCESS),
    LOAD(nr),
    ALLOW(read),
    ALLOW(write),
    ALLOW(recvfrom),
    ALLOW(sendto),
    ALLOW(brk),
    ALLOW(munmap),
    ALLOW(mremap),
    ALLOW(madvise),
    ALLOW(futex),
    ALLOW(sched_yield),
    ALLOW(clock_gettime),
    ALLOW(rt_sigprocmask),
    ALLOW(rt_sigreturn),
    /* The kernel's own, when a wait that has an end is interrupted: a process that was stopped and
     * goes on would take a refusal for what the wait has said, and libc ends it then. */
    ALLOW(restart_syscall),
    /* A thread that begins or ends just now: without these libc ends the process. */
    ALLOW(rseq),
    ALLOW(set_robust_list),
    ALLOW(exit),
    ALLOW(exit_group),
    SKIP_IF(__NR_mmap, 1),
    SKIP_UNLESS(__NR_mprotect, 4),
    LOAD(args[2]),
    SKIP_IF_BIT(PROT_EXEC, 1),
    ANSWER(SECCOMP_RET_ALLOW),
    ANSWER(SECCOMP_RET_ERRNO | EPERM),
    SKIP_UNLESS(__NR_prlimit64, 9),
    LOAD(args[0]), /* whose: 0 is its own */
    SKIP_UNLESS(0, 7),
    LOAD(args[1]),
    SKIP_IF(RLIMIT_DATA, 4),
    LOAD(args[2]), /* what it is set to: NULL reads it */
    SKIP_UNLESS(0, 3),
    LOAD_HIGH(args[2]),
    SKIP_UNLESS(0, 1),
    ANSWER(SECCOMP_RET_ALLOW),
    ANSWER(SECCOMP_RET_ERRNO | EPERM),
};

bool shd_confine(void) {
    const struct sock_fprog program = {sizeof rules / sizeof *rules, rules};
    /* All threads: libraries have started some. */
    return !syscall(__NR_seccomp, SECCOMP_SET_MODE_FILTER, SECCOMP_FILTER_FLAG_TSYNC, &program);
}

#else

bool shd_confine(void) {
    return false;
}

#endif
