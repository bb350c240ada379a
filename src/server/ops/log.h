/* The log: one JSON object a line, on stderr. A line is begun, gets its members, and is ended.
 *
 * Texts are escaped, so that nothing a client sends can forge a line or reach a terminal: lines are
 * ASCII, and JSON. A line that would not fit loses its last members. Each line leaves in one write,
 * whole, from any thread. If nobody reads what was written before, lines are lost, and "log-lost"
 * tells how many were. */
#pragma once

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef enum shd_log_level { SHD_LOG_INFO, SHD_LOG_WARNING, SHD_LOG_ERROR } shd_log_level;

typedef struct shd_log {
    char text[4000]; /* below PIPE_BUF: pipes take it whole */
    size_t length;
} shd_log;

void shd_log_begin(shd_log *line, shd_log_level level, const char *event);
void shd_log_text(shd_log *line, const char *name, const char *value);
void shd_log_whole(shd_log *line, const char *name, uint64_t value);
void shd_log_milliseconds(shd_log *line, const char *name, double seconds);
void shd_log_flag(shd_log *line, const char *name, bool value);
void shd_log_end(shd_log *line);
void shd_log_message(shd_log_level level, const char *event, const char *message);
