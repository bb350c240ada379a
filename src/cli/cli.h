/* The command line: files read whole and written atomically, messages, progress, commands.
 *
 * Everything here runs on the main thread. A function that returns false has printed on stderr what
 * went wrong. */
#pragma once

#include <stdbool.h>
#include <stddef.h>

#include "shaded.h"

/* Exit status of the program. */
enum { CLI_DONE = 0, CLI_FAILED = 1, CLI_USAGE = 2 };

/* ---- messages.c ---- */

/* One line on stderr, "shade: ...". */
void cli_say(const char *format, ...) SHD_PRINTF(1, 2);

/* As cli_say, with a pointer to --help. Returns CLI_USAGE. */
int cli_usage(const char *format, ...) SHD_PRINTF(1, 2);

/* Prints every problem of a report, one a line: "FILE:line:column: detail" for syntax, otherwise
 * "FILE: /pointer: detail", and warnings behind "warning: ". */
void cli_print_report(const char *file, const shd_report *report);

/* Prints a failure that came while rendering, in the same form. */
void cli_print_error(const char *file, const shd_error *error);

/* A bar on stderr. It is drawn only on a terminal, and only once a picture has taken some time. */
typedef struct cli_progress {
    bool terminal;
    bool drawn;
    double start, last; /* on shd_now()'s clock */
} cli_progress;

void cli_progress_begin(cli_progress *progress);
void cli_progress_draw(cli_progress *progress, double share); /* in [0,1] */
void cli_progress_end(cli_progress *progress);                /* wipes the bar */

/* ---- files.c ---- */

/* Reads all of `path` ("-": stdin) into memory that the caller frees. Refuses more than `cap`
 * bytes. */
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

bool cli_write_stdout(const void *data, size_t size);

/* ---- render.c: the commands. They return the program's exit status. ---- */

typedef struct cli_options {
    const char *output; /* -o; NULL: not given */
    bool json;          /* --json */
    shd_engine_options engine;
} cli_options;

/* What one scene may take on the command line, whose user owns the machine too. */
shd_limits cli_limits(void);

int cli_render(const char *scene, const cli_options *options);
int cli_explain(const char *scene, const cli_options *options);
int cli_compare(const char *scene, const cli_options *options);
int cli_check(const char *const *scenes, size_t count, const cli_options *options);
