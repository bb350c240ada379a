/* Documents that have scenes and pictures in them: two that are to be compared, and a scene with
 * its photo. */
#pragma once

#include "base/cancel.h"
#include "base/limits.h"
#include "base/report.h"
#include "scene/span.h"

typedef struct shd_pair_texts {
    shd_span sides[2];    /* the documents, which are objects, as they are written */
    const char *names[2]; /* or what pictures are named by, in the arena; NULL: it is a document */
    double density;       /* `pixelsPerDegree`; 0: it is not there */
} shd_pair_texts;

/* Reads {"a": {...}, "b": "sha256-...", "pixelsPerDegree": 67}; the scenes are not looked into.
 * Returns the report's status. */
shd_status shd_pair_read(const char *text, size_t length, const shd_limits *limits,
                         const atomic_bool *cancelled, shd_arena *arena, shd_pair_texts *out,
                         shd_report *report);

typedef struct shd_fit_texts {
    shd_span scene;     /* as it is written */
    const char *photo;  /* what the picture is named by, in the arena */
    const char *object; /* NULL: it is not there */
} shd_fit_texts;

/* The same of {"scene": {...}, "photo": "sha256-...", "object": "ball"}. */
shd_status shd_fit_read(const char *text, size_t length, const shd_limits *limits,
                        const atomic_bool *cancelled, shd_arena *arena, shd_fit_texts *out,
                        shd_report *report);
