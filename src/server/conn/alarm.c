#include "alarm.h"

#include <math.h>
#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <unistd.h>

bool shd_alarm_make(shd_alarm *alarm) {
    alarm->epoll = epoll_create1(EPOLL_CLOEXEC);
    alarm->rung = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    struct epoll_event event = {.events = EPOLLIN, .data.fd = alarm->rung};
    return alarm->epoll >= 0 && alarm->rung >= 0 &&
           !epoll_ctl(alarm->epoll, EPOLL_CTL_ADD, alarm->rung, &event);
}

void shd_alarm_drop(shd_alarm *alarm) {
    if (alarm->epoll >= 0) close(alarm->epoll);
    if (alarm->rung >= 0) close(alarm->rung);
}

void shd_alarm_ring(const shd_alarm *alarm) {
    eventfd_write(alarm->rung, 1); /* fails only if it has been rung 2^64 times */
}

void shd_alarm_watch(const shd_alarm *alarm, int socket, bool watches) {
    struct epoll_event event = {.events = EPOLLRDHUP | EPOLLONESHOT, .data.fd = socket};
    epoll_ctl(alarm->epoll, watches ? EPOLL_CTL_ADD : EPOLL_CTL_DEL, socket, &event);
}

bool shd_alarm_wait(const shd_alarm *alarm, double seconds) {
    struct epoll_event events[16];
    const int most = sizeof events / sizeof events[0],
              limit = isinf(seconds) ? -1 : (int)ceil(fmax(seconds, 0) * 1e3),
              count = epoll_wait(alarm->epoll, events, most, limit);
    bool left = false;
    for (int i = 0; i < count; i++) {
        eventfd_t ignored;
        if (events[i].data.fd == alarm->rung)
            eventfd_read(alarm->rung, &ignored);
        else
            left = true;
    }
    return left;
}
