/* What a service manager tells and wants to be told: sockets that it has opened (sd_listen_fds(3)),
 * and states (sd_notify(3)). Both protocols are a few environment variables and datagrams that
 * systemd promises to keep and invites others to speak; libsystemd, which also does so, would load
 * five more libraries (compression, encryption) into a process that strangers talk to. Does nothing
 * if there is no service manager. On the main thread. */
#pragma once

#include "base/status.h"

typedef struct shd_sockets {
    int public, admin; /* -1: none */
} shd_sockets;

/* The sockets that were handed over: `admin` is the one with that name, `public` any other. They
 * are the caller's. SHD_CONFIG if there are others, or what is no listening socket. */
shd_status shd_take_sockets(shd_sockets *out, shd_error *error);

/* "READY=1", "STOPPING=1", ... Takes a second at most. */
void shd_notify(const char *state);

/* "RELOADING=1", with the time, as Type=notify-reload wants it. */
void shd_notify_reloading(void);

/* Seconds between two "WATCHDOG=1"; 0: nobody waits for them. */
double shd_watchdog_interval(void);
