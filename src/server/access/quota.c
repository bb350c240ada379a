#include "quota.h"

#include <inttypes.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

static const double rounding = 1e-6; /* of a request: what it may leave of one that has run off */

struct shd_quota {
    shd_quota *next;
    double used, at; /* requests that had not run off, at that time */
    uint64_t admitted, refused;
    char name[];
};

struct shd_quotas {
    pthread_mutex_t mutex;
    shd_quota *first;
};

/* ---- Rates ---- */

static const struct {
    const char *name;
    uint32_t seconds;
} units[] = {{"second", 1}, {"minute", 60}, {"hour", 3600}, {"day", 86400}};

enum { UNITS = sizeof units / sizeof units[0] };

bool shd_rate_read(const char *text, shd_rate *out) {
    enum { DIGITS = 7, MOST = 1000000 };
    const size_t digits = strspn(text, "0123456789");
    if (!digits || digits > DIGITS || text[digits] != '/') return false;
    const unsigned long count = strtoul(text, NULL, 10);
    if (!count || count > MOST) return false;
    size_t i = 0;
    while (i < UNITS && strcmp(text + digits + 1, units[i].name)) i++;
    if (i < UNITS) *out = (shd_rate){(uint32_t)count, units[i].seconds};
    return i < UNITS;
}

const char *shd_rate_unit(shd_rate rate) {
    size_t i = 0;
    while (i < UNITS - 1 && units[i].seconds != rate.seconds) i++;
    return units[i].name;
}

/* ---- Buckets ---- */

shd_quotas *shd_quotas_new(void) {
    shd_quotas *quotas = calloc(1, sizeof *quotas);
    if (quotas) pthread_mutex_init(&quotas->mutex, NULL);
    return quotas;
}

void shd_quotas_drop(shd_quotas *quotas) {
    if (!quotas) return;
    for (shd_quota *quota = quotas->first, *next; quota; quota = next) {
        next = quota->next;
        free(quota);
    }
    pthread_mutex_destroy(&quotas->mutex);
    free(quotas);
}

shd_quota *shd_quotas_get(shd_quotas *quotas, const char *name) {
    pthread_mutex_lock(&quotas->mutex);
    shd_quota **at = &quotas->first;
    while (*at && strcmp((*at)->name, name) != 0) at = &(*at)->next;
    if (!*at) {
        const size_t size = strlen(name) + 1;
        *at = calloc(1, sizeof **at + size);
        if (*at) memcpy((*at)->name, name, size);
    }
    shd_quota *quota = *at;
    pthread_mutex_unlock(&quotas->mutex);
    return quota;
}

double shd_quota_take(shd_quotas *quotas, shd_quota *quota, shd_rate rate, double now) {
    const double a_second = (double)rate.count / rate.seconds;
    pthread_mutex_lock(&quotas->mutex);
    const double left = quota->used - (now - quota->at) * a_second;
    quota->used = left > 0 ? left : 0;
    quota->at = now;
    const double excess = quota->used + 1 - rate.count;
    const bool admitted = excess <= rounding;
    if (admitted) quota->used++;
    ++*(admitted ? &quota->admitted : &quota->refused);
    pthread_mutex_unlock(&quotas->mutex);
    return admitted ? 0 : excess / a_second;
}

void shd_quotas_print(shd_quotas *quotas, FILE *out) {
    fputs("# HELP shaded_token_requests_total Requests with a token that has a rate, by its name "
          "and whether it was used up.\n# TYPE shaded_token_requests_total counter\n",
          out);
    if (!quotas) return;
    pthread_mutex_lock(&quotas->mutex);
    for (const shd_quota *quota = quotas->first; quota; quota = quota->next)
        fprintf(out,
                "shaded_token_requests_total{token=\"%s\",result=\"admitted\"} %" PRIu64 "\n"
                "shaded_token_requests_total{token=\"%s\",result=\"refused\"} %" PRIu64 "\n",
                quota->name, quota->admitted, quota->name, quota->refused);
    pthread_mutex_unlock(&quotas->mutex);
}
