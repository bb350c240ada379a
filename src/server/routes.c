#include "routes.h"

#include <math.h>
#include <string.h>

#include "base/clock.h"
#include "server/access/tokens.h"
#include "server/answer/gzip.h"
#include "server/answer/negotiate.h"
#include "server/answer/pages.h"
#include "server/answer/problem.h"
#include "server/jobs/preview.h"
#include "server/jobs/scene_link.h"
#include "server/jobs/work.h"
#include "server/ops/settings.h"

static const char media_json[] = "application/json", media_page[] = "text/html";

/* At "/" are the list of paths for programs and the page for people: that is for who likes HTML
 * better than JSON, as browsers do. */
static bool wants_page(const shd_exchange *exchange) {
    return exchange->route == SHD_ROUTE_INDEX &&
           shd_prefers(exchange->accept, media_page, media_json);
}

static bool is_studio(const shd_exchange *exchange) {
    return exchange->route == SHD_ROUTE_STUDIO || exchange->route == SHD_ROUTE_ELEMENT ||
           wants_page(exchange);
}

static bool is_page(const shd_exchange *exchange) {
    return exchange->route == SHD_ROUTE_DOCS || exchange->route == SHD_ROUTE_PAGE;
}

/* NULL: there is no such file. */
static const shd_document *find_document(const shd_exchange *exchange) {
    if (is_page(exchange)) return shd_page_find(exchange->path);
    return is_studio(exchange) ? shd_studio_find(exchange->settings->studio, exchange->path)
                               : &exchange->settings->documents[exchange->route];
}

/* The body. Of a page in gzip alone, for a client that does not take it, it is made for this
 * answer. False, with a refusal: there is no memory for that. */
static bool set_text(shd_exchange *exchange, const shd_document *document, const shd_text *text) {
    shd_reply *reply = &exchange->reply;
    if (text->data) {
        shd_reply_lend(reply, document->media_type, text->data, text->size);
        return true;
    }
    shd_budget *budget = exchange->server->budget;
    if (!shd_budget_take(budget, text->size))
        return shd_problem_reply(reply, SHD_NO_MEMORY, "no memory for the page");
    void *made = shd_gunzip(document->gzip.data, document->gzip.size, text->size);
    if (!made) {
        shd_budget_give(budget, text->size);
        return shd_problem_reply(reply, SHD_NO_MEMORY, "no memory for the page");
    }
    shd_reply_give(reply, document->media_type, made, text->size);
    shd_reply_count(reply, budget, text->size);
    return true;
}

static void answer_document(shd_exchange *exchange) {
    const shd_document *document = find_document(exchange);
    bool is_coded = document->gzip.size && shd_accepts_gzip(exchange->accept_encoding);
    const shd_text *text = is_coded ? &document->gzip : &document->plain;
    shd_reply *reply = &exchange->reply;
    if (!set_text(exchange, document, text)) return;
    shd_reply_header(reply, "ETag", "\"%s\"", text->etag);
    shd_reply_plain(reply, "Cache-Control", "no-cache");
    shd_reply_plain(reply, "Vary",
                    exchange->route == SHD_ROUTE_INDEX ? "Accept, Accept-Encoding"
                                                       : "Accept-Encoding");
    if (is_coded) shd_reply_plain(reply, "Content-Encoding", "gzip");
    /* 304 has no body, but the Content-Length of the 200 that it stands for. */
    reply->status = shd_etag_matches(exchange->if_none_match, text->etag, true) ? 304 : 200;
    if ((is_studio(exchange) || is_page(exchange)) && reply->status == 200) {
        shd_reply_plain(reply, "X-Content-Type-Options", "nosniff");
        shd_reply_plain(reply, "Content-Security-Policy", shd_studio_policy);
    }
}

/* ---- Finding and admitting ---- */

static void add_allow(shd_reply *reply, unsigned methods) {
    char allow[SHD_METHODS_SIZE];
    shd_methods_list(methods, allow);
    shd_reply_plain(reply, "Allow", allow);
}

static bool admit_json(shd_exchange *exchange) {
    return shd_accepts(exchange->accept, media_json) ||
           shd_problem_reply(&exchange->reply, SHD_NOT_ACCEPTABLE,
                             "this path answers application/json%s",
                             exchange->route == SHD_ROUTE_INDEX ? " and text/html" : "");
}

