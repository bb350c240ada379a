/* The importer's process: what a hostile file does to it ends with it. */
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/installed.h"
#include "import/import.h"

static void limit(int which, rlim_t most) {
    struct rlimit now;
    if (getrlimit((unsigned)which, &now)) return;
    if (now.rlim_max == RLIM_INFINITY || most < now.rlim_max)
        now = (struct rlimit){most, most};
    else
        now.rlim_cur = now.rlim_max;
    setrlimit((unsigned)which, &now);
}

enum { NO_MODULE = 3, NOT_WRITTEN = 4 };

/* The child. Libraries that talk to a terminal talk to nobody. */
static _Noreturn void run_importer(const char *module, const char *path, int descriptor,
                                   const shd_model_limits *limits) {
    const int nowhere = open("/dev/null", O_RDWR | O_CLOEXEC);
    if (nowhere >= 0)
        for (int stream = 0; stream < 3; stream++) dup2(nowhere, stream);
    limit(RLIMIT_CORE, 0);
    limit(RLIMIT_CPU, limits->seconds);
#if !defined(__SANITIZE_ADDRESS__) &&                                                              \
    !defined(__SANITIZE_THREAD__) /* whose shadows are terabytes */
    limit(RLIMIT_AS, limits->memory);
#endif
    limit(RLIMIT_FSIZE, limits->memory);
    signal(SIGALRM, SIG_DFL);
    alarm(5 * limits->seconds);
    void *handle = dlopen(module, RTLD_NOW | RTLD_LOCAL);
    shd_import_fn *write = NULL;
    if (handle) *(void **)&write = dlsym(handle, SHD_IMPORT_ENTRY);
    if (!write) _exit(NO_MODULE);
    _exit(write(path, descriptor) ? 0 : NOT_WRITTEN);
}

/* Why the child ended, if not well. */
static shd_status blame_end(int status, const shd_model_limits *limits, shd_error *error) {
    if (WIFSIGNALED(status)) {
        const int number = WTERMSIG(status);
        if (number == SIGXCPU || number == SIGALRM || number == SIGKILL)
            return shd_fail(error, SHD_SCENE, "", "reading it takes more than %u seconds",
                            limits->seconds);
        return shd_fail(error, SHD_SCENE, "",
                        "assimp ended by signal %d (%s) as it read the file, which is damaged, or "
                        "takes more than %zu MB",
                        number, strsignal(number), limits->memory >> 20);
    }
    if (WEXITSTATUS(status) == NO_MODULE)
        return shd_fail(error, SHD_CONFIG, "", "assimp cannot be loaded");
    if (WEXITSTATUS(status) != 0)
        return shd_fail(error, SHD_EXHAUSTED, "", "there is no room for the model");
    return SHD_OK;
}

/* assimp quotes what it reads, which must not steer a terminal. */
static void make_printable(char *text) {
    for (; *text; text++)
        if ((unsigned char)*text < 0x20 || (unsigned char)*text > 0x7e) *text = '?';
}

/* What the child has written, mapped. */
static shd_status take_model(int descriptor, const shd_model **out, shd_error *error) {
    struct stat file;
    if (fstat(descriptor, &file) || (size_t)file.st_size < sizeof **out)
        return shd_fail(error, SHD_SCENE, "", "the importer has given no answer");
    const size_t size = (size_t)file.st_size;
    void *block = mmap(NULL, size, PROT_READ, MAP_PRIVATE, descriptor, 0);
    if (block == MAP_FAILED) return shd_fail(error, SHD_EXHAUSTED, "", "out of memory");
    const shd_status status = shd_model_check(block, size, error);
    if (status == SHD_OK)
        *out = block;
    else
        munmap(block, size);
    if (status != SHD_OK) make_printable(error->text);
    return status;
}

/* assimp opens what it is told to: a pipe would have no end. */
static shd_status check_file(const char *path, size_t most, shd_error *error) {
    struct stat file;
    if (stat(path, &file)) return shd_fail(error, SHD_SCENE, "", "%s", strerror(errno));
    if (!S_ISREG(file.st_mode)) return shd_fail(error, SHD_SCENE, "", "it is no regular file");
    if ((uint64_t)file.st_size > most)
        return shd_fail(error, SHD_SCENE, "", "it has %llu MB; reading it may take %zu MB",
                        (unsigned long long)file.st_size >> 20, most >> 20);
    return SHD_OK;
}

shd_status shd_model_load(const char *path, const shd_model_limits *limits, const shd_model **out,
                          shd_error *error) {
    char module[PATH_MAX];
    shd_status status = check_file(path, limits->memory, error);
    if (status != SHD_OK) return status;
    if (!shd_find_installed("shaded_import.so", R_OK, module))
        return shd_fail(error, SHD_CONFIG, "",
                        "the importer is not installed: shaded_import.so is missing");
    const int descriptor = memfd_create("model", MFD_CLOEXEC);
    if (descriptor < 0) return shd_fail(error, SHD_EXHAUSTED, "", "%s", strerror(errno));
    const pid_t child = fork();
    if (child == 0) run_importer(module, path, descriptor, limits);
    int ended = 0;
    while (child > 0 && waitpid(child, &ended, 0) < 0 && errno == EINTR) {
    }
    status = child < 0 ? shd_fail(error, SHD_EXHAUSTED, "", "%s", strerror(errno))
                       : blame_end(ended, limits, error);
    if (status == SHD_OK) status = take_model(descriptor, out, error);
    close(descriptor);
    return status;
}

void shd_model_drop(const shd_model *model) {
    if (model) munmap((void *)(uintptr_t)model, model->size);
}
