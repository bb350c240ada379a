/* Meshes that are kept under their digest: PUT /v1/meshes/{sha256}. */
#ifndef SHD_SERVER_JOBS_MESH_JOB_H
#define SHD_SERVER_JOBS_MESH_JOB_H

#include "server/exchange.h"

void shd_mesh_submit(shd_exchange *exchange);

#endif
