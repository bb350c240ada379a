/* The trace that a request belongs to (W3C Trace Context, level 1, section 3.2), for the log. */
#pragma once

#include <stdbool.h>

typedef struct shd_trace {
    char id[33], parent[17]; /* hexadecimal; "": there is none */
} shd_trace;

/* Reads a traceparent field, of an unknown version as far as version 00 goes. False: it is none. */
bool shd_trace_read(const char *field, shd_trace *out);
