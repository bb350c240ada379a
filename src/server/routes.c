#include "routes.h"

#include <inttypes.h>
#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "server/answer/gzip.h"
#include "server/answer/negotiate.h"
#include "server/answer/problem.h"
#include "server/jobs/json_job.h"
#include "server/jobs/mesh_job.h"
#include "server/jobs/preview.h"
#include "server/jobs/render_job.h"

/* The files of api/, embedded by the build. */
extern const unsigned char shd_embedded_openapi[], shd_embedded_openapi_json[],
    shd_embedded_schema[];
extern const unsigned long shd_embedded_openapi_size, shd_embedded_openapi_json_size,
    shd_embedded_schema_size;

static void answer_document(shd_exchange *exchange);

enum { READ = SHD_GET | SHD_HEAD | SHD_OPTIONS, WRITE = SHD_POST | SHD_OPTIONS };

static const shd_route routes[] = {
    {"/", SHD_ROUTE_INDEX, READ, answer_document},
    {"/v1/render", SHD_ROUTE_RENDER, WRITE, shd_render_submit},
    {"/v1/preview/{material}", SHD_ROUTE_PREVIEW, READ, shd_preview_submit},
    {"/v1/explain", SHD_ROUTE_EXPLAIN, WRITE, shd_explain_submit},
    {"/v1/compare", SHD_ROUTE_COMPARE, WRITE, shd_compare_submit},
    {"/v1/meshes/{sha256}", SHD_ROUTE_MESHES, SHD_PUT | SHD_OPTIONS, shd_mesh_submit},
    {"/v1/materials", SHD_ROUTE_MATERIALS, READ, answer_document},
    {"/v1/shapes", SHD_ROUTE_SHAPES, READ, answer_document},
    {"/v1/colorspaces", SHD_ROUTE_COLORSPACES, READ, answer_document},
    {"/v1/version", SHD_ROUTE_VERSION, READ, answer_document},
    {"/openapi.yaml", SHD_ROUTE_OPENAPI, READ, answer_document},
    {"/openapi.json", SHD_ROUTE_OPENAPI_JSON, READ, answer_document},
    {"/scene.schema.json", SHD_ROUTE_SCHEMA, READ, answer_document},
};

enum { ROUTES = sizeof routes / sizeof routes[0] };

static const struct {
    shd_method method;
    const char *name;
} method_names[] = {{SHD_GET, "GET"},
                    {SHD_HEAD, "HEAD"},
                    {SHD_POST, "POST"},
                    {SHD_PUT, "PUT"},
                    {SHD_OPTIONS, "OPTIONS"}};

/* ---- Documents ---- */

static const char media_json[] = "application/json";

/* FNV-1a, 64 bits: the tag tells versions of our own texts apart, nothing more. */
static void set_text(shd_text *text, const void *data, size_t size, bool owned) {
    uint64_t hash = UINT64_C(0xcbf29ce484222325);
    for (size_t i = 0; i < size; i++)
        hash = (hash ^ ((const unsigned char *)data)[i]) * UINT64_C(0x100000001b3);
    *text = (shd_text){.data = data, .size = size, .owned = owned};
    snprintf(text->etag, sizeof text->etag, "%016" PRIx64, hash);
}

static void set_document(shd_settings *settings, shd_route_id id, const char *media_type,
                         const void *data, size_t size, bool owned) {
    shd_document *document = &settings->documents[id];
    document->media_type = media_type;
    set_text(&document->plain, data, size, owned);
    size_t less;
    void *gzip = shd_gzip(data, size, &less);
    if (gzip) set_text(&document->gzip, gzip, less, true);
}

static json_t *method_list(unsigned methods) {
    json_t *list = json_array();
    for (size_t i = 0; i < sizeof method_names / sizeof method_names[0]; i++)
        if (methods & method_names[i].method)
            json_array_append_new(list, json_string(method_names[i].name));
    return list;
}

static char *make_index(void) {
    json_t *list = json_array();
    for (size_t i = 0; i < ROUTES; i++) {
        json_t *route = json_object();
        json_object_set_new(route, "path", json_string(routes[i].path));
        json_object_set_new(route, "methods", method_list(routes[i].methods));
        json_array_append_new(list, route);
    }
    json_t *index = json_object();
    json_object_set_new(index, "name", json_string("shaded"));
    json_object_set_new(index, "version", json_string(shd_version()));
    json_object_set_new(index, "openapi", json_string("/openapi.yaml"));
    json_object_set_new(index, "routes", list);
    char *text = json_dumps(index, JSON_INDENT(2));
    json_decref(index);
    return text;
}

