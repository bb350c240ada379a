/* An answer before it becomes HTTP: status, headers, body. Built by whichever thread knows it,
 * sent by http.c. A reply belongs to one thread at a time. */
#pragma once

#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>

#include "base/budget.h"
#include "base/status.h"
#include "stream.h"

enum { SHD_REPLY_HEADERS = 32 };

/* Bytes that several replies may share. */
typedef struct shd_bytes_held {
    atomic_uint holders;
    void *data;
    shd_budget *budget; /* that has `counted` bytes for them */
    size_t counted;
} shd_bytes_held;

void shd_bytes_drop(void *held); /* the last one frees them; NULL is fine */

typedef struct shd_reply {
    unsigned status; /* 0: not answered yet */
    shd_limit limit; /* that the request was refused for */
    size_t header_count;
    struct {
        const char *name; /* literal */
        char *value;      /* owned */
    } headers[SHD_REPLY_HEADERS];
    shd_bytes_held *held; /* NULL: the body is lent */
    const void *body;
    size_t size;
    shd_stream *stream; /* the body is made while it is sent; NULL: the body is `body` */
    bool is_short;      /* memory was refused for a part of it: it is not to be sent */
} shd_reply;

/* Frees everything and leaves an empty reply. */
void shd_reply_clear(shd_reply *reply);

/* Header values are made safe: whatever is not printable ASCII, and '%' itself, leaves
 * percent-encoded; over-long ones are cut. */
void shd_reply_header(shd_reply *reply, const char *name, const char *format, ...) SHD_PRINTF(3, 4);

/* Shaded-Warning: a list of strings, each with a pointer, as structured fields write them (RFC
 * 9651), so that fields that were joined by commas come apart again. Text is made safe as above,
 * and so are '"' and '\\'. */
void shd_reply_warning(shd_reply *reply, const char *pointer, const char *detail);

/* A value as it is: only for text that is known to be safe. */
void shd_reply_plain(shd_reply *reply, const char *name, const char *value);

/* Makes an empty reply the same as another one, whose body or stream they share from now on. */
void shd_reply_copy(shd_reply *reply, const shd_reply *from);

/* The body: given to the reply, which frees it, or lent for longer than the reply lives. */
void shd_reply_give(shd_reply *reply, const char *media_type, void *body, size_t size);
void shd_reply_lend(shd_reply *reply, const char *media_type, const void *body, size_t size);

/* What the body was given with takes `bytes` of the budget, which has them counted, until it is
 * freed. */
void shd_reply_count(shd_reply *reply, shd_budget *budget, size_t bytes);

/* The bytes of memory that go with the body when it has been sent; of one that is shared, as with
 * the response cache, its share. */
size_t shd_reply_alone(const shd_reply *reply);

/* Takes the headers from a reply, which keeps its status and body. */
void shd_reply_strip(shd_reply *reply);

/* Gives a reply without a body the body of another one, which they share. */
void shd_reply_share(shd_reply *reply, const shd_reply *from);

/* Gives back what the body's allocation has beyond its size, of a body that nobody shares yet. */
void shd_reply_fit(shd_reply *reply);

/* The time of day as HTTP writes it (RFC 9110, section 5.6.7). No locale is set in the daemon. */
enum { SHD_DATE_SIZE = 32 };
void shd_reply_date(char out[SHD_DATE_SIZE]);

/* The whole reply as an HTTP/1.1 message that ends its connection, for refusals that cannot go
 * through libmicrohttpd. The caller frees it; NULL if memory is short. */
char *shd_reply_raw(const shd_reply *reply, bool with_body, size_t *length);
