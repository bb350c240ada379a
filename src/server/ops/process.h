/* The process as the system sees it, under the names that Prometheus' own libraries give it. */
#pragma once

#include <stdio.h>

/* Writes process_* metrics: processor time, memory, descriptors, threads, and when it started. What
 * the system does not tell is left out. Any thread. */
void shd_process_print(FILE *out);
