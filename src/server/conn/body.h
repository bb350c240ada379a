/* Bodies of requests while they come, within what all may take together. On the I/O thread. */
#pragma once

#include "server/exchange.h"

/* Appends to the exchange's body what has come of it, within the limits `body` and `memory`. Memory
 * grows with that, not with what Content-Length promises. False: with a reply, there is no room. */
bool shd_body_keep(shd_exchange *exchange, const char *data, size_t size);
void shd_body_fit(shd_exchange *exchange); /* once it is whole: gives back what it does not take */
