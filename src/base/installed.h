/* What is installed beside the programs, or in lib/shaded: where their run path points, and that of
 * the shared library if this is in it. Any thread. */
#pragma once

#include <limits.h>
#include <stdbool.h>

/* Looks for a file of that name that may be used as `mode` says (R_OK, X_OK); it loads nothing.
 * False: there is none, and `path` is "". */
bool shd_find_installed(const char *name, int mode, char path[PATH_MAX]);
