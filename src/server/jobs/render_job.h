/* POST /v1/render and GET /v1/preview/{material}. */
#pragma once

#include "server/exchange.h"

/* Suspends the exchange and gives it to a worker, who answers it; if the queue is full the
 * answer, 429, is there at once. */
void shd_render_submit(shd_exchange *exchange);
void shd_preview_submit(shd_exchange *exchange);
