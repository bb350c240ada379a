#include "image/load.h"

#include <dlfcn.h>
#include <limits.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

#include "image/image.h"

static const char name[] = "shaded_oiio.so";

/* Each written once, under pthread_once, and constant from then on. */
static pthread_once_t find_once = PTHREAD_ONCE_INIT, load_once = PTHREAD_ONCE_INIT;
static char path[PATH_MAX]; /* of the module; "": it is not installed */
static shd_oiio_encode_fn *encode;
static char problem[400];

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

/* The module is never closed: its libraries start threads and register themselves in places that do
 * not forget. */
static void load(void) {
    pthread_once(&find_once, find);
    if (!*path) {
        snprintf(problem, sizeof problem, "%s is not installed", name);
        return;
    }
    void *module = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    void *symbol = module ? dlsym(module, "shd_oiio_encode") : NULL;
    if (!symbol) {
        const char *why = dlerror();
        snprintf(problem, sizeof problem, "%s", why ? why : "it is not a module");
        return;
    }
    /* POSIX's way from an object pointer to a function pointer, without a cast that ISO C lacks. */
    *(void **)&encode = symbol;
}

shd_status shd_oiio_load(shd_oiio_encode_fn **out, shd_error *error) {
    pthread_once(&load_once, load);
    if (!encode)
        return shd_fail(
            error, SHD_CONFIG, "",
            "the OpenImageIO module, which TIFF, EXR and HDR need, cannot be loaded: %s", problem);
    *out = encode;
    return SHD_OK;
}

bool shd_image_writes(shd_format format) {
    if (format != SHD_TIFF && format != SHD_EXR && format != SHD_HDR) return true;
    pthread_once(&find_once, find);
    return *path;
}

shd_status shd_image_preload(shd_error *error) {
    shd_oiio_encode_fn *unused;
    return shd_oiio_load(&unused, error);
}
