/* `shade batch`: each line of a file is a scene, or a scene with variants, and becomes a picture or
 * several in a folder. Threads take lines in turn, and each renders its own. */
#include <errno.h>
#include <pthread.h>
#include <search.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "cli/cli.h"

typedef struct batch {
    const char *path, *folder; /* as given */
    const cli_options *options;
    shd_engine *engine;

    pthread_mutex_t mutex; /* of what follows */
    FILE *file;
    size_t line;      /* of the file, from 1: the last one that was taken */
    int problem;      /* errno of the file's end, or 0 */
    size_t at, size;  /* bytes of it that were read, and of all; 0: it is not known */
    void *names;      /* of pictures, as tsearch keeps them */
    size_t failed;    /* pictures and lines that became none */
    size_t succeeded; /* pictures */
} batch;

/* A line on its way. */
typedef struct item {
    batch *batch;
    size_t line;
    char place[4096]; /* "FILE:LINE", for messages */
    char *text;
    size_t length, room;
} item;

static void complain(const item *e, const char *pointer, const char *text) {
    shd_error error;
    shd_fail(&error, SHD_SCENE, pointer, "%s", text);
    cli_print_error(e->place, &error);
}

/* ---- Names ---- */

static int compare_names(const void *a, const void *b) {
    return strcmp(a, b);
}

/* False: another line has the name, or memory is short. */
static bool claim_name(batch *b, const char *name) {
    char *copy = strdup(name);
    pthread_mutex_lock(&b->mutex);
    char **kept = copy ? tsearch(copy, &b->names, compare_names) : NULL;
    const bool is_new = kept && *kept == copy;
    pthread_mutex_unlock(&b->mutex);
    if (!is_new) free(copy);
    return is_new;
}

static int count_digits(size_t most) {
    int digits = 1;
    for (; most >= 10; most /= 10) digits++;
    return digits;
}

/* The name of a line's picture: its own, or the line's number; and the variant's, if there are
 * several. NULL: it was said why there is none. The caller frees it. */
static char *make_name(const item *e, const shd_batch *variants, size_t index) {
    const bool is_one = !variants || shd_batch_is_one(variants);
    const size_t count = is_one ? 1 : shd_batch_count(variants);
    const char *given = variants ? shd_batch_name(variants) : "";
    char number[32] = "", *name = NULL;
    if (!*given) snprintf(number, sizeof number, "%06zu", e->line);
    if (*given && !cli_name_is_safe(given)) {
        complain(e, "/name", "is no name for a file");
        return NULL;
    }
    const int length =
        count == 1 ? asprintf(&name, "%s%s", given, number)
                   : asprintf(&name, "%s%s-%0*zu", given, number, count_digits(count - 1), index);
    if (length < 0) {
        cli_say("out of memory");
        return NULL;
    }
    if (claim_name(e->batch, name)) return name;
    complain(e, *given ? "/name" : "", "another line of this shard has this name already");
    free(name);
    return NULL;
}

/* "FOLDER/NAME", and a suffix if the picture is one file. NULL: memory, which was said. */
static char *make_path(const batch *b, const char *name, const shd_request *request) {
    const bool multipart = shd_request_multipart(request);
    char *path = NULL;
    if (asprintf(&path, "%s/%s%s%s", b->folder, name, multipart ? "" : ".",
                 multipart ? "" : shd_format_get(shd_request_format(request, 0))->name) >= 0)
        return path;
    cli_say("out of memory");
    return NULL;
}

/* ---- A document ---- */

static void on_progress(void *request, double share) {
    (void)share;
    if (cli_interrupted()) shd_request_cancel(request);
}

static bool write_picture(const char *path, const shd_request *request) {
    size_t count;
    cli_file file;
    const shd_picture *pictures = shd_request_pictures(request, &count);
    if (shd_request_multipart(request)) return cli_write_pictures(path, pictures, count);
    return cli_file_write(path, pictures[0].data, pictures[0].size, &file) &&
           cli_file_commit(&file);
}

static bool render(const item *e, const char *name, shd_request *request) {
    const shd_render_options options = {.progress = on_progress, .context = request};
    struct stat status;
    shd_error error;
    char *path = make_path(e->batch, name, request);
    bool fine = path;
    if (path && !(e->batch->options->resume && !stat(path, &status))) {
        fine = shd_request_render(request, &options, &error) == SHD_OK;
        if (!fine && !cli_interrupted()) cli_print_error(e->place, &error);
        fine = fine && write_picture(path, request);
    }
    free(path);
    return fine;
}

/* A scene's document. `name` is NULL if that failed. */
static bool render_document(const item *e, const char *name, const char *text, size_t length) {
    shd_request *request = NULL;
    shd_error error;
    bool fine = false;
    if (!name) return false;
    if (shd_request_new(e->batch->engine, &request, &error) != SHD_OK) {
        cli_print_error(e->place, &error);
        return false;
    }
    const shd_status status = shd_request_read(request, text, length, SHD_PNG);
    cli_print_report(cli_name_of(e->batch->path), e->line, shd_request_report(request));
    if (status == SHD_OK) fine = render(e, name, request);
    shd_request_drop(request);
    return fine;
}

static void count_picture(batch *b, bool fine) {
    pthread_mutex_lock(&b->mutex);
    if (fine)
        b->succeeded++;
    else
        b->failed++;
    pthread_mutex_unlock(&b->mutex);
}

