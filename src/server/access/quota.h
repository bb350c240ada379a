/* How often tokens may be used: for each name a bucket that requests fill and that leaks evenly
 * (the continuous-state leaky bucket of ITU-T I.371, annex A, as large as what leaks in one unit of
 * time).
 *
 * Who has been away for long may ask `count` times at once; then each `seconds / count` seconds
 * one more may come. What is refused is not counted. Buckets belong to names: tokens of one name
 * share theirs, and another rate, after SIGHUP, leaves what is used of it. Any thread. */
#pragma once

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

/* `count` requests in `seconds`. 0 of them: any number. */
typedef struct shd_rate {
    uint32_t count, seconds;
} shd_rate;

/* "100/minute": 1 to 1000000 of them, a second, minute, hour or day. */
bool shd_rate_read(const char *text, shd_rate *out);
const char *shd_rate_unit(shd_rate rate); /* "minute": of a rate that was read */

typedef struct shd_quotas shd_quotas;
typedef struct shd_quota shd_quota; /* of a name; lives as long as all of them */

shd_quotas *shd_quotas_new(void);         /* NULL when out of memory */
void shd_quotas_drop(shd_quotas *quotas); /* NULL is fine */

/* The one of a name, which is copied; empty at first. NULL when out of memory. */
shd_quota *shd_quotas_get(shd_quotas *quotas, const char *name);

/* A request at `now`, in seconds on any clock that does not go back. 0: it may come, and is
 * counted; else how many seconds later the next one may. */
double shd_quota_take(shd_quotas *quotas, shd_quota *quota, shd_rate rate, double now);

/* The metrics of all of them, in Prometheus' text format. NULL is none. */
void shd_quotas_print(shd_quotas *quotas, FILE *out);
