/* What may change while the daemon runs: limits and times, the color configuration, tokens, keys,
 * origins. A request keeps the settings that it began with; SIGHUP makes new ones for the next,
 * all of them or, if one is bad, none. */
#pragma once

#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "config.h"
#include "server/access/access.h"
#include "server/access/client.h"
#include "server/access/tokens.h"
#include "server/answer/documents.h"
#include "server/answer/studio.h"
#include "server/server.h"
#include "shaded.h"

typedef struct shd_settings {
    atomic_uint holders;
    uint64_t number; /* of a server's settings, those of its start being 0 */
    shd_config config;
    shd_engine *engine;
    bool owns_engine;
    char *origins;            /* of CORS, joined by commas */
    shd_networks *proxies;    /* whose X-Forwarded-For is believed */
    shd_tokens *tokens;       /* NULL: everybody may ask */
    shd_tokens *admin_tokens; /* of metrics, alike */
    shd_keys *preview_keys;   /* NULL: previews need no signature */
    shd_studio *studio;
    shd_document documents[SHD_ROUTE_COUNT]; /* plain.size 0: the route has none */
} shd_settings;

/* Settings with a first engine, which they do not own, or with one of their own that borrows the
 * first one's workers. Tokens are held to their rates in `quotas`, which outlives them. */
shd_status shd_settings_new(const shd_config *config, shd_engine *first, bool renew,
                            shd_quotas *quotas, shd_settings **out, shd_error *error);
void shd_settings_drop(shd_settings *settings); /* the last holder frees them; NULL is fine */

/* The settings of now, of which the caller becomes a holder; and others from now on. */
shd_settings *shd_server_settings(shd_server *server);
void shd_server_replace(shd_server *server, shd_settings *settings);

/* The engine's part of the configuration, without the budget. */
shd_engine_options shd_settings_engine(const shd_config *config);
