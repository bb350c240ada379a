/* A job: a document that a worker reads and makes an answer from.
 *
 * Exchanges wait for it, suspended: usually one, but several if the same is asked for while it is
 * being made, and then it is made once. Each may leave, because its client has gone or its deadline
 * has come. A job that nobody waits for any more is taken from the queue, or cancelled.
 *
 *     work.c   what a worker does with a job
 *     jobs.c   who waits for which job: joining, leaving, deadlines
 *     turns.c  which job a worker takes, and gives way to
 *     queue.c  whose job is next; stuck.c  which do not end
 *     batch.c  many jobs with one answer; variants.c  what they share
 *     render_job.c, json_job.c, put_job.c, preview.c, scene_link.c  the kinds of work
 *
 * A job belongs to the thread that made it, then to jobs.c, then to a worker. */
#pragma once

#include "base/lru.h"
#include "queue.h"
#include "server/access/client.h"
#include "server/answer/cache.h"
#include "server/server.h"
#include "stuck.h"

typedef struct shd_job shd_job;
typedef struct shd_exchange shd_exchange;

/* A kind of work. A worker calls `read` and then `run`, which fill job->reply if they know the
 * answer. If `read` leaves it empty, `run` follows; if `run` does, it was cancelled. */
typedef struct shd_work {
    /* Whether the answer is known before anything is read. On the I/O thread; may be NULL. */
    bool (*recall)(const shd_job *job, const shd_exchange *exchange, shd_reply *reply);
    void (*read)(shd_job *job);
    void (*run)(shd_job *job);
    /* Whether one waiter has its answer before anything is run. After `read`, on any thread, also
     * while the job runs; may be NULL. */
    bool (*settle)(const shd_job *job, const shd_exchange *exchange, shd_reply *reply);
    /* What answers have besides what they share. May be NULL. */
    void (*add)(const shd_job *job, double queued, shd_reply *reply);
    /* The same question gets the same bytes, so that it need not be answered twice at a time. */
    bool shared;
    enum { SHD_BY_SCENE, SHD_SMALL, SHD_LARGE } size;
} shd_work;

struct shd_job {
    shd_server *server;
    struct shd_settings *settings;
    const shd_work *work;

    shd_question question;
    shd_digest digest; /* these three as its exchange's, of work that is not shared */
    bool is_binary;
    char client[SHD_CLIENT_SIZE];
    /* What the question's body stands for. If that has a coding, a worker guesses its size, or
     * has it in `decoded`, which is owned. */
    const unsigned char *body;
    size_t size;
    bool was_measured;
    size_t
        documents; /* bytes of those that a batch for one picture stands for; 0 until it is read */
    bool is_link;  /* the document was made of a link, in whose words its mistakes are told */
    shd_kept_scene *kept;        /* whose text `body` is, or NULL: it is to be found, or none */
    struct shd_variety *variety; /* it is a variant of this, or NULL */
    size_t variant;
    unsigned char *decoded;
    size_t body_bytes; /* of both, as the server counts them */
    bool takes_gzip;   /* its one exchange does, as above, */
    bool takes_parts;  /* and multipart/form-data */

    char id[SHD_ID_SIZE]; /* of the request that it was made for */
    shd_request *request;
    shd_reply reply;
    shd_cached cached;
    char timing[400];       /* Server-Timing, without the time waited */
    double asked, deadline; /* when it was first asked for, and until when it is done */
    double began, seconds;  /* when a worker took it, and what workers spent on it so far */
    double cost;            /* in the units of shd_request_work; jobs.c's, once it has the job */
    double done;            /* the share of its tiles; its worker's own */

    /* jobs.c's own. */
    struct shd_waiter *waiters;
    shd_turn turn;               /* in the queue */
    struct shd_begun *begun;     /* turns.c's, of a large one that a worker has */
    shd_job *earlier, *later;    /* by deadline */
    shd_key by_body, by_meaning; /* without a thing, it is not found by them */
    bool was_read;               /* without a mistake: it may settle */
    bool may_cancel;             /* it has a request that is not done */
    shd_watched watched;         /* once it is cancelled */
};
