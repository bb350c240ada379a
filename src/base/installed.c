#include "base/installed.h"

#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* Looks in the folders where dlopen would, from a program or a library that is loaded. */
static void look_from(void *loader, const char *name, int mode, char path[PATH_MAX]) {
    Dl_serinfo size, *folders = NULL;
    if (loader && !dlinfo(loader, RTLD_DI_SERINFOSIZE, &size)) folders = malloc(size.dls_size);
    if (!folders) return;
    *folders = size;
    if (!dlinfo(loader, RTLD_DI_SERINFO, folders)) {
        for (unsigned i = 0; i < folders->dls_cnt && !*path; i++) {
            char file[PATH_MAX];
            const int length =
                snprintf(file, sizeof file, "%s/%s", folders->dls_serpath[i].dls_name, name);
            if (length < PATH_MAX && !access(file, mode)) memcpy(path, file, (size_t)length + 1);
        }
    }
    free(folders);
}

/* Our programs' run path points beside them in the build tree, and to lib/shaded once they are
 * installed; so does that of the shared library, if this is in it, for anybody's program. */
bool shd_find_installed(const char *name, int mode, char path[PATH_MAX]) {
    static const char here_mark;
    Dl_info here;
    *path = 0;
    look_from(dlopen(NULL, RTLD_LAZY), name, mode, path);
    if (!*path && dladdr(&here_mark, &here))
        look_from(dlopen(here.dli_fname, RTLD_LAZY | RTLD_NOLOAD), name, mode, path);
    return *path;
}
