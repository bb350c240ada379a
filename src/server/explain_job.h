/* POST /v1/explain. */
#ifndef SHD_SERVER_EXPLAIN_JOB_H
#define SHD_SERVER_EXPLAIN_JOB_H

#include "server.h"

/* As shd_render_submit. */
void shd_explain_submit(shd_exchange *exchange);

#endif
