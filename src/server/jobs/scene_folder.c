#include "scene_folder.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>

#include "server/answer/problem.h"
#include "server/ops/log.h"

enum { NAME_SIZE = SHD_DIGEST_TEXT + 40, PIECE = 1 << 14 };

/* Nobody but the daemon's user and group: scenes may be secrets. */
enum { FILE_MODE = 0640 };

static const char missing[] = "no scene is kept by this digest: PUT the document to /v1/scenes, "
                              "then repeat";
static const char damaged[] = "the scene that was kept by this digest is damaged: PUT the document "
                              "to /v1/scenes, which mends it, then repeat";

struct shd_scene_folder {
    int fd;
    shd_metrics *metrics;
    uint64_t run; /* random: what other daemons write in the folder has other names */
    atomic_uint_least64_t next;
};

static void count_file(shd_scene_folder *folder, shd_filed filed) {
    atomic_fetch_add(&folder->metrics->scene_files[filed], 1);
}

static void name_file(const shd_digest *digest, char name[NAME_SIZE]) {
    shd_digest_write(digest, name);
    strcat(name, ".json");
}

static void name_new(shd_scene_folder *folder, const char *of, char name[NAME_SIZE]) {
    snprintf(name, NAME_SIZE, ".%.64s.%016llx-%llu.new", of, (unsigned long long)folder->run,
             (unsigned long long)atomic_fetch_add(&folder->next, 1));
}

/* Counts what has befallen a file, and tells the operator. */
static void report_file(shd_scene_folder *folder, shd_filed filed, const char *name,
                        const char *message) {
    count_file(folder, filed);
    shd_log line;
    shd_log_begin(&line, SHD_LOG_ERROR, "scene-file");
    shd_log_text(&line, "file", name);
    shd_log_text(&line, "message", message);
    shd_log_end(&line);
}

bool shd_scene_folder_lacks(shd_reply *reply) {
    return shd_problem_reply(reply, SHD_NOT_FOUND, "%s", missing);
}

/* ---- Reading ---- */

/* A regular file of the folder and its size; -1: errno says why not. A FIFO does not hang it. */
static int open_file(const shd_scene_folder *folder, const char *name, size_t *size) {
    const int flags = O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK | O_NOCTTY;
    const int fd = openat(folder->fd, name, flags);
    struct stat info;
    if (fd < 0 || (!fstat(fd, &info) && S_ISREG(info.st_mode))) {
        if (fd >= 0) *size = (size_t)info.st_size;
        return fd;
    }
    close(fd);
    errno = ELOOP; /* as of a symbolic link: it is there, and no file */
    return -1;
}

/* As many bytes as there are, up to `size`. Less than 0: errno says why not. */
static ssize_t read_bytes(int fd, char *out, size_t size) {
    size_t done = 0;
    while (done < size) {
        const ssize_t got = read(fd, out + done, size - done);
        if (got < 0 && errno == EINTR) continue;
        if (got < 0) return got;
        if (!got) break;
        done += (size_t)got;
    }
    return (ssize_t)done;
}

/* Whether a file of the name has just these bytes. */
static bool has_bytes(const shd_scene_folder *folder, const char *name, const char *text,
                      size_t length) {
    size_t size = 0, done = 0;
    char piece[PIECE];
    const int fd = open_file(folder, name, &size);
    bool same = fd >= 0 && size == length;
    while (same && done < length) {
        const size_t rest = length - done, part = rest < PIECE ? rest : PIECE;
        same = read_bytes(fd, piece, part) == (ssize_t)part && !memcmp(piece, text + done, part);
        done += part;
    }
    if (fd >= 0) close(fd);
    return same;
}

/* The file's bytes into a scene of their length. */
static shd_status fill_scene(shd_scene_folder *folder, int fd, const char *name,
                             const shd_digest *digest, char *text, size_t length,
                             shd_error *error) {
    const ssize_t got = read_bytes(fd, text, length);
    if (got < 0) {
        report_file(folder, SHD_FILED_UNREADABLE, name, strerror(errno));
        return shd_fail(error, SHD_INTERNAL, "", "the file of this scene cannot be read");
    }
    const shd_digest found = shd_digest_of(text, (size_t)got);
    if ((size_t)got == length && shd_digest_same(&found, digest)) return SHD_OK;
    report_file(folder, SHD_FILED_DAMAGED, name, "its bytes are others than its name says");
    return shd_fail(error, SHD_MISSING, "", "%s", damaged);
}

/* What could not be opened. */
static shd_status tell_unopened(shd_scene_folder *folder, const char *name, shd_error *error) {
    if (errno == ENOENT) {
        count_file(folder, SHD_FILED_MISSING);
        return shd_fail(error, SHD_MISSING, "", "%s", missing);
    }
    const bool is_other = errno == ELOOP;
    report_file(folder, is_other ? SHD_FILED_DAMAGED : SHD_FILED_UNREADABLE, name,
                is_other ? "it is no regular file" : strerror(errno));
    if (is_other) return shd_fail(error, SHD_MISSING, "", "%s", damaged);
    return shd_fail(error, SHD_INTERNAL, "", "the file of this scene cannot be read");
}

