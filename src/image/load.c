#include "image/load.h"

#include <dlfcn.h>
#include <fcntl.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/installed.h"
#include "image/image.h"

static const char module_name[] = "shaded_oiio.so";

/* Written once, under pthread_once, and constant from then on. */
static pthread_once_t find_once = PTHREAD_ONCE_INIT;
static char module_path[PATH_MAX]; /* of the module; "": it is not installed */
static pthread_mutex_t load_mutex = PTHREAD_MUTEX_INITIALIZER;
static pthread_cond_t load_ended = PTHREAD_COND_INITIALIZER;
/* Under the mutex, each written to true once. */
static _Atomic(shd_oiio_encode_fn *) loaded;
static atomic_bool incomplete; /* it, or one of its libraries, cannot be loaded */
static bool counted;           /* a budget has what it takes */
/* Under the mutex. */
static bool loading, counting; /* a thread is at it */
static unsigned waiting;       /* threads, for `loader` */
static pthread_t loader;
static bool loader_ended;    /* and whoever waits joins it */
static shd_error load_error; /* of the last time; its status may be SHD_OK */

static void find_module(void) {
    if (!shd_find_installed(module_name, R_OK, module_path)) *module_path = 0;
}

bool shd_image_writes(shd_format format) {
    if (!shd_format_takes_oiio(format)) return true;
    pthread_once(&find_once, find_module);
    return *module_path && !atomic_load(&incomplete);
}

static bool has_addresses(size_t size, int protection, int flags) {
    void *there = mmap(NULL, size, protection, MAP_PRIVATE | MAP_ANONYMOUS | flags, -1, 0);
    return there != MAP_FAILED && !munmap(there, size);
}

/* Some of its 260 libraries allocate in static constructors, and what these throw ends the process:
 * so it is asked before whether there is room. Loading takes 460 MB of addresses and 110 MB of
 * memory on Debian 12. */
static bool has_room(void) {
    enum { ADDRESSES = 640 << 20, MEMORY = 160 << 20 };
    const int descriptor = open("/", O_PATH | O_CLOEXEC);
    return descriptor >= 0 && !close(descriptor) &&
           has_addresses(ADDRESSES, PROT_NONE, MAP_NORESERVE) &&
           has_addresses(MEMORY, PROT_READ | PROT_WRITE, 0);
}

/* The module's encoder; NULL, with the reason. */
static shd_oiio_encode_fn *open_module(const char **why) {
    void *module = dlopen(module_path, RTLD_NOW | RTLD_LOCAL);
    /* POSIX's way from an object pointer to a function pointer, without a cast that ISO C lacks. */
    shd_oiio_open_fn *open = NULL;
    if (module) *(void **)&open = dlsym(module, "shd_oiio_open");
    const char *words = open ? "out of memory" : dlerror();
    *why = words ? words : "it is not a module";
    return open ? open() : NULL;
}

/* The module is never closed: its libraries start threads and register themselves in places that do
 * not forget. */
static void load_module(shd_error *error) {
    /* dlopen tells its reasons in words only. What fails twice, though there is room for it before
     * and after, is not there or broken, and stays so. */
    const char *why = "";
    shd_oiio_encode_fn *encode = NULL;
    bool room = has_room();
    for (int attempt = 0; attempt < 2 && room && !encode; attempt++) {
        encode = open_module(&why);
        room = encode || has_room();
    }
    atomic_store(&loaded, encode);
    atomic_store(&incomplete, room && !encode);
    if (!room)
        shd_fail(error, SHD_EXHAUSTED, "", "there is no room to load OpenImageIO");
    else if (!encode)
        shd_fail(error, SHD_SCENE, "", "OpenImageIO is not installed: %s", why);
}

static void *load_in_thread(void *nothing) {
    shd_error error = {.status = SHD_OK};
    load_module(&error);
    pthread_mutex_lock(&load_mutex);
    load_error = error;
    loading = false;
    if (waiting)
        loader_ended = true;
    else
        pthread_detach(pthread_self());
    pthread_cond_broadcast(&load_ended);
    pthread_mutex_unlock(&load_mutex);
    return nothing;
}

/* With the mutex held, which is free while this waits, for some time or until `load_ended`. */
static void wait_some(void) {
    const struct timespec until = shd_timespec(shd_now() + 0.01);
    pthread_cond_clockwait(&load_ended, &load_mutex, CLOCK_MONOTONIC, &until);
}

