#include "settings.h"

#include <stdlib.h>

enum { MOST_THREADS = 1024 }; /* as the option `threads` has it */

shd_engine_options shd_settings_engine(const shd_config *config) {
    /* jobs.c counts the places; rests of jobs that had one come on top, one a thread at most. */
    const size_t queue = config->queue + MOST_THREADS;
    return (shd_engine_options){.ocio_config = *config->ocio ? config->ocio : NULL,
                                .materials = config->materials,
                                .assets = *config->assets ? config->assets : NULL,
                                .kernel = config->kernel,
                                .threads = (unsigned)config->threads,
                                .queue = queue,
                                .reuse = config->reuse,
                                .mesh_store = config->mesh_store,
                                .scenes_elsewhere = *config->scenes_folder != 0,
                                .limits = config->limits};
}

shd_status shd_settings_new(const shd_config *config, shd_engine *first, bool renew,
                            shd_quotas *quotas, shd_settings **out, shd_error *error) {
    shd_settings *settings = calloc(1, sizeof *settings);
    if (!settings) return shd_fail(error, SHD_EXHAUSTED, "", "out of memory");
    atomic_init(&settings->holders, 1);
    settings->config = *config;
    settings->engine = renew ? NULL : first;
    settings->owns_engine = renew;
    shd_status status = SHD_OK;
    if (renew) {
        shd_engine_options options = shd_settings_engine(config);
        status = shd_engine_renew(first, &options, &settings->engine, error);
    }
    if (!status && *config->tokens)
        status = shd_tokens_load(config->tokens, quotas, &settings->tokens, error);
    if (!status && *config->admin_tokens)
        status = shd_tokens_load(config->admin_tokens, NULL, &settings->admin_tokens, error);
    if (!status && *config->preview_keys)
        status = shd_keys_load(config->preview_keys, &settings->preview_keys, error);
    if (!status) status = shd_networks_new(config->trusted_proxies, &settings->proxies, error);
    if (!status) status = shd_origins_list(config->cors_origins, &settings->origins, error);
    if (!status) status = shd_documents_make(settings->engine, settings->documents, error);
    if (!status) status = shd_studio_make(&settings->studio, error);
    if (status)
        shd_settings_drop(settings);
    else
        *out = settings;
    return status;
}

void shd_settings_drop(shd_settings *settings) {
    if (!settings || atomic_fetch_sub(&settings->holders, 1) > 1) return;
    shd_documents_release(settings->documents);
    shd_studio_drop(settings->studio);
    free(settings->origins);
    shd_networks_drop(settings->proxies);
    shd_tokens_drop(settings->tokens);
    shd_tokens_drop(settings->admin_tokens);
    shd_keys_drop(settings->preview_keys);
    if (settings->owns_engine) shd_engine_drop(settings->engine);
    free(settings);
}

shd_settings *shd_server_settings(shd_server *server) {
    pthread_mutex_lock(&server->settings_mutex);
    shd_settings *settings = server->settings;
    atomic_fetch_add(&settings->holders, 1);
    pthread_mutex_unlock(&server->settings_mutex);
    return settings;
}

void shd_server_replace(shd_server *server, shd_settings *settings) {
    pthread_mutex_lock(&server->settings_mutex);
    shd_settings *old = server->settings;
    settings->number = old->number + 1;
    server->settings = settings;
    pthread_mutex_unlock(&server->settings_mutex);
    shd_settings_drop(old);
}
