/* The line of the log that a request leaves: who asked what, and what came of it. It tells no
 * query, so that no signature, no scene in a link and no token gets there. */
#pragma once

#include "server/exchange.h"

/* Of an exchange that is over, while its answer's body is still there. `aborted`: nobody took the
 * answer, or there was none. */
void shd_log_request(const shd_exchange *exchange, double seconds, size_t bytes, bool aborted);
