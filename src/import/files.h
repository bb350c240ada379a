/* The inside of the module: files that a model names are read if they are regular: a pipe or a
 * device has no end, or no beginning. */
#pragma once

#include <assimp/cfileio.h>
#include <stdio.h>

/* For reading; the caller closes it. NULL: there is none, or it is no regular file. */
FILE *shd_open_regular(const char *path);

/* What assimp opens files by. */
extern struct aiFileIO shd_regular_files;
