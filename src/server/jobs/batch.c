/* POST /v1/batch: variants of a scene, each a job of its own, answered in order as parts of one
 * body while it is sent.
 *
 * A few jobs are ahead of what is sent, and no more: a client that does not read has so many
 * answers wait for it, and the rest is not even begun. */
#include <assert.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "server/answer/problem.h"
#include "server/ops/settings.h"
#include "variants.h"
#include "work.h"

enum { AHEAD_MOST = 16, HEAD_SIZE = 256, TAIL_SIZE = 80 };

typedef struct parade parade;

/* A variant whose answer is wanted next, or soon. */
typedef struct slot {
    shd_waiter waiter;
    parade *parade;
    enum {
        SLOT_FREE,    /* nothing was asked */
        SLOT_WAITS,   /* its job has its answer to give */
        SLOT_REFUSED, /* there was no place for it, and it is asked for again */
        SLOT_DONE
    } state;
    shd_reply reply;
} slot;

struct parade {
    shd_stream stream;
    shd_server *server;
    shd_settings *settings;
    struct shd_variety *variety;
    char client[SHD_CLIENT_SIZE], id[SHD_ID_SIZE], boundary[40];
    size_t count, ahead; /* variants; and slots, of which variant i has i % ahead */

    pthread_mutex_t mutex;
    slot slots[AHEAD_MOST];
    size_t head;            /* the variant that is sent next */
    shd_exchange *exchange; /* while it is suspended for the head, else NULL */
    bool is_left;

    /* The I/O thread's own. */
    char text[HEAD_SIZE];       /* before a part's body, or behind the last one */
    const char *body;           /* the part's, of `size` bytes */
    size_t size, text_size, at; /* of the text, then of the body */
    bool in_body, is_over;
};

static_assert(offsetof(slot, waiter) == 0 && offsetof(parade, stream) == 0, "found by these");

/* ---- Answers ---- */

static bool is_crowded_out(const shd_waiter *waiter) {
    return waiter->sent == SHD_SENT_FULL || waiter->sent == SHD_SENT_DISPLACED ||
           waiter->sent == SHD_SENT_CROWD;
}

/* The slot's answer is there, by whichever thread. What is next is not refused for want of a place
 * as long as it can wait for another one of these. */
static void take_answer(shd_waiter *waiter) {
    slot *s = (slot *)(void *)waiter;
    parade *p = s->parade;
    shd_exchange *waiting = NULL;
    pthread_mutex_lock(&p->mutex);
    const bool is_head = s == &p->slots[p->head % p->ahead];
    s->state = is_crowded_out(waiter) && !is_head ? SLOT_REFUSED : SLOT_DONE;
    if (is_head) {
        waiting = p->exchange;
        p->exchange = NULL;
    }
    pthread_mutex_unlock(&p->mutex);
    if (waiting) shd_exchange_resume(waiting);
    shd_stream_drop(&p->stream);
}

/* Without the mutex, for the answer may be there before this returns. False: memory is short. */
static bool ask_variant(parade *p, slot *s, size_t variant) {
    shd_job *job = calloc(1, sizeof *job);
    if (!job) return false;
    *job = (shd_job){.server = p->server,
                     .settings = p->settings,
                     .work = &shd_variant_work,
                     .variety = shd_variety_hold(p->variety),
                     .variant = variant,
                     .size = shd_batch_size(shd_variety_batch(p->variety)),
                     .question = {.fallback = SHD_PNG,
                                  .picture_accepted = true,
                                  .settings = p->settings->number}};
    memcpy(job->id, p->id, sizeof job->id);
    strcpy(job->client, p->client);
    atomic_fetch_add(&job->settings->holders, 1);
    shd_reply_clear(&s->reply);
    s->waiter = (shd_waiter){
        .client = p->client, .asked = shd_now(), .reply = &s->reply, .answer = take_answer};
    shd_stream_hold(&p->stream);
    shd_job_enter(job, &s->waiter);
    return true;
}

/* Asks for variants until as many are ahead as may be. On the I/O thread, which alone turns free
 * and refused slots into others. */
static bool ask_ahead(parade *p) {
    for (size_t i = p->head; i < p->count && i - p->head < p->ahead; i++) {
        slot *s = &p->slots[i % p->ahead];
        pthread_mutex_lock(&p->mutex);
        const bool asks = s->state == SLOT_FREE || s->state == SLOT_REFUSED;
        if (asks) s->state = SLOT_WAITS;
        pthread_mutex_unlock(&p->mutex);
        if (asks && !ask_variant(p, s, i)) return false;
    }
    return true;
}

/* ---- Parts ---- */

