/* The operators' port: a daemon of its own, so that no crowd on the public one can starve it. */
#include <microhttpd.h>
#include <stdlib.h>
#include <string.h>

#include "http.h"

static enum MHD_Result send_text(struct MHD_Connection *connection, unsigned status,
                                 const char *media_type, char *text, size_t size, bool owned) {
    struct MHD_Response *response = MHD_create_response_from_buffer(
        size, text, owned ? MHD_RESPMEM_MUST_FREE : MHD_RESPMEM_PERSISTENT);
    if (!response) {
        if (owned) free(text);
        return MHD_NO;
    }
    MHD_add_response_header(response, "Content-Type", media_type);
    MHD_add_response_header(response, "Cache-Control", "no-store");
    if (status == 405) MHD_add_response_header(response, "Allow", "GET, HEAD");
    enum MHD_Result result = MHD_queue_response(connection, status, response);
    MHD_destroy_response(response);
    return result;
}

static enum MHD_Result send_word(struct MHD_Connection *connection, unsigned status,
                                 const char *word) {
    return send_text(connection, status, "text/plain", (char *)(size_t)word, strlen(word), false);
}

static enum MHD_Result send_metrics(struct MHD_Connection *connection, shd_server *server) {
    shd_gauges gauges = {.load = shd_engine_load(server->engine),
                         .reaped = shd_reaper_count(server->reaper),
                         .reuse = shd_engine_reuse(server->engine),
                         .cache = shd_cache_load_of(server->cache),
                         .in_flight = atomic_load(&server->in_flight),
                         .draining = atomic_load(&server->draining)};
    size_t size;
    char *text = shd_metrics_text(&server->metrics, &gauges, &size);
    if (!text) return send_word(connection, 500, "out of memory\n");
    return send_text(connection, 200, "text/plain; version=0.0.4", text, size, true);
}

static enum MHD_Result handle(void *cls, struct MHD_Connection *connection, const char *path,
                              const char *method, const char *version, const char *upload,
                              size_t *upload_size, void **context) {
    shd_server *server = cls;
    (void)version, (void)upload;
    /* The first call comes with the head, and answering it would end the connection. */
    if (!*context) {
        *context = server;
        return MHD_YES;
    }
    if (*upload_size) {
        *upload_size = 0;
        return MHD_YES;
    }
    if (strcmp(method, "GET") && strcmp(method, "HEAD"))
        return send_word(connection, 405, "GET or HEAD\n");
    if (!strcmp(path, "/healthz")) return send_word(connection, 200, "ok\n");
    if (!strcmp(path, "/readyz"))
        return atomic_load(&server->draining) ? send_word(connection, 503, "draining\n")
                                              : send_word(connection, 200, "ready\n");
    if (!strcmp(path, "/metrics")) return send_metrics(connection, server);
    return send_word(connection, 404, "/healthz, /readyz, /metrics\n");
}

shd_status shd_admin_start(shd_server *server, int socket, struct MHD_Daemon **out,
                           shd_error *error) {
    struct MHD_Daemon *daemon =
        MHD_start_daemon(MHD_USE_EPOLL_INTERNAL_THREAD | MHD_USE_ITC, 0, NULL, NULL, handle, server,
                         MHD_OPTION_LISTEN_SOCKET, socket, MHD_OPTION_CONNECTION_LIMIT, 64u,
                         MHD_OPTION_CONNECTION_TIMEOUT, 10u, MHD_OPTION_CONNECTION_MEMORY_LIMIT,
                         (size_t)(32 << 10), MHD_OPTION_END);
    if (!daemon) return shd_fail(error, SHD_INTERNAL, "", "libmicrohttpd did not start");
    *out = daemon;
    return SHD_OK;
}

void shd_admin_stop(struct MHD_Daemon *daemon) {
    if (daemon) MHD_stop_daemon(daemon);
}
