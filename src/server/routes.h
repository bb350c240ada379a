/* The paths of the public port. */
#ifndef SHD_SERVER_ROUTES_H
#define SHD_SERVER_ROUTES_H

#include "server.h"

typedef struct shd_route {
    const char *path;
    shd_route_id id;
    unsigned methods; /* shd_method bits */
    /* Called once the body is there, for methods other than OPTIONS: fills the reply, or suspends
     * the exchange and submits a job that will. */
    void (*answer)(shd_exchange *exchange);
} shd_route;

/* Builds the documents that GET answers. */
shd_status shd_routes_prepare(shd_settings *settings, shd_error *error);
void shd_routes_release(shd_settings *settings);

/* Everything that the head alone decides: the path, the method, the media types. On refusal fills
 * the reply and returns false. */
bool shd_route_admit(shd_exchange *exchange);

/* The headers of CORS, where they are configured. */
void shd_route_add_cors(shd_exchange *exchange);

/* Answers an admitted exchange whose body is complete. Without a reply afterwards, a worker has
 * it. */
void shd_route_answer(shd_exchange *exchange);

#endif
