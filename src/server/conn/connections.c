#include "connections.h"

#include <sys/socket.h>

#include "linger.h"
#include "server/access/client.h"
#include "server/ops/memory.h"
#include "server/ops/settings.h"

/* The address that connections are counted by; NULL if they are not: those of named proxies are
 * the connections of many, and unix sockets are for who is let in to their folder. */
static const char *find_address(shd_server *server, const struct sockaddr *peer,
                                char out[SHD_CLIENT_SIZE]) {
    shd_settings *settings = shd_server_settings(server);
    const bool is_proxy = shd_networks_have(settings->proxies, peer);
    shd_settings_drop(settings);
    if (is_proxy || !peer || peer->sa_family == AF_UNIX) return NULL;
    shd_client_of_address(peer, NULL, NULL, out);
    return out;
}

enum MHD_Result shd_connection_accept(void *cls, const struct sockaddr *peer, socklen_t size) {
    shd_server *server = cls;
    char address[SHD_CLIENT_SIZE];
    (void)size;
    return shd_reaper_admits(server->reaper, find_address(server, peer, address)) ? MHD_YES
                                                                                  : MHD_NO;
}

/* libmicrohttpd closes the socket after this. If it has refused a request by itself, with words
 * of its own, the rest of the request may still be coming. */
void shd_connection_notify(void *cls, struct MHD_Connection *connection, void **context,
                           enum MHD_ConnectionNotificationCode code) {
    shd_server *server = cls;
    const union MHD_ConnectionInfo *info =
        MHD_get_connection_info(connection, MHD_CONNECTION_INFO_CONNECTION_FD);
    if (code == MHD_CONNECTION_NOTIFY_CLOSED) {
        bool amid = shd_reaper_remove(server->reaper, *context);
        shd_budget_give(server->budget, SHD_CONNECTION_MEMORY);
        *context = NULL;
        if (amid && info) shd_linger_keep(server->linger, info->connect_fd);
        return;
    }
    shd_budget_count(server->budget, SHD_CONNECTION_MEMORY);
    if (!info) return;
    const int socket = info->connect_fd;
    char address[SHD_CLIENT_SIZE];
    info = MHD_get_connection_info(connection, MHD_CONNECTION_INFO_CLIENT_ADDRESS);
    *context = shd_reaper_add(server->reaper, socket,
                              find_address(server, info ? info->client_addr : NULL, address));
}

shd_connection *shd_connection_watched(struct MHD_Connection *connection) {
    const union MHD_ConnectionInfo *info =
        MHD_get_connection_info(connection, MHD_CONNECTION_INFO_SOCKET_CONTEXT);
    return info ? info->socket_context : NULL;
}
