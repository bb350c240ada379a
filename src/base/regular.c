#include "regular.h"

#include <errno.h>
#include <fcntl.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

int shd_open_regular(const char *path, shd_error *error) {
    struct stat info;
    /* O_NONBLOCK: opening a FIFO that nobody writes to returns at once. */
    int file = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY);
    if (file < 0 || fstat(file, &info))
        shd_fail(error, SHD_CONFIG, path, "%s", strerror(errno));
    else if (!S_ISREG(info.st_mode))
        shd_fail(error, SHD_CONFIG, path, "not a regular file");
    else
        return file;
    if (file >= 0) close(file);
    return -1;
}

bool shd_occupy_closed_streams(void) {
    for (int fd = STDIN_FILENO; fd <= STDERR_FILENO; fd++) {
        if (fcntl(fd, F_GETFD) != -1) continue;
        int stand_in = open("/dev/null", fd == STDIN_FILENO ? O_WRONLY : O_RDONLY);
        if (stand_in == -1) return false;
    }
    return true;
}