/* With the mutex held. Loading takes 0.3 s and cannot be interrupted: a thread does it, which goes
 * on when all who waited for it have left. It is joined if one is left, so that a process that ends
 * right after its picture does not meet a thread whose storage is half freed. */
static shd_status load_aside(const atomic_bool *cancelled, shd_error *error) {
    if (atomic_load(&loaded)) return SHD_OK;
    if (!shd_image_writes(SHD_EXR))
        return shd_fail(error, SHD_SCENE, "", "OpenImageIO is not installed: %s is missing",
                        *module_path ? "a library" : module_name);
    if (!loading && !(loading = !pthread_create(&loader, NULL, load_in_thread, NULL)))
        return shd_fail(error, SHD_EXHAUSTED, "", "there is no thread to load OpenImageIO");
    waiting++;
    while (loading && !shd_is_cancelled(cancelled)) wait_some();
    waiting--;
    if (loading) return shd_fail(error, SHD_CANCELLED, "", "the render was cancelled");
    if (loader_ended) pthread_join(loader, NULL);
    loader_ended = false;
    if (load_error.status) *error = load_error;
    return load_error.status;
}

shd_status shd_oiio_load(shd_oiio_encode_fn **out, shd_error *error) {
    pthread_mutex_lock(&load_mutex);
    shd_status status = load_aside(NULL, error);
    pthread_mutex_unlock(&load_mutex);
    if (status == SHD_OK) *out = atomic_load(&loaded);
    return status;
}

shd_status shd_oiio_read_file(shd_oiio_file *file, shd_error *error) {
    shd_oiio_encode_fn *encode;
    char text[256] = "";
    const shd_status status = shd_oiio_load(&encode, error);
    if (status != SHD_OK) return status;
    void *module = dlopen(module_path, RTLD_NOW | RTLD_NOLOAD);
    shd_oiio_read_fn *read = NULL;
    if (module) *(void **)&read = dlsym(module, "shd_oiio_read");
    if (!read) return shd_fail(error, SHD_CONFIG, "", "the module is of another build");
    file->abi = sizeof *file;
    const int failed = read(file, text, sizeof text);
    if (!failed) return SHD_OK;
    return failed == 1 ? shd_fail(error, SHD_EXHAUSTED, "", "out of memory")
                       : shd_fail(error, SHD_SCENE, "", "%s", text);
}

/* With the mutex held. The module takes 127 MB, by VmRSS on Debian 12. 52 of these are its own, and
 * the rest are files, whose pages the system takes back if memory is short. */
static shd_status load_within(shd_budget *budget, const atomic_bool *cancelled, shd_error *error) {
    enum { MODULE = 64 << 20 };
    if (shd_budget_most(budget) < 2 * (uint64_t)MODULE) {
        shd_fail(error, SHD_LIMIT, "",
                 "OpenImageIO takes %d bytes, and the limit `memory` of the process leaves %llu "
                 "for all",
                 MODULE, (unsigned long long)shd_budget_most(budget));
        return shd_fail_limit(error, SHD_LIMIT_MEMORY);
    }
    if (!shd_budget_take(budget, MODULE))
        return shd_fail(error, SHD_CROWDED, "",
                        "other requests have the memory that OpenImageIO takes");
    const shd_status status = load_aside(cancelled, error);
    shd_budget_give(budget, MODULE);
    if (status == SHD_OK) {
        shd_budget_fix(budget, MODULE);
        counted = true;
    }
    return status;
}

shd_status shd_image_prepare(shd_format format, shd_budget *budget, const atomic_bool *cancelled,
                             shd_error *error) {
    if (!shd_format_takes_oiio(format)) return SHD_OK;
    shd_status status = SHD_OK;
    pthread_mutex_lock(&load_mutex);
    /* One of those who wait takes the memory. Where that one leaves, another does. */
    while (counting && !shd_is_cancelled(cancelled)) wait_some();
    if (counting) {
        status = shd_fail(error, SHD_CANCELLED, "", "the render was cancelled");
    } else if (!counted) {
        counting = true;
        status = load_within(budget, cancelled, error);
        counting = false;
        pthread_cond_broadcast(&load_ended);
    }
    pthread_mutex_unlock(&load_mutex);
    return status;
}
