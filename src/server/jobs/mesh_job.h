/* Meshes that are kept under their digest: PUT /v1/meshes/{sha256}. */
#pragma once

#include "server/exchange.h"

void shd_mesh_submit(shd_exchange *exchange);
