/* Status and error: how every function of the library says that it could not do its work.
 *
 * A function that can fail returns shd_status and fills an shd_error of its caller (which may be
 * NULL). On failure its outputs are untouched. The library never logs, exits or aborts. */
#pragma once

/* Before a function that C++ calls. */
#ifdef __cplusplus
#define SHD_C extern "C"
#else
#define SHD_C extern
#endif

typedef enum shd_status {
    SHD_OK = 0,
    SHD_SYNTAX,    /* the document is not JSON */
    SHD_SCENE,     /* it is JSON, but not a scene */
    SHD_LIMIT,     /* the scene asks for more than a configured limit allows */
    SHD_MEMORY,    /* the request's cap of memory is reached */
    SHD_EXHAUSTED, /* the system refused memory, or a thread */
    SHD_CROWDED,   /* other requests have the memory that the process may take */
    SHD_CANCELLED, /* the cancel flag was raised */
    SHD_CONFIG,    /* something the operator supplied is wrong */
    SHD_INTERNAL,  /* a dependency failed that should not fail */
    SHD_MISSING,   /* the document names data that is not kept here, and nothing else is wrong */
    SHD_STATUS_COUNT
} shd_status;

/* What more was asked for of than an operator allows: the options `max-pixels` and the like. */
typedef enum shd_limit {
    SHD_LIMIT_NONE, /* SHD_LIMIT may also be about what no option changes */
    SHD_LIMIT_BODY,
    SHD_LIMIT_PIXELS,
    SHD_LIMIT_SAMPLES,
    SHD_LIMIT_LIGHTS,
    SHD_LIMIT_OBJECTS,
    SHD_LIMIT_TRIANGLES,
    SHD_LIMIT_LIGHT_SAMPLES,
    SHD_LIMIT_OBJECT_LIGHTS,
    SHD_LIMIT_WORK,
    SHD_LIMIT_MEMORY,
    SHD_LIMIT_QUEUE,
    SHD_LIMIT_TIMEOUT,
    SHD_LIMIT_CONNECTIONS_EACH,
    SHD_LIMIT_MESH_STORE,
    SHD_LIMIT_RATE,
    SHD_LIMIT_COUNT
} shd_limit;

/* As refusals and metrics name them: "light-samples". */
extern const char *const shd_limit_names[SHD_LIMIT_COUNT];

typedef struct shd_error {
    shd_status status;
    shd_limit limit; /* of SHD_LIMIT and SHD_MEMORY */
    char path[256];  /* JSON Pointer (RFC 6901) into the document, a file name, or "" */
    char text[512];  /* one sentence, no trailing period or newline */
} shd_error;

#define SHD_PRINTF(text, args) __attribute__((format(printf, text, args)))

/* Fills `error` (unless NULL) and returns `status`. Over-long text is cut. */
SHD_C shd_status shd_fail(shd_error *error, shd_status status, const char *path, const char *format,
                          ...) SHD_PRINTF(4, 5);

/* Adds which limit it was to an error (unless NULL) of SHD_LIMIT, which is returned. */
shd_status shd_fail_limit(shd_error *error, shd_limit limit);
