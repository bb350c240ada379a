/* The line of the log that a request leaves: who asked what, and what came of it. It tells no
 * query, so that no signature, no scene in a link and no token gets there. */
#pragma once

#include "server/exchange.h"

/* When it is over, but its answer's body still there. `aborted`: nobody took that, or had one. */
void shd_log_request(const shd_exchange *exchange, double seconds, size_t bytes, bool aborted);
