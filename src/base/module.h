/* Modules: shared objects that are opened by name when something needs them, because they come with
 * hundreds of libraries. They lie beside the programs in the build tree, and in lib/shaded once
 * these are installed. */
#pragma once

#include <limits.h>
#include <stdbool.h>

/* Looks for a module in the folders where dlopen would, from the program and from what holds this
 * function; it loads nothing. False: it is not installed, and `path` is "". Any thread. */
bool shd_module_find(const char *name, char path[PATH_MAX]);
