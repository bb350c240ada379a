/* What the jobs of a batch share: the scene and its variants. Several jobs hold it. Any thread. */
#pragma once

#include "job.h"

/* Makes it of the job's body, which was read as a batch: from then on it has the body's memory, and
 * the job has none. NULL: memory is short, and both stay the job's. */
struct shd_variety *shd_variety_take(shd_job *job, shd_batch *batch);

struct shd_variety *shd_variety_hold(struct shd_variety *variety);
void shd_variety_drop(struct shd_variety *variety); /* NULL is fine */

const shd_batch *shd_variety_batch(const struct shd_variety *variety);

/* Gives the job, which is one of its variants, that variant's document for a body. False: the reply
 * says why not. */
bool shd_variety_write(shd_job *job);
