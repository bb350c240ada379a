/* What may change while the daemon runs: limits and times, the color configuration, tokens, keys,
 * origins. A request keeps the settings that it began with; SIGHUP makes new ones for the next,
 * all of them or, where one is bad, none. */
#ifndef SHD_SERVER_OPS_SETTINGS_H
#define SHD_SERVER_OPS_SETTINGS_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "config.h"
#include "metrics.h"
#include "server/access/access.h"
#include "server/access/client.h"
#include "server/access/tokens.h"
#include "shaded.h"

/* Texts that never change while the settings hold: one, and the same in gzip, where it is shorter
 * so; else that one's size is 0. */
typedef struct shd_text {
    const void *data;
    size_t size;
    bool owned;
    char etag[20];
} shd_text;

typedef struct shd_document {
    const char *media_type;
    shd_text plain, gzip;
} shd_document;

typedef struct shd_settings {
    atomic_uint holders;
    uint64_t number; /* of a server's settings, those of its start being 0 */
    shd_config config;
    shd_engine *engine;
    bool owns_engine;
    char *origins;                           /* of CORS, joined by commas */
    shd_networks *proxies;                   /* whose X-Forwarded-For is believed */
    shd_tokens *tokens;                      /* NULL: everybody may ask */
    shd_tokens *admin_tokens;                /* of metrics, alike */
    shd_keys *preview_keys;                  /* NULL: previews need no signature */
    shd_document documents[SHD_ROUTE_COUNT]; /* plain.size 0: the route has none */
} shd_settings;

/* Settings with a first engine, which they do not own, or with one of their own that borrows the
 * first one's workers. Tokens are held to their rates in `quotas`, which outlives them. */
shd_status shd_settings_new(const shd_config *config, shd_engine *first, bool renew,
                            shd_quotas *quotas, shd_settings **out, shd_error *error);
void shd_settings_drop(shd_settings *settings); /* the last holder frees them; NULL is fine */

/* The engine's part of the configuration, without the budget. */
shd_engine_options shd_settings_engine(const shd_config *config);

#endif
