/* What a worker does with a job, and how exchanges get one. */
#pragma once

#include "job.h"
#include "server/conn/reaper.h"
#include "server/exchange.h"

/* The kinds of work, as routes have them: the exchange is suspended until a job has its answer, or
 * has it at once, as if the queue is full. */
void shd_render_submit(shd_exchange *exchange);
void shd_preview_submit(shd_exchange *exchange);
void shd_scene_link_submit(shd_exchange *exchange);
void shd_scene_put_submit(shd_exchange *exchange);
void shd_compare_submit(shd_exchange *exchange);
void shd_analyze_submit(shd_exchange *exchange);
void shd_explain_submit(shd_exchange *exchange);
void shd_brdf_submit(shd_exchange *exchange);
void shd_diff_submit(shd_exchange *exchange);
void shd_fit_submit(shd_exchange *exchange);
void shd_mesh_submit(shd_exchange *exchange);
void shd_asset_submit(shd_exchange *exchange);
void shd_batch_submit(shd_exchange *exchange);

/* The same by any kind. */
void shd_job_submit(shd_exchange *exchange, const shd_work *work);

/* The job, which is its from now on, is asked for by a waiter that has its client, reply and
 * answer. */
void shd_job_enter(shd_job *job, shd_waiter *waiter);

/* Of a variant of a batch: the job has a `variety`. */
extern const shd_work shd_variant_work;

/* Parts of the work of pictures: shd_work's functions, and, for the end of its `read`, whether the
 * picture is kept. */
void shd_picture_find(shd_job *job);
void shd_picture_run(shd_job *job);
bool shd_picture_settle(const shd_job *job, const shd_exchange *exchange, shd_reply *reply);
void shd_picture_add(const shd_job *job, double queued, shd_reply *reply);

/* server->jobs, once there is an engine. */
shd_status shd_server_start_jobs(shd_server *server, shd_error *error);

/* For a reaper whose connections wait as exchanges. */
extern const shd_departure shd_exchange_departure;

/* shd_work.read: the scene, or what is wrong with it; nothing if it was cancelled, which the
 * report says. */
void shd_job_read(shd_job *job);

/* For shd_work.read, of a body that stands for so many bytes of documents. True: to read these is
 * for another turn, in which `read` is called again. It does no more then. */
bool shd_job_outgrows(shd_job *job, size_t documents);

/* The document's warnings, the first few of them, as headers of the reply. */
void shd_job_warn(shd_job *job);
