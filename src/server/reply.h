/* An answer before it becomes HTTP: status, headers, body. Built by whichever thread knows it,
 * sent by http.c. A reply belongs to one thread at a time. */
#ifndef SHD_SERVER_REPLY_H
#define SHD_SERVER_REPLY_H

#include <stdbool.h>
#include <stddef.h>

#include "base/status.h"

enum { SHD_REPLY_HEADERS = 32 };

typedef struct shd_reply {
    unsigned status; /* 0: not answered yet */
    size_t header_count;
    struct {
        const char *name; /* literal */
        char *value;      /* owned */
    } headers[SHD_REPLY_HEADERS];
    void *owned_body;
    const void *body; /* the owned one, or one that is lent */
    size_t size;
} shd_reply;

/* Frees everything and leaves an empty reply. */
void shd_reply_clear(shd_reply *reply);

/* Header values are made safe: whatever is not printable ASCII, and '%' itself, leaves
 * percent-encoded; over-long ones are cut. Where memory is short the header is left out. */
void shd_reply_header(shd_reply *reply, const char *name, const char *format, ...) SHD_PRINTF(3, 4);

/* A value as it is: only for text that is known to be safe. */
void shd_reply_plain(shd_reply *reply, const char *name, const char *value);

/* The body: given to the reply, which frees it, or lent for longer than the reply lives. */
void shd_reply_give(shd_reply *reply, const char *media_type, void *body, size_t size);
void shd_reply_lend(shd_reply *reply, const char *media_type, const void *body, size_t size);

/* The whole reply as an HTTP/1.1 message that ends its connection, for refusals that cannot go
 * through libmicrohttpd. The caller frees it; NULL where memory is short. */
char *shd_reply_raw(const shd_reply *reply, bool with_body, size_t *length);

#endif
