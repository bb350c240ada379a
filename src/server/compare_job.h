/* POST /v1/compare. */
#ifndef SHD_SERVER_COMPARE_JOB_H
#define SHD_SERVER_COMPARE_JOB_H

#include "server.h"

/* As shd_render_submit. */
void shd_compare_submit(shd_exchange *exchange);

#endif
