/* One request on its way through the daemon.
 *
 * An exchange belongs to the I/O thread. Between shd_exchange_suspend and shd_exchange_resume its
 * waiter belongs to jobs.c, and nobody else touches it. libmicrohttpd holds the only reference: it
 * asks for an exchange with a request's first line, and says when the exchange has ended. */
#pragma once

#include "paths.h"
#include "server.h"
#include "server/access/client.h"
#include "server/answer/reply.h"
#include "server/conn/inflate.h"
#include "server/conn/trace.h"
#include "server/jobs/jobs.h"

struct MHD_Connection;

enum { SHD_PATH_SIZE = 512 };

typedef struct shd_exchange {
    shd_server *server;
    struct shd_settings *settings;
    struct MHD_Connection *connection;
    enum {
        SHD_BEGUN,    /* its target was read */
        SHD_READING,  /* its head was */
        SHD_WAITING,  /* a worker has it, or had it */
        SHD_ANSWERED, /* its answer is on its way, or sent */
    } state;
    shd_route route;
    char id[SHD_ID_SIZE];
    shd_method method;
    char method_name[16], path[SHD_PATH_SIZE]; /* for the log, which cuts them */
    bool path_cut, path_hides;                 /* head.h */
    char client[SHD_CLIENT_SIZE];              /* "": its head was not read */
    /* The name of the token that let it in, "" if that has none. NULL: no token did. */
    const char *token;
    long long expires;      /* of the link that let it in, seconds since 1970; 0: never */
    char *target;           /* path and query as they were sent; owned */
    const char *target_end; /* in libmicrohttpd's memory, until the head is read */

    /* The head's fields, NULL if there are none. Strings live as long as the exchange. */
    char *accept, *accept_encoding, *content_encoding, *if_none_match, *forwarded_for;
    const char *content_type, *origin;
    const char *authorization; /* a secret; NULL, too, if there is more than one */
    bool is_preflight;
    shd_trace trace;

    shd_digest digest; /* of a path that ends in one */
    bool is_link;      /* scene_link.h: the path ends in a format, which is the answer's */
    shd_format format;
    bool is_digest;       /* of a document that is kept, and not the body, which is the digest */
    shd_kept_scene *kept; /* that document; NULL: a worker finds it */
    const char *kept_text;
    size_t kept_size;
    bool is_binary;    /* the body is application/octet-stream */
    shd_coding coding; /* of the body */
    unsigned char *body;
    size_t size, capacity; /* the server's body_bytes counts the capacity */

    double started, submitted; /* on shd_now()'s clock */
    shd_waiter waiter;
    shd_reply reply;
    shd_stream *stream; /* the reply's, once it is read */
    size_t unsent;      /* bytes of its answer that the server counts as such */

    bool is_refused;   /* it has its answer, but its body is read first */
    bool is_counted;   /* by the server's in_flight */
    bool is_accepted;  /* and by its `accepted` */
    bool is_suspended; /* and by its `suspended` */
} shd_exchange;

/* NULL if memory is short. */
shd_exchange *shd_exchange_new(shd_server *server, struct MHD_Connection *connection);
void shd_exchange_drop(shd_exchange *exchange);

void shd_exchange_count(shd_exchange *exchange);  /* it is a request, and in flight from now on */
void shd_exchange_accept(shd_exchange *exchange); /* all of it has come */

/* Says who the client is by its token or, if it came without one, by its address. */
void shd_exchange_set_client(shd_exchange *exchange);

/* Takes the connection from the I/O thread's loop, before the exchange waits for a job, or its
 * stream for a part. */
void shd_exchange_suspend(shd_exchange *exchange);

/* Gives it back once the reply is there, or its client has gone: then the reply is empty. On any
 * thread. The exchange may not exist any more when this returns. */
void shd_exchange_resume(shd_exchange *exchange);

void shd_exchange_wake(shd_exchange *exchange); /* it runs on the I/O thread again */
void shd_exchange_send(shd_exchange *exchange); /* its answer is being sent */

/* A part of its stream is being sent, while answers to come have so many bytes of memory. */
void shd_exchange_part(shd_exchange *exchange, size_t bytes);

/* The next bytes of its stream, as libmicrohttpd asks for them. */
ssize_t shd_exchange_read(void *exchange, uint64_t at, char *out, size_t room);

/* The bytes of its answer's body that are sent. */
size_t shd_exchange_sends(const shd_exchange *exchange);