shd_status shd_routes_prepare(shd_settings *settings, shd_error *error) {
    static const struct {
        shd_route_id id;
        shd_topic topic;
    } topics[] = {{SHD_ROUTE_MATERIALS, SHD_TOPIC_MATERIALS},
                  {SHD_ROUTE_SHAPES, SHD_TOPIC_SHAPES},
                  {SHD_ROUTE_COLORSPACES, SHD_TOPIC_COLORSPACES},
                  {SHD_ROUTE_VERSION, SHD_TOPIC_VERSION}};
    for (size_t i = 0; i < sizeof topics / sizeof topics[0]; i++) {
        char *json;
        shd_status status = shd_engine_describe(settings->engine, topics[i].topic, &json, error);
        if (status) return status;
        set_document(settings, topics[i].id, media_json, json, strlen(json), true);
    }
    char *index = make_index();
    if (!index) return shd_fail(error, SHD_EXHAUSTED, "", "no memory for the list of routes");
    set_document(settings, SHD_ROUTE_INDEX, media_json, index, strlen(index), true);
    set_document(settings, SHD_ROUTE_OPENAPI, "application/yaml", shd_embedded_openapi,
                 shd_embedded_openapi_size, false);
    set_document(settings, SHD_ROUTE_OPENAPI_JSON, media_json, shd_embedded_openapi_json,
                 shd_embedded_openapi_json_size, false);
    set_document(settings, SHD_ROUTE_SCHEMA, "application/schema+json", shd_embedded_schema,
                 shd_embedded_schema_size, false);
    return SHD_OK;
}

static void release_text(const shd_text *text) {
    if (text->owned) free((void *)(size_t)text->data);
}

void shd_routes_release(shd_settings *settings) {
    for (size_t i = 0; i < SHD_ROUTE_COUNT; i++) {
        release_text(&settings->documents[i].plain);
        release_text(&settings->documents[i].gzip);
    }
}

static void answer_document(shd_exchange *exchange) {
    const shd_document *document = &exchange->settings->documents[exchange->route->id];
    bool is_coded = document->gzip.size && shd_accepts_gzip(exchange->accept_encoding);
    const shd_text *text = is_coded ? &document->gzip : &document->plain;
    shd_reply *reply = &exchange->reply;
    shd_reply_header(reply, "ETag", "\"%s\"", text->etag);
    shd_reply_plain(reply, "Cache-Control", "no-cache");
    shd_reply_plain(reply, "Vary", "Accept-Encoding");
    if (is_coded) shd_reply_plain(reply, "Content-Encoding", "gzip");
    /* 304 has no body, but the Content-Length of the 200 that it stands for. */
    reply->status = shd_etag_matches(exchange->if_none_match, text->etag, true) ? 304 : 200;
    shd_reply_lend(reply, document->media_type, text->data, text->size);
}

/* ---- Finding and admitting ---- */

/* A route's "{name}" stands for one segment of the path, the last. */
static bool is_path_of(const shd_route *route, const char *path) {
    size_t fixed = strcspn(route->path, "{");
    if (!route->path[fixed]) return !strcmp(route->path, path);
    return !strncmp(route->path, path, fixed) && path[fixed] && !strchr(path + fixed, '/');
}

/* NULL where there is none. */
static const shd_route *find_route(const char *path) {
    for (size_t i = 0; i < ROUTES; i++)
        if (is_path_of(&routes[i], path)) return &routes[i];
    return NULL;
}

/* Whether the answer is a worker's. */
static bool wants_work(const shd_exchange *exchange) {
    return exchange->method & (SHD_POST | SHD_PUT) || exchange->route->id == SHD_ROUTE_PREVIEW;
}

static void add_allow(shd_reply *reply, unsigned methods) {
    char allow[64] = "";
    for (size_t i = 0; i < sizeof method_names / sizeof method_names[0]; i++) {
        if (!(methods & method_names[i].method)) continue;
        if (*allow) strcat(allow, ", ");
        strcat(allow, method_names[i].name);
    }
    shd_reply_plain(reply, "Allow", allow);
}

/* OPTIONS * asks about the server as a whole. */
static bool asks_for_all(const shd_exchange *exchange) {
    return exchange->method == SHD_OPTIONS && !strcmp(exchange->path, "*");
}

static bool admit_json(shd_exchange *exchange) {
    if (shd_accepts(exchange->accept, media_json)) return true;
    shd_problem_reply(&exchange->reply, SHD_NOT_ACCEPTABLE, "this path answers application/json");
    return false;
}

