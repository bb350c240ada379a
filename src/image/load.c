#include "image/load.h"

#include <dlfcn.h>
#include <errno.h>
#include <limits.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

#include "image/image.h"

static const char name[] = "shaded_oiio.so";

/* Written once, under pthread_once, and constant from then on. */
static pthread_once_t find_once = PTHREAD_ONCE_INIT;
static char path[PATH_MAX]; /* of the module; "": it is not installed */
/* Under the mutex, each at most once. */
static pthread_mutex_t load_mutex = PTHREAD_MUTEX_INITIALIZER;
static _Atomic(shd_oiio_encode_fn *) loaded;
static atomic_bool incomplete; /* its libraries are not installed */

/* Looks where dlopen would, along the program's run path, which points beside the program in the
 * build tree and to lib/shaded where installed; but loads nothing. */
static void find(void) {
    void *program = dlopen(NULL, RTLD_LAZY);
    Dl_serinfo size, *folders = NULL;
    if (program && !dlinfo(program, RTLD_DI_SERINFOSIZE, &size)) folders = malloc(size.dls_size);
    if (!folders) return;
    *folders = size;
    if (!dlinfo(program, RTLD_DI_SERINFO, folders)) {
        for (unsigned i = 0; i < folders->dls_cnt; i++) {
            int length =
                snprintf(path, sizeof path, "%s/%s", folders->dls_serpath[i].dls_name, name);
            if (length < (int)sizeof path && !access(path, R_OK)) break;
            *path = 0;
        }
    }
    free(folders);
}

static bool takes_module(shd_format format) {
    return format == SHD_TIFF || format == SHD_EXR || format == SHD_HDR;
}

bool shd_image_writes(shd_format format) {
    if (!takes_module(format)) return true;
    pthread_once(&find_once, find);
    return *path && !atomic_load(&incomplete);
}

/* Some of its 260 libraries allocate in static constructors, and what these throw ends the process:
 * so it is asked before whether there is room. Loading takes 460 MB of addresses and 110 MB of
 * memory on Debian 12. */
static bool has_room(void) {
    enum { ADDRESSES = 640 << 20, MEMORY = 160 << 20 };
    void *memory = malloc(MEMORY);
    void *addresses =
        mmap(NULL, ADDRESSES, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    bool both = memory && addresses != MAP_FAILED;
    if (addresses != MAP_FAILED) munmap(addresses, ADDRESSES);
    free(memory);
    return both;
}

/* dlerror() has the system's words for the reason at its end. */
static bool says(const char *why, int number) {
    return strstr(why, strerror(number));
}

static shd_status refuse(const char *why, shd_error *error) {
    if (says(why, ENOENT)) {
        atomic_store(&incomplete, true);
        return shd_fail(error, SHD_SCENE, "", "OpenImageIO is not installed: %s", why);
    }
    bool later = says(why, ENOMEM) || says(why, EMFILE) || says(why, ENFILE);
    return shd_fail(error, later ? SHD_EXHAUSTED : SHD_CONFIG, "",
                    "OpenImageIO, which TIFF, EXR and HDR need, cannot be loaded: %s", why);
}

/* The module is never closed: its libraries start threads and register themselves in places that do
 * not forget. */
static shd_status load(shd_error *error) {
    if (atomic_load(&loaded)) return SHD_OK;
    if (!shd_image_writes(SHD_EXR))
        return shd_fail(error, SHD_SCENE, "", "OpenImageIO is not installed: %s is missing",
                        *path ? "a library" : name);
    if (!has_room()) return shd_fail(error, SHD_EXHAUSTED, "", "out of memory for OpenImageIO");
    void *module = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    void *symbol = module ? dlsym(module, "shd_oiio_encode") : NULL;
    if (!symbol) {
        const char *why = dlerror();
        return refuse(why ? why : "it is not a module", error);
    }
    /* POSIX's way from an object pointer to a function pointer, without a cast that ISO C lacks. */
    shd_oiio_encode_fn *encode;
    *(void **)&encode = symbol;
    atomic_store(&loaded, encode);
    return SHD_OK;
}

shd_status shd_oiio_load(shd_oiio_encode_fn **out, shd_error *error) {
    pthread_mutex_lock(&load_mutex);
    shd_status status = load(error);
    pthread_mutex_unlock(&load_mutex);
    if (status == SHD_OK) *out = atomic_load(&loaded);
    return status;
}

shd_status shd_image_prepare(shd_format format, shd_error *error) {
    shd_oiio_encode_fn *unused;
    return takes_module(format) ? shd_oiio_load(&unused, error) : SHD_OK;
}
