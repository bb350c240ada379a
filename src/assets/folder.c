#include "assets/folder.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/format.h"

enum { NAMES_MOST = 10000 };

typedef struct file_note {
    bool known;
    shd_digest digest;
} file_note;

struct shd_asset_folder {
    int descriptor;
    const char **names; /* [count], each owned, sorted */
    size_t count;
    pthread_mutex_t mutex;
    file_note *notes; /* [count], under the mutex */
};

/* ---- Names ---- */

/* What begins as names of digests do cannot be named. */
static bool is_name(const char *name) {
    static const char signs[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789._-";
    const char *dot = strrchr(name, '.');
    shd_format format;
    const size_t length = strlen(name);
    return *name != '.' && strncmp(name, "sha256-", 7) != 0 && length <= SHD_ASSET_NAME &&
           strspn(name, signs) == length && dot && shd_format_find(dot + 1, &format);
}

static bool is_file(int folder, const char *name) {
    struct stat info;
    return !fstatat(folder, name, &info, 0) && S_ISREG(info.st_mode);
}

static int compare_names(const void *a, const void *b) {
    return strcmp(*(const char *const *)a, *(const char *const *)b);
}

/* False: out of memory. */
static bool add_name(shd_asset_folder *folder, const char *name) {
    if (!(folder->count & (folder->count - 1))) { /* 0, or a power of two: it is full */
        const size_t room = folder->count ? 2 * folder->count : 1;
        const char **more = realloc(folder->names, room * sizeof *more);
        if (!more) return false;
        folder->names = more;
    }
    char *copy = strdup(name);
    if (copy) folder->names[folder->count++] = copy;
    return copy;
}

static shd_status list_names(shd_asset_folder *folder, const char *path, shd_error *error) {
    const int again = openat(folder->descriptor, ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    DIR *list = again < 0 ? NULL : fdopendir(again);
    shd_status status = SHD_OK;
    if (!list) {
        shd_fail(error, SHD_CONFIG, path, "%s", strerror(errno));
        if (again >= 0) close(again);
        return SHD_CONFIG;
    }
    errno = 0;
    for (struct dirent *entry; status == SHD_OK && (entry = readdir(list)); errno = 0) {
        if (!is_name(entry->d_name) || !is_file(folder->descriptor, entry->d_name)) continue;
        if (folder->count == NAMES_MOST)
            status = shd_fail(error, SHD_CONFIG, path, "there are more than %d pictures in it",
                              NAMES_MOST);
        else if (!add_name(folder, entry->d_name))
            status = shd_fail(error, SHD_EXHAUSTED, path, "out of memory");
    }
    if (status == SHD_OK && errno)
        status = shd_fail(error, SHD_CONFIG, path, "%s", strerror(errno));
    closedir(list);
    if (folder->count) qsort(folder->names, folder->count, sizeof *folder->names, compare_names);
    return status;
}

/* ---- The folder ---- */

shd_status shd_asset_folder_open(const char *path, shd_asset_folder **out, shd_error *error) {
    shd_asset_folder *folder = calloc(1, sizeof *folder);
    if (!folder) return shd_fail(error, SHD_EXHAUSTED, path, "out of memory");
    pthread_mutex_init(&folder->mutex, NULL);
    folder->descriptor = open(path, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    shd_status status = folder->descriptor < 0
                            ? shd_fail(error, SHD_CONFIG, path, "%s", strerror(errno))
                            : list_names(folder, path, error);
    if (status == SHD_OK &&
        !(folder->notes = calloc(folder->count ? folder->count : 1, sizeof *folder->notes)))
        status = shd_fail(error, SHD_EXHAUSTED, path, "out of memory");
    if (status == SHD_OK)
        *out = folder;
    else
        shd_asset_folder_drop(folder);
    return status;
}

void shd_asset_folder_drop(shd_asset_folder *folder) {
    if (!folder) return;
    if (folder->descriptor >= 0) close(folder->descriptor);
    for (size_t i = 0; i < folder->count; i++) free((char *)(uintptr_t)folder->names[i]);
    free(folder->names);
    free(folder->notes);
    pthread_mutex_destroy(&folder->mutex);
    free(folder);
}

const char *const *shd_asset_names(const shd_asset_folder *folder, size_t *count) {
    *count = folder->count;
    return folder->names;
}

bool shd_asset_find(const shd_asset_folder *folder, const char *name, size_t *index) {
    const char **found = folder->count ? bsearch(&name, folder->names, folder->count,
                                                 sizeof *folder->names, compare_names)
                                       : NULL;
    if (found) *index = (size_t)(found - folder->names);
    return found;
}

bool shd_asset_find_digits(const shd_asset_folder *folder, const char *digits, size_t *index) {
    const size_t length = strlen(digits);
    for (size_t i = 0; i < folder->count; i++) {
        if (strncmp(folder->names[i], digits, length) || folder->names[i][length] != '.') continue;
        *index = i;
        return true;
    }
    return false;
}

/* ---- Files ---- */

bool shd_asset_known(shd_asset_folder *folder, size_t index, shd_digest *out) {
    pthread_mutex_lock(&folder->mutex);
    const file_note note = folder->notes[index];
    pthread_mutex_unlock(&folder->mutex);
    if (note.known) *out = note.digest;
    return note.known;
}

static shd_status read_file(int file, const char *name, size_t most, void **data, size_t *size,
                            shd_error *error) {
    struct stat info;
    if (fstat(file, &info) || !S_ISREG(info.st_mode))
        return shd_fail(error, SHD_SCENE, "", "the file of the asset %s cannot be read", name);
    if ((uint64_t)info.st_size > most) {
        shd_fail(error, SHD_LIMIT, "", "the asset %s has %lld bytes; the limit `memory` leaves %zu",
                 name, (long long)info.st_size, most);
        return shd_fail_limit(error, SHD_LIMIT_MEMORY);
    }
    const size_t expected = (size_t)info.st_size;
    unsigned char *bytes = malloc(expected ? expected : 1);
    if (!bytes) return shd_fail(error, SHD_EXHAUSTED, "", "out of memory");
    size_t length = 0;
    while (length < expected) {
        const ssize_t got = read(file, bytes + length, expected - length);
        if (got < 0 && errno == EINTR) continue;
        if (got < 0) {
            const int why = errno;
            free(bytes);
            return shd_fail(error, SHD_SCENE, "", "the file of the asset %s cannot be read: %s",
                            name, strerror(why));
        }
        if (!got) break; /* it has shrunk meanwhile */
        length += (size_t)got;
    }
    *data = bytes;
    *size = length;
    return SHD_OK;
}

shd_status shd_asset_read(shd_asset_folder *folder, size_t index, size_t most, void **data,
                          size_t *size, shd_digest *digest, shd_error *error) {
    const char *name = folder->names[index];
    const int file = openat(folder->descriptor, name, O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY);
    if (file < 0)
        return shd_fail(error, SHD_SCENE, "", "the file of the asset %s cannot be read: %s", name,
                        strerror(errno));
    const shd_status status = read_file(file, name, most, data, size, error);
    close(file);
    if (status != SHD_OK) return status;
    *digest = shd_digest_of(*data, *size);
    pthread_mutex_lock(&folder->mutex);
    folder->notes[index] = (file_note){true, *digest};
    pthread_mutex_unlock(&folder->mutex);
    return SHD_OK;
}