static bool admit_file(shd_exchange *exchange) {
    return find_document(exchange) ||
           shd_problem_reply(&exchange->reply, SHD_NOT_FOUND,
                             is_page(exchange) ? "there is no such page: /docs lists them"
                                               : "the studio has no such file");
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
    return shd_problem_reply(&exchange->reply, SHD_NOT_ACCEPTABLE,
                             "Accept admits none of %s (multipart/form-data for `outputs`)%s", made,
                             all ? "" : "; for other formats OpenImageIO is not installed");
}

static bool admit_figure(shd_exchange *exchange) {
    shd_brdf_form form;
    return shd_accepts_figure(exchange->accept, &form) ||
           shd_problem_reply(&exchange->reply, SHD_NOT_ACCEPTABLE,
                             "this path answers application/json, image/svg+xml and image/png");
}

static bool admit_diff(shd_exchange *exchange) {
    bool map;
    return shd_accepts_map(exchange->accept, &map) ||
           shd_problem_reply(&exchange->reply, SHD_NOT_ACCEPTABLE,
                             "this path answers application/json and image/png");
}

static bool refuse_type(shd_exchange *exchange, const char *field, const char *types) {
    const char *type = exchange->content_type;
    shd_problem_reply(&exchange->reply, SHD_BAD_TYPE, "%s%s: send Content-Type: %s",
                      type ? "the body is declared as " : "the request has no Content-Type",
                      type ? type : "", types);
    shd_reply_plain(&exchange->reply, field, types);
    return false;
}

static bool admit_digest(shd_exchange *exchange, const char *whose) {
    const char *digest = exchange->path + shd_path_fixed(exchange->route);
    return shd_digest_read(digest, &exchange->digest) ||
           shd_problem_reply(&exchange->reply, SHD_NOT_FOUND,
                             "%s path ends in 64 hexadecimal digits, in lower case", whose);
}

/* What it is, its first bytes say. */
static bool admit_asset(shd_exchange *exchange) {
    if (!admit_digest(exchange, "an asset's")) return false;
    return shd_is_image(exchange->content_type) || shd_is_binary(exchange->content_type) ||
           refuse_type(exchange, "Accept", "image/*, application/octet-stream");
}

static bool admit_mesh(shd_exchange *exchange) {
    if (!admit_digest(exchange, "a mesh's")) return false;
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

/* Whether it is a GET of a picture, for <img src>. */
static bool is_picture_link(shd_route route) {
    return route == SHD_ROUTE_PREVIEW || route == SHD_ROUTE_SCENE || route == SHD_ROUTE_KEPT;
}

static bool admit_media_types(shd_exchange *exchange) {
    const bool has_body = exchange->method & (SHD_POST | SHD_PUT);
    if (has_body && !admit_coding(exchange)) return false;
    if (exchange->route == SHD_ROUTE_MESHES) return admit_mesh(exchange);
    if (exchange->route == SHD_ROUTE_ASSETS) return admit_asset(exchange);
    if (has_body && !shd_is_json(exchange->content_type))
        return refuse_type(exchange, exchange->method == SHD_PUT ? "Accept" : "Accept-Post",
                           media_json);
    if (exchange->route == SHD_ROUTE_SCENE || exchange->route == SHD_ROUTE_KEPT)
        return shd_scene_link_admit(exchange);
    if (exchange->route == SHD_ROUTE_RENDER || exchange->route == SHD_ROUTE_PREVIEW ||
        exchange->route == SHD_ROUTE_BATCH)
        return admit_picture(exchange);
    if (exchange->route == SHD_ROUTE_BRDF) return admit_figure(exchange);
    if (exchange->route == SHD_ROUTE_DIFF) return admit_diff(exchange);
    if (is_studio(exchange) || is_page(exchange)) return admit_file(exchange);
    /* The contract and the schema are files rather than representations: no negotiation. */
    const char *type = exchange->settings->documents[exchange->route].media_type;
    return (type && strcmp(type, media_json) != 0) || admit_json(exchange);
}

/* A link to a picture, if there are keys. False without a reply: a token would do. */
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
    exchange->reply.limit = SHD_LIMIT_RATE;
    return false;
}

/* What this server is stays open; what it does needs a token or, of an image's link, a signature,
 * if there are any. */