static bool admit_picture(shd_exchange *exchange) {
    shd_format format;
    if (shd_accepts_picture(exchange->accept, &format) ||
        (exchange->method == SHD_POST && shd_accepts(exchange->accept, "multipart/form-data")))
        return true;
    char made[256] = "";
    bool all = true;
    for (int f = 0; f < SHD_FORMAT_COUNT; f++) {
        bool written = shd_writes((shd_format)f);
        if (written && *made) strcat(made, ", ");
        if (written) strcat(made, shd_format_get((shd_format)f)->media_type);
        all = all && written;
    }
    shd_problem_reply(&exchange->reply, SHD_NOT_ACCEPTABLE,
                      "Accept admits none of %s (multipart/form-data for `outputs`)%s", made,
                      all ? "" : "; for other formats OpenImageIO is not installed");
    return false;
}

static bool refuse_type(shd_exchange *exchange, const char *field, const char *types) {
    const char *type = exchange->content_type;
    shd_problem_reply(&exchange->reply, SHD_BAD_TYPE, "%s%s: send Content-Type: %s",
                      type ? "the body is declared as " : "the request has no Content-Type",
                      type ? type : "", types);
    shd_reply_plain(&exchange->reply, field, types);
    return false;
}

static bool admit_mesh(shd_exchange *exchange) {
    const char *digest = exchange->path + strcspn(exchange->route->path, "{");
    if (!shd_digest_read(digest, &exchange->digest)) {
        shd_problem_reply(&exchange->reply, SHD_NOT_FOUND,
                          "a mesh's path ends in 64 hexadecimal digits, in lower case");
        return false;
    }
    exchange->is_binary = shd_is_binary(exchange->content_type);
    return exchange->is_binary || shd_is_json(exchange->content_type) ||
           refuse_type(exchange, "Accept", "application/json, application/octet-stream");
}

static bool admit_coding(shd_exchange *exchange) {
    if (shd_coding_read(exchange->content_encoding, &exchange->coding) &&
        (!exchange->coding || shd_inflate_open(exchange->coding)))
        return true;
    const char *taken = shd_coding_list();
    shd_problem_reply(&exchange->reply, SHD_BAD_TYPE,
                      "the body has the Content-Encoding %s: one of these is taken: %s",
                      exchange->content_encoding, taken);
    shd_reply_plain(&exchange->reply, "Accept-Encoding", taken);
    return false;
}

static bool admit_body(shd_exchange *exchange) {
    if (!admit_coding(exchange)) return false;
    if (exchange->method == SHD_PUT) return admit_mesh(exchange);
    if (!shd_is_json(exchange->content_type))
        return refuse_type(exchange, "Accept-Post", media_json);
    return exchange->route->id == SHD_ROUTE_RENDER ? admit_picture(exchange) : admit_json(exchange);
}

static bool admit_media_types(shd_exchange *exchange) {
    if (exchange->method & (SHD_POST | SHD_PUT)) return admit_body(exchange);
    if (exchange->route->id == SHD_ROUTE_PREVIEW) return admit_picture(exchange);
    /* The contract and the schema are files rather than representations: no negotiation. */
    const shd_document *document = &exchange->settings->documents[exchange->route->id];
    return strcmp(document->media_type, media_json) || admit_json(exchange);
}

/* A link to a preview, where there are keys. False without a reply: a token would do. */
static bool admit_link(shd_exchange *exchange, const shd_keys *keys) {
    static const char *const details[] = {
        [SHD_LINK_UNSIGNED] = "this link needs a signature",
        [SHD_LINK_WRONG] = "the signature is not that of this link, by any of the keys",
        [SHD_LINK_EXPIRED] = "the link was valid until the time in `expires`, which has passed"};
    shd_link link = shd_preview_link(exchange, keys, &exchange->expires);
    if (link == SHD_LINK_SIGNED) return true;
    if (link != SHD_LINK_UNSIGNED || !exchange->settings->tokens)
        shd_problem_reply(&exchange->reply, SHD_BAD_SIGNATURE, "%s", details[link]);
    return false;
}

