#include "base/module.h"

#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

static bool find_from(void *loader_handle, const char *name, char path[PATH_MAX]) {
    Dl_serinfo size, *folders = NULL;
    bool found = false;
    if (loader_handle && !dlinfo(loader_handle, RTLD_DI_SERINFOSIZE, &size))
        folders = malloc(size.dls_size);
    if (!folders) return false;
    *folders = size;
    if (!dlinfo(loader_handle, RTLD_DI_SERINFO, folders)) {
        for (unsigned i = 0; i < folders->dls_cnt && !found; i++) {
            const int length =
                snprintf(path, PATH_MAX, "%s/%s", folders->dls_serpath[i].dls_name, name);
            found = length < PATH_MAX && !access(path, R_OK);
        }
    }
    free(folders);
    return found;
}

/* Our programs' run path points beside them in the build tree, and to lib/shaded once they are
 * installed; so does that of the shared library, if this is in it, for anybody's program. */
bool shd_module_find(const char *name, char path[PATH_MAX]) {
    static const char here_name = 0; /* something that lies in what holds this function */
    Dl_info here;
    if (find_from(dlopen(NULL, RTLD_LAZY), name, path)) return true;
    if (dladdr(&here_name, &here) &&
        find_from(dlopen(here.dli_fname, RTLD_LAZY | RTLD_NOLOAD), name, path))
        return true;
    *path = 0;
    return false;
}