shd_status shd_scene_folder_find(shd_scene_folder *folder, shd_engine *engine,
                                 const shd_digest *digest, uint64_t most, const char *client,
                                 shd_kept_scene **out, const char **text, size_t *length,
                                 shd_error *error) {
    char name[NAME_SIZE], *room;
    size_t size;
    shd_kept_scene *scene = NULL;
    name_file(digest, name);
    const int fd = open_file(folder, name, &size);
    if (fd < 0) return tell_unopened(folder, name, error);
    shd_status status;
    if (size > most) {
        shd_fail(error, SHD_LIMIT, "", "it has %zu bytes; the limit `body` is %llu", size,
                 (unsigned long long)most);
        status = shd_fail_limit(error, SHD_LIMIT_BODY);
    } else {
        status = shd_engine_new_scene(engine, digest, size, &scene, &room, error);
    }
    if (!status) status = fill_scene(folder, fd, name, digest, room, size, error);
    close(fd);
    if (status) {
        shd_kept_scene_drop(scene);
        return status;
    }
    count_file(folder, SHD_FILED_READ);
    bool known;
    shd_engine_keep_scene(engine, scene, client, &known, NULL); /* else it is read again */
    *out = scene;
    *text = room;
    *length = size;
    return SHD_OK;
}

/* ---- Writing ---- */

static bool write_bytes(int fd, const char *text, size_t length) {
    while (length) {
        const ssize_t put = write(fd, text, length);
        if (put < 0 && errno == EINTR) continue;
        if (put < 0) return false;
        text += put;
        length -= (size_t)put;
    }
    return true;
}

/* To the disk. What cannot be asked for that is not: EINVAL. */
static bool settle_file(int fd) {
    return !fsync(fd) || errno == EINVAL;
}

/* A new file of the name, whole and on the disk. False: errno says why not, and it is gone. */
static bool write_file(const shd_scene_folder *folder, const char *name, const char *text,
                       size_t length) {
    const int flags = O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW;
    const int fd = openat(folder->fd, name, flags, FILE_MODE);
    if (fd < 0) return false;
    bool good = write_bytes(fd, text, length) && settle_file(fd);
    int why = errno;
    if (close(fd) && good) {
        good = false;
        why = errno;
    }
    if (!good) unlinkat(folder->fd, name, 0);
    errno = why;
    return good;
}

/* In place of what is there, if anything is. False: errno says why not. */
static bool replace_file(shd_scene_folder *folder, const char *name, const char *text,
                         size_t length) {
    char fresh[NAME_SIZE];
    name_new(folder, name, fresh);
    if (!write_file(folder, fresh, text, length)) return false;
    if (!renameat(folder->fd, fresh, folder->fd, name)) return true;
    const int why = errno;
    unlinkat(folder->fd, fresh, 0);
    errno = why;
    return false;
}

shd_status shd_scene_folder_keep(shd_scene_folder *folder, const shd_digest *digest,
                                 const char *text, size_t length, bool *known, shd_error *error) {
    char name[NAME_SIZE];
    name_file(digest, name);
    const bool is_known = has_bytes(folder, name, text, length);
    /* The folder, too, where another daemon may just have renamed the file. */
    if ((is_known || replace_file(folder, name, text, length)) && settle_file(folder->fd)) {
        count_file(folder, is_known ? SHD_FILED_KNOWN : SHD_FILED_WRITTEN);
        *known = is_known;
        return SHD_OK;
    }
    const bool is_full = errno == ENOSPC || errno == EDQUOT;
    report_file(folder, SHD_FILED_UNWRITABLE, name, strerror(errno));
    return shd_fail(error, SHD_INTERNAL, "", "the folder of scenes %s: this one is not kept",
                    is_full ? "is full" : "cannot be written");
}

/* ---- The folder ---- */

/* Whether files can be opened there, and a warning if none can be written. */
static shd_status try_folder(shd_scene_folder *folder, const char *path, shd_error *error) {
    static const shd_digest none;
    char name[NAME_SIZE], fresh[NAME_SIZE];
    size_t size;
    name_file(&none, name);
    name_new(folder, name, fresh);
    const int fd = open_file(folder, name, &size);
    if (fd >= 0) close(fd);
    if (fd < 0 && errno != ENOENT && errno != ELOOP)
        return shd_fail(error, SHD_CONFIG, path, "scenes-folder: %s", strerror(errno));
    if (write_file(folder, fresh, "", 0)) {
        unlinkat(folder->fd, fresh, 0);
        return SHD_OK;
    }
    shd_log line;
    shd_log_begin(&line, SHD_LOG_WARNING, "scenes-folder-unwritable");
    shd_log_text(&line, "folder", path);
    shd_log_text(&line, "message", strerror(errno));
    shd_log_end(&line);
    return SHD_OK;
}

shd_status shd_scene_folder_open(const char *path, shd_metrics *metrics, shd_scene_folder **out,
                                 shd_error *error) {
    shd_scene_folder *folder = calloc(1, sizeof *folder);
    if (!folder) return shd_fail(error, SHD_EXHAUSTED, "", "out of memory");
    folder->metrics = metrics;
    if (getrandom(&folder->run, sizeof folder->run, 0) != (ssize_t)sizeof folder->run)
        folder->run = (uint64_t)getpid();
    folder->fd = open(path, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    const shd_status status =
        folder->fd < 0 ? shd_fail(error, SHD_CONFIG, path, "scenes-folder: %s", strerror(errno))
                       : try_folder(folder, path, error);
    if (status)
        shd_scene_folder_drop(folder);
    else
        *out = folder;
    return status;
}

void shd_scene_folder_drop(shd_scene_folder *folder) {
    if (!folder) return;
    if (folder->fd >= 0) close(folder->fd);
    free(folder);
}
