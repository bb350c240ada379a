#include "cli/cli.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

bool cli_read_file(const char *path, size_t cap, char **text, size_t *length) {
    bool is_stdin = !strcmp(path, "-");
    int fd = is_stdin ? STDIN_FILENO : open(path, O_RDONLY | O_CLOEXEC);
    if (fd < 0) {
        cli_say("cannot open '%s': %s", path, strerror(errno));
        return false;
    }

    /* Pipes do not tell their size, so the buffer grows as bytes come. */
    size_t room = 0, used = 0;
    char *bytes = NULL;
    ssize_t got;
    do {
        if (used == room) {
            room = room ? room * 2 : 64 * 1024;
            char *more = realloc(bytes, room);
            if (!more) {
                got = -1;
                break;
            }
            bytes = more;
        }
        got = read(fd, bytes + used, room - used);
        if (got > 0) used += (size_t)got;
    } while (used <= cap && (got > 0 || (got < 0 && errno == EINTR)));
    const int problem = errno;
    if (!is_stdin) close(fd);
    if (got == 0) {
        *text = bytes;
        *length = used;
        return true;
    }
    if (got < 0)
        cli_say("cannot read '%s': %s", path, strerror(problem));
    else
        cli_say("'%s' is longer than %zu bytes, the most that a scene may have", path, cap);
    free(bytes);
    return false;
}

/* 0, or errno. */
static int write_all(int fd, const void *data, size_t size) {
    const char *next = data;
    while (size > 0) {
        ssize_t wrote = write(fd, next, size);
        if (wrote < 0 && errno == EINTR) continue;
        if (wrote < 0) return errno;
        next += wrote;
        size -= (size_t)wrote;
    }
    return 0;
}

bool cli_write_stdout(const void *data, size_t size) {
    int problem = write_all(STDOUT_FILENO, data, size);
    /* A file system may refuse (quota, network) as late as at close. */
    if (!problem && close(STDOUT_FILENO)) problem = errno;
    if (problem) cli_say("cannot write to stdout: %s", strerror(problem));
    return !problem;
}

/* Opens a new file beside `target`, whose own name may be as long as the system allows. */
static int open_beside(const char *target, mode_t mode, char **name) {
    const char *slash = strrchr(target, '/');
    int folder = slash ? (int)(slash - target) + 1 : 0;
    for (int attempt = 0; attempt < 1000; attempt++) {
        char *candidate;
        if (asprintf(&candidate, "%.*s.shade-%ld-%d.part", folder, target, (long)getpid(),
                     attempt) < 0)
            return -1;
        int fd = open(candidate, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, mode);
        if (fd >= 0) {
            *name = candidate;
            return fd;
        }
        free(candidate); /* which leaves errno alone */
        if (errno != EEXIST) return -1;
    }
    return -1;
}

bool cli_file_write(const char *path, const void *data, size_t size, cli_file *out) {
    struct stat status;
    bool there = !stat(path, &status);
    if (there && S_ISDIR(status.st_mode)) {
        cli_say("cannot write '%s': it is a directory", path);
        return false;
    }

    char *target = NULL, *temporary = NULL;
    int fd = -1;
    if (there && !S_ISREG(status.st_mode)) {
        fd = open(path, O_WRONLY | O_CLOEXEC);
    } else {
        /* A link stays a link: the file that it points to is replaced. */
        target = there ? realpath(path, NULL) : strdup(path);
        mode_t mode = there ? status.st_mode & 0777 : 0666;
        if (target) fd = open_beside(target, mode, &temporary);
    }
    cli_file file = {target, temporary};
    int problem = fd < 0 ? errno : write_all(fd, data, size);
    if (fd >= 0 && close(fd) && !problem) problem = errno;
    if (problem) {
        cli_say("cannot write '%s': %s", path, strerror(problem));
        cli_file_discard(&file);
        return false;
    }
    *out = file;
    return true;
}

bool cli_file_commit(cli_file *file) {
    const bool is_placed = !file->temporary || !rename(file->temporary, file->target);
    if (is_placed) {
        free(file->temporary);
        file->temporary = NULL;
    } else {
        cli_say("cannot write '%s': %s", file->target, strerror(errno));
    }
    cli_file_discard(file);
    return is_placed;
}

void cli_file_discard(cli_file *file) {
    if (file->temporary) unlink(file->temporary);
    free(file->temporary);
    free(file->target);
    *file = (cli_file){0};
}

bool cli_make_folder(const char *path) {
    struct stat status;
    if (!mkdir(path, 0777)) return true;
    if (errno == EEXIST && !stat(path, &status)) errno = S_ISDIR(status.st_mode) ? 0 : ENOTDIR;
    if (!errno) return true;
    cli_say("cannot make directory '%s': %s", path, strerror(errno));
    return false;
}

bool cli_name_is_safe(const char *name) {
    return *name && *name != '.' && !strchr(name, '/');
}

bool cli_write_pictures(const char *directory, const shd_picture *pictures, size_t count) {
    if (!cli_make_folder(directory)) return false;
    cli_file *files = calloc(count, sizeof *files);
    if (!files) {
        cli_say("out of memory");
        return false;
    }
    const char *slash = directory[strlen(directory) - 1] == '/' ? "" : "/";
    size_t written = 0;
    bool fine = true;
    for (size_t i = 0; i < count && fine; i++) {
        const char *suffix = shd_format_get(pictures[i].format)->name;
        char *path = NULL;
        if (!cli_name_is_safe(pictures[i].name)) {
            cli_say("output '%s' is no name for a file", pictures[i].name);
        } else if (asprintf(&path, "%s%s%s.%s", directory, slash, pictures[i].name, suffix) < 0) {
            cli_say("out of memory");
            path = NULL;
        }
        fine = path && cli_file_write(path, pictures[i].data, pictures[i].size, &files[i]);
        free(path);
        if (fine) written++;
    }
    for (size_t i = 0; i < written; i++) {
        if (fine)
            fine = cli_file_commit(&files[i]);
        else
            cli_file_discard(&files[i]);
    }
    free(files);
    return fine;
}
