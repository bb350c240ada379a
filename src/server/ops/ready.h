/* `shaded --ready`: what a health check of an image without a shell can call. */
#pragma once

#include <stdbool.h>

#include "config.h"

/* Asks the operators' port of the daemon that runs with this configuration for /readyz. Says on
 * the standard error if the answer is not 200, or none comes for some seconds. */
bool shd_ask_ready(const shd_config *config);
