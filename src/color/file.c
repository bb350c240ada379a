#include "color/file.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/regular.h"

static shd_status read_all(int file, const char *path, size_t cap, char **data, size_t *size,
                           shd_error *error) {
    struct stat info;
    if (fstat(file, &info)) return shd_fail(error, SHD_CONFIG, path, "%s", strerror(errno));
    if (info.st_size < 0 || (size_t)info.st_size > cap)
        return shd_fail(error, SHD_CONFIG, path, "larger than %zu bytes", cap);

    size_t expected = (size_t)info.st_size, length = 0;
    char *bytes = malloc(expected + 1);
    if (!bytes) return shd_fail(error, SHD_EXHAUSTED, path, "out of memory");
    while (length < expected) {
        ssize_t got = read(file, bytes + length, expected - length);
        if (got < 0 && errno == EINTR) continue;
        if (got < 0) {
            int why = errno;
            free(bytes);
            return shd_fail(error, SHD_CONFIG, path, "%s", strerror(why));
        }
        if (got == 0) break; /* the file has shrunk meanwhile */
        length += (size_t)got;
    }
    *data = bytes;
    *size = length;
    return SHD_OK;
}

shd_status shd_color_read_file(const char *path, size_t cap, char **data, size_t *size,
                               shd_error *error) {
    int file = shd_open_regular(path, error);
    if (file < 0) return SHD_CONFIG;
    shd_status status = read_all(file, path, cap, data, size, error);
    close(file);
    return status;
}
