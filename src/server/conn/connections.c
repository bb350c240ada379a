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

/* libmicrohttpd closes the socket next. The rest of a request that it has refused by itself may
 * still be coming. */
void shd_connection_notify(void *cls, struct MHD_Connection *connection, void **context,
                           enum MHD_ConnectionNotificationCode code) {
    shd_server *server = cls;
    const int socket = shd_connection_socket(connection);
    if (code == MHD_CONNECTION_NOTIFY_CLOSED) {
        bool amid = shd_reaper_remove(server->reaper, *context);
        shd_budget_give(server->budget, SHD_CONNECTION_MEMORY);
        *context = NULL;
        if (amid) shd_linger_keep(server->linger, socket);
        return;
    }
    shd_budget_count(server->budget, SHD_CONNECTION_MEMORY);
    char address[SHD_CLIENT_SIZE];
    const struct sockaddr *peer = shd_connection_peer(connection);
    *context = shd_reaper_add(server->reaper, socket, find_address(server, peer, address));
}

shd_connection *shd_connection_watched(struct MHD_Connection *connection) {
    const union MHD_ConnectionInfo *info =
        MHD_get_connection_info(connection, MHD_CONNECTION_INFO_SOCKET_CONTEXT);
    return info ? info->socket_context : NULL;
}

int shd_connection_socket(struct MHD_Connection *connection) {
    const union MHD_ConnectionInfo *info =
        MHD_get_connection_info(connection, MHD_CONNECTION_INFO_CONNECTION_FD);
    return info ? info->connect_fd : -1;
}

const struct sockaddr *shd_connection_peer(struct MHD_Connection *connection) {
    const union MHD_ConnectionInfo *info =
        MHD_get_connection_info(connection, MHD_CONNECTION_INFO_CLIENT_ADDRESS);
    return info ? info->client_addr : NULL;
}
