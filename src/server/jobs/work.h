/* What a worker does with a job, and how exchanges get one. */
#pragma once

#include "job.h"
#include "server/conn/reaper.h"
#include "server/exchange.h"

/* Suspends the exchange until a job has its answer; or answers it at once if the queue is
 * full. */
void shd_job_submit(shd_exchange *exchange, const shd_work *work);

/* server->jobs, once there is an engine. */
shd_status shd_server_start_jobs(shd_server *server, shd_error *error);

/* For a reaper whose connections wait as exchanges. */
extern const shd_departure shd_exchange_departure;

/* shd_work.read: the scene, or what is wrong with it; nothing if it was cancelled, which the
 * report says. */
void shd_job_read(shd_job *job);

/* The document's warnings, the first few of them, as headers. */
void shd_job_warn(shd_reply *reply, const shd_request *request);
