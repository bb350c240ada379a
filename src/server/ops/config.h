/* The daemon's options. Each has one name: `--max-body` on the command line, SHADED_MAX_BODY in
 * the environment, `max-body` in the file. Flags win over the environment, the environment over
 * the file, the file over the defaults. */
#pragma once

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include "base/limits.h"

typedef struct shd_config {
    char listen[1024];        /* ADDR:PORT, unix:/path, parted by blanks or commas */
    char admin[256];          /* ADDR:PORT or "off" */
    char ocio[4096];          /* path; "": the embedded configuration */
    char kernel[16];          /* auto, portable, avx2, avx512, neon */
    char cache_control[256];  /* of pictures */
    char tokens[4096];        /* path; "": everybody may ask */
    char admin_tokens[4096];  /* path; "": everybody may ask for metrics */
    char preview_keys[4096];  /* path; "": previews need no signature */
    char scenes_folder[4096]; /* path; "": scenes are kept in memory alone */
    char cors_origins[1024];
    char assets[4096];          /* path of a folder of pictures; "": none have names */
    char materials[2048];       /* paths of files of materials, parted by blanks */
    char trusted_proxies[1024]; /* networks whose X-Forwarded-For is believed */
    bool log_requests;
    shd_limits limits;
    uint64_t threads, queue, connections, connections_each;
    uint64_t budget;            /* bytes of the process; 0: by what the machine leaves */
    uint64_t reuse, mesh_store; /* bytes, see shd_engine_options */
    uint64_t response_cache;    /* bytes, see shd_cache_new */
    uint64_t timeout, idle_timeout, head_time, body_time, send_time, drain_time; /* seconds */
} shd_config;

typedef enum shd_config_result {
    SHD_CONFIG_RUN,
    SHD_CONFIG_READY, /* --ready: *config is that of the daemon to ask */
    SHD_CONFIG_HELP,
    SHD_CONFIG_VERSION,
    SHD_CONFIG_BAD_FLAGS, /* `message` says what is wrong with the command line */
    SHD_CONFIG_BAD        /* ... with the environment or the file */
} shd_config_result;

shd_config shd_config_defaults(void);

/* Reads everything into *config; `message` gets one line without a newline. */
shd_config_result shd_config_read(int argc, char **argv, shd_config *config, char *message,
                                  size_t message_size);

/* Takes back what only a start can change, and names the options. False: there was nothing. */
bool shd_config_keep(shd_config *config, const shd_config *running, char *names, size_t size);

void shd_config_help(FILE *out); /* what --help prints */
