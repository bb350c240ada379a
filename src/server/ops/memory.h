/* The memory of the process: how much it may have, and the most that each part gets of it. One
 * budget (base/budget.h) has all of it. If work wants more than is free, what is in no use goes
 * first, then answers that their clients do not take, then what is kept; only then work is refused.
 */
#pragma once

#include "base/budget.h"
#include "base/machine.h"
#include "base/status.h"
#include "config.h"

typedef struct shd_server shd_server;

/* What a connection takes in any case: libmicrohttpd's for its heads, and ours beside. */
enum { SHD_CONNECTION_HEADS = 64 << 10, SHD_CONNECTION_MEMORY = SHD_CONNECTION_HEADS + (8 << 10) };

enum { SHD_LEAST_REQUEST = 1 << 20 }; /* what a request takes beside its body, at least */

void shd_memory_begin(void); /* sets how malloc gives back what is free; before there are threads */

/* A budget of config->budget bytes or, if that is 0, of three quarters of what the machine leaves.
 * SHD_CONFIG: it is too little to begin with. */
shd_status shd_memory_open(const shd_machine *machine, const shd_config *config, shd_budget **out,
                           shd_error *error);

/* Holds what the configuration gives to parts within what fits into the budget together. */
void shd_memory_clip(shd_config *config, shd_budget *budget);

void shd_memory_connect(shd_server *server);   /* who gives way, once all of them are there */
void shd_memory_log(const shd_server *server); /* the line "memory": what parts may take */

/* The most bytes that a request could have beside those of its body, if no other had any. */
uint64_t shd_memory_beside(const shd_server *server, size_t body_bytes);

void shd_memory_return_body(shd_server *server, size_t bytes); /* one is freed */

/* Called every SHD_REST_SECONDS: gives the system back what was not in use of late. */
enum { SHD_REST_SECONDS = 5 };
void shd_memory_rest(shd_server *server);