/* An answer that memory was refused for in part is not sent: what says so needs none. */
static void write_part_head(parade *p, const shd_reply *reply) {
    const char *type = "application/problem+json", *suffix = "json";
    p->body = reply->is_short ? shd_problem_last_words : reply->body;
    p->size = reply->is_short ? strlen(shd_problem_last_words) : reply->size;
    for (size_t i = 0; i < reply->header_count && !reply->is_short; i++)
        if (!strcmp(reply->headers[i].name, "Content-Type")) type = reply->headers[i].value;
    for (int f = 0; f < SHD_FORMAT_COUNT; f++)
        if (!strcmp(type, shd_format_get((shd_format)f)->media_type))
            suffix = shd_format_get((shd_format)f)->name;
    p->text_size = (size_t)snprintf(
        p->text, sizeof p->text,
        "%s--%s\r\nContent-Disposition: form-data; name=\"%zu\"; filename=\"%zu.%s\"\r\n"
        "Content-Type: %s\r\n\r\n",
        p->head ? "\r\n" : "", p->boundary, p->head, p->head, suffix, type);
}

/* Bytes of answers that wait to be sent. */
static size_t bytes_ahead(parade *p) {
    size_t bytes = 0;
    pthread_mutex_lock(&p->mutex);
    for (size_t i = 0; i < p->ahead; i++)
        if (p->slots[i].state == SLOT_DONE) bytes += shd_reply_alone(&p->slots[i].reply);
    pthread_mutex_unlock(&p->mutex);
    return bytes;
}

static bool is_head_done(parade *p) {
    pthread_mutex_lock(&p->mutex);
    const bool is_done = p->slots[p->head % p->ahead].state == SLOT_DONE;
    pthread_mutex_unlock(&p->mutex);
    return is_done;
}

/* The part that is sent next begins. False: its answer is not there yet. */
static bool begin_part(parade *p, shd_exchange *exchange) {
    if (p->head == p->count) {
        p->text_size = (size_t)snprintf(p->text, sizeof p->text, "\r\n--%s--\r\n", p->boundary);
        return true;
    }
    if (!is_head_done(p)) return false;
    write_part_head(p, &p->slots[p->head % p->ahead].reply);
    shd_exchange_part(exchange, bytes_ahead(p));
    return true;
}

/* The head is sent: the next one is it. */
static bool end_part(parade *p) {
    p->text_size = p->at = 0;
    p->in_body = false;
    if (p->head == p->count) {
        p->is_over = true;
        return true;
    }
    slot *s = &p->slots[p->head % p->ahead];
    shd_reply_clear(&s->reply);
    pthread_mutex_lock(&p->mutex);
    s->state = SLOT_FREE;
    p->head++;
    pthread_mutex_unlock(&p->mutex);
    return ask_ahead(p);
}

/* What is there of the text and the body, as far as there is room. */
static size_t copy_part(parade *p, char *out, size_t room) {
    const char *from = p->in_body ? p->body : p->text;
    const size_t size = p->in_body ? p->size : p->text_size;
    const size_t some = size - p->at < room ? size - p->at : room;
    if (some) memcpy(out, from + p->at, some);
    p->at += some;
    return some;
}

/* ---- The stream ---- */

/* The exchange waits for the head, unless that is there by now, or nobody wants it any more. */
static void wait_for_head(parade *p, shd_exchange *exchange) {
    shd_exchange_suspend(exchange);
    const bool stops = atomic_load(&p->server->stopping);
    pthread_mutex_lock(&p->mutex);
    const bool waits = !stops && p->slots[p->head % p->ahead].state == SLOT_WAITS && !p->is_left;
    if (waits) p->exchange = exchange;
    pthread_mutex_unlock(&p->mutex);
    if (!waits) shd_exchange_resume(exchange);
}

static ssize_t read_parade(shd_stream *stream, shd_exchange *exchange, char *out, size_t room) {
    parade *p = (parade *)(void *)stream;
    size_t size = 0;
    pthread_mutex_lock(&p->mutex);
    const bool is_left = p->is_left;
    pthread_mutex_unlock(&p->mutex);
    if (is_left || atomic_load(&p->server->stopping) || !ask_ahead(p)) return SHD_STREAM_BREAKS;
    while (size < room && !p->is_over) {
        if (!p->text_size && !begin_part(p, exchange)) break;
        size += copy_part(p, out + size, room - size);
        if (p->at < (p->in_body ? p->size : p->text_size)) break;
        if (!p->in_body && p->head < p->count) {
            p->in_body = true;
            p->at = 0;
        } else if (!end_part(p)) {
            return SHD_STREAM_BREAKS;
        }
    }
    if (!size && p->is_over) return SHD_STREAM_ENDS;
    if (!size) wait_for_head(p, exchange);
    return (ssize_t)size;
}

static bool leave_parade(shd_stream *stream) {
    parade *p = (parade *)(void *)stream;
    pthread_mutex_lock(&p->mutex);
    const bool was_left = p->is_left, was_waiting = p->exchange;
    p->is_left = true;
    p->exchange = NULL;
    pthread_mutex_unlock(&p->mutex);
    for (size_t i = 0; i < p->ahead && !was_left; i++)
        if (shd_jobs_leave(p->server->jobs, &p->slots[i].waiter)) shd_stream_drop(stream);
    return was_waiting;
}

