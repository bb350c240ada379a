/* What the public port answers at which path. On the I/O thread. */
#pragma once

#include "exchange.h"

/* Everything that the head alone decides: the path, the method, the media types. False: the reply
 * refuses it. */
bool shd_route_admit(shd_exchange *exchange);

/* The headers of CORS, if it is configured. */
void shd_route_add_cors(shd_exchange *exchange);

/* Answers an admitted exchange whose body is complete. Without a reply afterwards, a worker has
 * it. */
void shd_route_answer(shd_exchange *exchange);
