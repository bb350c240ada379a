#include "scene_link.h"

#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "scene_folder.h"
#include "server/answer/negotiate.h"
#include "server/answer/problem.h"
#include "server/ops/settings.h"
#include "work.h"

/* What paths may end in. */
static const struct {
    const char *suffix;
    shd_format format;
} suffixes[] = {{".png", SHD_PNG}, {".jpg", SHD_JPEG}, {".webp", SHD_WEBP}};

enum { SUFFIXES = sizeof suffixes / sizeof suffixes[0], EXPIRES_MOST = 15 };

static const char *suffix_of(shd_format format) {
    size_t i = 0;
    while (suffixes[i].format != format) i++;
    return suffixes[i].suffix;
}

/* ---- The path ---- */

/* The path's third segment, of which the exchange's has only the beginning if it is long. `out` has
 * room for the target. Returns its length. */
static size_t decode_segment(const char *target, char *out) {
    size_t length = 0, slashes = 0;
    for (const char *c = target; *c && *c != '?'; c++) {
        if (*c == '/' && slashes < 3) {
            slashes++;
            length = 0;
        } else if (*c == '%' && isxdigit((unsigned char)c[1]) && isxdigit((unsigned char)c[2])) {
            const char digits[] = {c[1], c[2], 0};
            out[length++] = (char)strtoul(digits, NULL, 16);
            c += 2;
        } else {
            out[length++] = *c;
        }
    }
    out[length] = 0;
    return length;
}

/* Where the suffix begins in a segment that ends in one; else its end. */
static size_t find_suffix(const char *segment, size_t length, shd_format *format) {
    for (size_t i = 0; i < SUFFIXES; i++) {
        const size_t size = strlen(suffixes[i].suffix);
        if (length <= size || strcmp(segment + length - size, suffixes[i].suffix) != 0) continue;
        *format = suffixes[i].format;
        return length - size;
    }
    return length;
}

bool shd_scene_link_admit(shd_exchange *exchange) {
    shd_reply *reply = &exchange->reply;
    const bool is_kept = exchange->route == SHD_ROUTE_KEPT;
    char *segment = exchange->target ? malloc(strlen(exchange->target) + 1) : NULL;
    if (!segment) return shd_problem_reply(reply, SHD_NO_MEMORY, "out of memory");
    const size_t length = decode_segment(exchange->target, segment);
    const size_t end = find_suffix(segment, length, &exchange->format);
    const bool has_format = end < length;
    segment[end] = 0;
    const bool is_found = has_format && (!is_kept || shd_digest_read(segment, &exchange->digest));
    free(segment);
    if (!is_found)
        return shd_problem_reply(reply, SHD_NOT_FOUND,
                                 "a link to a scene ends in %s.png, .jpg or "
                                 ".webp",
                                 is_kept ? "64 hexadecimal digits, in lower case, and " : "");
    const char *media_type = shd_format_get(exchange->format)->media_type;
    exchange->is_link = true;
    return shd_accepts(exchange->accept, media_type) ||
           shd_problem_reply(reply, SHD_NOT_ACCEPTABLE, "this link answers %s", media_type);
}

/* ---- The query ---- */

static bool refuse_parameter(shd_exchange *exchange, const char *parameter, const char *detail) {
    const shd_mistake mistake = {.parameter = parameter, .detail = detail};
    shd_problem_mistakes(&exchange->reply, SHD_BAD_QUERY, &mistake, 1);
    return false;
}

/* A scene has no other parameters than those of signed links. */
static bool check_query(shd_exchange *exchange) {
    static const char *const names[] = {"expires", "signature"};
    bool seen[2] = {false};
    const char *query = strchr(exchange->target, '?');
    while (query) {
        const char *from = query + 1;
        query = strchr(from, '&');
        const size_t size = query ? (size_t)(query - from) : strlen(from);
        const size_t length = strcspn(from, "=&");
        if (!size) continue;
        size_t which = 0;
        while (which < 2 && (strlen(names[which]) != length || memcmp(names[which], from, length)))
            which++;
        if (which == 2) {
            char name[64];
            snprintf(name, sizeof name, "%.*s", (int)(length < 60 ? length : 60), from);
            return refuse_parameter(exchange, name,
                                    "it is not known here: there is expires, signature");
        }
        if (seen[which])
            return refuse_parameter(exchange, names[which], "it is given more than once");
        seen[which] = true;
        const size_t digits = size > length ? strspn(from + length + 1, "0123456789") : 0;
        if (!which && (!digits || digits > EXPIRES_MOST || length + 1 + digits != size))
            return refuse_parameter(exchange, names[which], "expected an integer");
    }
    return true;
}

/* ---- The document ---- */

static int digit_of(char c) {
    if (c >= 'A' && c <= 'Z') return c - 'A';
    if (c >= 'a' && c <= 'z') return c - 'a' + 26;
    if (c >= '0' && c <= '9') return c - '0' + 52;
    return c == '-' ? 62 : c == '_' ? 63 : -1;
}

/* Base64url without padding (RFC 4648, section 5), in place, so that each bytes have one text.
 * False: it is something else. */
static bool decode_base64(char *text, size_t length, size_t *out) {
    unsigned bits = 0;
    size_t size = 0;
    for (size_t i = 0; i < length; i++) {
        const int digit = digit_of(text[i]);
        if (digit < 0) return false;
        bits = bits << 6 | (unsigned)digit;
        if (i % 4) text[size++] = (char)(bits >> (6 - 2 * (i % 4)));
    }
    const unsigned rest = length % 4 == 2 ? 15 : length % 4 == 3 ? 3 : 0;
    *out = size;
    return length % 4 != 1 && !(bits & rest);
}

