/* Bodies of requests while they come, within what all of them may take together. On the I/O
 * thread. */
#pragma once

#include "server/exchange.h"

/* Appends to the exchange's body what has come of it, within the limits `body` and `memory`. Memory
 * grows with what has really come, not with what Content-Length promises. False: with a reply,
 * there is no room. */
bool shd_body_keep(shd_exchange *exchange, const char *data, size_t size);

/* Once it is whole: gives back what it does not take. */
void shd_body_fit(shd_exchange *exchange);
