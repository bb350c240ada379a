/* POST /v1/compare and POST /v1/explain: what there is to tell about a scene, in JSON. */
#ifndef SHD_SERVER_JOBS_JSON_JOB_H
#define SHD_SERVER_JOBS_JSON_JOB_H

#include "server/exchange.h"

/* Answer the exchange, as routes do (see routes.h). */
void shd_compare_submit(shd_exchange *exchange);
void shd_explain_submit(shd_exchange *exchange);

#endif
