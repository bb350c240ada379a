/* Work for the engine's workers: admission to its queue, the deadline, the refusals. What kind of
 * work it is, the routes' own files know. */
#ifndef SHD_SERVER_JOB_H
#define SHD_SERVER_JOB_H

#include "server.h"

/* Suspends the exchange and gives it to a worker, who calls `work` with a new request and the
 * seconds that it waited. Where the queue is full the answer, 429, is there at once. */
void shd_job_submit(shd_exchange *exchange, shd_work *work);

/* The document's warnings, the first few of them, as headers. */
void shd_job_warn(shd_reply *reply, const shd_request *request);

#endif
