#include "work.h"

#include <assert.h>
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "preview.h"
#include "scene_link.h"
#include "server/answer/negotiate.h"
#include "server/answer/problem.h"
#include "server/ops/settings.h"
#include "variants.h"

/* How long others are waited for that give way to an answer, seconds. */
static const double patience = 5;

/* ---- multipart/form-data (RFC 7578) ---- */

/* A name inside a quoted parameter, escaped as browsers do it. */
static void print_name(FILE *out, const char *name) {
    for (; *name; name++) {
        if (*name == '"' || *name == '\r' || *name == '\n')
            fprintf(out, "%%%02X", *name);
        else
            fputc(*name, out);
    }
}

static char *part_head(const char *boundary, const shd_picture *picture, bool first,
                       size_t *length) {
    const shd_format_info *format = shd_format_get(picture->format);
    const char *name = picture->name ? picture->name : "picture";
    char *head = NULL;
    FILE *out = open_memstream(&head, length);
    if (!out) return NULL;
    fprintf(out, "%s--%s\r\nContent-Disposition: form-data; name=\"", first ? "" : "\r\n",
            boundary);
    print_name(out, name);
    fputs("\"; filename=\"", out);
    print_name(out, name);
    fprintf(out, ".%s\"\r\nContent-Type: %s\r\n\r\n", format->name, format->media_type);
    if (!fclose(out)) return head;
    free(head);
    return NULL;
}

/* The boundary follows from the entity tag: the same request gives the same bytes, and that a
 * picture holds the hash of its own document is as unlikely as any collision of the hash. */
static void set_multipart(shd_reply *reply, shd_budget *budget, shd_request *request) {
    char boundary[71], media_type[128], tail[80];
    snprintf(boundary, sizeof boundary, "shaded-%s", shd_request_etag(request));
    snprintf(media_type, sizeof media_type, "multipart/form-data; boundary=%s", boundary);
    size_t count, tail_size = (size_t)snprintf(tail, sizeof tail, "\r\n--%s--\r\n", boundary);
    const shd_picture *pictures = shd_request_pictures(request, &count);

    struct head {
        char *text;
        size_t length;
    } *heads = calloc(count ? count : 1, sizeof *heads);
    size_t total = tail_size;
    bool complete = heads;
    for (size_t i = 0; i < count && complete; i++) {
        heads[i].text = part_head(boundary, &pictures[i], i == 0, &heads[i].length);
        complete = heads[i].text && !__builtin_add_overflow(total, heads[i].length, &total) &&
                   !__builtin_add_overflow(total, pictures[i].size, &total);
    }

    const bool counted = complete && shd_budget_wait(budget, total, patience);
    char *body = counted ? malloc(total) : NULL, *end = body;
    for (size_t i = 0; body && i < count; i++) {
        size_t size = pictures[i].size;
        end = mempcpy(end, heads[i].text, heads[i].length);
        unsigned char *data = shd_request_take(request, i);
        if (size) end = mempcpy(end, data, size);
        free(data);
        shd_budget_give(budget, size);
    }
    if (body) {
        memcpy(end, tail, tail_size);
        shd_reply_give(reply, media_type, body, total);
        shd_reply_count(reply, budget, total);
    } else if (counted) {
        shd_budget_give(budget, total);
    }
    for (size_t i = 0; heads && i < count; i++) free(heads[i].text);
    free(heads);
}

static void set_single(shd_reply *reply, shd_budget *budget, shd_request *request) {
    size_t count;
    const shd_picture *picture = shd_request_pictures(request, &count);
    const char *media_type = picture->animated && picture->format == SHD_PNG
                                 ? "image/apng"
                                 : shd_format_get(picture->format)->media_type;
    const size_t size = picture->size;
    assert(count == 1);
    shd_reply_give(reply, media_type, shd_request_take(request, 0), size);
    shd_reply_count(reply, budget, size);
}

/* ---- Headers ---- */

static void add_validators(const shd_settings *settings, const char *tag, shd_reply *reply) {
    shd_reply_header(reply, "ETag", "\"%s\"", tag);
    shd_reply_plain(reply, "Cache-Control", settings->config.cache_control);
    shd_reply_plain(reply, "Vary", "Accept");
}

/* Most pictures build no trees, trace no rays and have no shadows, and say nothing of them. */
static bool is_run(size_t stage, const double seconds[SHD_STAGE_COUNT]) {
    const bool is_rare =
        stage == SHD_STAGE_BUILD || stage == SHD_STAGE_SHADOW || stage == SHD_STAGE_TRACE;
    return !is_rare || seconds[stage] > 0;
}

