#include "cli/cli.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include "base/clock.h"

static void print_line(const char *format, va_list args) {
    fputs("shade: ", stderr);
    vfprintf(stderr, format, args);
    fputc('\n', stderr);
}

void cli_say(const char *format, ...) {
    va_list args;
    va_start(args, format);
    print_line(format, args);
    va_end(args);
}

int cli_usage(const char *format, ...) {
    va_list args;
    va_start(args, format);
    print_line(format, args);
    va_end(args);
    fputs("Try 'shade --help'.\n", stderr);
    return CLI_USAGE;
}

/* Prints text that comes from a document. Control characters are escaped: the name of a member must
 * neither break the form of one problem a line nor steer the terminal. */
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

void cli_print_report(const char *file, const shd_report *report) {
    size_t errors = shd_report_errors_kept(report);
    for (size_t i = 0; i < errors; i++) {
        const shd_problem *problem = &report->errors[i];
        if (report->line > 0 && i == 0) {
            fprintf(stderr, "%s:%d:%d: ", file, report->line, report->column);
            print_safely(without_place(problem->detail, report));
            fputc('\n', stderr);
        } else {
            print_problem("", file, problem->pointer, problem->detail);
        }
    }
    if (report->error_count > errors)
        fprintf(stderr, "%s: and %zu more errors\n", file, report->error_count - errors);

    size_t warnings = shd_report_warnings_kept(report);
    for (size_t i = 0; i < warnings; i++) {
        const shd_problem *problem = &report->warnings[i];
        print_problem("warning: ", file, problem->pointer, problem->detail);
    }
    if (report->warning_count > warnings)
        fprintf(stderr, "warning: %s: and %zu more warnings\n", file,
                report->warning_count - warnings);
}

void cli_print_error(const char *file, const shd_error *error) {
    print_problem("", file, error->path, error->text);
}

/* ---- Progress ---- */

enum { BAR_WIDTH = 40 };
static const double BAR_DELAY = 0.5; /* seconds before the first bar */
static const double BAR_PAUSE = 0.1; /* seconds between two */

void cli_progress_begin(cli_progress *progress) {
    memset(progress, 0, sizeof *progress);
    progress->terminal = isatty(STDERR_FILENO);
    progress->start = progress->last = shd_now();
}

/* The columns that a line may fill without wrapping. */
static int terminal_columns(void) {
    struct winsize size;
    if (ioctl(STDERR_FILENO, TIOCGWINSZ, &size) || size.ws_col == 0) return 79;
    return size.ws_col - 1;
}

void cli_progress_draw(cli_progress *progress, double share) {
    if (!progress->terminal || shd_now() - progress->start < BAR_DELAY) return;
    if (progress->drawn && shd_now() - progress->last < BAR_PAUSE) return;
    share = fmin(fmax(share, 0), 1);

    char bar[BAR_WIDTH + 1];
    int full = (int)(share * BAR_WIDTH);
    memset(bar, ' ', BAR_WIDTH);
    memset(bar, '#', (size_t)full);
    bar[BAR_WIDTH] = 0;
    char line[BAR_WIDTH + 32];
    snprintf(line, sizeof line, "[%s] %3d %%", bar, (int)(share * 100));
    fprintf(stderr, "\r%.*s", terminal_columns(), line);
    fflush(stderr);
    progress->drawn = true;
    progress->last = shd_now();
}

void cli_progress_end(cli_progress *progress) {
    if (!progress->drawn) return;
    fputs("\r\033[K", stderr); /* to the line's start, erase to its end */
    fflush(stderr);
    progress->drawn = false;
}
