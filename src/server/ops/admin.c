#include "admin.h"

#include <stdlib.h>
#include <string.h>

#include "descriptors.h"
#include "server/conn/connections.h"
#include "server/jobs/jobs.h"
#include "settings.h"

struct shd_admin {
    shd_server *server;
    struct MHD_Daemon *daemon;
    shd_reaper *reaper;
};

static void enter_phase(const shd_admin *admin, struct MHD_Connection *connection,
                        shd_phase phase) {
    shd_reaper_phase(admin->reaper, shd_connection_watched(connection), phase, NULL);
}

static enum MHD_Result send_text(struct MHD_Connection *connection, unsigned status,
                                 const char *media_type, const char *text) {
    struct MHD_Response *response =
        MHD_create_response_from_buffer(strlen(text), (void *)(size_t)text, MHD_RESPMEM_MUST_COPY);
    if (!response) return MHD_NO;
    MHD_add_response_header(response, "Content-Type", media_type);
    MHD_add_response_header(response, "Cache-Control", "no-store");
    if (status == 401)
        MHD_add_response_header(response, "WWW-Authenticate", "Bearer realm=\"metrics\"");
    if (status == 405) MHD_add_response_header(response, "Allow", "GET, HEAD");
    enum MHD_Result result = MHD_queue_response(connection, status, response);
    MHD_destroy_response(response);
    return result;
}

static enum MHD_Result send_word(struct MHD_Connection *connection, unsigned status,
                                 const char *word) {
    return send_text(connection, status, "text/plain", word);
}

static enum MHD_Result send_metrics(struct MHD_Connection *connection, shd_server *server) {
    shd_gauges gauges = {.load = shd_engine_load(server->engine),
                         .jobs = shd_jobs_load_of(server->jobs),
                         .reaped = shd_reaper_count(server->reaper),
                         .reuse = shd_engine_reuse(server->engine),
                         .cache = shd_cache_load_of(server->cache),
                         .memory = shd_budget_load_of(server->budget),
                         .meshes = shd_engine_meshes(server->engine),
                         .quotas = server->quotas,
                         .in_flight = atomic_load(&server->in_flight),
                         .unsent = atomic_load(&server->unsent),
                         .draining = atomic_load(&server->draining)};
    char *text = shd_metrics_text(&server->metrics, &gauges);
    if (!text) return send_word(connection, 500, "out of memory\n");
    enum MHD_Result result = send_text(connection, 200, "text/plain; version=0.0.4", text);
    free(text);
    return result;
}

static enum MHD_Result send_readiness(struct MHD_Connection *connection, shd_server *server) {
    if (atomic_load(&server->draining)) return send_word(connection, 503, "draining\n");
    if (shd_jobs_load_of(server->jobs).stuck) return send_word(connection, 503, "stuck\n");
    return send_word(connection, 200, "ready\n");
}

static bool may_see_metrics(shd_server *server, struct MHD_Connection *connection) {
    shd_settings *settings = shd_server_settings(server);
    const char *given = MHD_lookup_connection_value(connection, MHD_HEADER_KIND, "Authorization");
    bool may = !settings->admin_tokens || shd_tokens_admit(settings->admin_tokens, given);
    shd_settings_drop(settings);
    return may;
}

static enum MHD_Result handle_request(void *cls, struct MHD_Connection *connection,
                                      const char *path, const char *method, const char *version,
                                      const char *upload, size_t *upload_size, void **context) {
    const shd_admin *admin = cls;
    shd_server *server = admin->server;
    (void)version, (void)upload;
    /* The first call comes with the head, and answering it would end the connection. */
    if (!*context) {
        *context = server;
        enter_phase(admin, connection, SHD_AT_BODY);
        return MHD_YES;
    }
    if (*upload_size) {
        *upload_size = 0;
        return MHD_YES;
    }
    enter_phase(admin, connection, SHD_AT_ANSWER);
    if (strcmp(method, "GET") && strcmp(method, "HEAD"))
        return send_word(connection, 405, "GET or HEAD\n");
    if (!strcmp(path, "/healthz")) return send_word(connection, 200, "ok\n");
    if (!strcmp(path, "/readyz")) return send_readiness(connection, server);
    if (!strcmp(path, "/metrics"))
        return may_see_metrics(server, connection)
                   ? send_metrics(connection, server)
                   : send_word(connection, 401, "send Authorization: Bearer TOKEN\n");
    return send_word(connection, 404, "/healthz, /readyz, /metrics\n");
}

static void end_request(void *cls, struct MHD_Connection *connection, void **context,
                        enum MHD_RequestTerminationCode code) {
    (void)code, (void)context;
    enter_phase(cls, connection, SHD_AT_REST);
}

static void notify_connection(void *cls, struct MHD_Connection *connection, void **context,
                              enum MHD_ConnectionNotificationCode code) {
    const shd_admin *admin = cls;
    if (code == MHD_CONNECTION_NOTIFY_CLOSED) {
        shd_reaper_remove(admin->reaper, *context);
        *context = NULL;
        return;
    }
    char address[SHD_CLIENT_SIZE];
    shd_client_of_address(shd_connection_peer(connection), NULL, NULL, address);
    *context = shd_reaper_add(admin->reaper, shd_connection_socket(connection), address);
}

/* A reaper of its own: half of the places are always for who comes, and has its head at hand. */
shd_status shd_admin_start(shd_server *server, int socket, shd_admin **out, shd_error *error) {
    const shd_patience patience = {.head = 5,
                                   .body = 5,
                                   .send = 10,
                                   .least_reading = 0.1,
                                   .connections = SHD_ADMIN_CONNECTIONS / 2};
    shd_admin *admin = calloc(1, sizeof *admin);
    if (!admin) return shd_fail(error, SHD_EXHAUSTED, "", "no memory for the operators' port");
    admin->server = server;
    shd_status status = shd_reaper_new(&patience, NULL, &admin->reaper, error);
    if (!status)
        admin->daemon = MHD_start_daemon(
            MHD_USE_EPOLL_INTERNAL_THREAD | MHD_USE_ITC, 0, NULL, NULL, handle_request, admin,
            MHD_OPTION_LISTEN_SOCKET, socket, MHD_OPTION_NOTIFY_COMPLETED, end_request, admin,
            MHD_OPTION_NOTIFY_CONNECTION, notify_connection, admin, MHD_OPTION_CONNECTION_LIMIT,
            (unsigned)SHD_ADMIN_CONNECTIONS, MHD_OPTION_CONNECTION_TIMEOUT, 10u,
            MHD_OPTION_CONNECTION_MEMORY_LIMIT, (size_t)(32 << 10), MHD_OPTION_END);
    if (!status && !admin->daemon)
        status = shd_fail(error, SHD_INTERNAL, "", "libmicrohttpd did not start");
    if (status)
        shd_admin_stop(admin);
    else
        *out = admin;
    return status;
}

void shd_admin_stop(shd_admin *admin) {
    if (!admin) return;
    if (admin->daemon) MHD_stop_daemon(admin->daemon);
    shd_reaper_drop(admin->reaper);
    free(admin);
}
