#include "base/report.h"

#include <stdarg.h>
#include <stdio.h>

#include "base/arena.h"

void shd_report_init(shd_report *report, shd_arena *arena) {
    *report = (shd_report){.arena = arena};
}

/* Adds a problem to `list`, of which there are *count. */
static void add_problem(shd_arena *arena, shd_problem *list, size_t *count, const char *pointer,
                        const char *format, va_list args) {
    if (*count < SHD_REPORT_KEEP) {
        char text[sizeof((shd_error *)0)->text];
        vsnprintf(text, sizeof text, format, args);
        const char *kept = shd_arena_strdup(arena, pointer),
                   *detail = shd_arena_strdup(arena, text);
        list[*count] =
            (shd_problem){kept ? kept : "", detail ? detail : "out of memory for this message"};
    }
    ++*count;
}

void shd_report_error(shd_report *report, shd_status status, const char *pointer,
                      const char *format, ...) {
    if (report->status == SHD_OK) {
        report->status = status;
        report->limit = status == SHD_MEMORY ? SHD_LIMIT_MEMORY : SHD_LIMIT_NONE;
    }
    va_list args;
    va_start(args, format);
    add_problem(report->arena, report->errors, &report->error_count, pointer, format, args);
    va_end(args);
}

void shd_report_limit(shd_report *report, shd_limit limit) {
    if (report->error_count == 1) report->limit = limit;
}

void shd_report_warning(shd_report *report, const char *pointer, const char *format, ...) {
    va_list args;
    va_start(args, format);
    add_problem(report->arena, report->warnings, &report->warning_count, pointer, format, args);
    va_end(args);
}
