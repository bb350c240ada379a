/* Decodes the files of strangers in a process of its own, shaded-decode, which is started for each
 * and ends with it: it may take the memory that it is given, some seconds, and no file. What it
 * answers is checked. Any thread. */
#pragma once

#include "base/budget.h"
#include "base/cancel.h"
#include "base/status.h"
#include "decode/wire.h"

typedef struct shd_decode_job {
    const void *data; /* the file */
    size_t size;
    size_t most;                  /* pixels */
    shd_budget *budget;           /* what the process may take is counted there while it runs */
    const atomic_bool *cancelled; /* ends it; or NULL */
    /* Gives room for the samples, once they are known to be `bytes`, aligned to 4. NULL, with an
     * error: they are not wanted. Called once at most; what it gave stays the caller's in any case.
     */
    void *(*room)(void *context, const shd_decoded *picture, size_t bytes, shd_error *error);
    void *context;
    atomic_bool *loose; /* NULL; or becomes true if the kernel does not confine the process to the
                         * system calls that it needs */
} shd_decode_job;

/* Decodes into that room. SHD_SCENE: it is no picture that is read here, with a sentence that tells
 * why. SHD_LIMIT: it has more pixels, or takes more time or memory than there is for it.
 * SHD_CROWDED, SHD_EXHAUSTED, SHD_CANCELLED. SHD_INTERNAL: shaded-decode is not installed, or ended
 * without an answer. */
shd_status shd_decode_file(const shd_decode_job *job, shd_decoded *out, shd_error *error);
