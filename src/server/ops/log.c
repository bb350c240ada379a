#include "log.h"

#include <assert.h>
#include <errno.h>
#include <poll.h>
#include <pthread.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "base/status.h"
#include "base/utf8.h"

enum { LOG_TAIL = 2 }; /* room for the closing brace and the newline */

/* Milliseconds that a full log is waited for, before lines are lost until there is room again. */
enum { LOG_PATIENCE = 100 };

static const char *const level_names[] = {"info", "warning", "error"};

/* Adds all of it or nothing. */
static bool add_text(shd_log *line, const char *text, size_t length) {
    if (length > sizeof line->text - LOG_TAIL - line->length) return false;
    memcpy(line->text + line->length, text, length);
    line->length += length;
    return true;
}

SHD_PRINTF(2, 3)
static void add_formatted(shd_log *line, const char *format, ...) {
    char text[128];
    va_list args;
    va_start(args, format);
    int length = vsnprintf(text, sizeof text, format, args);
    va_end(args);
    if (length > 0 && (size_t)length < sizeof text) add_text(line, text, (size_t)length);
}

/* Printable ASCII passes. Other characters become \uxxxx, of which JSON makes them again, so that
 * the log stays ASCII and nothing in it moves a terminal. A byte that is no UTF-8 becomes \\xff: to
 * who reads the JSON, four characters that show it. */
static bool add_escaped(shd_log *line, const char *text) {
    for (const char *c = text; *c;) {
        char escaped[16];
        uint32_t point = 0;
        int length;
        size_t taken = shd_utf8_decode(c, &point);
        if (!taken)
            length = snprintf(escaped, sizeof escaped, "\\\\x%02x", (unsigned char)*c);
        else if (point == '"' || point == '\\')
            length = snprintf(escaped, sizeof escaped, "\\%c", *c);
        else if (point >= 0x20 && point < 0x7f)
            length = snprintf(escaped, sizeof escaped, "%c", *c);
        else if (point < 0x10000)
            length = snprintf(escaped, sizeof escaped, "\\u%04x", (unsigned)point);
        else /* a surrogate pair (RFC 8259, section 7) */
            length = snprintf(escaped, sizeof escaped, "\\u%04x\\u%04x",
                              (unsigned)(0xd800 + ((point - 0x10000) >> 10)),
                              (unsigned)(0xdc00 + ((point - 0x10000) & 0x3ff)));
        if (!add_text(line, escaped, (size_t)length)) return false;
        c += taken ? taken : 1;
    }
    return true;
}

void shd_log_begin(shd_log *line, shd_log_level level, const char *event) {
    struct timespec now;
    struct tm date;
    clock_gettime(CLOCK_REALTIME, &now);
    gmtime_r(&now.tv_sec, &date);
    char stamp[32];
    strftime(stamp, sizeof stamp, "%Y-%m-%dT%H:%M:%S", &date);
    line->length = 0;
    add_formatted(line, "{\"time\":\"%s.%03dZ\",\"level\":\"%s\"", stamp,
                  (int)(now.tv_nsec / 1000000), level_names[level]);
    shd_log_text(line, "event", event);
}

void shd_log_text(shd_log *line, const char *name, const char *value) {
    size_t start = line->length;
    add_formatted(line, ",\"%s\":\"", name);
    if (!add_escaped(line, value) || !add_text(line, "\"", 1)) line->length = start;
}

void shd_log_whole(shd_log *line, const char *name, uint64_t value) {
    add_formatted(line, ",\"%s\":%llu", name, (unsigned long long)value);
}

void shd_log_milliseconds(shd_log *line, const char *name, double seconds) {
    add_formatted(line, ",\"%s\":%.3f", name, seconds * 1e3);
}

void shd_log_flag(shd_log *line, const char *name, bool value) {
    add_formatted(line, ",\"%s\":%s", name, value ? "true" : "false");
}

/* What is ready takes a line whole, though nobody reads. Errors are for write() to meet. */
static bool is_ready(int milliseconds) {
    struct pollfd out = {.fd = STDERR_FILENO, .events = POLLOUT};
    return poll(&out, 1, milliseconds);
}

static void write_line(shd_log *line) {
    assert(line->length <= sizeof line->text - LOG_TAIL);
    memcpy(line->text + line->length, "}\n", LOG_TAIL);
    size_t length = line->length + LOG_TAIL;
    for (size_t done = 0; done < length;) {
        ssize_t written = write(STDERR_FILENO, line->text + done, length - done);
        if (written < 0 && errno == EINTR) continue;
        if (written <= 0) break; /* nobody reads the log: the service goes on */
        done += (size_t)written;
    }
}

void shd_log_end(shd_log *line) {
    static pthread_mutex_t mutex = PTHREAD_MUTEX_INITIALIZER;
    static uint64_t lost;
    pthread_mutex_lock(&mutex);
    bool ready = is_ready(lost ? 0 : LOG_PATIENCE);
    if (ready && lost) {
        shd_log told;
        shd_log_begin(&told, SHD_LOG_WARNING, "log-lost");
        shd_log_whole(&told, "lines", lost);
        write_line(&told);
        lost = 0;
        ready = is_ready(0);
    }
    if (ready)
        write_line(line);
    else
        lost++;
    pthread_mutex_unlock(&mutex);
}

void shd_log_message(shd_log_level level, const char *event, const char *message) {
    shd_log line;
    shd_log_begin(&line, level, event);
    shd_log_text(&line, "message", message);
    shd_log_end(&line);
}
