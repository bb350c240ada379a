/* What wakes a thread that looks at connections: a call, or the end of a client that is waited for.
 */
#pragma once

#include <stdbool.h>

typedef struct shd_alarm {
    int epoll; /* sockets that are watched, each until its client leaves; and */
    int rung;  /* an eventfd */
} shd_alarm;

/* False: the system refuses. It is dropped all the same. */
bool shd_alarm_make(shd_alarm *alarm);
void shd_alarm_drop(shd_alarm *alarm);

/* Any thread. */
void shd_alarm_ring(const shd_alarm *alarm);

/* From now on the end of the socket's client rings, once; or does not any more. Any thread. The
 * system may refuse: then it is not noticed here. */
void shd_alarm_watch(const shd_alarm *alarm, int socket, bool watches);

/* Waits until it rings, or for `seconds`; INFINITY: for ever. True: the client of a socket has
 * left. Which one is not told: by now the socket may be closed, or another one. One thread. */
bool shd_alarm_wait(const shd_alarm *alarm, double seconds);