static bool admit_caller(shd_exchange *exchange) {
    const shd_tokens *tokens = exchange->settings->tokens;
    const shd_keys *keys =
        is_picture_link(exchange->route) ? exchange->settings->preview_keys : NULL;
    if ((!tokens && !keys) || strncmp(exchange->path, "/v1/", 4)) return true;
    const shd_token *token = tokens ? shd_tokens_admit(tokens, exchange->authorization) : NULL;
    if (token) {
        exchange->token = token->name;
        return admit_use(exchange, token);
    }
    if (keys && admit_link(exchange, keys)) return true;
    if (exchange->reply.status) return false;
    const bool has_shown = exchange->authorization;
    shd_problem_reply(&exchange->reply, SHD_UNAUTHORIZED, "%s",
                      has_shown ? "the token is not a known one, or has expired"
                                : "send Authorization: Bearer TOKEN");
    shd_reply_plain(&exchange->reply, "WWW-Authenticate",
                    has_shown ? "Bearer realm=\"shaded\", error=\"invalid_token\""
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
    /* To all alike if anybody may: a picture that an <img> has left in the browser's cache is
     * read by a script next. */
    bool admits = exchange->origin && shd_origins_admit(origins, exchange->origin);
    if (!anybody && !admits) return;
    shd_reply_header(reply, "Access-Control-Allow-Origin", "%s", anybody ? "*" : exchange->origin);
    shd_reply_plain(reply, "Access-Control-Expose-Headers",
                    "Cache-Status, ETag, Location, Retry-After, Server-Timing, Shaded-Clipped, "
                    "Shaded-Codec, Shaded-Plan, Shaded-Rays, "
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
    /* OPTIONS * asks about the server as a whole. */
    if (exchange->method == SHD_OPTIONS && !strcmp(exchange->path, "*")) return true;
    const shd_route route = shd_path_find(exchange->path);
    if (!exchange->path_cut || route == SHD_ROUTE_SCENE) exchange->route = route;
    if (exchange->route == SHD_ROUTE_OTHER)
        return shd_problem_reply(reply, SHD_NOT_FOUND, "GET / lists the paths");
    const unsigned methods = shd_paths[exchange->route].methods;
    if (!(methods & exchange->method)) {
        shd_problem_reply(reply, SHD_BAD_METHOD, "the header Allow lists the methods");
        add_allow(reply, methods);
        return false;
    }
    if (exchange->method == SHD_OPTIONS) return true;
    if (!admit_caller(exchange)) return false;
    const bool wants_work =
        exchange->method & (SHD_POST | SHD_PUT) || is_picture_link(exchange->route);
    if (wants_work && atomic_load(&exchange->server->draining))
        return shd_problem_reply(reply, SHD_DRAINING, "the server takes no more work");
    return admit_media_types(exchange);
}

/* ---- Answering ---- */

/* NULL: a document is the answer. */
static void (*const submits[SHD_ROUTE_OTHER])(shd_exchange *exchange) = {
    [SHD_ROUTE_RENDER] = shd_render_submit,    [SHD_ROUTE_PREVIEW] = shd_preview_submit,
    [SHD_ROUTE_SCENE] = shd_scene_link_submit, [SHD_ROUTE_KEPT] = shd_scene_link_submit,
    [SHD_ROUTE_SCENES] = shd_scene_put_submit, [SHD_ROUTE_EXPLAIN] = shd_explain_submit,
    [SHD_ROUTE_COMPARE] = shd_compare_submit,  [SHD_ROUTE_BRDF] = shd_brdf_submit,
    [SHD_ROUTE_BATCH] = shd_batch_submit,      [SHD_ROUTE_MESHES] = shd_mesh_submit,
    [SHD_ROUTE_ANALYZE] = shd_analyze_submit,  [SHD_ROUTE_DIFF] = shd_diff_submit,
    [SHD_ROUTE_FIT] = shd_fit_submit,          [SHD_ROUTE_ASSETS] = shd_asset_submit};

void shd_route_answer(shd_exchange *exchange) {
    const shd_route route = exchange->route;
    if (exchange->method == SHD_OPTIONS) {
        exchange->reply.status = 204;
        add_allow(&exchange->reply,
                  route == SHD_ROUTE_OTHER ? (1 << SHD_METHODS) - 1 : shd_paths[route].methods);
    } else if (submits[route]) {
        submits[route](exchange);
    } else {
        answer_document(exchange);
    }
}