static void print_timing(char *out, size_t size, const double seconds[SHD_STAGE_COUNT],
                         const char *reused) {
    size_t length = 0;
    for (size_t i = SHD_STAGE_QUEUE + 1; i < SHD_STAGE_COUNT; i++)
        if (is_run(i, seconds))
            length += (size_t)snprintf(out + length, size - length, ", %s;dur=%.3f",
                                       shd_stage_names[i], seconds[i] * 1e3);
    snprintf(out + length, size - length, ", reuse;desc=%s", reused);
}

/* What every picture has, however it came about; `queued` in seconds. */
static void add_account(shd_reply *reply, shd_metrics *metrics, shd_cached cached, double queued,
                        const char *timing) {
    static const char *const values[] = {[SHD_CACHE_HIT] = "shaded; hit",
                                         [SHD_CACHE_STORED] = "shaded; fwd=miss; stored",
                                         [SHD_CACHE_MISS] = "shaded; fwd=miss"};
    shd_reply_header(reply, "Server-Timing", "%s;dur=%.3f%s", shd_stage_names[SHD_STAGE_QUEUE],
                     queued * 1e3, timing);
    if (cached != SHD_CACHE_OFF) shd_reply_plain(reply, "Cache-Status", values[cached]);
    shd_metrics_cached(metrics, cached);
}

static void add_rays(const shd_request *request, uint64_t rays, double cut, shd_reply *reply) {
    uint64_t edges;
    const double error = shd_request_ray_error(request, &edges);
    char told[80] = "";
    /* Rounded up to two digits. */
    if (isfinite(error))
        snprintf(told, sizeof told, "; error<=%.2g; edges=%" PRIu64, 1.05 * error, edges);
    shd_reply_header(reply, "Shaded-Rays", "%" PRIu64 "; cut=%.2g%s", rays, cut, told);
}

/* What a picture's making tells: kept with it. */
static void add_making(shd_job *job) {
    shd_reply *reply = &job->reply;
    shd_metrics *metrics = &job->server->metrics;
    const shd_times *times = shd_request_times(job->request);
    const double seconds[SHD_STAGE_COUNT] = {
        [SHD_STAGE_PARSE] = times->parse,  [SHD_STAGE_PLAN] = times->plan,
        [SHD_STAGE_BUILD] = times->build,  [SHD_STAGE_VISIBILITY] = times->visibility,
        [SHD_STAGE_SHADE] = times->shade,  [SHD_STAGE_SHADOW] = times->shadow,
        [SHD_STAGE_TRACE] = times->trace,  [SHD_STAGE_COLOR] = times->color,
        [SHD_STAGE_ENCODE] = times->encode};
    for (size_t i = SHD_STAGE_QUEUE + 1; i < SHD_STAGE_COUNT; i++)
        if (is_run(i, seconds)) shd_metrics_stage(metrics, (shd_stage)i, seconds[i]);
    static const char *const reused[] = {[SHD_REUSED_NOTHING] = "nothing",
                                         [SHD_REUSED_GEOMETRY] = "geometry",
                                         [SHD_REUSED_LIGHT] = "light"};
    print_timing(job->timing, sizeof job->timing, seconds,
                 reused[shd_request_reused(job->request)]);
    shd_reply_header(reply, "Shaded-Plan", "%s", shd_request_plan(job->request));

    const char *codec = shd_request_codec(job->request);
    if (codec) shd_reply_header(reply, "Shaded-Codec", "%s", codec);

    uint64_t saturated = shd_request_saturated(job->request);
    if (saturated) {
        atomic_fetch_add(&metrics->saturated, saturated);
        shd_reply_header(reply, "Shaded-Saturated", "%" PRIu64, saturated);
    }
    uint64_t clipped = shd_request_clipped(job->request);
    if (clipped) {
        atomic_fetch_add(&metrics->clipped, clipped);
        shd_reply_header(reply, "Shaded-Clipped", "%" PRIu64, clipped);
    }
    double cut;
    const uint64_t rays = shd_request_rays(job->request, &cut);
    if (rays) add_rays(job->request, rays, cut, reply);
}

/* What the document itself tells, whether the picture is made or found. */
static void add_document(shd_job *job) {
    add_validators(job->settings, shd_request_etag(job->request), &job->reply);
    shd_job_warn(job);
}

/* Whether the client has it. `*` stands for whatever a path has: a link's picture; but a POST makes
 * its own. */
static bool is_known(const shd_exchange *exchange, const char *tag) {
    return shd_etag_matches(exchange->if_none_match, tag, exchange->method != SHD_POST);
}

/* ---- The response cache ---- */

/* Warnings are found by reading: a document that has some must be read. A variant has no bytes that
 * were sent, and what no kept question is looked up for leaves none. */