/* The target holds the document. */
static bool read_document(shd_exchange *exchange) {
    shd_reply *reply = &exchange->reply;
    if (!shd_inflate_open(SHD_CODING_DEFLATE))
        return shd_problem_reply(reply, SHD_NOT_FOUND,
                                 "zlib is not installed here: PUT /v1/scenes makes other links");
    char *text = malloc(strlen(exchange->target) + 1);
    if (!text) return shd_problem_reply(reply, SHD_NO_MEMORY, "out of memory");
    const size_t end = find_suffix(text, decode_segment(exchange->target, text), &exchange->format);
    exchange->body = (unsigned char *)text;
    exchange->coding = SHD_CODING_DEFLATE;
    return decode_base64(text, end, &exchange->size) ||
           refuse_parameter(exchange, "document",
                            "it is not base64url (A-Z a-z 0-9 - _) without padding, of the scene's "
                            "JSON in deflate without a head");
}

/* The document is kept: its digest is all that is asked. A worker looks into the folder, if there
 * is one. */
static bool find_document(shd_exchange *exchange) {
    shd_reply *reply = &exchange->reply;
    const shd_digest *digest = &exchange->digest;
    exchange->kept = shd_engine_find_scene(exchange->settings->engine, digest, &exchange->kept_text,
                                           &exchange->kept_size);
    if (!exchange->kept && !exchange->server->scenes) return shd_scene_folder_lacks(reply);
    exchange->is_digest = true;
    exchange->body = malloc(sizeof digest->bytes);
    if (!exchange->body) return shd_problem_reply(reply, SHD_NO_MEMORY, "out of memory");
    memcpy(exchange->body, digest->bytes, sizeof digest->bytes);
    exchange->size = sizeof digest->bytes;
    return true;
}

bool shd_scene_link_read(shd_exchange *exchange) {
    if (!check_query(exchange)) return false;
    free(exchange->body);
    exchange->body = NULL;
    exchange->size = 0;
    return exchange->route == SHD_ROUTE_KEPT ? find_document(exchange) : read_document(exchange);
}

/* ---- What links can show ---- */

void shd_scene_link_check(shd_job *job) {
    const shd_format asked = job->question.fallback;
    const char *suffix;
    shd_error error;
    if (shd_request_suffix(job->request, &suffix, &error)) shd_problem_error(&job->reply, &error);
    if (job->reply.status || shd_request_format(job->request, 0) == asked) return;
    shd_fail(&error, SHD_SCENE, "/output/format", "the link ends in %s, but the scene asks for %s",
             suffix_of(asked), suffix);
    shd_problem_error(&job->reply, &error);
}

/* ---- Keeping ---- */

static void read_kept(shd_job *job) {
    shd_job_read(job);
    const char *suffix;
    shd_error error;
    if (job->reply.status || shd_request_report(job->request)->status) return;
    if (shd_request_suffix(job->request, &suffix, &error)) shd_problem_error(&job->reply, &error);
}

/* In memory, beside the meshes. */
static shd_status keep_here(const shd_job *job, const shd_digest *digest, const char *text,
                            size_t size, bool *known, shd_error *error) {
    shd_engine *engine = job->settings->engine;
    const char *there;
    size_t length;
    shd_kept_scene *scene = shd_engine_find_scene(engine, digest, &there, &length);
    *known = scene;
    shd_status status = SHD_OK;
    if (!*known) {
        char *room;
        status = shd_engine_new_scene(engine, digest, size, &scene, &room, error);
        if (!status) {
            memcpy(room, text, size);
            status = shd_engine_keep_scene(engine, scene, job->client, known, error);
        }
    }
    shd_kept_scene_drop(scene);
    return status;
}

/* A scene that is in the folder is kept, even if memory has no room for it. False: the reply says
 * what is wrong. */
static bool keep_text(shd_job *job, shd_digest *digest, bool *known) {
    const char *text;
    size_t size;
    shd_error error;
    shd_scene_folder *folder = job->server->scenes;
    bool is_here;
    shd_status status = shd_request_condense(job->request, (const char *)job->body, job->size,
                                             &text, &size, digest, &error);
    if (!status && folder) {
        status = shd_scene_folder_keep(folder, digest, text, size, known, &error);
        if (status) return shd_problem_reply(&job->reply, SHD_NO_STORAGE, "%s", error.text);
        keep_here(job, digest, text, size, &is_here, NULL);
    } else if (!status) {
        status = keep_here(job, digest, text, size, known, &error);
    }
    if (status) shd_problem_error(&job->reply, &error);
    return !status;
}

static void keep_scene(shd_job *job) {
    shd_reply *reply = &job->reply;
    shd_digest digest;
    char digits[SHD_DIGEST_TEXT], path[128], *text;
    bool known;
    if (!keep_text(job, &digest, &known)) return;
    shd_digest_write(&digest, digits);
    snprintf(path, sizeof path, "%s%s%s", "/v1/scenes/", digits,
             suffix_of(shd_request_format(job->request, 0)));
    const int length = asprintf(&text, "{\"digest\":\"%s\",\"path\":\"%s\"}\n", digits, path);
    if (length < 0) {
        shd_problem_reply(reply, SHD_NO_MEMORY, "out of memory");
        return;
    }
    reply->status = known ? 200 : 201;
    shd_reply_give(reply, "application/json", text, (size_t)length);
    shd_reply_plain(reply, "Location", path);
    shd_reply_plain(reply, "Cache-Control", "no-store");
    shd_job_warn(job);
}

void shd_scene_put_submit(shd_exchange *exchange) {
    static const shd_work work = {.read = read_kept, .run = keep_scene, .size = SHD_SMALL};
    shd_job_submit(exchange, &work);
}
