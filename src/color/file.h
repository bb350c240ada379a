/* Reads the operator's files with care: a directory, a FIFO or a device is refused before it can
 * hang a start, and a size is checked before memory is taken. */
#pragma once

#include <stddef.h>

#include "base/status.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Reads a whole regular file of at most `cap` bytes. The caller frees *data. SHD_CONFIG, with the
 * file's name as path, if it cannot be read; SHD_EXHAUSTED. */
shd_status shd_color_read_file(const char *path, size_t cap, char **data, size_t *size,
                               shd_error *error);

#ifdef __cplusplus
}
#endif
