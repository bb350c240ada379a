#include "assets/decoder.h"

#include <errno.h>
#include <poll.h>
#include <pthread.h>
#include <signal.h>
#include <spawn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/installed.h"

extern char **environ;

/* What a library may take before there is a pixel, and then beside the samples: OpenImageIO asks
 * for 64 MB whatever it reads, and hardly touches them. Decoding may take so many copies of the
 * samples: progressive JPEG has as many coefficients, in 16 bits, and TIFF may be one strip. */
static const uint64_t head_most = 64 << 20, rest_most = 160 << 20, copies_most = 4;

/* What is counted as its memory: libraries, and copies. */
static const uint64_t small_libraries = 8 << 20, large_libraries = 64 << 20, copies = 3;

/* Seconds from its start to its end, and how often it is looked whether the work is cancelled. */
static const double seconds_most = 30;
enum { TICK = 20 /* ms */ };

/* Written once, under pthread_once. */
static pthread_once_t find_once = PTHREAD_ONCE_INIT;
static char program_path[PATH_MAX];

static void find_program(void) {
    shd_find_installed("shaded-decode", X_OK, program_path);
}

typedef struct child {
    const shd_decode_job *job;
    pid_t process;
    int socket;
    double until;
} child;

/* ---- The process ---- */

/* What dynamic loading and sanitizers look at; and that OpenImageIO starts no thread for each
 * processor, nor do numeric libraries, which it loads and nobody calls here. */
enum { VARIABLES = 16 };

static void choose_environment(char *out[VARIABLES]) {
    static char single[] = "OPENBLAS_NUM_THREADS=1", alone[] = "OMP_NUM_THREADS=1",
                no_pool[] = "OPENIMAGEIO_THREADS=1", arenas[] = "MALLOC_ARENA_MAX=1";
    static const char *const kept[] = {
        "LD_LIBRARY_PATH=", "ASAN_OPTIONS=", "UBSAN_OPTIONS=", "TSAN_OPTIONS=", "LSAN_OPTIONS="};
    size_t count = 0;
    out[count++] = single;
    out[count++] = alone;
    out[count++] = no_pool;
    out[count++] = arenas;
    for (char **variable = environ; *variable; variable++)
        for (size_t i = 0; i < sizeof kept / sizeof *kept; i++)
            if (!strncmp(*variable, kept[i], strlen(kept[i])) && count < VARIABLES - 1)
                out[count++] = *variable;
    out[count] = NULL;
}

static int spawn(pid_t *process, int end) {
    static char name[] = "shaded-decode";
    char *const words[] = {name, NULL};
    char *variables[VARIABLES];
    posix_spawn_file_actions_t actions;
    posix_spawnattr_t attributes;
    sigset_t none;
    choose_environment(variables);
    sigemptyset(&none);
    if (posix_spawn_file_actions_init(&actions)) return ENOMEM;
    if (posix_spawnattr_init(&attributes)) {
        posix_spawn_file_actions_destroy(&actions);
        return ENOMEM;
    }
    int failed = posix_spawn_file_actions_adddup2(&actions, end, STDIN_FILENO);
    posix_spawnattr_setsigmask(&attributes, &none);
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK);
    if (!failed)
        failed = posix_spawn(process, program_path, &actions, &attributes, words, variables);
    posix_spawnattr_destroy(&attributes);
    posix_spawn_file_actions_destroy(&actions);
    return failed;
}

static shd_status start(const shd_decode_job *job, child *out, shd_error *error) {
    int ends[2];
    pthread_once(&find_once, find_program);
    if (!*program_path)
        return shd_fail(error, SHD_INTERNAL, "", "pictures are not read: no shaded-decode here");
    if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends))
        return shd_fail(error, SHD_EXHAUSTED, "", "no socket to shaded-decode: %s",
                        strerror(errno));
    *out = (child){.job = job, .socket = ends[0], .until = shd_now() + seconds_most};
    const int failed = spawn(&out->process, ends[1]);
    close(ends[1]);
    if (!failed) return SHD_OK;
    close(ends[0]);
    return shd_fail(error, failed == ENOMEM || failed == EAGAIN ? SHD_EXHAUSTED : SHD_INTERNAL, "",
                    "shaded-decode could not be started: %s", strerror(failed));
}

/* However far it has come. */
static void stop(const child *c) {
    close(c->socket);
    kill(c->process, SIGKILL);
    while (waitpid(c->process, NULL, 0) < 0 && errno == EINTR) continue;
}

/* ---- What is said ---- */

static shd_status wait_for(const child *c, short events, shd_error *error) {
    for (;;) {
        struct pollfd at = {.fd = c->socket, .events = events};
        if (shd_is_cancelled(c->job->cancelled))
            return shd_fail(error, SHD_CANCELLED, "", "the work was cancelled");
        if (shd_now() >= c->until)
            return shd_fail(error, SHD_LIMIT, "", "decoding it takes more than %.0f seconds",
                            seconds_most);
        if (poll(&at, 1, TICK) > 0) return SHD_OK;
    }
}

/* It ends without a word if it has no memory for the file, or its processor time is over; and a
 * library that has been led astray ends it, too. */
static shd_status fail_silent(shd_error *error) {
    return shd_fail(error, SHD_SCENE, "", "the picture cannot be read: its decoder gave up");
}

static shd_status say(const child *c, const void *from, size_t size, shd_error *error) {
    for (size_t at = 0; at < size;) {
        const shd_status status = wait_for(c, POLLOUT, error);
        if (status != SHD_OK) return status;
        const ssize_t sent =
            send(c->socket, (const char *)from + at, size - at, MSG_NOSIGNAL | MSG_DONTWAIT);
        if (sent > 0)
            at += (size_t)sent;
        else if (errno != EINTR && errno != EAGAIN)
            return fail_silent(error);
    }
    return SHD_OK;
}

