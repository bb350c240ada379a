#include "image/load.h"

#include <dlfcn.h>
#include <pthread.h>
#include <stdio.h>

#include "image/image.h"

/* Written once, under pthread_once, and constant from then on. */
static pthread_once_t once = PTHREAD_ONCE_INIT;
static shd_oiio_encode_fn *encode;
static char problem[400];

/* A bare name is looked for along the program's RUNPATH, which points beside the program in the
 * build tree and to lib/shaded where installed. The module is never closed: its libraries start
 * threads and register themselves in places that do not forget. */
static void load(void) {
    void *module = dlopen("shaded_oiio.so", RTLD_NOW | RTLD_LOCAL);
    void *symbol = module ? dlsym(module, "shd_oiio_encode") : NULL;
    if (!symbol) {
        const char *why = dlerror();
        snprintf(problem, sizeof problem, "%s", why ? why : "shaded_oiio.so is not a module");
        return;
    }
    /* POSIX's way from an object pointer to a function pointer, without a cast that ISO C lacks. */
    *(void **)&encode = symbol;
}

shd_status shd_oiio_load(shd_oiio_encode_fn **out, shd_error *error) {
    pthread_once(&once, load);
    if (!encode)
        return shd_fail(
            error, SHD_CONFIG, "",
            "the OpenImageIO module, which TIFF, EXR and HDR need, cannot be loaded: %s", problem);
    *out = encode;
    return SHD_OK;
}

shd_status shd_image_preload(shd_error *error) {
    shd_oiio_encode_fn *unused;
    return shd_oiio_load(&unused, error);
}
