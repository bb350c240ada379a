#include "problem.h"

#include <jansson.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/json_memory.h"

enum { DETAIL_SIZE = 1024 };

static const struct {
    unsigned status;
    const char *name, *title;
} kinds[SHD_PROBLEM_KINDS] = {
    [SHD_BAD_REQUEST] = {400, "request", "The request is not sound HTTP"},
    [SHD_BAD_SYNTAX] = {400, "syntax", "The document is not JSON"},
    [SHD_BAD_CODING] = {400, "coding", "The request body is not what its Content-Encoding says"},
    [SHD_BAD_QUERY] = {400, "query", "A parameter of the link is wrong"},
    [SHD_UNAUTHORIZED] = {401, "unauthorized", "This path needs a token"},
    [SHD_BAD_SIGNATURE] = {403, "signature", "The link is not validly signed"},
    [SHD_NOT_FOUND] = {404, "not-found", "There is nothing at this path"},
    [SHD_BAD_METHOD] = {405, "method", "This path does not take this method"},
    [SHD_NOT_ACCEPTABLE] = {406, "not-acceptable", "No media type of the answer is acceptable"},
    [SHD_TOO_LARGE] = {413, "body-too-large", "The request body is too large"},
    [SHD_LONG_TARGET] = {414, "target-too-long", "The request's target is too long"},
    [SHD_BAD_TYPE] = {415, "media-type",
                      "The request body is of a media type or coding not taken here"},
    [SHD_UNKNOWN_DATA] = {409, "unknown-data", "The scene names data that is not kept here"},
    [SHD_BAD_MESH] = {422, "mesh", "The body is not a valid mesh"},
    [SHD_BAD_ASSET] = {422, "asset", "The body is not a picture that is read here"},
    [SHD_BAD_SCENE] = {422, "scene", "The document is not a valid scene"},
    [SHD_OVER_LIMIT] = {422, "limit", "The scene asks for more than a limit allows"},
    [SHD_BUSY] = {429, "busy", "The server is busy"},
    [SHD_OVER_RATE] = {429, "rate", "The token is used too often"},
    [SHD_FAILED] = {500, "internal", "The server failed"},
    [SHD_NO_MEMORY] = {503, "memory", "The server is out of memory"},
    [SHD_DRAINING] = {503, "draining", "The server is stopping"},
    [SHD_OVERDUE] = {504, "deadline", "The request took too long"},
    [SHD_NO_STORAGE] = {507, "storage", "The server cannot keep this"},
};

/* The one table from the library's statuses to HTTP's, by way of the kinds. */
static const shd_problem_kind status_kinds[SHD_STATUS_COUNT] = {
    [SHD_OK] = SHD_FAILED,
    [SHD_SYNTAX] = SHD_BAD_SYNTAX,
    [SHD_SCENE] = SHD_BAD_SCENE,
    [SHD_LIMIT] = SHD_OVER_LIMIT,
    [SHD_MEMORY] = SHD_OVER_LIMIT,
    [SHD_CANCELLED] = SHD_OVERDUE,
    [SHD_MISSING] = SHD_UNKNOWN_DATA,
    [SHD_CONFIG] = SHD_FAILED,
    [SHD_INTERNAL] = SHD_FAILED,
    [SHD_EXHAUSTED] = SHD_NO_MEMORY,
    [SHD_CROWDED] = SHD_BUSY,
};

const char shd_problem_last_words[] =
    "{\"type\":\"urn:shaded:problem:memory\",\"title\":\"The server is out of memory\","
    "\"status\":503,\"detail\":\"out of memory\"}\n";

/* A JSON string of text that may have been cut inside a UTF-8 sequence, or echo junk. */
static json_t *make_string(const char *text) {
    json_t *value = json_string(text);
    if (value) return value;
    char *copy = strdup(text);
    if (!copy) return NULL;
    for (unsigned char *c = (unsigned char *)copy; *c; c++)
        if (*c >= 0x80) *c = '?';
    value = json_string(copy);
    free(copy);
    return value;
}

static json_t *begin_document(shd_problem_kind kind, const char *detail) {
    shd_json_memory_watch();
    return json_pack("{s:s+, s:s, s:i, s:o}", "type", "urn:shaded:problem:", kinds[kind].name,
                     "title", kinds[kind].title, "status", (int)kinds[kind].status, "detail",
                     make_string(detail));
}

/* Whether the same request may be answered a moment later. */
static bool passes_soon(shd_problem_kind kind) {
    return kind == SHD_NO_MEMORY || kind == SHD_BUSY || kind == SHD_DRAINING;
}