static void free_parade(shd_stream *stream) {
    parade *p = (parade *)(void *)stream;
    for (size_t i = 0; i < p->ahead; i++) shd_reply_clear(&p->slots[i].reply);
    shd_variety_drop(p->variety);
    shd_settings_drop(p->settings);
    pthread_mutex_destroy(&p->mutex);
    free(p);
}

/* ---- The request ---- */

/* Enough to keep all workers busy, but no more than half of the queue: this client may have more to
 * ask. */
static size_t count_ahead(const shd_server *server) {
    const size_t wanted = 2 * (size_t)shd_engine_load(server->engine).threads + 2;
    size_t most = (size_t)server->config.queue / 2;
    if (most > AHEAD_MOST) most = AHEAD_MOST;
    if (!most) most = 1;
    return wanted < most ? wanted : most;
}

/* The boundary follows from the request: the same one gives the same bytes. */
static parade *new_parade(shd_job *job, shd_batch *batch) {
    static const shd_stream_kind kind = {read_parade, leave_parade, free_parade};
    char digits[SHD_DIGEST_TEXT];
    const shd_digest digest = shd_digest_of(job->body, job->size);
    parade *p = calloc(1, sizeof *p);
    struct shd_variety *variety = p ? shd_variety_take(job, batch) : NULL;
    if (!variety) {
        free(p);
        return NULL;
    }
    shd_digest_write(&digest, digits);
    p->stream = (shd_stream){.kind = &kind, .holders = 1};
    p->server = job->server;
    p->settings = job->settings;
    atomic_fetch_add(&p->settings->holders, 1);
    p->variety = variety;
    p->count = shd_batch_count(batch);
    p->ahead = count_ahead(job->server);
    strcpy(p->client, job->client);
    memcpy(p->id, job->id, sizeof p->id);
    snprintf(p->boundary, sizeof p->boundary, "shaded-%.32s", digits);
    pthread_mutex_init(&p->mutex, NULL);
    for (size_t i = 0; i < p->ahead; i++) p->slots[i].parade = p;
    return p;
}

static void read_batch(shd_job *job);

/* A sheet, or a turntable, is a picture, and the job's from now on. */
static void read_one(shd_job *job, shd_batch *batch) {
    static const shd_work work = {.read = read_batch,
                                  .run = shd_picture_run,
                                  .settle = shd_picture_settle,
                                  .add = shd_picture_add};
    if (shd_job_outgrows(job, shd_batch_count(batch) * shd_batch_size(batch))) {
        shd_batch_drop(batch);
        return;
    }
    const shd_status status = shd_request_read_one(job->request, batch, job->question.fallback);
    if (status == SHD_CANCELLED) return;
    job->work = &work;
    if (status != SHD_OK)
        shd_problem_report(&job->reply, shd_request_report(job->request), SHD_BAD_SCENE);
    else if (!job->question.picture_accepted)
        shd_problem_reply(&job->reply, SHD_NOT_ACCEPTABLE,
                          "Accept admits multipart/form-data only, but the batch asks for one "
                          "picture");
    else
        shd_picture_find(job);
}

/* Its variants are parts of one answer. */
static void read_parts(shd_job *job, shd_batch *batch) {
    shd_reply *reply = &job->reply;
    if (!job->takes_parts) {
        shd_batch_drop(batch);
        shd_problem_reply(reply, SHD_NOT_ACCEPTABLE,
                          "a batch without a `sheet` or a `turntable` is answered as "
                          "multipart/form-data");
        return;
    }
    parade *p = new_parade(job, batch);
    if (!p) {
        shd_batch_drop(batch);
        shd_problem_reply(reply, SHD_NO_MEMORY, "out of memory");
        return;
    }
    reply->status = 200;
    reply->stream = &p->stream;
    shd_reply_header(reply, "Content-Type", "multipart/form-data; boundary=%s", p->boundary);
    shd_reply_plain(reply, "Cache-Control", "no-store");
    shd_job_warn(job);
}

static void read_batch(shd_job *job) {
    const char *body = job->body ? (const char *)job->body : "";
    shd_batch *batch;
    const shd_status status = shd_request_read_batch(job->request, body, job->size, &batch);
    if (status == SHD_CANCELLED) return;
    if (status != SHD_OK)
        shd_problem_report(&job->reply, shd_request_report(job->request), SHD_BAD_SCENE);
    else if (shd_batch_is_one(batch))
        read_one(job, batch);
    else
        read_parts(job, batch);
}

static void run_nothing(shd_job *job) {
    (void)job; /* what is read is answered */
}

void shd_batch_submit(shd_exchange *exchange) {
    static const shd_work work = {.read = read_batch, .run = run_nothing, .size = SHD_SMALL};
    shd_job_submit(exchange, &work);
}
