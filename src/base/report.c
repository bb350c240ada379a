#include "base/report.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

void shd_report_init(shd_report *report, shd_arena *arena) {
    memset(report, 0, sizeof *report);
    report->arena = arena;
}

static shd_problem make_problem(shd_arena *arena, const char *pointer, const char *detail) {
    const char *kept_pointer = shd_arena_strdup(arena, pointer);
    const char *kept_detail = shd_arena_strdup(arena, detail);
    return (shd_problem){kept_pointer ? kept_pointer : "",
                         kept_detail ? kept_detail : "out of memory for this message"};
}

void shd_report_error(shd_report *report, shd_status status, const char *pointer,
                      const char *format, ...) {
    if (report->status == SHD_OK) {
        report->status = status;
        report->limit = status == SHD_MEMORY ? SHD_LIMIT_MEMORY : SHD_LIMIT_NONE;
    }
    if (report->error_count < SHD_REPORT_KEEP) {
        char detail[sizeof((shd_error *)0)->text];
        va_list args;
        va_start(args, format);
        vsnprintf(detail, sizeof detail, format, args);
        va_end(args);
        report->errors[report->error_count] = make_problem(report->arena, pointer, detail);
    }
    report->error_count++;
}

void shd_report_limit(shd_report *report, shd_limit limit) {
    if (report->error_count == 1) report->limit = limit;
}

void shd_report_warning(shd_report *report, const char *pointer, const char *format, ...) {
    if (report->warning_count < SHD_REPORT_KEEP) {
        char detail[sizeof((shd_error *)0)->text];
        va_list args;
        va_start(args, format);
        vsnprintf(detail, sizeof detail, format, args);
        va_end(args);
        report->warnings[report->warning_count] = make_problem(report->arena, pointer, detail);
    }
    report->warning_count++;
}

static size_t kept_count(size_t count) {
    return count < SHD_REPORT_KEEP ? count : SHD_REPORT_KEEP;
}

size_t shd_report_errors_kept(const shd_report *report) {
    return kept_count(report->error_count);
}

size_t shd_report_warnings_kept(const shd_report *report) {
    return kept_count(report->warning_count);
}
