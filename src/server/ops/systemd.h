/* What a service manager tells and wants to be told: sockets that it has opened (sd_listen_fds(3)),
 * and states (sd_notify(3)). Does nothing if there is none. On the main thread. */
#pragma once

#include "base/status.h"

typedef struct shd_sockets {
    int public, admin; /* -1: none */
} shd_sockets;

/* The sockets that were handed over: `admin` is the one with that name, `public` any other. They
 * are the caller's. SHD_CONFIG if there are others, or what is no listening socket. */
shd_status shd_take_sockets(shd_sockets *out, shd_error *error);

void shd_notify(const char *state); /* "READY=1", "STOPPING=1", ... takes a second at most */
void shd_notify_reloading(void);    /* "RELOADING=1" with the time, as Type=notify-reload wants */
double shd_watchdog_interval(void); /* seconds between two "WATCHDOG=1"; 0: nobody waits for them */
