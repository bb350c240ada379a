/* The command line: files, messages, progress, commands. All on the main thread, but for files and
 * reports of batches. A function that returns false has printed on stderr what went wrong. */
#pragma once

#include <stdbool.h>
#include <stddef.h>

#include "shaded.h"

/* The program's exit status. */
enum { CLI_DONE = 0, CLI_FAILED = 1, CLI_USAGE = 2 };

/* ---- messages.c ---- */

/* One line on stderr, "shade: ...". */
void cli_say(const char *format, ...) SHD_PRINTF(1, 2);

int cli_hint(void); /* prints a pointer to --help; returns CLI_USAGE */
#define cli_usage(...) (cli_say(__VA_ARGS__), cli_hint())

/* What messages call a file: "stdin" for "-". */
const char *cli_name_of(const char *path);

/* Prints every problem of a report, one a line: "FILE:line:column: detail" for syntax, otherwise
 * "FILE: /pointer: detail", and warnings behind "warning: ". `line`: 0, or that of the file which
 * is the document; it then stands behind all names of the file. */
void cli_print_report(const char *file, size_t line, const shd_report *report);
void cli_print_error(const char *file, const shd_error *error); /* of rendering, in that form */

/* The bar on stderr. It is drawn on a terminal only, once a picture has taken some time. */
void cli_progress_begin(void);
void cli_progress_draw(double share); /* in [0,1] */
void cli_progress_end(void);          /* wipes the bar */

/* The first interrupt ends what is rendered at the next tile, and then the program with the status
 * that a shell expects; a second one ends it at once. */
void cli_catch_interrupts(void);
bool cli_interrupted(void);
void cli_end_if_interrupted(void);

/* ---- files.c ---- */

/* Reads all of `path` ("-": stdin), up to `cap` bytes, into memory that the caller frees. */
bool cli_read_file(const char *path, size_t cap, char **text, size_t *length);

/* A file on its way. It is written beside its target under another name, then renamed over it. If
 * the target is there and is no regular file (a device, a pipe), bytes go straight to it. */
typedef struct cli_file {
    char *target;
    char *temporary; /* NULL: there is nothing to rename or to remove */
} cli_file;

/* Writes the bytes. Nothing can be seen at `path` yet, and on failure nothing is left behind. */
bool cli_file_write(const char *path, const void *data, size_t size, cli_file *out);
bool cli_file_commit(cli_file *file);  /* puts the file in its place; ends the struct */
void cli_file_discard(cli_file *file); /* removes the file; ends the struct */

bool cli_make_folder(const char *path); /* it may be there */

/* Whether a name may become that of a file in a folder. */
bool cli_name_is_safe(const char *name);

/* Writes pictures into a folder, which is made, by their names. All are written beside their places
 * first, so that a full disk leaves the old files. */
bool cli_write_pictures(const char *folder, const shd_picture *pictures, size_t count);

bool cli_write_stdout(const void *data, size_t size);

/* ---- render.c ---- */

enum { CLI_ABOVE_MOST = 16 };

/* --fail-above: a metric, where it is in shd_diff, and what it may be at most. */
typedef struct cli_above {
    const char *name;
    size_t offset;
    double value;
} cli_above;

typedef struct cli_options {
    const char *output;   /* -o; NULL: not given */
    bool json;            /* --json */
    bool resume;          /* --resume */
    size_t shard, shards; /* --shard; 0 of 0: not given */
    bool checks_pixels;   /* --pixels, --seed or --tolerance is given */
    shd_verify_options verify;
    bool compares; /* --fail-above or --density is given */
    cli_above above[CLI_ABOVE_MOST];
    size_t above_count;
    double density;     /* --density; 0: not given */
    bool phong;         /* --phong */
    const char *meshes; /* --meshes; NULL: not given */
    const char *object; /* --object; NULL: not given */
    shd_engine_options engine;
} cli_options;

enum cli_command {
    CLI_RENDER,
    CLI_EXPLAIN,
    CLI_COMPARE,
    CLI_ANALYZE,
    CLI_BRDF,
    CLI_CHECK,
    CLI_COMMANDS
};

/* Only CLI_CHECK takes several scenes; CLI_RENDER has an output. Returns the exit status. */
int cli_run(enum cli_command command, const char *const *scenes, size_t count,
            const cli_options *options);

/* ---- verify.c ---- */

/* What a command does with a picture's path and format, and the request that has read its scene.
 * Returns the exit status. */
typedef int cli_work_on_picture(shd_request *request, const char *picture, shd_format format,
                                const char *scene, const cli_options *options);

/* Reads the scene, and works on it. Returns the exit status. */
int cli_on_picture(const char *picture, const char *scene, const cli_options *options,
                   cli_work_on_picture *work);

/* Tells whether a picture is that of a scene. Returns the exit status. */
int cli_verify(const char *picture, const char *scene, const cli_options *options);

/* ---- diff.c ---- */

/* Takes METRIC=VALUE. False: it is something else. */
bool cli_take_above(const char *text, cli_options *options);

/* Tells how far two pictures are apart, each of a file or a scene. Returns the exit status. */
int cli_diff(const char *const paths[2], const cli_options *options);

/* ---- fit.c ---- */

/* Tells the coefficients of a material in a photo of a scene. Returns the exit status. */
int cli_fit(const char *photo, const char *scene, const cli_options *options);

/* ---- link.c ---- */

/* Prints the path of the link that holds a scene. Returns the exit status. */
int cli_link(const char *scene, const shd_engine_options *options);

/* ---- import.c ---- */

/* Makes a scene of a model of another program, options->output. Returns the exit status. */
int cli_import(const char *path, const cli_options *options);

/* ---- batch.c ---- */

/* Renders each line of a file into a folder, options->output. Returns the exit status. */
int cli_batch(const char *path, const cli_options *options);
