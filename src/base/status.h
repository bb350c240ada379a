/* Status and error: how every function of the library says that it could not do its work.
 *
 * A function that can fail returns shd_status and fills an shd_error of its caller (which may be
 * NULL). On failure its outputs are untouched. The library never logs, exits or aborts. */
#ifndef SHD_BASE_STATUS_H
#define SHD_BASE_STATUS_H

#ifdef __cplusplus
extern "C" {
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

typedef struct shd_error {
    shd_status status;
    char path[256]; /* JSON Pointer (RFC 6901) into the document, a file name, or "" */
    char text[512]; /* one sentence, no trailing period or newline */
} shd_error;

#if defined(__GNUC__)
#define SHD_PRINTF(text, args) __attribute__((format(printf, text, args)))
#else
#define SHD_PRINTF(text, args)
#endif

/* Fills `error` (unless NULL) and returns `status`. Over-long text is cut. */
shd_status shd_fail(shd_error *error, shd_status status, const char *path, const char *format, ...)
    SHD_PRINTF(4, 5);

#ifdef __cplusplus
}
#endif
#endif
