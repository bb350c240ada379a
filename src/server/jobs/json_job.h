/* POST /v1/compare and POST /v1/explain: what there is to tell about a scene, in JSON. */
#pragma once

#include "server/exchange.h"

/* Answer the exchange, as routes do (see routes.h). */
void shd_compare_submit(shd_exchange *exchange);
void shd_explain_submit(shd_exchange *exchange);
