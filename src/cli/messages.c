#include "cli/cli.h"

#include <assert.h>
#include <math.h>
#include <signal.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <string.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include "base/clock.h"

void cli_say(const char *format, ...) {
    va_list args;
    va_start(args, format);
    flockfile(stderr);
    fputs("shade: ", stderr);
    vfprintf(stderr, format, args);
    fputc('\n', stderr);
    funlockfile(stderr);
    va_end(args);
}

int cli_hint(void) {
    fputs("Try 'shade --help'.\n", stderr);
    return CLI_USAGE;
}

/* Text of a document must neither break the form of one problem a line nor steer the terminal. */
static void print_safely(const char *text) {
    for (const unsigned char *c = (const unsigned char *)text; *c; c++) {
        if (*c < 0x20 || *c == 0x7f)
            fprintf(stderr, "\\u%04x", *c);
        else if (*c == 0xc2 && c[1] >= 0x80 && c[1] < 0xa0) /* U+0080 to U+009F */
            fprintf(stderr, "\\u%04x", *++c);
        else
            fputc(*c, stderr);
    }
}

static void print_problem(const char *kind, const char *file, const char *pointer,
                          const char *detail) {
    fprintf(stderr, "%s%s: ", kind, file);
    if (*pointer) {
        print_safely(pointer);
        fputs(": ", stderr);
    }
    print_safely(detail);
    fputc('\n', stderr);
}

/* The detail of a syntax error without its own words for the place, which is printed before it. */
static const char *without_place(const char *detail, const shd_report *report) {
    char place[64];
    int length =
        snprintf(place, sizeof place, "line %d, column %d: ", report->line, report->column);
    return strncmp(detail, place, (size_t)length) ? detail : detail + length;
}

/* Problems of a list that holds the first of them. */
static void print_problems(const char *kind, const char *noun, const char *file,
                           const shd_problem *list, size_t kept, size_t count) {
    for (size_t i = 0; i < kept; i++) print_problem(kind, file, list[i].pointer, list[i].detail);
    if (count > kept) fprintf(stderr, "%s%s: and %zu more %s\n", kind, file, count - kept, noun);
}

void cli_print_report(const char *file, size_t line, const shd_report *report) {
    const size_t syntax = report->line > 0; /* errors of it: the first one, or none */
    char place[4096];
    assert(report->error_count >= syntax);
    flockfile(stderr); /* what other threads print comes before or behind it */
    if (syntax) {
        fprintf(stderr, "%s:%zu:%d: ", file, line ? line : (size_t)report->line, report->column);
        print_safely(without_place(report->errors[0].detail, report));
        fputc('\n', stderr);
    }
    if (line) {
        snprintf(place, sizeof place, "%s:%zu", file, line);
        file = place;
    }
    print_problems("", "errors", file, report->errors + syntax,
                   shd_report_errors_kept(report) - syntax, report->error_count - syntax);
    print_problems("warning: ", "warnings", file, report->warnings,
                   shd_report_warnings_kept(report), report->warning_count);
    funlockfile(stderr);
}

void cli_print_error(const char *file, const shd_error *error) {
    flockfile(stderr);
    print_problem("", file, error->path, error->text);
    funlockfile(stderr);
}

const char *cli_name_of(const char *path) {
    return strcmp(path, "-") ? path : "stdin";
}

/* ---- Interrupts ---- */

/* Free of locks, as handlers want it, and seen by all threads. */
static atomic_int interrupt;

static void on_interrupt(int number) {
    interrupt = number;
}

void cli_catch_interrupts(void) {
    struct sigaction action = {.sa_handler = on_interrupt, .sa_flags = (int)SA_RESETHAND};
    sigemptyset(&action.sa_mask);
    sigaction(SIGINT, &action, NULL);
    sigaction(SIGTERM, &action, NULL);
}

bool cli_interrupted(void) {
    return interrupt;
}

void cli_end_if_interrupted(void) {
    const int number = interrupt;
    if (number) raise(number); /* its default action is in force again */
}

/* ---- Progress ---- */

enum { BAR_WIDTH = 40 };
static const double BAR_DELAY = 0.5,
                    BAR_PAUSE = 0.1; /* seconds: before the first one, between two */

static struct {
    bool on_terminal, is_drawn;
    double start, last; /* on shd_now()'s clock */
} progress;

void cli_progress_begin(void) {
    progress.on_terminal = isatty(STDERR_FILENO);
    progress.start = shd_now();
}

/* The columns that a line may fill without wrapping. */
static int terminal_columns(void) {
    struct winsize size;
    if (ioctl(STDERR_FILENO, TIOCGWINSZ, &size) || size.ws_col == 0) return 79;
    return size.ws_col - 1;
}

void cli_progress_draw(double share) {
    static const char full[BAR_WIDTH + 1] = "########################################";
    const double now = shd_now();
    if (!progress.on_terminal || now - progress.start < BAR_DELAY ||
        now - progress.last < BAR_PAUSE)
        return;
    share = fmin(fmax(share, 0), 1);
    char line[BAR_WIDTH + 32];
    snprintf(line, sizeof line, "[%-*.*s] %3d %%", BAR_WIDTH, (int)(share * BAR_WIDTH), full,
             (int)(share * 100));
    fprintf(stderr, "\r%.*s", terminal_columns(), line);
    fflush(stderr);
    progress.is_drawn = true;
    progress.last = now;
}

void cli_progress_end(void) {
    if (!progress.is_drawn) return;
    fputs("\r\033[K", stderr); /* to the line's start, erase to its end */
    fflush(stderr);
    progress.is_drawn = false;
}