/* Whether a token may be used once more now. Whatever comes of the request, it is counted. */
static bool admit_use(shd_exchange *exchange, const shd_token *token) {
    if (!token->quota) return true;
    const double wait =
        shd_quota_take(exchange->server->quotas, token->quota, token->rate, shd_now());
    if (!(wait > 0)) return true;
    const unsigned seconds = (unsigned)ceil(wait);
    shd_problem_later(&exchange->reply, SHD_OVER_RATE, seconds,
                      "the limit `rate` of the token %s is %u a %s: the next request may come in "
                      "%u s",
                      token->name, (unsigned)token->rate.count, shd_rate_unit(token->rate),
                      seconds);
    return false;
}

/* What this server is stays open; what it does needs a token or, of an image's link, a signature,
 * where there are any. */
static bool admit_caller(shd_exchange *exchange) {
    const shd_tokens *tokens = exchange->settings->tokens;
    const shd_keys *keys =
        exchange->route->id == SHD_ROUTE_PREVIEW ? exchange->settings->preview_keys : NULL;
    if ((!tokens && !keys) || strncmp(exchange->route->path, "/v1/", 4)) return true;
    const shd_token *token = tokens ? shd_tokens_admit(tokens, exchange->authorization) : NULL;
    if (token) {
        exchange->token = token->name;
        return admit_use(exchange, token);
    }
    if (keys && admit_link(exchange, keys)) return true;
    if (exchange->reply.status) return false;
    shd_problem_reply(&exchange->reply, SHD_UNAUTHORIZED,
                      exchange->authorization ? "the token is not a known one, or has expired"
                                              : "send Authorization: Bearer TOKEN");
    shd_reply_plain(&exchange->reply, "WWW-Authenticate",
                    exchange->authorization ? "Bearer realm=\"shaded\", error=\"invalid_token\""
                                            : "Bearer realm=\"shaded\"");
    return false;
}

/* Cross-origin requests: what a page of a configured origin may send and read. */
void shd_route_add_cors(shd_exchange *exchange) {
    const char *origins = exchange->settings->config.cors_origins;
    shd_reply *reply = &exchange->reply;
    if (!*origins) return;
    bool anybody = !strcmp(origins, "*");
    /* An <img> tells no origin: what it may be told is said to all. */
    shd_reply_plain(reply, "Timing-Allow-Origin", exchange->settings->origins);
    shd_reply_plain(reply, "Cross-Origin-Resource-Policy", "cross-origin");
    if (!anybody) shd_reply_plain(reply, "Vary", "Origin");
    /* To all alike where anybody may: a picture that an <img> has left in the browser's cache is
     * read by a script next. */
    bool admits = exchange->origin && shd_origins_admit(origins, exchange->origin);
    if (!anybody && !admits) return;
    shd_reply_header(reply, "Access-Control-Allow-Origin", "%s", anybody ? "*" : exchange->origin);
    shd_reply_plain(reply, "Access-Control-Expose-Headers",
                    "Cache-Status, ETag, Retry-After, Server-Timing, Shaded-Plan, "
                    "Shaded-Saturated, Shaded-Warning, X-Request-Id");
    if (!exchange->is_preflight || !admits) return;
    shd_reply_plain(reply, "Access-Control-Allow-Methods", "GET, HEAD, POST, PUT, OPTIONS");
    shd_reply_plain(reply, "Access-Control-Allow-Headers",
                    "Authorization, Content-Encoding, Content-Type, If-None-Match, traceparent, "
                    "X-Request-Id");
    shd_reply_plain(reply, "Access-Control-Max-Age", "600");
}

bool shd_route_admit(shd_exchange *exchange) {
    shd_reply *reply = &exchange->reply;
    if (asks_for_all(exchange)) return true;
    exchange->route = exchange->path_cut ? NULL : find_route(exchange->path);
    if (!exchange->route) {
        shd_problem_reply(reply, SHD_NOT_FOUND, "GET / lists the paths");
        return false;
    }
    if (!(exchange->route->methods & exchange->method)) {
        shd_problem_reply(reply, SHD_BAD_METHOD, "the header Allow lists the methods");
        add_allow(reply, exchange->route->methods);
        return false;
    }
    if (exchange->method == SHD_OPTIONS) return true;
    if (!admit_caller(exchange)) return false;
    if (wants_work(exchange) && atomic_load(&exchange->server->draining)) {
        shd_problem_reply(reply, SHD_DRAINING, "the server takes no more work");
        return false;
    }
    return admit_media_types(exchange);
}

void shd_route_answer(shd_exchange *exchange) {
    if (exchange->method != SHD_OPTIONS) {
        exchange->route->answer(exchange);
        return;
    }
    exchange->reply.status = 204;
    add_allow(&exchange->reply,
              exchange->route ? exchange->route->methods : READ | WRITE | SHD_PUT);
}
