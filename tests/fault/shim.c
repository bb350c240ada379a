/* Preloaded into the programs: fails allocations, and moves the wall clock, as the test says in
 * a file that both map.
 *
 * With `armed` set, the allocations from number `first` to `last` (from 1, in the order in which
 * the process makes them) fail with ENOMEM, and `seen` counts them all. With `hashes_most` set
 * nothing fails: the hash of each allocation's call stack is written down, so that the test can
 * fail each place once instead of each allocation. A program that has FAULT_MAIN in its environment
 * is armed as main begins: what the dynamic linker and static constructors take is no part of it.
 *
 * With `hold` set, a thread that compresses a PNG or a WebP stays there.
 *
 * It stands before the C library's allocator. A sanitizer's, which must be the first, cannot
 * follow: leaks show in `live`. */
#include <dlfcn.h>
#include <errno.h>
#include <execinfo.h>
#include <fcntl.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/time.h>
#include <time.h>
#include <unistd.h>

enum { DEPTH = 32, WHERE = 8000, HASHES = 1 << 20 };

/* The test has the same layout, in control.py. */
typedef struct control {
    atomic_uint_least64_t armed, seen, first, last, failed, hashes_most;
    atomic_int_least64_t clock_offset; /* seconds, of the wall clock */
    atomic_int_least64_t accept_pause; /* microseconds that each accept takes longer */
    atomic_int_least64_t live;         /* allocations that were not given back */
    atomic_int_least64_t hold;         /* PNGs and WebPs are not compressed as long as it is set */
    atomic_uint_least64_t where_length;
    char where[WHERE]; /* call stack of the first that failed, a line a frame */
    uint64_t hashes[HASHES];
} control;

static control *shared;
static _Thread_local bool inside; /* what runs is ours */

#define NEXT(name) ((__typeof__(&(name)))dlsym(RTLD_NEXT, #name))

/* ---- Who allocates ---- */

typedef struct place {
    const char *file;
    uintptr_t offset;
    const char *symbol;
} place;

static place find_place(void *address) {
    Dl_info info;
    if (!dladdr(address, &info) || !info.dli_fname) return (place){"?", 0, "?"};
    const char *slash = strrchr(info.dli_fname, '/');
    return (place){slash ? slash + 1 : info.dli_fname,
                   (uintptr_t)address - (uintptr_t)info.dli_fbase,
                   info.dli_sname ? info.dli_sname : "?"};
}

static void tell_where(void) {
    void *frames[DEPTH];
    int count = backtrace(frames, DEPTH);
    size_t length = 0;
    for (int i = 2; i < count && length < WHERE - 300; i++) {
        place p = find_place(frames[i]);
        length += (size_t)snprintf(shared->where + length, 300, "%.60s+%#lx %.180s\n", p.file,
                                   (unsigned long)p.offset, p.symbol);
    }
    atomic_store(&shared->where_length, length);
}

/* Does not depend on where the linker has put things. */
static uint64_t hash_stack(void) {
    void *frames[DEPTH];
    int count = backtrace(frames, DEPTH);
    uint64_t hash = 14695981039346656037u;
    for (int i = 2; i < count; i++) {
        Dl_info info = {0};
        uintptr_t base = dladdr(frames[i], &info) ? (uintptr_t)info.dli_fbase : 0;
        hash = (hash ^ ((uintptr_t)frames[i] - base)) * 1099511628211u;
    }
    return hash;
}

static bool is_failing(void) {
    if (inside || !shared || !atomic_load_explicit(&shared->armed, memory_order_relaxed))
        return false;
    inside = true;
    uint64_t number = atomic_fetch_add(&shared->seen, 1) + 1;
    uint64_t most = atomic_load(&shared->hashes_most);
    bool fails =
        !most && number >= atomic_load(&shared->first) && number <= atomic_load(&shared->last);
    if (most && number <= most && number <= HASHES) shared->hashes[number - 1] = hash_stack();
    if (fails && !atomic_fetch_add(&shared->failed, 1)) tell_where();
    inside = false;
    if (fails) errno = ENOMEM;
    return fails;
}

/* ---- Allocations ---- */

/* The C library's own. dlsym would ask for memory itself. */
extern void *__libc_malloc(size_t);
extern void *__libc_calloc(size_t, size_t);
extern void *__libc_realloc(void *, size_t);
extern void *__libc_memalign(size_t, size_t);
extern void __libc_free(void *);