/* `seconds`: of Retry-After, 0 if the kind decides. */
static void finish_document(shd_reply *reply, shd_problem_kind kind, unsigned seconds,
                            json_t *document) {
    char *text = json_dumps(document, JSON_COMPACT);
    json_decref(document);
    if (!seconds) seconds = passes_soon(kind);
    reply->status = kinds[kind].status;
    reply->is_short = reply->is_short || !text || shd_json_memory_short();
    shd_reply_give(reply, "application/problem+json", text, text ? strlen(text) : 0);
    shd_reply_plain(reply, "Cache-Control", "no-store");
    if (seconds) shd_reply_header(reply, "Retry-After", "%u", seconds);
}

bool shd_problem_later(shd_reply *reply, shd_problem_kind kind, unsigned seconds,
                       const char *format, ...) {
    char detail[DETAIL_SIZE];
    va_list args;
    va_start(args, format);
    vsnprintf(detail, sizeof detail, format, args);
    va_end(args);
    finish_document(reply, kind, seconds, begin_document(kind, detail));
    return false;
}

/* `kind` of place: "pointer" or "parameter". */
static void add_error(json_t *errors, const char *kind, const char *place, const char *detail) {
    json_array_append_new(
        errors, json_pack("{s:o, s:o}", kind, make_string(place), "detail", make_string(detail)));
}

void shd_problem_error(shd_reply *reply, const shd_error *error) {
    shd_problem_kind kind = status_kinds[error->status];
    /* What fails inside may name the operator's files, which are not the client's business. */
    bool tells_path = kind != SHD_FAILED && *error->path;
    char detail[DETAIL_SIZE];
    snprintf(detail, sizeof detail, "%s%s%s", tells_path ? error->path : "", tells_path ? ": " : "",
             error->text);
    json_t *document = begin_document(kind, detail);
    if (kind != SHD_FAILED && !passes_soon(kind)) {
        json_t *errors = json_array();
        add_error(errors, "pointer", error->path, error->text);
        json_object_set_new(document, "errors", errors);
    }
    finish_document(reply, kind, 0, document);
    reply->limit = error->limit;
}

/* The detail alone must do for a person who sees nothing else of the document. */
static void write_summary(char detail[DETAIL_SIZE], const char *where, const char *what,
                          size_t count) {
    char more[48] = "";
    if (count > 1) snprintf(more, sizeof more, " (and %zu more)", count - 1);
    snprintf(detail, DETAIL_SIZE, "%.400s%s%.500s%s", where, *where ? ": " : "", what, more);
}

void shd_problem_report(shd_reply *reply, const shd_report *report, shd_problem_kind wrong) {
    const shd_problem_kind kind =
        report->status == SHD_SCENE ? wrong : status_kinds[report->status];
    size_t kept = shd_report_errors_kept(report);
    const char *first = kept ? report->errors[0].detail : kinds[kind].title;

    char detail[DETAIL_SIZE];
    write_summary(detail, kept ? report->errors[0].pointer : "", first, report->error_count);
    /* What is missing is named in the library's words: a mesh, or an asset. */
    if (kind == SHD_UNKNOWN_DATA)
        strncat(detail,
                strncmp(first, "no asset", 8)
                    ? ": PUT it to /v1/meshes/ and its 64 digits, then repeat"
                    : ": PUT it to /v1/assets/ and its 64 digits, then repeat",
                sizeof detail - strlen(detail) - 1);

    json_t *document = begin_document(kind, detail);
    if (kind == SHD_BAD_SYNTAX && report->line) {
        json_object_set_new(document, "line", json_integer(report->line));
        json_object_set_new(document, "column", json_integer(report->column));
    }
    json_t *errors = json_array();
    for (size_t i = 0; i < kept; i++)
        add_error(errors, "pointer", report->errors[i].pointer, report->errors[i].detail);
    json_object_set_new(document, "errors", errors);
    if (report->error_count > kept)
        json_object_set_new(document, "errorCount", json_integer((json_int_t)report->error_count));
    finish_document(reply, kind, 0, document);
    reply->limit = report->limit;
}

void shd_problem_mistakes(shd_reply *reply, shd_problem_kind kind, const shd_mistake *mistakes,
                          size_t count) {
    const char *parameter = mistakes->parameter;
    char detail[DETAIL_SIZE];
    write_summary(detail, parameter ? parameter : mistakes->pointer, mistakes->detail, count);
    json_t *document = begin_document(kind, detail), *errors = json_array();
    for (const shd_mistake *m = mistakes; m < mistakes + count; m++)
        add_error(errors, m->parameter ? "parameter" : "pointer",
                  m->parameter ? m->parameter : m->pointer, m->detail);
    json_object_set_new(document, "errors", errors);
    finish_document(reply, kind, 0, document);
}
