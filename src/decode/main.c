/* shaded-decode: reads one picture for the program that starts it, and ends.
 *
 * It is started for each picture, has a socket as its standard input (decode/wire.h), and no other
 * way to anything: before it looks at a byte of the picture behind its first ones, it has given up
 * all files, has limits of memory, processor time and what it may write, and of system calls those
 * that decoding takes (decode/confine.h). */
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "decode/confine.h"
#include "decode/decode.h"

enum { SOCKET = STDIN_FILENO, SECONDS = 30 };

static bool read_whole(void *to, size_t size) {
    for (size_t at = 0; at < size;) {
        const ssize_t got = recv(SOCKET, (char *)to + at, size - at, 0);
        if (got < 0 && errno == EINTR) continue;
        if (got <= 0) return false;
        at += (size_t)got;
    }
    return true;
}

static bool send_whole(const void *from, size_t size) {
    for (size_t at = 0; at < size;) {
        const ssize_t sent = send(SOCKET, (const char *)from + at, size - at, MSG_NOSIGNAL);
        if (sent < 0 && errno == EINTR) continue;
        if (sent <= 0) return false;
        at += (size_t)sent;
    }
    return true;
}

/* Not by exit: nothing of what libraries would do then is wanted. */
static _Noreturn void leave(void) {
    _exit(0);
}

static bool confined; /* by the kernel, since its libraries were loaded */

static void tell(shd_status status, const shd_decoded *picture, const char *text) {
    shd_decode_told told = {
        .abi = sizeof told, .status = (int32_t)status, .picture = *picture, .confined = confined};
    snprintf(told.text, sizeof told.text, "%s", text);
    if (!send_whole(&told, sizeof told)) leave();
}

/* ---- What it may do ---- */

static void set_limit(int resource, rlim_t most) {
    const struct rlimit limit = {most, most};
    setrlimit(resource, &limit);
}

/* Nothing but the socket is open, and what libraries print goes nowhere. */
static bool drop_surroundings(void) {
    int nowhere[2];
    signal(SIGPIPE, SIG_IGN);
    /* The end of the daemon is not that of a picture whose answer it waits for. */
    signal(SIGTERM, SIG_IGN);
    signal(SIGINT, SIG_IGN);
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0);
    set_limit(RLIMIT_CORE, 0);
    set_limit(RLIMIT_CPU, SECONDS);
    if (pipe2(nowhere, O_CLOEXEC)) return false;
    close(nowhere[0]);
    if (dup2(nowhere[1], STDOUT_FILENO) < 0 || dup2(nowhere[1], STDERR_FILENO) < 0) return false;
    syscall(SYS_close_range, STDERR_FILENO + 1, UINT_MAX, 0);
    return true;
}

/* Bytes of memory that is its own now: libraries, and the stacks of threads that they start, which
 * are as many as there are processors. 0: the system does not tell. */
static rlim_t find_own_bytes(void) {
    char line[256];
    unsigned long long kilobytes = 0;
    FILE *file = fopen("/proc/self/status", "re");
    while (file && fgets(line, sizeof line, file))
        if (sscanf(line, "VmData: %llu", &kilobytes) == 1) break;
    if (file) fclose(file);
    return (rlim_t)kilobytes << 10;
}

static rlim_t own_bytes;

/* `is_last`: there is no way to a higher one. Sanitizers map terabytes for themselves. */
static void limit_memory(uint64_t more, bool is_last) {
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
    const rlim_t most = own_bytes ? own_bytes + more : RLIM_INFINITY;
    const struct rlimit limit = {most, is_last ? most : RLIM_INFINITY};
    setrlimit(RLIMIT_DATA, &limit);
#else
    (void)more;
    (void)is_last;
#endif
}

/* Once libraries are loaded: no file can be opened any more, by whatever name, and little else can
 * be done where the kernel sees to that. */
static void drop_rights(void) {
    own_bytes = find_own_bytes();
    set_limit(RLIMIT_NOFILE, 0);
    set_limit(RLIMIT_FSIZE, 0);
    confined = shd_confine();
}

/* ---- The picture ---- */

static shd_oiio_decode_fn *load_oiio(void) {
    void *module = dlopen("shaded_oiio.so", RTLD_NOW | RTLD_LOCAL);
    shd_oiio_open_fn *open_it = NULL;
    shd_oiio_decode_fn *decode = NULL;
    if (module) *(void **)&open_it = dlsym(module, "shd_oiio_open");
    if (open_it && open_it()) *(void **)&decode = dlsym(module, "shd_oiio_decode");
    return decode;
}

/* Says what the head is, and goes on when it is told how far. */
static bool admit(void *context, const shd_decoded *picture) {
    (void)context;
    shd_decode_go go;
    tell(SHD_OK, picture, "");
    if (!read_whole(&go, sizeof go)) leave();
    limit_memory(go.memory, true);
    return true;
}

int main(void) {
    shd_decode_ask ask;
    if (!drop_surroundings() || !read_whole(&ask, sizeof ask) ||
        ask.abi != sizeof(shd_decode_told) || ask.size > SSIZE_MAX)
        leave();
    unsigned char *data = malloc(ask.size ? ask.size : 1);
    if (!data || !read_whole(data, ask.size)) leave();
    const bool takes_oiio = shd_format_takes_oiio(shd_format_sniff(data, ask.size));
    const shd_decoder decoder = {
        .most = ask.most, .oiio = takes_oiio ? load_oiio() : NULL, .admit = admit};
    drop_rights();
    limit_memory(ask.memory, false);

    shd_decoded picture;
    void *samples;
    shd_error error;
    const shd_status status = shd_decode(&decoder, data, ask.size, &picture, &samples, &error);
    tell(status, &picture, status ? error.text : "");
    if (status == SHD_OK)
        send_whole(samples, (size_t)picture.width * (size_t)picture.height * (size_t)picture.count *
                                shd_decoded_sample(picture.depth));
    leave();
}
