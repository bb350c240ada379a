/* Lingering closes. If a connection is closed while its client is sending, the kernel answers with
 * a reset, which can overtake the refusal that was just sent: the client sees a broken pipe instead
 * of "413". So such connections are kept for a while, and what still arrives is thrown away.
 *
 * Bounded in number, time and bytes: over a bound the connection is closed at once. Any thread. */
#pragma once

#include "base/status.h"

typedef struct shd_linger shd_linger;

shd_status shd_linger_new(shd_linger **out, shd_error *error);
void shd_linger_drop(shd_linger *linger); /* closes what is left; NULL is fine */

/* Keeps a duplicate of the connection's socket, which the caller then closes as usual. */
void shd_linger_keep(shd_linger *linger, int socket);