static const shd_question *question_to_keep(const shd_job *job) {
    if (job->variety || !job->work->recall) return NULL;
    return shd_request_report(job->request)->warning_count ? NULL : &job->question;
}

static bool recall_picture(const shd_job *job, const shd_exchange *exchange, shd_reply *reply) {
    static const double no_time[SHD_STAGE_COUNT] = {0};
    shd_server *server = job->server;
    char tag[SHD_TAG_SIZE], timing[sizeof job->timing];
    if (shd_cache_ask(server->cache, &job->question, tag, reply) != SHD_CACHE_HIT) return false;
    if (is_known(exchange, tag)) {
        shd_reply_strip(reply);
        reply->status = 304;
        add_validators(job->settings, tag, reply);
        return true;
    }
    add_validators(job->settings, tag, reply);
    print_timing(timing, sizeof timing, no_time, "picture");
    add_account(reply, &server->metrics, SHD_CACHE_HIT, 0, timing);
    return true;
}

void shd_picture_find(shd_job *job) {
    job->cached = shd_cache_find(job->server->cache, shd_request_etag(job->request),
                                 question_to_keep(job), &job->reply);
    if (job->cached != SHD_CACHE_HIT) return;
    const double seconds[SHD_STAGE_COUNT] = {[SHD_STAGE_PARSE] =
                                                 shd_request_times(job->request)->parse};
    print_timing(job->timing, sizeof job->timing, seconds, "picture");
    add_document(job);
}

/* ---- The job ---- */

static void read_scene(shd_job *job) {
    shd_job_read(job);
    if (job->reply.status || shd_request_report(job->request)->status) return;
    if (job->question.is_link) shd_scene_link_check(job);
    if (job->reply.status) return;
    if (!shd_request_multipart(job->request) && !job->question.picture_accepted)
        shd_problem_reply(&job->reply, SHD_NOT_ACCEPTABLE,
                          "Accept admits multipart/form-data only, but the scene has no `outputs`");
    else
        shd_picture_find(job);
}

static void read_variant(shd_job *job) {
    if (!shd_variety_write(job)) return;
    shd_job_read(job);
    if (job->reply.status || shd_request_report(job->request)->status) return;
    if (shd_request_multipart(job->request))
        shd_problem_mistakes(
            &job->reply, SHD_BAD_SCENE,
            &(shd_mistake){.pointer = "/outputs",
                           .detail = "a variant has one picture: give one `output` instead"},
            1);
    else
        shd_picture_find(job);
}

bool shd_picture_settle(const shd_job *job, const shd_exchange *exchange, shd_reply *reply) {
    const char *tag = shd_request_etag(job->request);
    if (!is_known(exchange, tag)) return false;
    reply->status = 304;
    add_validators(job->settings, tag, reply);
    return true;
}

static void note_progress(void *job, double share) {
    ((shd_job *)job)->done = share;
}

void shd_picture_run(shd_job *job) {
    shd_error error;
    shd_reply *reply = &job->reply;
    const shd_render_options options = {.progress = note_progress, .context = job};
    shd_status status = shd_request_render(job->request, job->begun ? &options : NULL, &error);
    if (status == SHD_CANCELLED) return;
    if (status) {
        shd_problem_error(reply, &error);
        return;
    }
    add_making(job);
    reply->status = 200;
    if (shd_request_multipart(job->request))
        set_multipart(reply, job->server->budget, job->request);
    else
        set_single(reply, job->server->budget, job->request);
    if (!reply->held) {
        shd_reply_clear(reply);
        shd_problem_reply(reply, SHD_NO_MEMORY, "no memory for the answer");
        return;
    }
    job->cached = shd_cache_put(job->server->cache, shd_request_etag(job->request),
                                question_to_keep(job), reply);
    add_document(job);
}

void shd_picture_add(const shd_job *job, double queued, shd_reply *reply) {
    add_account(reply, &job->server->metrics, job->cached, queued, job->timing);
}

const shd_work shd_variant_work = {.read = read_variant, .run = shd_picture_run};

void shd_render_submit(shd_exchange *exchange) {
    static const shd_work work = {.recall = recall_picture,
                                  .read = read_scene,
                                  .run = shd_picture_run,
                                  .settle = shd_picture_settle,
                                  .add = shd_picture_add,
                                  .shared = true};
    shd_job_submit(exchange, &work);
}

void shd_preview_submit(shd_exchange *exchange) {
    if (shd_preview_document(exchange)) shd_render_submit(exchange);
}

void shd_scene_link_submit(shd_exchange *exchange) {
    if (shd_scene_link_read(exchange)) shd_render_submit(exchange);
}
