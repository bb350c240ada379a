/* Two scenes of one request, whose pictures are compared, or pictures that are there. */
#pragma once

#include "render/request.h"

typedef struct shd_pair {
    shd_request *sides[2]; /* owned; cancelled with the request that has them */
    double density;        /* pixels a degree; 0: the usual */
    uint64_t work;         /* as shd_request_work */
} shd_pair;
