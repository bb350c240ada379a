#include "import/files.h"

#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "import/respell.h"

FILE *shd_open_regular(const char *path) {
    const int descriptor = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY);
    struct stat info;
    if (descriptor < 0) return NULL;
    FILE *file =
        !fstat(descriptor, &info) && S_ISREG(info.st_mode) ? fdopen(descriptor, "r") : NULL;
    if (!file) close(descriptor);
    return file;
}

/* ---- For assimp ---- */

static FILE *stream_of(const struct aiFile *file) {
    return (FILE *)(void *)file->UserData;
}

static size_t read_items(struct aiFile *file, char *to, size_t size, size_t count) {
    return fread(to, size, count, stream_of(file));
}

/* Nothing is written: no file is opened for that. */
static size_t write_nothing(struct aiFile *file, const char *from, size_t size, size_t count) {
    (void)file, (void)from, (void)size, (void)count;
    return 0;
}

static void flush_nothing(struct aiFile *file) {
    (void)file;
}

static size_t tell_place(struct aiFile *file) {
    const long at = ftell(stream_of(file));
    return at > 0 ? (size_t)at : 0;
}

static size_t tell_size(struct aiFile *file) {
    struct stat info;
    return fstat(fileno(stream_of(file)), &info) ? 0 : (size_t)info.st_size;
}

static enum aiReturn seek_place(struct aiFile *file, size_t offset, enum aiOrigin origin) {
    const int from = origin == aiOrigin_SET   ? SEEK_SET
                     : origin == aiOrigin_CUR ? SEEK_CUR
                                              : SEEK_END;
    return fseek(stream_of(file), (long)offset, from) ? aiReturn_FAILURE : aiReturn_SUCCESS;
}

static struct aiFile *open_file(struct aiFileIO *io, const char *path, const char *mode) {
    (void)io;
    FILE *stream = *mode == 'r' && !strchr(mode, '+') ? shd_open_regular(path) : NULL;
    if (stream) stream = shd_respell(stream, path);
    struct aiFile *file = stream ? malloc(sizeof *file) : NULL;
    if (file)
        *file = (struct aiFile){.ReadProc = read_items,
                                .WriteProc = write_nothing,
                                .TellProc = tell_place,
                                .FileSizeProc = tell_size,
                                .SeekProc = seek_place,
                                .FlushProc = flush_nothing,
                                .UserData = (char *)(void *)stream};
    else if (stream)
        fclose(stream);
    return file;
}

static void close_file(struct aiFileIO *io, struct aiFile *file) {
    (void)io;
    fclose(stream_of(file));
    free(file);
}

struct aiFileIO shd_regular_files = {.OpenProc = open_file, .CloseProc = close_file};
