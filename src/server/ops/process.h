/* The process as the system sees it, under the names that Prometheus' own libraries give it. */
#pragma once

#include <stddef.h>
#include <stdint.h>

/* A line of metrics. Names tell the type and the unit: what is named _total is a counter, else a
 * gauge; what is named _seconds is given in milliseconds. */
typedef struct shd_metric {
    const char *name, *labels; /* "{kind=\"light\"}"; "": it has none */
    const char *help;          /* "": it belongs to the metric of the line before */
    uint64_t value;
} shd_metric;

enum { SHD_PROCESS_METRICS = 7 };

/* Returns how many there are: what the system does not tell is left out. Any thread. */
size_t shd_process_metrics(shd_metric out[SHD_PROCESS_METRICS]);
