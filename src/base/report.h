/* A report: everything that is wrong with a document, or worth a word, in one answer. Texts live in
 * the arena. If that is full, a fixed text stands in. */
#pragma once

#include <stddef.h>

#include "base/status.h"

typedef struct shd_arena shd_arena; /* base/arena.h */

enum { SHD_REPORT_KEEP = 64 }; /* problems of each kind; the rest are counted */

typedef struct shd_problem {
    const char *pointer; /* JSON Pointer (RFC 6901): "" is the whole document */
    const char *detail;  /* one sentence, no trailing period */
} shd_problem;

typedef struct shd_report {
    shd_arena *arena;
    shd_status status; /* SHD_OK, or the first error's: SHD_SYNTAX, SHD_SCENE, SHD_LIMIT, ... */
    shd_limit limit;   /* of the first error, if that is SHD_LIMIT or SHD_MEMORY */
    int line, column;  /* of a syntax error, from 1; otherwise 0 */
    size_t error_count, warning_count; /* all of them */
    shd_problem errors[SHD_REPORT_KEEP];
    shd_problem warnings[SHD_REPORT_KEEP];
} shd_report;

void shd_report_init(shd_report *report, shd_arena *arena);

/* Adds an error; `status` is not SHD_OK. `pointer` is copied. */
void shd_report_error(shd_report *report, shd_status status, const char *pointer,
                      const char *format, ...) SHD_PRINTF(4, 5);
/* The error that was added last is about this limit. */
void shd_report_limit(shd_report *report, shd_limit limit);
void shd_report_warning(shd_report *report, const char *pointer, const char *format, ...)
    SHD_PRINTF(3, 4);

static inline size_t shd_report_errors_kept(const shd_report *report) {
    return report->error_count < SHD_REPORT_KEEP ? report->error_count : SHD_REPORT_KEEP;
}

static inline size_t shd_report_warnings_kept(const shd_report *report) {
    return report->warning_count < SHD_REPORT_KEEP ? report->warning_count : SHD_REPORT_KEEP;
}
