/* A body that is made while it is sent.
 *
 * It has several holders. The I/O thread alone reads it, for the exchange whose answer it is. */
#pragma once

#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <sys/types.h>

typedef struct shd_exchange shd_exchange;

typedef struct shd_stream {
    const struct shd_stream_kind *kind;
    atomic_uint holders;
} shd_stream;

enum { SHD_STREAM_ENDS = -1, SHD_STREAM_BREAKS = -2 };

typedef struct shd_stream_kind {
    /* Some of the next bytes, `room` at most. 0: there are none yet, and the exchange is suspended
     * until there are, or until it is left. Or the end, or that the connection is to be closed. */
    ssize_t (*read)(shd_stream *stream, shd_exchange *exchange, char *out, size_t room);
    /* Nothing is read any more; work for it ends. Any thread, and more than once. True: the
     * exchange was suspended, and is the caller's to resume. */
    bool (*leave)(shd_stream *stream);
    void (*free)(shd_stream *stream);
} shd_stream_kind;

static inline shd_stream *shd_stream_hold(shd_stream *stream) {
    if (stream) atomic_fetch_add(&stream->holders, 1);
    return stream;
}

/* The last one frees it; NULL is fine. */
static inline void shd_stream_drop(shd_stream *stream) {
    if (stream && atomic_fetch_sub(&stream->holders, 1) == 1) stream->kind->free(stream);
}