static void *count_in(void *memory) {
    if (memory && shared) atomic_fetch_add_explicit(&shared->live, 1, memory_order_relaxed);
    return memory;
}

void *malloc(size_t size) {
    return is_failing() ? NULL : count_in(__libc_malloc(size));
}

void *calloc(size_t count, size_t size) {
    return is_failing() ? NULL : count_in(__libc_calloc(count, size));
}

void *realloc(void *memory, size_t size) {
    if (is_failing()) return NULL;
    void *moved = __libc_realloc(memory, size);
    return memory ? moved : count_in(moved);
}

void *aligned_alloc(size_t alignment, size_t size) {
    return is_failing() ? NULL : count_in(__libc_memalign(alignment, size));
}

int posix_memalign(void **out, size_t alignment, size_t size) {
    void *memory = is_failing() ? NULL : count_in(__libc_memalign(alignment, size));
    if (memory) *out = memory;
    return memory ? 0 : ENOMEM;
}

void free(void *memory) {
    if (memory && shared) atomic_fetch_sub_explicit(&shared->live, 1, memory_order_relaxed);
    __libc_free(memory);
}

void *mmap(void *at, size_t size, int protection, int flags, int fd, off_t offset) {
    if (flags & MAP_ANONYMOUS && is_failing()) return MAP_FAILED;
    return (void *)syscall(SYS_mmap, at, size, protection, flags, fd, offset);
}

/* ---- The wall clock ---- */

static time_t wall_offset(void) {
    return shared ? (time_t)atomic_load_explicit(&shared->clock_offset, memory_order_relaxed) : 0;
}

int clock_gettime(clockid_t clock, struct timespec *out) {
    static __typeof__(&clock_gettime) next;
    if (!next) next = NEXT(clock_gettime);
    int status = next(clock, out);
    if (!status && (clock == CLOCK_REALTIME || clock == CLOCK_REALTIME_COARSE))
        out->tv_sec += wall_offset();
    return status;
}

time_t time(time_t *out) {
    struct timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    if (out) *out = now.tv_sec;
    return now.tv_sec;
}

int gettimeofday(struct timeval *restrict out, void *restrict zone) {
    (void)zone;
    struct timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    *out = (struct timeval){now.tv_sec, now.tv_nsec / 1000};
    return 0;
}

/* ---- Connections ---- */

int accept4(int fd, struct sockaddr *address, socklen_t *length, int flags) {
    int accepted = (int)syscall(SYS_accept4, fd, address, length, flags);
    if (accepted >= 0 && shared) usleep((useconds_t)atomic_load(&shared->accept_pause));
    return accepted;
}

/* ---- The start ---- */

static void attach(void) {
    const char *path = getenv("FAULT_CONTROL");
    int fd = path ? open(path, O_RDWR | O_CLOEXEC) : -1;
    if (fd < 0) return;
    void *memory = mmap(NULL, sizeof *shared, PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
    close(fd);
    if (memory == MAP_FAILED) return;
    void *frames[2];
    backtrace(frames, 2); /* its first call loads a library */
    shared = memory;
}

static int (*real_main)(int, char **, char **);

static int run_main(int count, char **arguments, char **environment) {
    attach();
    if (shared && getenv("FAULT_MAIN")) atomic_store(&shared->armed, 1);
    return real_main(count, arguments, environment);
}

int __libc_start_main(int (*main)(int, char **, char **), int count, char **arguments,
                      void (*init)(void), void (*fini)(void), void (*loader)(void), void *stack);

int __libc_start_main(int (*main)(int, char **, char **), int count, char **arguments,
                      void (*init)(void), void (*fini)(void), void (*loader)(void), void *stack) {
    real_main = main;
    return NEXT(__libc_start_main)(run_main, count, arguments, init, fini, loader, stack);
}

/* ---- A library's call that does not end ---- */

size_t libdeflate_deflate_compress(void *compressor, const void *in, size_t size, void *out,
                                   size_t room);

size_t libdeflate_deflate_compress(void *compressor, const void *in, size_t size, void *out,
                                   size_t room) {
    while (shared && atomic_load(&shared->hold)) usleep(10000);
    return NEXT(libdeflate_deflate_compress)(compressor, in, size, out, room);
}

int WebPEncode(const void *config, void *picture);

int WebPEncode(const void *config, void *picture) {
    while (shared && atomic_load(&shared->hold)) usleep(10000);
    return NEXT(WebPEncode)(config, picture);
}