static shd_status hear(const child *c, void *to, size_t size, shd_error *error) {
    for (size_t at = 0; at < size;) {
        const shd_status status = wait_for(c, POLLIN, error);
        if (status != SHD_OK) return status;
        const ssize_t got = recv(c->socket, (char *)to + at, size - at, MSG_DONTWAIT);
        if (got > 0)
            at += (size_t)got;
        else if (!got || (errno != EINTR && errno != EAGAIN))
            return fail_silent(error);
    }
    return SHD_OK;
}

/* One sentence without control characters, whatever came. */
static void clean_text(char text[], size_t size) {
    text[size - 1] = 0;
    for (char *c = text; *c; c++)
        if ((unsigned char)*c < 0x20 || *c == 0x7f) *c = ' ';
    for (char *c = text; *c; c++)
        if ((unsigned char)*c > 0x7f) *c = '?';
}

static bool is_sound(const shd_decoded *p, size_t most) {
    return p->width >= 1 && p->height >= 1 && p->count >= 1 && p->count <= 4 &&
           (p->alpha == 0 || p->alpha == 1) && (p->associated == 0 || p->associated == 1) &&
           (p->count - p->alpha == 1 || p->count - p->alpha == 3) &&
           (p->depth == SHD_U8 || p->depth == SHD_U16 || p->depth == SHD_FLOAT) &&
           (size_t)p->width <= most / (size_t)p->height;
}

/* The next word of the process, whose status becomes ours. */
static shd_status hear_told(const child *c, shd_decode_told *told, shd_error *error) {
    const shd_status status = hear(c, told, sizeof *told, error);
    if (status != SHD_OK) return status;
    if (told->abi != sizeof *told)
        return shd_fail(error, SHD_INTERNAL, "", "shaded-decode is of another build");
    if (!told->confined && c->job->loose) atomic_store(c->job->loose, true);
    clean_text(told->text, sizeof told->text);
    if (told->status == SHD_OK)
        return is_sound(&told->picture, c->job->most) ? SHD_OK : fail_silent(error);
    if (told->status == SHD_LIMIT) {
        shd_fail(error, SHD_LIMIT, "", "%s", told->text);
        return shd_fail_limit(error, SHD_LIMIT_PIXELS);
    }
    if (told->status == SHD_EXHAUSTED) {
        shd_fail(error, SHD_LIMIT, "", "decoding it takes more memory than there is for it");
        return shd_fail_limit(error, SHD_LIMIT_MEMORY);
    }
    return shd_fail(error, SHD_SCENE, "", "%s", told->text);
}

/* ---- The whole ---- */

static shd_status take_memory(const shd_decode_job *job, uint64_t bytes, shd_error *error) {
    if (bytes > shd_budget_most(job->budget)) {
        shd_fail(error, SHD_LIMIT, "",
                 "decoding it may take %llu bytes; the limit `memory` of the process leaves %llu",
                 (unsigned long long)bytes, (unsigned long long)shd_budget_most(job->budget));
        return shd_fail_limit(error, SHD_LIMIT_MEMORY);
    }
    return shd_budget_take(job->budget, bytes)
               ? SHD_OK
               : shd_fail(error, SHD_CROWDED, "",
                          "other requests have the memory that decoding takes");
}

static shd_status hear_samples(const child *c, const shd_decoded *picture, uint64_t *taken,
                               shd_error *error) {
    const shd_decode_job *job = c->job;
    const size_t bytes = (size_t)picture->width * (size_t)picture->height * (size_t)picture->count *
                         shd_decoded_sample(picture->depth);
    const shd_decode_go go = {.memory = job->size + rest_most + copies_most * bytes};
    shd_decode_told told;
    void *room = job->room(job->context, picture, bytes, error);
    if (!room) return error->status;
    shd_status status = take_memory(job, copies * bytes, error);
    if (status != SHD_OK) return status;
    *taken += copies * bytes;
    if (status == SHD_OK) status = say(c, &go, sizeof go, error);
    if (status == SHD_OK) status = hear_told(c, &told, error);
    if (status == SHD_OK && memcmp(&told.picture, picture, sizeof *picture))
        status = fail_silent(error);
    return status == SHD_OK ? hear(c, room, bytes, error) : status;
}

static shd_status talk(const child *c, shd_decoded *out, uint64_t *taken, shd_error *error) {
    const shd_decode_job *job = c->job;
    const shd_decode_ask ask = {.abi = sizeof(shd_decode_told),
                                .size = job->size,
                                .most = job->most,
                                .memory = job->size + head_most};
    shd_decode_told told;
    shd_status status = say(c, &ask, sizeof ask, error);
    if (status == SHD_OK) status = say(c, job->data, job->size, error);
    if (status == SHD_OK) status = hear_told(c, &told, error);
    if (status == SHD_OK) status = hear_samples(c, &told.picture, taken, error);
    if (status == SHD_OK) *out = told.picture;
    return status;
}

shd_status shd_decode_file(const shd_decode_job *job, shd_decoded *out, shd_error *error) {
    shd_error here;
    if (!error) error = &here;
    child c;
    const shd_format format = shd_format_sniff(job->data, job->size);
    uint64_t taken =
        job->size + (shd_format_takes_oiio(format) ? large_libraries : small_libraries);
    shd_status status = take_memory(job, taken, error);
    if (status != SHD_OK) return status;
    status = start(job, &c, error);
    if (status == SHD_OK) {
        status = talk(&c, out, &taken, error);
        stop(&c);
    }
    shd_budget_give(job->budget, taken);
    return status;
}
