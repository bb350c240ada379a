/* A report: everything that is wrong with a document, or worth a word, in one answer.
 *
 * Up to SHD_REPORT_KEEP problems of each kind are kept, the rest are counted. Texts live in the
 * arena. If the arena is full a fixed text stands in, so that no problem is lost from the count. */
#pragma once

#include <stddef.h>

#include "base/arena.h"
#include "base/status.h"

enum { SHD_REPORT_KEEP = 64 };

typedef struct shd_problem {
    const char *pointer; /* JSON Pointer (RFC 6901): "" is the whole document */
    const char *detail;  /* one sentence, no trailing period */
} shd_problem;

typedef struct shd_report {
    shd_arena *arena;
    shd_status status; /* SHD_OK, or the first error's: SHD_SYNTAX, SHD_SCENE, SHD_LIMIT, ... */
    shd_limit limit;   /* of the first error, if that is SHD_LIMIT or SHD_MEMORY */
    int line, column;  /* of a syntax error, from 1; otherwise 0 */
    size_t error_count, warning_count; /* all of them; min(count, SHD_REPORT_KEEP) are kept */
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

/* How many problems of each kind are kept. */
size_t shd_report_errors_kept(const shd_report *report);
size_t shd_report_warnings_kept(const shd_report *report);