static void render_variants(const item *e, const shd_batch *variants) {
    for (size_t i = 0; i < shd_batch_count(variants) && !cli_interrupted(); i++) {
        char *name = make_name(e, variants, i), *text = NULL;
        size_t length;
        shd_error error;
        bool fine = name;
        if (fine && shd_batch_document(variants, i, NULL, &text, &length, &error) != SHD_OK) {
            cli_print_error(e->place, &error);
            fine = false;
        }
        count_picture(e->batch, fine && render_document(e, name, text, length));
        free(text);
        free(name);
    }
}

/* All variants become one picture. */
static void render_one(const item *e, shd_request *request, shd_batch *variants) {
    char *name = make_name(e, variants, 0);
    const shd_status status = shd_request_read_one(request, variants, SHD_PNG);
    cli_print_report(cli_name_of(e->batch->path), e->line, shd_request_report(request));
    count_picture(e->batch, name && status == SHD_OK && render(e, name, request));
    free(name);
}

static void render_line(const item *e) {
    shd_request *request = NULL;
    shd_batch *variants = NULL;
    shd_error error;
    if (!shd_batch_is(e->text, e->length)) {
        char *name = make_name(e, NULL, 0);
        count_picture(e->batch, render_document(e, name, e->text, e->length));
        free(name);
        return;
    }
    if (shd_request_new(e->batch->engine, &request, &error) != SHD_OK) {
        cli_print_error(e->place, &error);
        count_picture(e->batch, false);
    } else if (shd_request_read_batch(request, e->text, e->length, &variants) != SHD_OK) {
        cli_print_report(cli_name_of(e->batch->path), e->line, shd_request_report(request));
        count_picture(e->batch, false);
    } else if (shd_batch_is_one(variants)) {
        render_one(e, request, variants); /* which are the request's */
    } else {
        shd_request_drop(request);
        request = NULL;
        render_variants(e, variants);
        shd_batch_drop(variants);
    }
    shd_request_drop(request);
}

/* ---- Lines ---- */

static bool is_blank(const char *text) {
    return !text[strspn(text, " \t\r\n")];
}

/* The next line of the shard that is not blank. False: there is none, or it cannot be read. */
static bool take_line(batch *b, item *e) {
    const size_t shards = b->options->shards ? b->options->shards : 1;
    ssize_t length = -1;
    pthread_mutex_lock(&b->mutex);
    bool is_ours = false;
    while (!is_ours && !cli_interrupted()) {
        errno = 0;
        length = getline(&e->text, &e->room, b->file);
        if (length < 0) {
            if (!b->problem) b->problem = errno;
            break;
        }
        b->at += (size_t)length;
        is_ours = b->line++ % shards == b->options->shard && !is_blank(e->text);
    }
    if (is_ours) {
        e->line = b->line;
        e->length = (size_t)length;
        while (e->length && strchr("\r\n", e->text[e->length - 1])) e->length--;
        snprintf(e->place, sizeof e->place, "%s:%zu", cli_name_of(b->path), b->line);
    }
    if (b->size) cli_progress_draw((double)b->at / (double)b->size);
    pthread_mutex_unlock(&b->mutex);
    return is_ours;
}

static void *run_lines(void *context) {
    batch *b = context;
    item *e = calloc(1, sizeof *e);
    if (!e) {
        cli_say("out of memory");
        count_picture(b, false);
        return NULL;
    }
    e->batch = b;
    while (take_line(b, e)) {
        if (e->length <= b->options->engine.limits.body) {
            render_line(e);
            continue;
        }
        complain(e, "", "the line is longer than a scene may be");
        count_picture(b, false);
    }
    free(e->text);
    free(e);
    return NULL;
}

/* This thread is one of them. */
static void run_threads(batch *b, unsigned count) {
    pthread_t threads[1024];
    unsigned made = 0;
    while (made + 1 < count && !pthread_create(&threads[made], NULL, run_lines, b)) made++;
    run_lines(b);
    while (made) pthread_join(threads[--made], NULL);
}

/* ---- The batch ---- */

static int run_batch(batch *b) {
    struct stat status;
    if (!fstat(fileno(b->file), &status) && S_ISREG(status.st_mode))
        b->size = (size_t)status.st_size;
    pthread_mutex_init(&b->mutex, NULL);
    cli_catch_interrupts();
    cli_progress_begin();
    run_threads(b, shd_engine_load(b->engine).threads);
    cli_progress_end();
    cli_end_if_interrupted();
    tdestroy(b->names, free);
    pthread_mutex_destroy(&b->mutex);
    if (b->problem) {
        cli_say("cannot read '%s': %s", b->path, strerror(b->problem));
        return CLI_FAILED;
    }
    if (b->failed) cli_say("%zu pictures were made, and %zu failed", b->succeeded, b->failed);
    return b->failed ? CLI_FAILED : CLI_DONE;
}

int cli_batch(const char *path, const cli_options *options) {
    batch b = {.path = path, .folder = options->output, .options = options};
    shd_engine_options engine = options->engine;
    shd_error error;
    engine.reuse = shd_engine_defaults().reuse; /* what catalogues show is mostly the same */
    if (!cli_make_folder(b.folder)) return CLI_FAILED;
    b.file = strcmp(path, "-") ? fopen(path, "re") : stdin;
    if (!b.file) {
        cli_say("cannot open '%s': %s", path, strerror(errno));
        return CLI_FAILED;
    }
    int result = CLI_FAILED;
    if (shd_engine_new(&engine, &b.engine, &error) != SHD_OK)
        cli_say("%s%s%s", error.path, *error.path ? ": " : "", error.text);
    else
        result = run_batch(&b);
    shd_engine_drop(b.engine);
    if (b.file != stdin) fclose(b.file);
    return result;
}
