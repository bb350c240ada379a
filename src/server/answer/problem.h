/* Problem documents (RFC 9457): the one way in which this server says no.
 *
 * Every kind has a stable `type`, "urn:shaded:problem:NAME", and one HTTP status. Each function
 * fills an empty reply, with Cache-Control: no-store. Any thread. */
#pragma once

#include "base/report.h"
#include "base/status.h"
#include "reply.h"

typedef enum shd_problem_kind {
    SHD_BAD_REQUEST,    /* 400: not sound HTTP */
    SHD_BAD_SYNTAX,     /* 400: the body is not JSON */
    SHD_BAD_CODING,     /* 400: the body is not in its content coding */
    SHD_BAD_QUERY,      /* 400: a query parameter is wrong */
    SHD_UNAUTHORIZED,   /* 401, with WWW-Authenticate */
    SHD_BAD_SIGNATURE,  /* 403: a link is not signed, or not any more */
    SHD_NOT_FOUND,      /* 404 */
    SHD_BAD_METHOD,     /* 405, with Allow */
    SHD_NOT_ACCEPTABLE, /* 406 */
    SHD_TOO_LARGE,      /* 413: the body, by the limit `body` */
    SHD_LONG_TARGET,    /* 414 */
    SHD_BAD_TYPE,       /* 415 */
    SHD_UNKNOWN_DATA,   /* 409: the scene names what is not kept here */
    SHD_BAD_SCENE,      /* 422: JSON, but not a scene */
    SHD_BAD_MESH,       /* 422: not a mesh, or not the one of the path */
    SHD_BAD_ASSET,      /* 422: no picture, or not the one of the path */
    SHD_OVER_LIMIT,     /* 422: more than a limit allows */
    SHD_BUSY,           /* 429, with Retry-After: no place or memory is free */
    SHD_OVER_RATE,      /* 429, with Retry-After: a token is used too often */
    SHD_FAILED,         /* 500 */
    SHD_NO_MEMORY,      /* 503, with Retry-After: the system refused memory */
    SHD_DRAINING,       /* 503, with Retry-After: the daemon is stopping */
    SHD_OVERDUE,        /* 504: `timeout` seconds passed */
    SHD_NO_STORAGE,     /* 507: the folder of scenes is full, or cannot be written */
    SHD_PROBLEM_KINDS
} shd_problem_kind;

/* What is sent if there is no memory for any other document. */
extern const char shd_problem_last_words[];

/* With Retry-After, if `seconds` or the kind say so. Returns false, for callers to return. */
bool shd_problem_later(shd_reply *reply, shd_problem_kind kind, unsigned seconds,
                       const char *format, ...) SHD_PRINTF(4, 5);
#define shd_problem_reply(reply, kind, ...) shd_problem_later(reply, kind, 0, __VA_ARGS__)

/* From what the library says: its status decides the kind. `wrong` is the kind of a document that
 * is wrong: SHD_BAD_SCENE, SHD_BAD_MESH or SHD_BAD_ASSET. */
void shd_problem_error(shd_reply *reply, const shd_error *error);
void shd_problem_report(shd_reply *reply, const shd_report *report, shd_problem_kind wrong);

/* Something wrong with a parameter of the path or query or, if that is NULL, in a document. */
typedef struct shd_mistake {
    const char *parameter, *pointer, *detail;
} shd_mistake;

void shd_problem_mistakes(shd_reply *reply, shd_problem_kind kind, const shd_mistake *mistakes,
                          size_t count);
